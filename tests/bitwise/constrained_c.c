/* SPDX-License-Identifier: BSD-3-Clause */
/* The constrained problems of README.md by the C interface; with an argument problem c alone. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dynstep.h"

enum { N = 3, MOST = 100 };

/* Problem c */
static int rod_force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    (void)n, (void)t, (void)ctx;
    f[0] = 0.0;
    f[1] = -49.05;
    f[2] = -(100.0 * v[2] + 3000.0 * (q[2] - 4.71238898038469));
    return 0;
}

static int rod_tangent(int n, double t, const double *q, const double *v, const double *a, double *k, double *c,
                       void *ctx)
{
    (void)n, (void)t, (void)q, (void)v, (void)a, (void)ctx;
    k[2] = 3000.0;
    c[2] = 100.0;
    return 0;
}

static int rod_constraint(int n, int m, double t, const double *q, double *g, void *ctx)
{
    (void)n, (void)m, (void)t, (void)ctx;
    g[0] = q[0] - 2.0 * cos(q[2]);
    g[1] = q[1] - 2.0 * sin(q[2]);
    return 0;
}

static int rod_jacobian(int n, int m, double t, const double *q, double *gq, double *gt, void *ctx)
{
    (void)m, (void)t, (void)gt, (void)ctx;
    gq[0] = 1.0;
    gq[2] = 2.0 * sin(q[2]);
    gq[1 + n] = 1.0;
    gq[2 + n] = -(2.0 * cos(q[2]));
    return 0;
}

/* Problem d */
static int edge_force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    (void)n, (void)t, (void)ctx;
    f[0] = 1.0 - 0.125 * q[0];
    f[1] = 0.0 - 0.5 * v[1];
    f[2] = 0.0;
    return 0;
}

static int edge_mass(int n, double t, const double *q, const double *v, double *m, void *ctx)
{
    (void)n, (void)t, (void)v, (void)ctx;
    m[0] = 1.0;
    m[1] = 1.0 + (0.25 * q[2]) * q[2];
    m[2] = 0.5;
    return 0;
}

static int turning(int n, int m, double t, const double *q, double *g, void *ctx)
{
    (void)n, (void)m, (void)ctx;
    g[0] = q[2] - t * (1.0 + 0.25 * t);
    return 0;
}

static int turning_jacobian(int n, int m, double t, const double *q, double *gq, double *gt, void *ctx)
{
    (void)n, (void)m, (void)q, (void)ctx;
    gq[2] = 1.0;
    gt[0] = -(1.0 + 0.5 * t);
    return 0;
}

static int turning_curvature(int n, int m, double t, const double *q, const double *v, double *c, void *ctx)
{
    (void)n, (void)m, (void)t, (void)q, (void)v, (void)ctx;
    c[0] = -0.5;
    return 0;
}

static int edge(int n, int p, double t, const double *q, const double *v, double *k, void *ctx)
{
    (void)n, (void)p, (void)t, (void)ctx;
    k[0] = sin(q[2]) * v[0] - cos(q[2]) * v[1];
    return 0;
}

/* In the pattern of x and y */
static int edge_jacobian(int n, int p, double t, const double *q, const double *v, double *kv, void *ctx)
{
    (void)n, (void)p, (void)t, (void)v, (void)ctx;
    kv[0] = sin(q[2]);
    kv[1] = -cos(q[2]);
    return 0;
}

static int edge_curvature(int n, int p, double t, const double *q, const double *v, double *c, void *ctx)
{
    (void)n, (void)p, (void)t, (void)ctx;
    c[0] = (cos(q[2]) * v[0] + sin(q[2]) * v[1]) * v[2];
    return 0;
}

static int reaction(int n, int m, int p, double t, const double *q, const double *v, const double *lambda,
                    const double *psi, double *r, void *ctx)
{
    double s = psi[0] + ((0.125 * psi[0]) * psi[0]) * psi[0];
    (void)n, (void)m, (void)p, (void)t, (void)v, (void)ctx;
    r[0] = -(sin(q[2]) * s);
    r[1] = cos(q[2]) * s;
    r[2] = -lambda[0];
    return 0;
}

static int reaction_jacobian(int n, int m, int p, double t, const double *q, const double *v, const double *lambda,
                             const double *psi, double *rl, double *rp, void *ctx)
{
    double s = 1.0 + (0.375 * psi[0]) * psi[0];
    (void)n, (void)m, (void)p, (void)t, (void)v, (void)lambda, (void)ctx;
    rl[2] = -1.0;
    rp[0] = -(sin(q[2]) * s);
    rp[1] = cos(q[2]) * s;
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

static void run(intptr_t s, const char *problem, const char *name, double rho_inf, int m, int p, const double *q0,
                const double *v0)
{
    const double times[4] = {0.1, 0.11, 0.5, 0.99};
    double t[MOST], q[N * MOST], v[N * MOST], a[N * MOST], lambda[2 * MOST], psi[MOST], c[4];
    int count, code, reduced = strcmp(name, "reduced") == 0;
    must(dynstep_alpha_coefficients(rho_inf, c));
    must(dynstep_set_soi2(s, c[0], c[1], c[2], c[3], reduced ? DYNSTEP_REDUCED : DYNSTEP_SOI2));
    must(dynstep_set_alpha_options(s, reduced ? DYNSTEP_MASS_RECOMPUTED : DYNSTEP_MASS_STORED, 1, 1, 1));
    must(dynstep_start(s, N, 0.0, q0, v0));
    must(dynstep_begin(s, 1.0, 0.015625, 1, strcmp(name, "times") == 0 ? 4 : 0, times));
    do {
        must(code = dynstep_proceed(s, 7, 5, &count, t, q, v, a));      /* in small pieces */
        must(dynstep_record_multipliers(s, count, m, lambda, p, psi));
        for (int i = 0; i < count; i++) {
            printf("%s %s", problem, name);
            print(t + i, 1);
            print(q + i * N, N);
            print(v + i * N, N);
            print(a + i * N, N);
            print(lambda + i * m, m);
            print(psi + i * p, p);
            printf("\n");
        }
    } while (code == DYNSTEP_MORE);
}

int main(int count, char **arguments)
{
    const double mass[N] = {5.0, 5.0, 6.666666666666667}, rod_q[N] = {0.0, -2.0, 4.71238898038469};
    const double rod_v[N] = {20.0, 0.0, 10.0}, edge_q[N] = {0.0, 0.0, 0.0}, edge_v[N] = {1.0, 0.0, 1.0};
    const int first[2] = {0, 2}, column[2] = {0, 1};
    intptr_t s = dynstep_new(N);
    must(dynstep_set_force(s, (intptr_t)rod_force, 0));
    must(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_DIAGONAL, 0, 0, 1, mass));
    must(dynstep_set_tangent(s, (intptr_t)rod_tangent, 0));
    must(dynstep_set_structure(s, DYNSTEP_DIAGONAL, 0, 0, 1, 1, 0, 0));
    must(dynstep_set_constraint(s, 2, (intptr_t)rod_constraint, 0));
    must(dynstep_set_constraint_jacobian(s, (intptr_t)rod_jacobian, 0));
    run(s, "c", "soi2", 0.8, 2, 0, rod_q, rod_v);
    run(s, "c", "times", 0.8, 2, 0, rod_q, rod_v);
    must(dynstep_delete(&s));
    (void)arguments;
    if (count > 1) return 0;

    s = dynstep_new(N);
    must(dynstep_set_force(s, (intptr_t)edge_force, 0));
    must(dynstep_set_mass(s, (intptr_t)edge_mass, 0, DYNSTEP_DIAGONAL, 0, 0, 1, 0));
    must(dynstep_set_constraint(s, 1, (intptr_t)turning, 0));
    must(dynstep_set_constraint_jacobian(s, (intptr_t)turning_jacobian, 0));
    must(dynstep_set_constraint_curvature(s, (intptr_t)turning_curvature, 0));
    must(dynstep_set_velocity_constraint(s, 1, (intptr_t)edge, 0));
    must(dynstep_set_velocity_jacobian(s, (intptr_t)edge_jacobian, 0));
    must(dynstep_set_velocity_curvature(s, (intptr_t)edge_curvature, 0));
    must(dynstep_set_pattern(s, DYNSTEP_VELOCITY_JACOBIAN, 1, first, column));
    must(dynstep_set_reaction(s, (intptr_t)reaction, 0));
    must(dynstep_set_reaction_jacobian(s, (intptr_t)reaction_jacobian, 0));
    run(s, "d", "soi2", 0.8, 1, 1, edge_q, edge_v);
    run(s, "d", "reduced", 0.5, 1, 1, edge_q, edge_v);
    must(dynstep_delete(&s));
    return 0;
}
