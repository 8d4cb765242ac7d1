/* SPDX-License-Identifier: BSD-3-Clause */
/* SOI2 and generalized-alpha by the C interface: the pendulum of Jay & Negrut (2008), points and multipliers,
 * starts that are off the constraints, and what is refused.  That the bits are those of the other languages is
 * tested in tests/bitwise. */
#include "rod_pendulum.h"

enum { STEPS = 64, MOST = STEPS + 1 };
static const double h = 1.0 / 64.0;

static intptr_t soi2_handle(double rho_inf)
{
    double c[4];
    intptr_t s = rod_handle(NULL);
    CHECK(dynstep_alpha_coefficients(rho_inf, c) == 0);
    CHECK(dynstep_set_soi2(s, c[0], c[1], c[2], c[3], DYNSTEP_SOI2) == 0);
    return s;
}

static double largest(const double *x, int n)
{
    double size = 0.0;
    for (int i = 0; i < n; i++) size = fmax(size, fabs(x[i]));
    return size;
}

/* The table of section 1 of the paper, and what is outside of it */
static void test_coefficients(void)
{
    double c[4];
    CHECK(dynstep_alpha_coefficients(0.5, c) == 0);
    CHECK(c[0] == 0.0 && fabs(c[1] - 1.0 / 3.0) < 1e-15 && fabs(c[2] - 4.0 / 9.0) < 1e-15 && fabs(c[3] - 5.0 / 6.0) < 1e-15);
    CHECK(dynstep_alpha_coefficients(0.0, c) == 0 && c[0] == -1.0 && c[1] == 0.0 && c[2] == 1.0 && c[3] == 1.5);
    CHECK(dynstep_alpha_coefficients(1.0, c) == 0 && c[0] == 0.5 && c[1] == 0.5 && c[2] == 0.25 && c[3] == 0.5);
    CHECK(dynstep_alpha_coefficients(-0.01, c) == DYNSTEP_INVALID_INPUT && c[0] == 0.5);
    CHECK(dynstep_alpha_coefficients(1.01, c) == DYNSTEP_INVALID_INPUT);
    CHECK(dynstep_alpha_coefficients(NAN, c) == DYNSTEP_INVALID_INPUT);
    CHECK(dynstep_alpha_coefficients(0.5, NULL) == DYNSTEP_INVALID_INPUT);
}

/* Consistent multipliers at the start, both levels of the constraints in the end, energy that falls */
static void test_pendulum(void)
{
    double q[3], v[3], a[3], lambda[2], g[2], gv[2], report[5], t;
    long long counts[DYNSTEP_COUNTS];
    int calls = 0, facts[DYNSTEP_FACTS];
    char name[33];
    intptr_t s = soi2_handle(0.2);
    CHECK(dynstep_properties(s, sizeof name, name, NULL, facts, NULL) == 0);
    CHECK(strcmp(name, "soi2") == 0 && facts[DYNSTEP_FACT_ORDER] == 2 && facts[DYNSTEP_FACT_MULTIPLIER_ORDER] == 2);
    CHECK(dynstep_set_constraint(s, 2, ADDRESS(rod_constraint), ADDRESS(&calls)) == 0);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_get(s, 3, NULL, q, v, a) == 0);
    CHECK(dynstep_get_multipliers(s, 2, lambda, 0, NULL) == 0);
    CHECK(fabs(a[0] + 75.0) < 1e-10 && fabs(a[1] - 200.0) < 1e-10 && fabs(a[2] + 37.5) < 1e-10);
    CHECK(fabs(lambda[0] - 375.0) < 1e-10 && fabs(lambda[1] + 1049.05) < 1e-10);
    CHECK(dynstep_start_report(s, report) == 0);
    CHECK(report[0] < 1e-15 && report[1] < 1e-13 && report[2] == 0.0 && report[3] < 1e-15 && report[4] < 1e-13);
    CHECK(dynstep_redundant_constraints(s, sizeof name, name) == 0 && name[0] == '\0');

    CHECK(dynstep_run(s, 1.0, h) == 0);
    CHECK(dynstep_get(s, 3, &t, q, v, a) == 0 && t == 1.0);
    CHECK(dynstep_residuals(s, 3, t, q, v, 2, g, gv, 0, NULL) == 0);
    CHECK(largest(g, 2) < 1e-14 && largest(gv, 2) < 1e-13);
    CHECK(dynstep_counts(s, counts) == 0);
    CHECK(counts[DYNSTEP_COUNT_STEPS] == STEPS);
    CHECK(counts[DYNSTEP_COUNT_CONSTRAINTS] == calls - 1 && calls > STEPS);       /* but for dynstep_residuals */
    CHECK(counts[DYNSTEP_COUNT_NEWTON_ITERATIONS] <= 5 * STEPS);
    CHECK(dynstep_delete(&s) == 0);
}

/* A run cut into calls with little room, and its multipliers */
static void test_records(void)
{
    double t[MOST], q[3 * MOST], lambda[2 * MOST], more[2 * MOST], now[2], part[2 * 5];
    const double times[3] = {0.0, 0.5, 0.5 + 0.25 * h};
    int count, number = 0, code;
    intptr_t s = soi2_handle(0.8);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_begin(s, 1.0, h, 1, 0, NULL) == 0);
    CHECK(dynstep_proceed(s, 1000, MOST, &count, t, q, NULL, NULL) == 0 && count == MOST);
    CHECK(dynstep_record_multipliers(s, MOST, 2, lambda, 0, NULL) == 0);
    CHECK(dynstep_get_multipliers(s, 2, now, 0, NULL) == 0);
    CHECK(memcmp(now, lambda + 2 * STEPS, sizeof now) == 0);
    CHECK(dynstep_record_multipliers(s, MOST, 2, NULL, 0, NULL) == 0);

    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_begin(s, 1.0, h, 1, 0, NULL) == 0);
    do {
        code = dynstep_proceed(s, 7, 5, &count, t, NULL, NULL, NULL);
        CHECK(code >= 0);
        CHECK(dynstep_record_multipliers(s, count, 2, part, 0, NULL) == 0);
        memcpy(more + 2 * number, part, 2 * count * sizeof *part);
        number += count;
    } while (code == DYNSTEP_MORE);
    CHECK(number == MOST && memcmp(more, lambda, sizeof more) == 0);

    /* inside a step, on a straight line; one point at a time, so that some of them have to wait */
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_begin(s, 1.0, h, 1, 3, times) == 0);
    number = 0;
    do {
        code = dynstep_proceed(s, 1000, 1, &count, t, q, NULL, NULL);
        CHECK(code >= 0);
        CHECK(dynstep_record_multipliers(s, count, 2, more + 2 * number, 0, NULL) == 0);
        number += count;
    } while (code == DYNSTEP_MORE && number < 3);
    CHECK(number == 3);
    CHECK(memcmp(more, lambda, 2 * sizeof *more) == 0);
    CHECK(memcmp(more + 2, lambda + 2 * 32, 2 * sizeof *more) == 0);
    for (int i = 0; i < 2; i++)
        CHECK(fabs(more[4 + i] - (0.75 * lambda[64 + i] + 0.25 * lambda[66 + i])) < 1e-12 * fabs(more[4 + i]));
    CHECK(dynstep_delete(&s) == 0);
}

/* The same motion by other ways: a Jacobian in a pattern, by differences; an order of the unknowns; a reaction that is
 * -G' lambda; steps by hand */
static int own_reaction(int n, int m, int p, double t, const double *q, const double *v, const double *lambda,
                        const double *psi, double *r, void *ctx)
{
    (void)n, (void)m, (void)p, (void)t, (void)v, (void)psi, (void)ctx;
    r[0] = -lambda[0];
    r[1] = -lambda[1];
    r[2] = -rod_length * (sin(q[2]) * lambda[0] - cos(q[2]) * lambda[1]);
    return 0;
}

static int own_reaction_jacobian(int n, int m, int p, double t, const double *q, const double *v,
                                 const double *lambda, const double *psi, double *rl, double *rp, void *ctx)
{
    (void)m, (void)p, (void)t, (void)v, (void)lambda, (void)psi, (void)rp, (void)ctx;
    rl[0] = -1.0;
    rl[1 + n] = -1.0;
    rl[2] = -rod_length * sin(q[2]);
    rl[2 + n] = rod_length * cos(q[2]);
    return 0;
}

static double end_of_run(intptr_t s, double *q, double *lambda)
{
    double energy = 0.0;
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_run(s, 1.0, h) == 0);
    CHECK(dynstep_get(s, 3, NULL, q, NULL, NULL) == 0);
    CHECK(dynstep_get_multipliers(s, 2, lambda, 0, NULL) == 0);
    return energy;
}

static void same_end(intptr_t s, const double *q, const double *lambda, double tolerance)
{
    double q1[3], lambda1[2];
    end_of_run(s, q1, lambda1);
    for (int i = 0; i < 3; i++) CHECK(fabs(q1[i] - q[i]) <= tolerance);
    for (int i = 0; i < 2; i++) CHECK(fabs(lambda1[i] - lambda[i]) <= 1e3 * tolerance);
}

static void test_other_ways(void)
{
    const int order[5] = {2, 0, 3, 4, 1};
    double q[3], lambda[2], c[4];
    intptr_t s = soi2_handle(0.5);
    end_of_run(s, q, lambda);
    CHECK(dynstep_set_pattern(s, DYNSTEP_CONSTRAINT_JACOBIAN, 2, rod_first, rod_column) == 0);
    CHECK(dynstep_set_constraint_jacobian(s, ADDRESS(rod_jacobian_values), 0) == 0);
    same_end(s, q, lambda, 1e-12);
    CHECK(dynstep_set_constraint_order(s, 5, order) == 0);
    same_end(s, q, lambda, 1e-12);
    CHECK(dynstep_set_constraint_order(s, 0, NULL) == 0);
    CHECK(dynstep_set_reaction(s, ADDRESS(own_reaction), 0) == 0);
    CHECK(dynstep_set_reaction_jacobian(s, ADDRESS(own_reaction_jacobian), 0) == 0);
    same_end(s, q, lambda, 1e-11);
    CHECK(dynstep_set_reaction(s, 0, 0) == 0);
    CHECK(dynstep_set_reaction_tangent(s, 0, 0) == 0);
    same_end(s, q, lambda, 1e-12);

    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    for (int i = 0; i < STEPS; i++) CHECK(dynstep_step(s, h) == 0);
    double q1[3];
    CHECK(dynstep_get(s, 3, NULL, q1, NULL, NULL) == 0);
    for (int i = 0; i < 3; i++) CHECK(fabs(q1[i] - q[i]) < 1e-12);

    /* other members and options give another motion, near by */
    CHECK(dynstep_alpha_coefficients(0.5, c) == 0);
    CHECK(dynstep_set_soi2(s, c[0], c[1], c[2], c[3], DYNSTEP_INDEX3) == 0);
    end_of_run(s, q1, lambda);
    CHECK(q1[0] != q[0] && fabs(q1[0] - q[0]) < 1e-2);
    CHECK(dynstep_set_soi2(s, c[0], c[1], c[2], c[3], DYNSTEP_REDUCED) == 0);
    same_end(s, q, lambda, 1.0);
    CHECK(dynstep_set_alpha_options(s, DYNSTEP_MASS_RECOMPUTED, 0, 0, 0) == 0);
    end_of_run(s, q1, lambda);
    CHECK(q1[0] != q[0] && fabs(q1[0] - q[0]) < 1e-2);
    CHECK(dynstep_delete(&s) == 0);
}

/* Off the constraints by 0.01 in x and 0.25 in its velocity */
static void test_starts(void)
{
    const double q0[3] = {0.01, -2.0, rod_hanging}, v0[3] = {20.25, 0.0, 10.0};
    double q[3], v[3], report[5], g[2], gv[2];
    intptr_t s = soi2_handle(0.8);
    REFUSES(dynstep_start_report(s, report), DYNSTEP_INVALID_INPUT, "dynstep_start first");
    CHECK(dynstep_start(s, 3, 0.0, q0, v0) == 0);
    CHECK(dynstep_start_report(s, report) == 0);
    CHECK(fabs(report[0] - 0.01) < 1e-15 && fabs(report[1] - 0.25) < 0.1 && report[2] == 0.0);
    CHECK(report[3] > 1e-3 && report[3] < 0.01 && report[4] > 0.01 && report[4] < 0.25);
    CHECK(dynstep_get(s, 3, NULL, q, v, NULL) == 0);
    CHECK(dynstep_residuals(s, 3, 0.0, q, v, 2, g, gv, 0, NULL) == 0);
    CHECK(largest(g, 2) < 1e-14 && largest(gv, 2) < 1e-13);
    CHECK(fabs(fmax(fabs(q[0] - q0[0]), fmax(fabs(q[1] - q0[1]), fabs(q[2] - q0[2]))) - report[3]) < 1e-15);

    CHECK(dynstep_set_start(s, DYNSTEP_START_REFUSE) == 0);
    REFUSES(dynstep_start(s, 3, 0.0, q0, v0), DYNSTEP_INCONSISTENT_START, "off the constraints");
    CHECK(dynstep_start_report(s, report) == 0 && fabs(report[0] - 0.01) < 1e-15);
    REFUSES(dynstep_run(s, 1.0, h), DYNSTEP_INVALID_INPUT, "dynstep_start first");
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);

    CHECK(dynstep_set_start(s, DYNSTEP_START_KEEP) == 0);
    CHECK(dynstep_start(s, 3, 0.0, q0, v0) == 0);
    CHECK(dynstep_get(s, 3, NULL, q, v, NULL) == 0);
    CHECK(memcmp(q, q0, sizeof q) == 0 && memcmp(v, v0, sizeof v) == 0);
    CHECK(dynstep_delete(&s) == 0);
}

/* The second constraint is the first again, or contradicts it */
static int twice(int n, int m, double t, const double *q, double *g, void *ctx)
{
    rod_constraint(n, m, t, q, g, NULL);
    g[1] = g[0] - *(double *)ctx;
    return 0;
}

static int twice_curvature(int n, int m, double t, const double *q, const double *v, double *c, void *ctx)
{
    rod_curvature(n, m, t, q, v, c, ctx);
    c[1] = c[0];
    return 0;
}

static void test_redundant(void)
{
    double off = 0.0;
    char text[DYNSTEP_MESSAGE_LENGTH];
    intptr_t s = soi2_handle(0.8);
    CHECK(dynstep_set_constraint(s, 2, ADDRESS(twice), ADDRESS(&off)) == 0);
    CHECK(dynstep_set_constraint_jacobian(s, 0, 0) == 0);
    CHECK(dynstep_set_constraint_curvature(s, ADDRESS(twice_curvature), 0) == 0);
    CHECK(dynstep_set_reaction_tangent(s, 0, 0) == 0);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_redundant_constraints(s, sizeof text, text) == 0 && strstr(text, "2"));
    CHECK(dynstep_run(s, 0.25, h) == 0);
    CHECK(dynstep_set_start(s, DYNSTEP_START_PROJECT) == 0);
    off = 0.125;
    REFUSES(dynstep_start(s, 3, 0.0, rod_q0, rod_v0), DYNSTEP_INCONSISTENT_START, "contradict");
    CHECK(dynstep_delete(&s) == 0);
}

/* Generalized-alpha takes no constraints, and without them it is a method like others */
static void test_generalized_alpha(void)
{
    double c[4], q[3], report[5];
    int facts[DYNSTEP_FACTS];
    char name[33];
    intptr_t s = rod_handle(NULL);
    CHECK(dynstep_alpha_coefficients(0.8, c) == 0);
    CHECK(dynstep_set_generalized_alpha(s, c[0], c[1], c[2], c[3]) == 0);
    CHECK(dynstep_properties(s, sizeof name, name, NULL, facts, NULL) == 0);
    CHECK(strcmp(name, "generalized-alpha") == 0 && facts[DYNSTEP_FACT_MULTIPLIER_ORDER] == 0);
    REFUSES(dynstep_start(s, 3, 0.0, rod_q0, rod_v0), DYNSTEP_INVALID_INPUT, "takes no constraints");
    CHECK(dynstep_set_reaction_tangent(s, 0, 0) == 0);
    CHECK(dynstep_set_constraint(s, 0, 0, 0) == 0);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    CHECK(dynstep_run(s, 1.0, h) == 0);
    CHECK(dynstep_get(s, 3, NULL, q, NULL, NULL) == 0);
    CHECK(fabs(q[0] - 20.0) < 1e-12 && fabs(q[1] + 2.0 + 0.5 * rod_gravity) < 1e-12);
    CHECK(dynstep_start_report(s, report) == 0 && report[0] == 0.0);

    /* a linear system, and no extrapolation over a method that is not symmetric */
    CHECK(dynstep_set_extrapolation(s, 2, DYNSTEP_HARMONIC, 0, NULL) == 0);
    REFUSES(dynstep_start(s, 3, 0.0, rod_q0, rod_v0), DYNSTEP_INVALID_INPUT, "symmetric");
    CHECK(dynstep_set_extrapolation(s, 0, 0, 0, NULL) == 0);
    CHECK(dynstep_set_newmark(s, 0.25, 0.5) == 0);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    REFUSES(dynstep_start_report(s, report), DYNSTEP_INVALID_INPUT, "no report");
    REFUSES(dynstep_redundant_constraints(s, sizeof name, name), DYNSTEP_INVALID_INPUT, "no report");
    CHECK(dynstep_delete(&s) == 0);
}

static void test_misuse(void)
{
    double report[5];
    intptr_t s = soi2_handle(0.8);
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    REFUSES(dynstep_set_generalized_alpha(s, 1.0, 0.5, 0.25, 0.5), DYNSTEP_INVALID_INPUT, "alpha_m and alpha_f other than 1");
    REFUSES(dynstep_set_generalized_alpha(s, 0.5, NAN, 0.25, 0.5), DYNSTEP_INVALID_INPUT, "NaN");
    REFUSES(dynstep_set_soi2(s, 0.5, 0.5, -0.25, 0.5, 1), DYNSTEP_INVALID_INPUT, "beta >= 0");
    REFUSES(dynstep_set_soi2(s, 0.5, 0.5, 0.25, INFINITY, 1), DYNSTEP_INVALID_INPUT, "gamma >= 0");
    REFUSES(dynstep_set_soi2(s, 0.5, 0.5, 0.25, 0.5, 0), DYNSTEP_INVALID_INPUT, "variant = 0");
    REFUSES(dynstep_set_soi2(s, 0.5, 0.5, 0.25, 0.5, 4), DYNSTEP_INVALID_INPUT, "variant = 4");
    REFUSES(dynstep_set_alpha_options(s, 0, 1, 1, 1), DYNSTEP_INVALID_INPUT, "mass_at = 0");
    REFUSES(dynstep_set_alpha_options(s, 3, 1, 1, 1), DYNSTEP_INVALID_INPUT, "mass_at = 3");
    REFUSES(dynstep_set_start(s, 0), DYNSTEP_INVALID_INPUT, "mode = 0");
    REFUSES(dynstep_set_start(s, 4), DYNSTEP_INVALID_INPUT, "mode = 4");
    REFUSES(dynstep_start_report(s, NULL), DYNSTEP_INVALID_INPUT, "report is NULL");
    CHECK(dynstep_start_report(s, report) == 0);
    CHECK(dynstep_run(s, 0.125, h) == 0);                /* nothing was changed */
    CHECK(dynstep_set_soi2(s, 0.0, 0.0, 0.0, 0.5, 1) == 0);
    REFUSES(dynstep_start(s, 3, 0.0, rod_q0, rod_v0), DYNSTEP_INVALID_INPUT, "constraints need beta > 0");
    CHECK(dynstep_delete(&s) == 0);
}

/* Functions that refuse or give NaN after t = 0.25: the run ends at the last good step */
struct orders {
    int row;
    double number;
    int code;
};

static int ordered(int n, int m, double t, const double *q, double *g, void *ctx)
{
    struct orders *o = ctx;
    rod_constraint(n, m, t, q, g, NULL);
    if (t <= 0.25) return 0;
    if (o->row) g[o->row - 1] = o->number;
    return o->code;
}

static int ordered_jacobian(int n, int m, double t, const double *q, double *gq, double *gt, void *ctx)
{
    struct orders *o = ctx;
    rod_jacobian(n, m, t, q, gq, gt, NULL);
    if (t <= 0.25) return 0;
    if (o->row) gq[o->row - 1] = o->number;
    return o->code;
}

static void fails(intptr_t s, int code, const char *word)
{
    double t;
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    REFUSES(dynstep_run(s, 1.0, h), code, word);
    CHECK(dynstep_get(s, 3, &t, NULL, NULL, NULL) == 0 && t == 0.25);
}

static void test_failures(void)
{
    struct orders o = {2, NAN, 0};
    intptr_t s = soi2_handle(0.8);
    CHECK(dynstep_set_constraint(s, 2, ADDRESS(ordered), ADDRESS(&o)) == 0);
    fails(s, DYNSTEP_NOT_FINITE, "constraint returned NaN");
    o = (struct orders){0, 0.0, 3};
    fails(s, DYNSTEP_CALLBACK_FAILED, "constraint");
    o = (struct orders){0, 0.0, -3};
    fails(s, DYNSTEP_CALLBACK_FAILED, "ierr = -3");
    o = (struct orders){2, -INFINITY, 0};
    CHECK(dynstep_set_constraint(s, 2, ADDRESS(rod_constraint), 0) == 0);
    CHECK(dynstep_set_constraint_jacobian(s, ADDRESS(ordered_jacobian), ADDRESS(&o)) == 0);
    fails(s, DYNSTEP_NOT_FINITE, "constraint_jacobian returned -Infinity in row 1, column 2");
    o = (struct orders){0, 0.0, -7};
    fails(s, DYNSTEP_CALLBACK_FAILED, "ierr = -7");
    CHECK(dynstep_set_constraint_jacobian(s, ADDRESS(rod_jacobian), 0) == 0);
    CHECK(dynstep_set_newton(s, 1, 0, 0.0) == 0);        /* one correction is too few */
    CHECK(dynstep_start(s, 3, 0.0, rod_q0, rod_v0) == 0);
    REFUSES(dynstep_run(s, 1.0, h), DYNSTEP_NOT_CONVERGED, "did not converge in 1 corrections");
    CHECK(dynstep_delete(&s) == 0);
}

int main(void)
{
    test_coefficients();
    test_pendulum();
    test_records();
    test_other_ways();
    test_starts();
    test_redundant();
    test_generalized_alpha();
    test_misuse();
    test_failures();
    return finish();
}
