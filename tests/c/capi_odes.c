/* SPDX-License-Identifier: BSD-3-Clause */
/* The C interface to first-order systems: settings, refusals, functions that belong to the other kind, runs. */
#include <stdlib.h>
#include "checks.h"

enum { N = 3 };

static int rhs(int n, double t, const double *y, double *f, void *ctx)
{
    (void)t, (void)ctx;
    for (int i = 0; i < n; i++) f[i] = -(i + 1) * y[i];
    return 0;
}

static int jacobian(int n, double t, const double *y, double *jac, void *ctx)
{
    (void)t, (void)y, (void)ctx;
    for (int i = 0; i < n; i++) jac[i] = -(i + 1);
    return 0;
}

static int source(int n, double t, double *b, void *ctx)
{
    (void)ctx;
    for (int i = 0; i < n; i++) b[i] = t;
    return 0;
}

/* What belongs to mechanical systems is refused by a handle of the other kind, and the other way round */
static void test_kinds_of_handles(void)
{
    double x[4 * N] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    const int bad = DYNSTEP_INVALID_INPUT;
    intptr_t s = dynstep_new_ode(N);
    CHECK(s != 0 && dynstep_new_ode(0) == 0 && dynstep_new_ode(-1) == 0);
    REFUSES(dynstep_set_force(s, ADDRESS(rhs), 0), bad, "call dynstep_set_rhs");
    REFUSES(dynstep_set_mass(s, 0, 0, 1, 0, 0, 1, 1), bad, "dynstep_set_mass is for mechanical systems");
    REFUSES(dynstep_set_tangent(s, 0, 0), bad, "dynstep_set_jacobian");
    REFUSES(dynstep_set_structure(s, 3, 0, 0, 0, 0, 0, 0), bad, "dynstep_set_jacobian");
    REFUSES(dynstep_set_energy(s, 0, 0), bad, "mechanical");
    REFUSES(dynstep_set_constraint(s, 1, 0, 0), bad, "mechanical");
    REFUSES(dynstep_set_pattern(s, 1, 0, NULL, NULL), bad, "mechanical");
    REFUSES(dynstep_set_constraint_order(s, 0, NULL), bad, "mechanical");
    REFUSES(dynstep_set_matrix(s, 1, 1, 0, 0, 1, x), bad, "dynstep_set_system_matrix");
    REFUSES(dynstep_set_load(s, 0, 0), bad, "dynstep_set_source");
    REFUSES(dynstep_set_coupling(s, x, x, x), bad, "mechanical");
    REFUSES(dynstep_check(s, N, 0.0, x, x, 0, NULL), bad, "mechanical");
    REFUSES(dynstep_start(s, N, 0.0, x, x), bad, "dynstep_start_ode");
    REFUSES(dynstep_get(s, N, NULL, x, x, x), bad, "dynstep_get_ode");
    REFUSES(dynstep_energy(s, x), bad, "mechanical");
    REFUSES(dynstep_residuals(s, N, 0.0, x, x, 0, NULL, NULL, 0, NULL), bad, "mechanical");
    CHECK(dynstep_delete(&s) == 0);

    s = dynstep_new(N);
    REFUSES(dynstep_set_rhs(s, ADDRESS(rhs), 0), bad, "dynstep_new_ode");
    REFUSES(dynstep_set_jacobian(s, 0, 0, 3, 0, 0), bad, "first-order");
    REFUSES(dynstep_set_system_matrix(s, 1, 0, 0, x), bad, "first-order");
    REFUSES(dynstep_set_source(s, 0, 0), bad, "first-order");
    REFUSES(dynstep_start_ode(s, N, 0.0, x), bad, "first-order");
    REFUSES(dynstep_get_ode(s, N, NULL, x, x), bad, "first-order");
    CHECK(dynstep_delete(&s) == 0);
}

static void test_settings(void)
{
    double a[N * N] = {-1.0, 0.0, 0.0, 0.0, -2.0, 0.0, 0.0, 0.0, -3.0}, y[N] = {1.0, 1.0, 1.0};
    double samples[2 * N] = {0.0, 0.0, 0.0, 1.0, 1.0, 1.0};
    const int bad = DYNSTEP_INVALID_INPUT;
    intptr_t s = dynstep_new_ode(N);
    REFUSES(dynstep_start_ode(s, N, 0.0, y), bad, "dynstep_set_rhs");
    REFUSES(dynstep_step(s, 0.1), bad, "dynstep_start_ode");
    REFUSES(dynstep_get_ode(s, N, NULL, y, NULL), bad, "dynstep_start_ode");
    REFUSES(dynstep_get_ode(s, N - 1, NULL, y, NULL), bad, "n = 2, but the system has 3 unknowns");
    REFUSES(dynstep_set_system_matrix(s, 9, 0, 0, a), bad, "kind = 9");
    REFUSES(dynstep_set_system_matrix(s, DYNSTEP_BANDED, 0, 3, a), bad, "ku = 3");
    REFUSES(dynstep_set_system_matrix(s, DYNSTEP_DENSE, 0, 0, NULL), bad, "a is NULL");
    a[4] = NAN;
    REFUSES(dynstep_set_system_matrix(s, DYNSTEP_DENSE, 0, 0, a), bad, "A(2,2)");
    a[4] = -2.0;
    REFUSES(dynstep_set_jacobian(s, 0, 0, DYNSTEP_IDENTITY, 0, 0), bad, "kind = 0");
    REFUSES(dynstep_set_jacobian(s, 0, 0, DYNSTEP_BANDED, -1, 0), bad, "kl = -1");
    REFUSES(dynstep_set_load_table(s, 1, 2, 0.0, 1.0, NULL, samples, NULL, 0), bad, "signals = 1");
    CHECK(dynstep_set_jacobian(s, ADDRESS(jacobian), 0, DYNSTEP_DIAGONAL, 0, 0) == 0);
    REFUSES(dynstep_start_ode(s, N, 0.0, y), bad, "its Jacobian goes with one");
    CHECK(dynstep_set_rhs(s, ADDRESS(rhs), 0) == 0 && dynstep_set_source(s, ADDRESS(source), 0) == 0);
    REFUSES(dynstep_start_ode(s, N, 0.0, y), bad, "not both; add the source");
    CHECK(dynstep_set_system_matrix(s, DYNSTEP_DENSE, 0, 0, a) == 0);
    REFUSES(dynstep_start_ode(s, N, 0.0, y), bad, "not both; add A y");
    REFUSES(dynstep_start_ode(s, N, 0.0, NULL), bad, "y is NULL");
    REFUSES(dynstep_start_ode(s, N + 1, 0.0, y), bad, "n = 4");
    y[1] = NAN;
    REFUSES(dynstep_start_ode(s, N, 0.0, y), bad, "component 2 of y");
    y[1] = 1.0;
    REFUSES(dynstep_start_ode(s, N, INFINITY, y), bad, "t = ");

    /* a method for mechanical systems */
    CHECK(dynstep_set_rhs(s, 0, 0) == 0 && dynstep_set_jacobian(s, 0, 0, DYNSTEP_DENSE, 0, 0) == 0);
    CHECK(dynstep_set_newmark(s, 0.25, 0.5) == 0);
    REFUSES(dynstep_start_ode(s, N, 0.0, y), bad, "first order");
    CHECK(dynstep_delete(&s) == 0);
}

/* A coupling belongs to matrices, and to methods that can solve with it */
static void test_coupling(void)
{
    double k[N] = {1.0, 2.0, 3.0}, b[N] = {1.0, 0.0, 0.0}, v[N] = {0.0, 0.0, 0.0};
    const int bad = DYNSTEP_INVALID_INPUT;
    intptr_t s = dynstep_new(N);
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DIAGONAL, 0, 0, 1, k) == 0);
    CHECK(dynstep_set_coupling(s, b, k, NULL) == 0);
    REFUSES(dynstep_start(s, N, 0.0, b, v), bad, "coupling");
    k[2] = NAN;
    REFUSES(dynstep_set_coupling(s, b, k, NULL), bad, "component 3 of k");
    CHECK(dynstep_set_coupling(s, NULL, k, k) == 0);
    CHECK(dynstep_start(s, N, 0.0, b, v) == 0 && dynstep_run(s, 1.0, 0.1) == 0);
    CHECK(dynstep_set_coupling(s, b, NULL, b) == 0 && dynstep_set_force(s, ADDRESS(rhs), 0) == 0);
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_ZERO, 0, 0, 1, NULL) == 0);
    REFUSES(dynstep_start(s, N, 0.0, b, v), bad, "a force or a coupling");
    CHECK(dynstep_delete(&s) == 0);
}

/* y' = A y + t, A tridiagonal, as right-hand side and as matrix */
static const double band[3 * N] = {0.0, -2.0, 1.0, 1.0, -2.0, 1.0, 1.0, -2.0, 0.0};
static const double start[N] = {1.0, 0.0, -0.5};

static int chain(int n, double t, const double *y, double *f, void *ctx)
{
    if (ctx) ++*(int *)ctx;
    for (int i = 0; i < n; i++) f[i] = t - 2.0 * y[i] + (i > 0 ? y[i - 1] : 0.0) + (i < n - 1 ? y[i + 1] : 0.0);
    return 0;
}

static int chain_banded(int n, double t, const double *y, double *jac, void *ctx)
{
    (void)t, (void)y;
    ++*(int *)ctx;
    memcpy(jac, band, 3 * n * sizeof *jac);
    return 0;
}

static int failing(int n, double t, const double *y, double *f, void *ctx)
{
    chain(n, t, y, f, NULL);
    return t > 0.55 ? *(int *)ctx : 0;
}

/* Ends the run at t = 1, and sees y, no v, and y' */
static int watch(int n, double t, const double *y, const double *v, const double *yp, void *ctx)
{
    double f[N], error = 0.0;
    chain(n, t, y, f, NULL);
    for (int i = 0; i < n; i++) error = fmax(error, fabs(f[i] - yp[i]));
    *(int *)ctx += v == NULL && error < 1e-14;
    return t > 0.95;
}

/* Run a handle to t = 2 and compare its end with `expected` */
static double run(intptr_t s, const double *expected, double *y)
{
    double t = 0.0, yp[N], f[N], error = 0.0;
    CHECK(dynstep_start_ode(s, N, 0.0, start) == 0);
    CHECK(dynstep_run(s, 2.0, 0.1) == 0);
    CHECK(dynstep_get_ode(s, N, &t, y, yp) == 0 && t == 2.0);
    chain(N, t, y, f, NULL);
    for (int i = 0; i < N; i++) error = fmax(error, fmax(fabs(y[i] - expected[i]), fabs(yp[i] - f[i])));
    return error;
}

static void test_runs(void)
{
    double reference[N] = {0.0, 0.0, 0.0}, y[N], table[2 * N] = {0.0, 0.0, 0.0, 4.0, 4.0, 4.0};
    int calls = 0, jacobians = 0, seen = 0, refusal = -1;
    intptr_t s = dynstep_new_ode(N);
    char name[33];

    CHECK(dynstep_properties(s, sizeof name, name, NULL, NULL, NULL) == 0 && strcmp(name, "backinterpolation") == 0);
    CHECK(dynstep_set_system_matrix(s, DYNSTEP_BANDED, 1, 1, band) == 0 && dynstep_set_source(s, ADDRESS(source), 0) == 0);
    CHECK(dynstep_set_pade(s, 6, 6, 0) == 0);
    run(s, reference, reference);

    /* the same source as a table */
    CHECK(dynstep_set_load_table(s, N, 2, 0.0, 4.0, NULL, table, NULL, DYNSTEP_OUTSIDE_HOLD) == 0);
    CHECK(run(s, reference, y) < 1e-13);
    CHECK(dynstep_set_load_table(s, 0, 0, 0.0, 0.0, NULL, NULL, NULL, 0) == 0);
    CHECK(dynstep_start_ode(s, N, 0.0, start) == 0 && dynstep_run(s, 2.0, 0.1) == 0);
    CHECK(dynstep_get_ode(s, N, NULL, y, NULL) == 0 && fabs(y[0] - reference[0]) > 1e-2);
    CHECK(dynstep_set_source(s, ADDRESS(source), 0) == 0);
    CHECK(run(s, reference, y) < 1e-15);        /* the sum of y' in another order */
    CHECK(dynstep_set_backinterpolation(s, 4, 4, 0.5, DYNSTEP_HALVES_TAYLOR) == 0);
    CHECK(run(s, reference, y) < 1e-6);

    /* a right-hand side; a Jacobian by differences of all kinds, and by a function */
    CHECK(dynstep_delete(&s) == 0);
    s = dynstep_new_ode(N);
    CHECK(dynstep_set_rhs(s, ADDRESS(chain), ADDRESS(&calls)) == 0);
    CHECK(run(s, reference, y) < 1e-6 && calls > 100);
    CHECK(dynstep_set_jacobian(s, 0, 0, DYNSTEP_BANDED, 1, 1) == 0 && run(s, reference, y) < 1e-6);
    CHECK(dynstep_set_jacobian(s, ADDRESS(chain_banded), ADDRESS(&jacobians), DYNSTEP_BANDED, 1, 1) == 0);
    CHECK(run(s, reference, y) < 1e-6 && jacobians >= 1);
    CHECK(dynstep_set_backinterpolation(s, 4, 4, 0.5, DYNSTEP_HALVES_FEHLBERG) == 0 && run(s, reference, y) < 1e-9);
    CHECK(dynstep_set_backinterpolation(s, 1, 1, 0.5, DYNSTEP_HALVES_TAYLOR) == 0);
    CHECK(dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL) == 0 && run(s, reference, y) < 1e-9);
    double rows[4 * 4 * N];
    int numbers[4];
    REFUSES(dynstep_tableau(s, 2 * N, 4, rows, numbers), DYNSTEP_INVALID_INPUT, "size = 6 must be 3");
    CHECK(dynstep_tableau(s, N, 4, rows, numbers) == 0 && numbers[3] == 4);
    CHECK(fabs(rows[3 * N + 3 * N * 4] - y[0]) < 1e-14);      /* row 3, column 3 */
    CHECK(dynstep_set_extrapolation(s, 0, 0, 0, NULL) == 0);

    /* records in small pieces; v_out is left alone; an observer */
    double t[4], q[4 * N], v[4 * N], a[4 * N], f[N];
    const double times[3] = {0.05, 0.1, 1.23};
    int code, count, points = 0;
    CHECK(dynstep_set_backinterpolation(s, 4, 4, 0.5, DYNSTEP_HALVES_TAYLOR) == 0);
    CHECK(dynstep_start_ode(s, N, 0.0, start) == 0 && dynstep_begin(s, 2.0, 0.1, 2, 0, NULL) == 0);
    for (int i = 0; i < 4 * N; i++) v[i] = 77.0;
    do {
        CHECK((code = dynstep_proceed(s, 3, 4, &count, t, q, v, a)) >= 0);
        for (int i = 0; i < count; i++) {
            chain(N, t[i], q + i * N, f, NULL);
            CHECK(fabs(t[i] - 0.2 * (points + i)) < 1e-15 && fabs(a[i * N] - f[0]) < 1e-14);
        }
        points += count;
    } while (code == DYNSTEP_MORE);
    CHECK(points == 11 && v[0] == 77.0 && v[4 * N - 1] == 77.0);
    CHECK(dynstep_start_ode(s, N, 0.0, start) == 0 && dynstep_begin(s, 2.0, 0.1, 1, 3, times) == 0);
    CHECK(dynstep_proceed(s, 100, 4, &count, t, q, NULL, a) == 0 && count == 3 && t[2] == times[2]);
    CHECK(dynstep_set_observer(s, ADDRESS(watch), ADDRESS(&seen)) == 0);
    CHECK(dynstep_start_ode(s, N, 0.0, start) == 0 && dynstep_run(s, 2.0, 0.1) == DYNSTEP_STOPPED);
    CHECK(dynstep_get_ode(s, N, t, NULL, NULL) == 0 && fabs(t[0] - 1.0) < 1e-15 && seen == 10);

    /* steps, and a right-hand side that gives up */
    CHECK(dynstep_set_rhs(s, ADDRESS(failing), ADDRESS(&refusal)) == 0 && dynstep_start_ode(s, N, 0.0, start) == 0);
    CHECK(dynstep_step(s, 0.5) == 0);
    REFUSES(dynstep_step(s, 0.5), DYNSTEP_CALLBACK_FAILED, "rhs");
    CHECK(dynstep_get_ode(s, N, t, NULL, NULL) == 0 && t[0] == 0.5);
    CHECK(dynstep_get_multipliers(s, 0, NULL, 0, NULL) == 0);
    CHECK(dynstep_delete(&s) == 0);
}

static void test_ranges(void)
{
    const int bad = DYNSTEP_INVALID_INPUT;
    intptr_t s = dynstep_new_ode(1);
    REFUSES(dynstep_set_pade(s, -1, 2, 0), bad, "p = -1");
    REFUSES(dynstep_set_pade(s, 2, 9, 0), bad, "q = 9");
    REFUSES(dynstep_set_pade(s, 0, 0, 0), bad, "must not both be 0");
    REFUSES(dynstep_set_pade(s, 4, 4, 4), bad, "form = 4");
    REFUSES(dynstep_set_pade(s, 4, 3, 1), bad, "p <= q");
    REFUSES(dynstep_set_backinterpolation(s, 0, 4, 0.5, 1), bad, "p = 0");
    REFUSES(dynstep_set_backinterpolation(s, 4, 6, 0.5, 1), bad, "q = 6");
    REFUSES(dynstep_set_backinterpolation(s, 4, 4, 1.5, 1), bad, "alpha = 1.5");
    REFUSES(dynstep_set_backinterpolation(s, 4, 4, NAN, 1), bad, "alpha = ");
    REFUSES(dynstep_set_backinterpolation(s, 4, 4, 0.5, 3), bad, "halves = 3");
    CHECK(dynstep_set_backinterpolation(s, 0, 4, 0.0, 1) == 0 && dynstep_set_backinterpolation(s, 4, 9, 1.0, 1) == 0);
    CHECK(dynstep_set_backinterpolation(s, 9, 9, 0.5, 2) == 0);
    REFUSES(dynstep_set_listing_estimate(s, 2), bad, "listing = 2");
    CHECK(dynstep_delete(&s) == 0);
}

/* Predators and prey from (10, 10) to t = 10 (Xie 1995, Fig. 3.33) by the thesis's settings, standard; PI, as listed and in
 * print; and the estimate that is the sum of both: steps and rejections of the same runs in Fortran, but for one at the edge */
static int lotka_volterra(int n, double t, const double *y, double *f, void *ctx)
{
    (void)n, (void)t, (void)ctx;
    f[0] = -y[0] + 0.1 * y[0] * y[1];
    f[1] = y[1] - y[0] * y[1];
    return 0;
}

static void test_control(void)
{
    const double y0[2] = {10.0, 10.0}, exact[2] = {0.0007104218221780829, 3.259057322389767};
    const int steps[4] = {34, 33, 57, 37}, rejections[4] = {1, 12, 1, 1};
    double y[2], t[200];
    long long counts[DYNSTEP_COUNTS];
    int count;
    intptr_t s = dynstep_new_ode(2);
    CHECK(dynstep_set_rhs(s, ADDRESS(lotka_volterra), 0) == 0);
    CHECK(dynstep_set_backinterpolation(s, 0, 0, 0.4, DYNSTEP_HALVES_FEHLBERG) == 0);
    for (int way = 0; way < 4; way++) {
        CHECK(dynstep_set_listing_estimate(s, way < 3) == 0 && dynstep_start_ode(s, 2, 0.0, y0) == 0);
        CHECK(dynstep_begin_controlled(s, 10.0, 1e-6, way == 0 || way == 3 ? DYNSTEP_STANDARD : DYNSTEP_PI,
                                       way == 1 ? DYNSTEP_SAFETY_INSIDE : DYNSTEP_SAFETY_IN_FRONT, 0.0, 0.0, 0, NULL) == 0);
        CHECK(dynstep_proceed(s, 1000, 200, &count, t, NULL, NULL, NULL) == 0 && t[count - 1] == 10.0);
        CHECK(dynstep_counts(s, counts) == 0 && counts[DYNSTEP_COUNT_STEPS] == count - 1);
        CHECK(dynstep_get_ode(s, 2, NULL, y, NULL) == 0 && fabs(y[0] - exact[0]) < 1e-5 && fabs(y[1] - exact[1]) < 1e-4);
        CHECK(abs(count - 1 - steps[way]) <= 1 && llabs(counts[DYNSTEP_COUNT_REJECTIONS] - rejections[way]) <= 1);
    }
    CHECK(dynstep_delete(&s) == 0);
}

/* A coupled band is the dense closed loop */
static void test_closed_loop(void)
{
    const double m[N] = {2.0, 1.0, 1.0}, k[3 * N] = {0.0, 3.0, -1.0, -1.0, 2.0, -1.0, -1.0, 2.0, 0.0};
    const double b[N] = {1.0, 0.0, 0.5}, gain[N] = {0.5, 0.25, 1.0}, rate[N] = {0.1, 0.0, 0.2}, zero[N] = {0.0};
    double dense[2][N * N], q[2][N], v[2][N], error = 0.0;
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            dense[0][i + j * N] = b[i] * gain[j] + (abs(i - j) < 2 ? k[1 + i - j + 3 * j] : 0.0);
            dense[1][i + j * N] = b[i] * rate[j];
        }
    for (int closed = 0; closed < 2; closed++) {
        intptr_t s = dynstep_new(N);
        CHECK(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_DIAGONAL, 0, 0, 1, m) == 0 && dynstep_set_pade(s, 4, 4, 0) == 0);
        if (closed) {
            CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DENSE, 0, 0, 0, dense[0]) == 0);
            CHECK(dynstep_set_matrix(s, DYNSTEP_DAMPING, DYNSTEP_DENSE, 0, 0, 0, dense[1]) == 0);
        } else {
            CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_BANDED, 1, 1, 1, k) == 0);
            CHECK(dynstep_set_coupling(s, b, gain, rate) == 0);
        }
        CHECK(dynstep_start(s, N, 0.0, start, zero) == 0 && dynstep_run(s, 5.0, 0.1) == 0);
        CHECK(dynstep_get(s, N, NULL, q[closed], v[closed], NULL) == 0 && dynstep_delete(&s) == 0);
    }
    for (int i = 0; i < N; i++) error = fmax(error, fmax(fabs(q[0][i] - q[1][i]), fabs(v[0][i] - v[1][i])));
    CHECK(error < 1e-13);
}

int main(void)
{
    test_runs();
    test_ranges();
    test_control();
    test_closed_loop();
    test_kinds_of_handles();
    test_settings();
    test_coupling();
    return finish();
}
