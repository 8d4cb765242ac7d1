/* SPDX-License-Identifier: BSD-3-Clause */
/* The C interface to first-order systems: settings, refusals, and functions that belong to the other kind. */
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

int main(void)
{
    test_kinds_of_handles();
    test_settings();
    test_coupling();
    return finish();
}
