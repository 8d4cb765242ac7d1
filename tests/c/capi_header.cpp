// SPDX-License-Identifier: BSD-3-Clause
// The header in a C++ program: it compiles, and its functions are found.
#include <cstdint>
#include <cstdio>

#include "dynstep.h"

static int force(int n, double, const double *q, const double *, double *f, void *)
{
    for (int i = 0; i < n; i++) f[i] = -q[i];
    return 0;
}

int main()
{
    dynstep_force *function = force;
    double q = 1.0, v = 0.0;
    std::intptr_t s = dynstep_new(1);
    bool ok = dynstep_set_force(s, reinterpret_cast<std::intptr_t>(function), 0) == DYNSTEP_SUCCESS &&
              dynstep_start(s, 1, 0.0, &q, &v) == DYNSTEP_SUCCESS && dynstep_run(s, 1.0, 0.125) == DYNSTEP_SUCCESS &&
              dynstep_get(s, 1, nullptr, &q, &v, nullptr) == DYNSTEP_SUCCESS && q > 0.5 && q < 0.6 &&
              dynstep_delete(&s) == DYNSTEP_SUCCESS;
    std::printf("%d passed, %d failed\n", ok, !ok);
    return !ok;
}
