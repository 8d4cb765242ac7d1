/* SPDX-License-Identifier: BSD-3-Clause */
/* The problems of README.md by the C interface. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dynstep.h"

enum { MOST = 100 };

static int load(int n, double t, double *p, void *ctx)
{
    (void)ctx;
    for (int i = 0; i < n; i++) p[i] = (i + 1) * (t - (0.25 * t) * t);
    return 0;
}

static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    double d = q[0] - q[1];
    (void)n, (void)t, (void)ctx;
    f[0] = ((0.0 - 4.0 * (q[0] - ((q[0] * q[0]) * q[0]) / 6.0)) - ((0.25 * d) * v[1]) * v[1]) - 0.125 * v[0];
    f[1] = ((0.0 - 2.0 * (q[1] - ((q[1] * q[1]) * q[1]) / 6.0)) + ((0.25 * d) * v[0]) * v[0]) - 0.125 * v[1];
    return 0;
}

static int mass(int n, double t, const double *q, const double *v, double *m, void *ctx)
{
    double d = q[0] - q[1];
    (void)n, (void)t, (void)v, (void)ctx;
    m[0] = 2.0;
    m[1] = m[2] = 1.0 - (0.5 * d) * d;
    m[3] = 1.5;
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

static void run(intptr_t s, int n, const char *problem, const char *name, const double *q0, const double *v0)
{
    const double times[4] = {0.1, 0.11, 0.5, 1.99};
    double t[MOST], q[3 * MOST], v[3 * MOST], a[3 * MOST];
    int count, code;
    must(dynstep_set_extrapolation(s, strcmp(name, "extrapolation") == 0 ? 4 : 0, DYNSTEP_HARMONIC, 0, NULL));
    must(dynstep_start(s, n, 0.0, q0, v0));
    must(dynstep_begin(s, 2.0, 0.03125, 1, strcmp(name, "times") == 0 ? 4 : 0, times));
    do {
        must(code = dynstep_proceed(s, 7, 5, &count, t, q, v, a));      /* in small pieces */
        for (int i = 0; i < count; i++) {
            printf("%s %s", problem, name);
            print(t + i, 1);
            print(q + i * n, n);
            print(v + i * n, n);
            print(a + i * n, n);
            printf("\n");
        }
    } while (code == DYNSTEP_MORE);
}

static void all_runs(intptr_t s, int n, const char *problem, const double *q0, const double *v0)
{
    run(s, n, problem, "newmark", q0, v0);
    run(s, n, problem, "extrapolation", q0, v0);
    run(s, n, problem, "times", q0, v0);
    must(dynstep_delete(&s));
}

int main(void)
{
    const double m[3] = {2.0, 1.0, 1.0}, k[9] = {0.0, 3.0, -1.0, -1.0, 2.0, -1.0, -1.0, 2.0, 0.0};
    double c[9];
    intptr_t s = dynstep_new(3);
    for (int i = 0; i < 9; i++) c[i] = 0.0625 * k[i];
    must(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_DIAGONAL, 0, 0, 1, m));
    must(dynstep_set_matrix(s, DYNSTEP_DAMPING, DYNSTEP_BANDED, 1, 1, 1, c));
    must(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_BANDED, 1, 1, 1, k));
    must(dynstep_set_load(s, (intptr_t)load, 0));
    all_runs(s, 3, "a", (double[]){1.0, 0.0, -0.5}, (double[]){0.0, 0.25, 0.0});

    s = dynstep_new(2);
    must(dynstep_set_force(s, (intptr_t)force, 0));
    must(dynstep_set_mass(s, (intptr_t)mass, 0, DYNSTEP_DENSE, 0, 0, 1, 0));
    all_runs(s, 2, "b", (double[]){1.0, -0.5}, (double[]){0.0, 0.25});
    return 0;
}
