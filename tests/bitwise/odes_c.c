/* SPDX-License-Identifier: BSD-3-Clause */
/* The first-order problem of README.md by the C interface. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dynstep.h"

enum { N = 2 };

static int rhs(int n, double t, const double *y, double *f, void *ctx)
{
    (void)n, (void)ctx;
    f[0] = y[0] * (1.0 - y[1]);
    f[1] = y[1] * (y[0] - 1.0) + 0.125 * t;
    return 0;
}

static void must(int code)
{
    if (code < 0) exit(1);
}

static void print(const double *x, int n)
{
    for (int i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, &x[i], sizeof bits);
        printf(" %016" PRIX64, bits);
    }
}

static void run(intptr_t s, const char *name, int n_eval, double tolerance)
{
    const double times[4] = {0.1, 0.11, 0.5, 1.99}, y0[N] = {2.0, 3.0};
    double t[5], y[5 * N], yp[5 * N];
    int count, code;
    must(dynstep_start_ode(s, N, 0.0, y0));
    if (tolerance > 0.0)
        must(dynstep_begin_controlled(s, 2.0, tolerance, DYNSTEP_PI, DYNSTEP_SAFETY_IN_FRONT, 0.125, 0.0, n_eval, times));
    else
        must(dynstep_begin(s, 2.0, 0.03125, 1, n_eval, times));
    do {
        must(code = dynstep_proceed(s, 7, 5, &count, t, y, NULL, yp));      /* in small pieces */
        for (int i = 0; i < count; i++) {
            printf("e %s", name);
            print(t + i, 1);
            print(y + i * N, N);
            print(yp + i * N, N);
            printf("\n");
        }
    } while (code == DYNSTEP_MORE);
}

int main(void)
{
    intptr_t s = dynstep_new_ode(N);
    must(dynstep_set_rhs(s, (intptr_t)rhs, 0));
    run(s, "bi", 0, 0.0);
    run(s, "times", 4, 0.0);
    run(s, "control", 0, 1e-6);
    must(dynstep_set_backinterpolation(s, 4, 5, 0.44, DYNSTEP_HALVES_TAYLOR));
    run(s, "bi45", 0, 0.0);
    must(dynstep_delete(&s));
    return 0;
}
