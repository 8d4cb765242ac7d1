/* SPDX-License-Identifier: BSD-3-Clause */
/* Constraints by C functions: how they are set, their residuals, and every way to set them wrong. */
#include "rod_pendulum.h"

/* A knife edge (x, y, theta): no velocity across the edge, K = (sin theta, -cos theta, 0), and theta = t */
static int no_force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    (void)t, (void)q, (void)v, (void)ctx;
    for (int i = 0; i < n; i++) f[i] = 0.0;
    return 0;
}

static int edge(int n, int p, double t, const double *q, const double *v, double *k, void *ctx)
{
    (void)t, (void)ctx;
    k[0] = sin(q[2]) * v[0] - cos(q[2]) * v[1];
    return n == 3 && p == 1 ? 0 : -1;
}

static int edge_jacobian(int n, int p, double t, const double *q, const double *v, double *kv, void *ctx)
{
    (void)p, (void)t, (void)v, (void)ctx;
    kv[0] = sin(q[2]);
    kv[1] = -cos(q[2]);
    return n == 3 ? 0 : -1;
}

static int turning(int n, int m, double t, const double *q, double *g, void *ctx)
{
    (void)n, (void)ctx;
    g[0] = q[2] - t;
    return m == 1 ? 0 : -1;
}

static int turning_jacobian(int n, int m, double t, const double *q, double *gq, double *gt, void *ctx)
{
    (void)n, (void)t, (void)q, (void)ctx;
    gq[2] = 1.0;
    gt[0] = -1.0;
    return m == 1 ? 0 : -1;
}

static int zero_motion(int n, int rows, double t, const double *q, const double *v, double *c, void *ctx)
{
    (void)n, (void)t, (void)q, (void)v, (void)ctx;
    for (int i = 0; i < rows; i++) c[i] = 0.0;
    return 0;
}

static int any_reaction(int n, int m, int p, double t, const double *q, const double *v, const double *lambda,
                        const double *psi, double *r, void *ctx)
{
    (void)n, (void)m, (void)p, (void)t, (void)q, (void)v, (void)lambda, (void)psi, (void)r, (void)ctx;
    return 0;
}

static int any_reaction_jacobian(int n, int m, int p, double t, const double *q, const double *v,
                                 const double *lambda, const double *psi, double *rl, double *rp, void *ctx)
{
    (void)n, (void)m, (void)p, (void)t, (void)q, (void)v, (void)lambda, (void)psi, (void)rl, (void)rp, (void)ctx;
    return 0;
}

/* Does what its context says, in the last row: a code, or a number */
struct orders {
    int code;
    double number;
};

static int ordered(int n, int m, double t, const double *q, double *g, void *ctx)
{
    struct orders *o = ctx;
    rod_constraint(n, m, t, q, g, NULL);
    if (o->code == 0) g[1] = o->number;
    return o->code;
}

static int ordered_jacobian(int n, int m, double t, const double *q, double *gq, double *gt, void *ctx)
{
    struct orders *o = ctx;
    rod_jacobian(n, m, t, q, gq, gt, NULL);
    if (o->code == 0) gt[1] = o->number;
    return o->code;
}

static void test_residuals(void)
{
    const double q[3] = {1.0, 2.0, 0.5}, v[3] = {-1.0, 3.0, 0.25}, t = 0.125;
    double g[2], gv[2], by_pattern[2], k[1];
    int calls = 0;
    intptr_t s = rod_handle(&calls);

    CHECK(dynstep_residuals(s, 3, t, q, v, 2, g, gv, 0, NULL) == 0);
    CHECK(calls == 1);
    CHECK(g[0] == 1.0 - 2.0 * cos(0.5) && g[1] == 2.0 - 2.0 * sin(0.5));
    CHECK(fabs(gv[0] - (-1.0 + 2.0 * sin(0.5) * 0.25)) < 1e-15);
    CHECK(fabs(gv[1] - (3.0 - 2.0 * cos(0.5) * 0.25)) < 1e-15);
    CHECK(dynstep_residuals(s, 3, t, q, v, 2, NULL, NULL, 0, NULL) == 0);
    CHECK(calls == 1);

    /* the same numbers in a pattern, and by differences (four points: the errors are near 1e-12) */
    CHECK(dynstep_set_pattern(s, DYNSTEP_CONSTRAINT_JACOBIAN, 2, rod_first, rod_column) == 0);
    CHECK(dynstep_set_constraint_jacobian(s, ADDRESS(rod_jacobian_values), 0) == 0);
    CHECK(dynstep_residuals(s, 3, t, q, v, 2, NULL, by_pattern, 0, NULL) == 0);
    CHECK(by_pattern[0] == gv[0] && by_pattern[1] == gv[1]);
    CHECK(dynstep_set_constraint_jacobian(s, 0, 0) == 0);
    CHECK(dynstep_residuals(s, 3, t, q, v, 2, NULL, by_pattern, 0, NULL) == 0);
    CHECK(fabs(by_pattern[0] - gv[0]) < 1e-10 && fabs(by_pattern[1] - gv[1]) < 1e-10);
    CHECK(dynstep_set_pattern(s, DYNSTEP_CONSTRAINT_JACOBIAN, 0, NULL, NULL) == 0);
    CHECK(dynstep_residuals(s, 3, t, q, v, 2, NULL, by_pattern, 0, NULL) == 0);
    CHECK(fabs(by_pattern[0] - gv[0]) < 1e-10 && fabs(by_pattern[1] - gv[1]) < 1e-10);
    CHECK(dynstep_delete(&s) == 0);

    /* both kinds of constraints, one of them rheonomic; other numbers of rows than before */
    s = dynstep_new(3);
    CHECK(dynstep_set_force(s, ADDRESS(no_force), 0) == 0);
    CHECK(dynstep_residuals(s, 3, t, q, v, 0, NULL, NULL, 0, NULL) == 0);
    CHECK(dynstep_set_velocity_constraint(s, 1, ADDRESS(edge), 0) == 0);
    CHECK(dynstep_set_velocity_jacobian(s, ADDRESS(edge_jacobian), 0) == 0);
    CHECK(dynstep_set_constraint(s, 1, ADDRESS(turning), 0) == 0);
    CHECK(dynstep_set_constraint_jacobian(s, ADDRESS(turning_jacobian), 0) == 0);
    CHECK(dynstep_residuals(s, 3, t, q, v, 1, g, gv, 1, k) == 0);
    CHECK(g[0] == 0.375 && gv[0] == -0.75 && k[0] == -sin(0.5) - cos(0.5) * 3.0);
    CHECK(dynstep_delete(&s) == 0);
}

/* Newmark's method takes no constraints; without them it does */
static void test_newmark(void)
{
    double q[3], lambda[2];
    intptr_t s = rod_handle(NULL);
    REFUSES(dynstep_start(s, 3, 0.0, rod_q0, rod_v0), DYNSTEP_INVALID_INPUT,
            "Newmark takes no constraints, and this system has 2 of g and 0 of k");
    REFUSES(dynstep_get_multipliers(s, 2, lambda, 0, NULL), DYNSTEP_INVALID_INPUT, "dynstep_start first");
    REFUSES(dynstep_run(s, 1.0, 0.1), DYNSTEP_INVALID_INPUT, "dynstep_start first");
    CHECK(dynstep_set_reaction_tangent(s, 0, 0) == 0);
    CHECK(dynstep_set_constraint(s, 0, 0, 0) == 0);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_run(s, 1.0, 0.125) == 0);
    CHECK(dynstep_get(s, 3, NULL, q, NULL, NULL) == 0);
    CHECK(fabs(q[0] - 20.0) < 1e-13);
    CHECK(dynstep_get_multipliers(s, 0, NULL, 0, NULL) == 0);

    /* points without multipliers */
    int count;
    double t[4];
    CHECK(dynstep_begin(s, 1.5, 0.125, 1, 0, NULL) == 0);
    REFUSES(dynstep_record_multipliers(s, 3, 0, NULL, 0, NULL), DYNSTEP_INVALID_INPUT, "wrote 0 points");
    CHECK(dynstep_proceed(s, 2, 4, &count, t, NULL, NULL, NULL) == DYNSTEP_MORE && count == 3);
    CHECK(dynstep_record_multipliers(s, 3, 0, NULL, 0, NULL) == 0);
    REFUSES(dynstep_record_multipliers(s, 3, 1, lambda, 0, NULL), DYNSTEP_INVALID_INPUT, "m = 1, but the system has 0");
    REFUSES(dynstep_record_multipliers(s, 4, 0, NULL, 0, NULL), DYNSTEP_INVALID_INPUT, "count = 4");
    CHECK(dynstep_step(s, 0.125) == 0);
    REFUSES(dynstep_record_multipliers(s, 3, 0, NULL, 0, NULL), DYNSTEP_INVALID_INPUT, "dynstep_begin");
    CHECK(dynstep_delete(&s) == 0);
}

/* What goes with a constraint needs one; constraints need a force */
static void test_parts(void)
{
    double x[3];
    intptr_t s = rod_handle(NULL);
#define STARTS(word) REFUSES(dynstep_start(s, 3, 0.0, rod_q0, rod_v0), DYNSTEP_INVALID_INPUT, word)
    CHECK(dynstep_set_constraint(s, 0, 0, 0) == 0);
    STARTS("set a constraint: reactions");
    CHECK(dynstep_set_reaction_tangent(s, 0, 0) == 0);
    CHECK(dynstep_set_reaction(s, ADDRESS(any_reaction), 0) == 0);
    STARTS("set a constraint: reactions");
    CHECK(dynstep_set_reaction_jacobian(s, ADDRESS(any_reaction_jacobian), 0) == 0);
    CHECK(dynstep_set_reaction(s, 0, 0) == 0);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_set_reaction_jacobian(s, ADDRESS(any_reaction_jacobian), 0) == 0);
    STARTS("set a reaction: its Jacobian");
    CHECK(dynstep_set_reaction_jacobian(s, 0, 0) == 0);

    CHECK(dynstep_set_constraint_jacobian(s, ADDRESS(rod_jacobian), 0) == 0);
    STARTS("set a constraint: its Jacobian, curvature and pattern");
    CHECK(dynstep_set_constraint_jacobian(s, 0, 0) == 0);
    CHECK(dynstep_set_constraint_curvature(s, ADDRESS(zero_motion), 0) == 0);
    STARTS("set a constraint: its Jacobian, curvature and pattern");
    CHECK(dynstep_set_constraint_curvature(s, 0, 0) == 0);
    CHECK(dynstep_set_pattern(s, DYNSTEP_CONSTRAINT_JACOBIAN, 2, rod_first, rod_column) == 0);
    STARTS("set a constraint: its Jacobian, curvature and pattern");
    CHECK(dynstep_set_constraint(s, 1, ADDRESS(turning), 0) == 0);
    STARTS("the pattern of constraint_jacobian has 2 rows, but there are 1 constraints");
    CHECK(dynstep_set_constraint(s, 0, 0, 0) == 0);

    CHECK(dynstep_set_velocity_jacobian(s, ADDRESS(edge_jacobian), 0) == 0);
    STARTS("set a velocity constraint");
    CHECK(dynstep_set_velocity_jacobian(s, 0, 0) == 0);
    CHECK(dynstep_set_velocity_curvature(s, ADDRESS(zero_motion), 0) == 0);
    STARTS("set a velocity constraint");
    CHECK(dynstep_set_velocity_curvature(s, 0, 0) == 0);
    CHECK(dynstep_set_pattern(s, DYNSTEP_VELOCITY_JACOBIAN, 2, rod_first, rod_column) == 0);
    STARTS("set a velocity constraint");
    CHECK(dynstep_set_velocity_constraint(s, 1, ADDRESS(edge), 0) == 0);
    STARTS("the pattern of velocity_jacobian has 2 rows");
    CHECK(dynstep_set_velocity_constraint(s, 0, 0, 0) == 0);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);

    const int order[4] = {3, 0, 1, 2};
    CHECK(dynstep_set_constraint_order(s, 4, order) == 0);
    STARTS("the constraint order has 4 unknowns, but n + m + p = 3");
    CHECK(dynstep_set_constraint(s, 1, ADDRESS(turning), 0) == 0);
    STARTS("Newmark takes no constraints");
    CHECK(dynstep_set_constraint_order(s, 0, NULL) == 0);

    CHECK(dynstep_set_force(s, 0, 0) == 0);
    CHECK(dynstep_set_tangent(s, 0, 0) == 0);
    STARTS("set a force: constraints go with one");
    REFUSES(dynstep_residuals(s, 3, 0.0, rod_q0, rod_v0, 1, x, NULL, 0, NULL), DYNSTEP_INVALID_INPUT, "set a force");
    CHECK(dynstep_set_constraint(s, 0, 0, 0) == 0);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_delete(&s) == 0);
}

/* Arguments out of their range change nothing */
static void test_misuse(void)
{
    double x[3];
    const int late[3] = {1, 2, 4}, backward[3] = {0, 3, 2}, outside[4] = {0, 3, 1, 2}, twice[4] = {0, 2, 2, 2};
    const int negative[4] = {-1, 2, 1, 2}, again[5] = {0, 1, 2, 2, 4}, beyond[5] = {0, 1, 2, 3, 5}, below[2] = {-1, 0};
    intptr_t s = rod_handle(NULL);
    CHECK(dynstep_residuals(s, 3, 0.0, rod_q0, rod_v0, 2, x, NULL, 0, NULL) == 0);

    REFUSES(dynstep_set_constraint(s, 0, ADDRESS(rod_constraint), 0), DYNSTEP_INVALID_INPUT, "m = 0");
    REFUSES(dynstep_set_constraint(s, -1, ADDRESS(rod_constraint), 0), DYNSTEP_INVALID_INPUT, "m = -1");
    REFUSES(dynstep_set_constraint(s, 4, ADDRESS(rod_constraint), 0), DYNSTEP_INVALID_INPUT, "between 1 and n = 3");
    REFUSES(dynstep_set_velocity_constraint(s, 0, ADDRESS(edge), 0), DYNSTEP_INVALID_INPUT, "p = 0");
    REFUSES(dynstep_set_velocity_constraint(s, 4, ADDRESS(edge), 0), DYNSTEP_INVALID_INPUT, "p = 4");

#define PATTERN(rows, first, column, word) \
    REFUSES(dynstep_set_pattern(s, DYNSTEP_CONSTRAINT_JACOBIAN, rows, first, column), DYNSTEP_INVALID_INPUT, word)
    REFUSES(dynstep_set_pattern(s, 0, 2, rod_first, rod_column), DYNSTEP_INVALID_INPUT, "which = 0");
    REFUSES(dynstep_set_pattern(s, 3, 2, rod_first, rod_column), DYNSTEP_INVALID_INPUT, "which = 3");
    PATTERN(-1, rod_first, rod_column, "rows = -1");
    PATTERN(4, rod_first, rod_column, "rows = 4");
    PATTERN(2, NULL, rod_column, "first is NULL");
    PATTERN(2, rod_first, NULL, "column is NULL");
    PATTERN(2, late, rod_column, "first[0] = 1 must be 0");
    PATTERN(2, backward, rod_column, "first[2] = 2");
    PATTERN(2, rod_first, outside, "has column 4 in row 1, outside 1 to 3");
    PATTERN(2, rod_first, negative, "has column 0 in row 1");
    PATTERN(2, rod_first, twice, "do not increase in row 2");

#define ORDER(count, order, word) REFUSES(dynstep_set_constraint_order(s, count, order), DYNSTEP_INVALID_INPUT, word)
    ORDER(-1, again, "count = -1");
    ORDER(5, NULL, "order is NULL");
    ORDER(5, again, "order[3] = 2 comes twice");
    ORDER(5, beyond, "order[4] = 5 must lie between 0 and count - 1 = 4");
    ORDER(2, below, "order[0] = -1");

#define RESIDUALS(n, t, q, v, m, p, word) \
    REFUSES(dynstep_residuals(s, n, t, q, v, m, x, NULL, p, NULL), DYNSTEP_INVALID_INPUT, word)
    const double bad[3] = {0.0, NAN, 0.0};
    RESIDUALS(2, 0.0, rod_q0, rod_v0, 2, 0, "n = 2");
    RESIDUALS(3, INFINITY, rod_q0, rod_v0, 2, 0, "t = ");
    RESIDUALS(3, 0.0, NULL, rod_v0, 2, 0, "q is NULL");
    RESIDUALS(3, 0.0, rod_q0, NULL, 2, 0, "v is NULL");
    RESIDUALS(3, 0.0, bad, rod_v0, 2, 0, "component 2 of q");
    RESIDUALS(3, 0.0, rod_q0, bad, 2, 0, "component 2 of v");
    RESIDUALS(3, 0.0, rod_q0, rod_v0, 3, 0, "m = 3, but the system has 2 holonomic");
    RESIDUALS(3, 0.0, rod_q0, rod_v0, 2, 1, "p = 1, but the system has 0 constraints on velocities");
    REFUSES(dynstep_get_multipliers(s, 1, x, 0, NULL), DYNSTEP_INVALID_INPUT, "m = 1");
    REFUSES(dynstep_get_multipliers(s, 2, x, 1, x), DYNSTEP_INVALID_INPUT, "p = 1");

    /* nothing was changed */
    CHECK(dynstep_residuals(s, 3, 0.0, rod_q0, rod_v0, 2, x, NULL, 0, NULL) == 0);
    CHECK(dynstep_delete(&s) == 0);
}

/* A function that refuses, and one that gives NaN, name themselves, row and time */
static void test_functions_that_fail(void)
{
    double g[2] = {7.0, 7.0};
    struct orders o = {0, NAN};
    intptr_t s = rod_handle(NULL);
    CHECK(dynstep_set_constraint(s, 2, ADDRESS(ordered), ADDRESS(&o)) == 0);
#define ASK(g, gv) dynstep_residuals(s, 3, 0.5, rod_q0, rod_v0, 2, g, gv, 0, NULL)
    REFUSES(ASK(g, NULL), DYNSTEP_NOT_FINITE, "constraint returned NaN in row 2 at t = 0.5");
    CHECK(g[0] == 7.0 && g[1] == 7.0);
    o.code = 4;
    REFUSES(ASK(g, NULL), DYNSTEP_CALLBACK_FAILED, "constraint gave up at t = 0.5 (ierr = 4)");
    CHECK(dynstep_set_constraint_jacobian(s, ADDRESS(ordered_jacobian), ADDRESS(&o)) == 0);
    REFUSES(ASK(NULL, g), DYNSTEP_CALLBACK_FAILED, "constraint_jacobian gave up");
    o.code = 0;
    o.number = INFINITY;
    REFUSES(ASK(NULL, g), DYNSTEP_NOT_FINITE, "constraint_jacobian returned Infinity in row 2");
    o.number = 0.0;
    CHECK(ASK(NULL, g) == 0);
    CHECK(dynstep_set_constraint_jacobian(s, 0, 0) == 0);
    o.code = -2;
    REFUSES(ASK(NULL, g), DYNSTEP_CALLBACK_FAILED, "constraint_jacobian gave up at t = 0.5 (ierr = -2)");
    CHECK(dynstep_delete(&s) == 0);
}

int main(void)
{
    test_residuals();
    test_newmark();
    test_parts();
    test_misuse();
    test_functions_that_fail();
    return finish();
}
