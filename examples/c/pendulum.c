/* SPDX-License-Identifier: BSD-3-Clause */
/* A rod of mass m and length 2 L swings on a pin, in the coordinates (x, y, theta) of its centre:
 *
 *   M = diag(m, m, m L^2/3),   x - L cos(theta) = 0,   y - L sin(theta) = 0
 *
 * SOI2 keeps the pin together, in place and in velocity, and gives the force in it: the multipliers. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "dynstep.h"

struct rod {
    double mass, half_length, gravity;
};

static int weight(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    const struct rod *rod = ctx;
    (void)n, (void)t, (void)q, (void)v;
    f[0] = f[2] = 0.0;
    f[1] = -rod->mass * rod->gravity;
    return 0;
}

static int pin(int n, int m, double t, const double *q, double *g, void *ctx)
{
    const struct rod *rod = ctx;
    (void)n, (void)m, (void)t;
    g[0] = q[0] - rod->half_length * cos(q[2]);
    g[1] = q[1] - rod->half_length * sin(q[2]);
    return 0;
}

/* By rows, zero on entry; without this function, and that of the curvature, the library takes differences */
static int pin_jacobian(int n, int m, double t, const double *q, double *gq, double *gt, void *ctx)
{
    const struct rod *rod = ctx;
    (void)m, (void)t, (void)gt;
    gq[0] = gq[1 + n] = 1.0;
    gq[2] = rod->half_length * sin(q[2]);
    gq[2 + n] = -rod->half_length * cos(q[2]);
    return 0;
}

static int pin_curvature(int n, int m, double t, const double *q, const double *v, double *c, void *ctx)
{
    const struct rod *rod = ctx;
    (void)n, (void)m, (void)t;
    c[0] = rod->half_length * v[2] * v[2] * cos(q[2]);
    c[1] = rod->half_length * v[2] * v[2] * sin(q[2]);
    return 0;
}

int main(void)
{
    struct rod rod = {5.0, 2.0, 9.81};
    const double m[3] = {rod.mass, rod.mass, rod.mass * rod.half_length * rod.half_length / 3.0};
    double q[3] = {rod.half_length, 0.0, 0.0}, v[3] = {0.0, 0.0, 0.0}, c[4], g[2], gv[2], lambda[2], t = 0.0;
    char text[DYNSTEP_MESSAGE_LENGTH];
    intptr_t s = dynstep_new(3), context = (intptr_t)&rod;

    dynstep_set_force(s, (intptr_t)weight, context);
    dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_DIAGONAL, 0, 0, 1, m);
    dynstep_set_constraint(s, 2, (intptr_t)pin, context);
    dynstep_set_constraint_jacobian(s, (intptr_t)pin_jacobian, context);
    dynstep_set_constraint_curvature(s, (intptr_t)pin_curvature, context);
    dynstep_alpha_coefficients(0.8, c);
    dynstep_set_soi2(s, c[0], c[1], c[2], c[3], DYNSTEP_SOI2);
    int code = dynstep_start(s, 3, t, q, v);
    /* at the bottom a released rod pulls with 5/2 of its weight, 122.6 */
    puts("     t     angle   force in the pin     |g|        |g'|");
    while (code >= 0 && t < 2.0) {
        code = dynstep_run(s, t + 0.25, 0.005);
        dynstep_get(s, 3, &t, q, v, NULL);
        dynstep_get_multipliers(s, 2, lambda, 0, NULL);
        dynstep_residuals(s, 3, t, q, v, 2, g, gv, 0, NULL);
        printf("%6.2f %9.5f %13.4f %15.1e %10.1e\n", t, q[2], hypot(lambda[0], lambda[1]), hypot(g[0], g[1]),
               hypot(gv[0], gv[1]));
    }
    if (dynstep_message(s, sizeof text, text) == 0 && text[0]) puts(text);
    dynstep_delete(&s);
    return code < 0;
}
