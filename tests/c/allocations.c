/* SPDX-License-Identifier: BSD-3-Clause */
/* No step allocates: a run of 1100 steps calls malloc, calloc and realloc (counting_malloc.c) as often as one of 100. */
#include "rod_pendulum.h"

#include <stdlib.h>

extern long allocator_calls(void);

enum { LARGEST = 40 };

/* A chain with cubic springs and damping */
static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    (void)t, (void)ctx;
    for (int i = 0; i < n; i++) {
        double left = i > 0 ? q[i] - q[i - 1] : q[i], right = i < n - 1 ? q[i + 1] - q[i] : -q[i];
        f[i] = right - left - 0.1 * q[i] * q[i] * q[i] - 0.05 * v[i];
    }
    return 0;
}

static int mass(int n, double t, const double *q, const double *v, double *m, void *ctx)
{
    (void)t, (void)v, (void)ctx;
    for (int i = 0; i < n; i++) m[i] = 1.0 + 0.1 * q[i] * q[i];
    return 0;
}

static int load(int n, double t, double *p, void *ctx)
{
    (void)ctx;
    for (int i = 0; i < n; i++) p[i] = 0.01 * t;
    return 0;
}

/* Calls of the allocator by a run of so many steps */
static long run(intptr_t s, int n, int steps)
{
    double q[LARGEST], v[LARGEST] = {0};
    for (int i = 0; i < n; i++) q[i] = 0.1 + 0.01 * i;
    CHECK(dynstep_start(s, n, 0.0, q, v) == 0);
    CHECK(dynstep_run(s, 0.01 * 5, 0.01) == 0);          /* what is allocated once, is by now */
    long before = allocator_calls();
    CHECK(dynstep_run(s, 0.01 * (5 + steps), 0.01) == 0);
    return allocator_calls() - before;
}

static void compare(intptr_t s, int n)
{
    for (int levels = 0; levels <= 4; levels += 4) {
        CHECK(dynstep_set_extrapolation(s, levels, DYNSTEP_HARMONIC, 0, NULL) == 0);
        long few = run(s, n, 100), many = run(s, n, 1100);
        CHECK(few == many);
        if (few != many) printf("     n = %d, levels = %d: %ld and %ld calls\n", n, levels, few, many);
    }
}

static void linear(int n, int kind, int loaded)
{
    static double k[LARGEST * LARGEST];
    intptr_t s = dynstep_new(n);
    int width = kind == DYNSTEP_BANDED ? 1 : 0, rows = kind == DYNSTEP_BANDED ? 3 : n;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            double entry = i == j ? 2.0 : i - j == 1 || j - i == 1 ? -1.0 : 0.0;
            if (kind == DYNSTEP_DENSE) k[i + j * rows] = entry;
            if (kind == DYNSTEP_BANDED && i - j <= 1 && j - i <= 1) k[1 + i - j + j * rows] = entry;
        }
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, kind, width, width, 1, k) == 0);
    if (loaded) CHECK(dynstep_set_load(s, ADDRESS(load), 0) == 0);
    compare(s, n);
    CHECK(dynstep_set_newmark(s, 1.0 / 6.0, 0.5) == 0);
    compare(s, n);
    CHECK(dynstep_set_midpoint(s) == 0);
    compare(s, n);
    CHECK(dynstep_delete(&s) == 0);
}

static void general(int n, int massive)
{
    intptr_t s = dynstep_new(n);
    int width = n > 1 ? 1 : 0;
    CHECK(dynstep_set_force(s, ADDRESS(force), 0) == 0);
    if (massive) CHECK(dynstep_set_mass(s, ADDRESS(mass), 0, DYNSTEP_DIAGONAL, 0, 0, 1, 0) == 0);
    CHECK(dynstep_set_structure(s, DYNSTEP_BANDED, width, width, 0, 0, 0, 0) == 0);
    compare(s, n);
    CHECK(dynstep_set_midpoint(s) == 0);
    compare(s, n);
    CHECK(dynstep_set_extrapolation(s, 0, 0, 0, NULL) == 0);
    CHECK(dynstep_set_generalized_alpha(s, 0.0, 1.0 / 3.0, 4.0 / 9.0, 5.0 / 6.0) == 0);
    long few = run(s, n, 100), many = run(s, n, 1100);
    CHECK(few == many);
    if (few != many) printf("     generalized-alpha, n = %d: %ld and %ld calls\n", n, few, many);
    CHECK(dynstep_delete(&s) == 0);
}

/* Calls of the allocator by a run of the pendulum, recording its multipliers */
static long constrained_run(intptr_t s, int steps)
{
    static double t[5000], lambda[2 * 5000];
    int count;
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_run(s, 0.05, 0.01) == 0);
    CHECK(dynstep_begin(s, 0.01 * (5 + steps), 0.01, 1, 0, NULL) == 0);
    CHECK(dynstep_proceed(s, 1, 5000, &count, t, NULL, NULL, NULL) == DYNSTEP_MORE);
    long before = allocator_calls();
    CHECK(dynstep_proceed(s, 5000, 5000, &count, t, NULL, NULL, NULL) == 0);
    CHECK(dynstep_record_multipliers(s, count, 2, lambda, 0, NULL) == 0);
    return allocator_calls() - before;
}

static void constrained(int variant, int by_differences)
{
    double c[4];
    intptr_t s = rod_handle(NULL);
    CHECK(dynstep_alpha_coefficients(0.8, c) == 0);
    CHECK(dynstep_set_soi2(s, c[0], c[1], c[2], c[3], variant) == 0);
    if (by_differences) CHECK(dynstep_set_constraint_jacobian(s, 0, 0) == 0);
    long few = constrained_run(s, 100), many = constrained_run(s, 1100);
    CHECK(few == many);
    if (few != many) printf("     variant %d, %d: %ld and %ld calls\n", variant, by_differences, few, many);
    CHECK(dynstep_delete(&s) == 0);
}

int main(void)
{
    void *volatile counted = malloc(1);
    CHECK(allocator_calls() > 0);        /* this program's malloc is the one in force */
    free(counted);
    for (int loaded = 0; loaded < 2; loaded++) {
        linear(1, DYNSTEP_DENSE, loaded);
        linear(4, DYNSTEP_DENSE, loaded);
        linear(7, DYNSTEP_DENSE, loaded);
        linear(LARGEST, DYNSTEP_DENSE, loaded);
        linear(LARGEST, DYNSTEP_BANDED, loaded);
    }
    for (int massive = 0; massive < 2; massive++) {
        general(1, massive);
        general(LARGEST, massive);
    }
    for (int variant = 1; variant <= 3; variant++) {
        constrained(variant, 0);
        constrained(variant, 1);
    }
    return finish();
}
