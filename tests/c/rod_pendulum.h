/* SPDX-License-Identifier: BSD-3-Clause */
/* Rod on a pin with a spring and a damper that turn it (Jay & Negrut 2008, eqs. (16)) by C functions.  The
 * formulas are written as in dynstep_rod_pendulum. */
#ifndef ROD_PENDULUM_H
#define ROD_PENDULUM_H

#include "checks.h"

static const double rod_mass = 5.0, rod_length = 2.0, rod_spring = 3000.0, rod_damper = 100.0, rod_gravity = 9.81;
static const double rod_hanging = 1.5 * 3.14159265358979323846;
static const double rod_q0[3] = {0.0, -2.0, 1.5 * 3.14159265358979323846}, rod_v0[3] = {20.0, 0.0, 10.0};
static const double rod_m[3] = {5.0, 5.0, 5.0 * 4.0 / 3.0};

static inline int rod_force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    (void)n, (void)t, (void)ctx;
    f[0] = 0.0;
    f[1] = -rod_mass * rod_gravity;
    f[2] = -rod_damper * v[2] - rod_spring * (q[2] - rod_hanging);
    return 0;
}

static inline int rod_tangent(int n, double t, const double *q, const double *v, const double *a, double *k,
                              double *c, void *ctx)
{
    (void)n, (void)t, (void)q, (void)v, (void)a, (void)ctx;
    k[2] = rod_spring;
    c[2] = rod_damper;
    return 0;
}

static inline int rod_constraint(int n, int m, double t, const double *q, double *g, void *ctx)
{
    (void)t;
    if (ctx) ++*(int *)ctx;
    g[0] = q[0] - rod_length * cos(q[2]);
    g[1] = q[1] - rod_length * sin(q[2]);
    return n == 3 && m == 2 ? 0 : -1;
}

static inline int rod_jacobian(int n, int m, double t, const double *q, double *gq, double *gt, void *ctx)
{
    (void)t, (void)gt, (void)ctx;
    gq[0] = 1.0;
    gq[2] = rod_length * sin(q[2]);
    gq[1 + n] = 1.0;
    gq[2 + n] = -rod_length * cos(q[2]);
    return n == 3 && m == 2 ? 0 : -1;
}

/* The same in the pattern of the four entries that may differ from zero */
static const int rod_first[3] = {0, 2, 4}, rod_column[4] = {0, 2, 1, 2};

static inline int rod_jacobian_values(int n, int m, double t, const double *q, double *gq, double *gt, void *ctx)
{
    (void)t, (void)gt, (void)ctx;
    gq[0] = 1.0;
    gq[1] = rod_length * sin(q[2]);
    gq[2] = 1.0;
    gq[3] = -rod_length * cos(q[2]);
    return n == 3 && m == 2 ? 0 : -1;
}

static inline int rod_curvature(int n, int m, double t, const double *q, const double *v, double *c, void *ctx)
{
    (void)t, (void)ctx;
    c[0] = rod_length * (v[2] * v[2]) * cos(q[2]);
    c[1] = rod_length * (v[2] * v[2]) * sin(q[2]);
    return n == 3 && m == 2 ? 0 : -1;
}

/* k = -dr/dq with r = -G' lambda */
static inline int rod_reaction_tangent(int n, int m, int p, double t, const double *q, const double *v,
                                       const double *lambda, const double *psi, double *k, double *c, void *ctx)
{
    (void)n, (void)m, (void)p, (void)t, (void)v, (void)psi, (void)c, (void)ctx;
    k[2] = rod_length * (cos(q[2]) * lambda[0] + sin(q[2]) * lambda[1]);
    return 0;
}

/* A handle with the pendulum; its constraint counts in *calls where there is one */
static inline intptr_t rod_handle(int *calls)
{
    intptr_t s = dynstep_new(3);
    CHECK(dynstep_set_force(s, ADDRESS(rod_force), 0) == 0);
    CHECK(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_DIAGONAL, 0, 0, 1, rod_m) == 0);
    CHECK(dynstep_set_tangent(s, ADDRESS(rod_tangent), 0) == 0);
    CHECK(dynstep_set_structure(s, DYNSTEP_DIAGONAL, 0, 0, 1, 1, 0, 0) == 0);
    CHECK(dynstep_set_constraint(s, 2, ADDRESS(rod_constraint), ADDRESS(calls)) == 0);
    CHECK(dynstep_set_constraint_jacobian(s, ADDRESS(rod_jacobian), 0) == 0);
    CHECK(dynstep_set_constraint_curvature(s, ADDRESS(rod_curvature), 0) == 0);
    CHECK(dynstep_set_reaction_tangent(s, ADDRESS(rod_reaction_tangent), 0) == 0);
    return s;
}

#endif
