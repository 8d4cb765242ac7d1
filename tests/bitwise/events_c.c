/* SPDX-License-Identifier: BSD-3-Clause */
/* The problem with events of README.md by the C interface. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dynstep.h"

enum { N = 2 };

static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    const int *side = ctx;
    (void)n, (void)t;
    f[0] = ((0.0 - q[0] * (1.0 + q[0] * q[0])) + 0.5 * (q[1] - q[0])) - 0.125 * v[0];
    f[1] = (0.0 - 2.0 * q[1]) - 0.5 * (q[1] - q[0]);
    if (side[0] > 0) f[1] = f[1] - 4.0 * (q[1] - 0.125);
    return 0;
}

static int switches(int n, int count, double t, const double *q, const double *v, double *s, void *ctx)
{
    (void)n, (void)count, (void)t, (void)v, (void)ctx;
    s[0] = q[1] - 0.125;
    return 0;
}

static int events(int n, int count, double t, const double *q, const double *v, double *s, void *ctx)
{
    (void)n, (void)count, (void)t, (void)ctx;
    s[0] = q[0] + 0.25;
    s[1] = v[1];
    return 0;
}

static int action(int n, int which, double t, double *q, double *v, void *ctx)
{
    (void)n, (void)t, (void)q, (void)ctx;
    if (which != 0) return 0;
    v[0] = -(0.5 * v[0]);
    return 1;
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

static void run(intptr_t s, char problem)
{
    const double q0[N] = {1.0, 0.0}, v0[N] = {0.0, 0.5}, atol[2 * N] = {1e-9, 1e-9, 1e-7, 1e-8};
    double t[3], q[3 * N], v[3 * N], a[3 * N];
    int count, code, which;
    must(dynstep_start(s, N, 0.0, q0, v0));
    must(dynstep_begin_within(s, 6.0, 1e-8, 2 * N, atol, 0.0, 0.0, 0.0, 0.0, 0.0, 0, NULL));
    do {
        must(code = dynstep_proceed(s, 7, 3, &count, t, q, v, a));      /* in small pieces */
        for (int i = 0; i < count; i++) {
            printf("%c point", problem);
            print(t + i, 1);
            print(q + i * N, N);
            print(v + i * N, N);
            print(a + i * N, N);
            printf("\n");
        }
    } while (code == DYNSTEP_MORE);
    must(dynstep_event_count(s, &count));
    for (int i = 0; i < count; i++) {
        must(dynstep_get_events(s, i, 1, &which, t, q, v));
        printf("%c event%d", problem, which + 1);
        print(t, 1);
        print(q, N);
        print(v, N);
        printf("\n");
    }
}

int main(int argc, char **argv)
{
    intptr_t s = dynstep_new(N);
    int side[1] = {-1};
    const int direction[2] = {-1, 0};
    must(dynstep_set_force(s, (intptr_t)force, (intptr_t)side));
    must(dynstep_set_events(s, 2, (intptr_t)events, 0, direction, NULL));
    must(dynstep_set_event_action(s, (intptr_t)action, 0));
    must(dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL));
    run(s, 'f');
    must(dynstep_set_extrapolation(s, 0, 0, 0, NULL));
    must(dynstep_set_backinterpolation(s, 4, 4, 0.5, DYNSTEP_HALVES_TAYLOR));
    run(s, 'f');
    if (argc > 1 && strcmp(argv[1], "f") == 0) return 0;
    must(dynstep_set_newmark(s, 0.25, 0.5));
    must(dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL));
    must(dynstep_set_switches(s, 1, (intptr_t)switches, 0, side));
    run(s, 'g');
    must(dynstep_delete(&s));
    return 0;
}
