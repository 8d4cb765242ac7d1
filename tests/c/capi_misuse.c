/* SPDX-License-Identifier: BSD-3-Clause */
/* The C interface: each mistake gives its code and a message that names it, and changes nothing.
 *
 * capi_misuse          everything but the next
 * capi_misuse stale    handles that were deleted; it looks at freed memory on purpose, hence not under valgrind */
#ifdef TRAPS
#define _GNU_SOURCE
#include <fenv.h>
#endif
#include <limits.h>
#include "checks.h"

enum { N = 2 };
static const double q0[N] = {1.0, 0.0}, v0[N] = {0.0, 0.0};

/* What a user function is to do, and what it found */
struct orders {
    int refuse;              /* return this after `at` */
    double at;
    int gives;               /* put `give` into the result after `at` */
    double give;
    intptr_t call;           /* call this handle */
    int in_use;              /* how many of its functions said so */
};

static int in_use(intptr_t s)
{
    double x[4 * N];
    int i[16], n = 0;
    long long counts[DYNSTEP_COUNTS];
    char text[DYNSTEP_MESSAGE_LENGTH];
    intptr_t copy = s;
    n += dynstep_delete(&copy) == DYNSTEP_IN_USE && copy == s;
    n += dynstep_set_force(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_mass(s, 0, 0, 1, 0, 0, 1, 1) == DYNSTEP_IN_USE;
    n += dynstep_set_tangent(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_structure(s, 3, 0, 0, 0, 0, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_energy(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_constraint_jacobian(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_constraint_curvature(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_velocity_jacobian(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_velocity_curvature(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_reaction(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_reaction_jacobian(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_reaction_tangent(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_constraint(s, 0, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_velocity_constraint(s, 0, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_pattern(s, 1, 0, NULL, NULL) == DYNSTEP_IN_USE;
    n += dynstep_set_constraint_order(s, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_get_multipliers(s, 0, NULL, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_record_multipliers(s, 0, 0, NULL, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_residuals(s, N, 0.0, q0, v0, 0, NULL, NULL, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_set_matrix(s, 1, 1, 0, 0, 1, x) == DYNSTEP_IN_USE;
    n += dynstep_set_load(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_load_table(s, 0, 0, 0.0, 0.0, NULL, NULL, NULL, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_coupling(s, NULL, NULL, NULL) == DYNSTEP_IN_USE;
    n += dynstep_set_rhs(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_jacobian(s, 0, 0, 3, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_system_matrix(s, 1, 0, 0, x) == DYNSTEP_IN_USE;
    n += dynstep_set_source(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_start_ode(s, N, 0.0, q0) == DYNSTEP_IN_USE;
    n += dynstep_get_ode(s, N, x, NULL, NULL) == DYNSTEP_IN_USE;
    n += dynstep_set_newmark(s, 0.25, 0.5) == DYNSTEP_IN_USE;
    n += dynstep_set_midpoint(s) == DYNSTEP_IN_USE;
    n += dynstep_set_generalized_alpha(s, 0.5, 0.5, 0.25, 0.5) == DYNSTEP_IN_USE;
    n += dynstep_set_soi2(s, 0.5, 0.5, 0.25, 0.5, 1) == DYNSTEP_IN_USE;
    n += dynstep_set_pade(s, 4, 4, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_backinterpolation(s, 4, 4, 0.5, 1) == DYNSTEP_IN_USE;
    n += dynstep_set_listing_estimate(s, 0) == DYNSTEP_IN_USE;
    n += dynstep_set_alpha_options(s, 1, 1, 1, 1) == DYNSTEP_IN_USE;
    n += dynstep_set_start(s, 1) == DYNSTEP_IN_USE;
    n += dynstep_start_report(s, x) == DYNSTEP_IN_USE;
    n += dynstep_redundant_constraints(s, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_set_extrapolation(s, 0, 0, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_set_newton(s, 1, 1, 0.0) == DYNSTEP_IN_USE;
    n += dynstep_properties(s, 0, NULL, NULL, i, NULL) == DYNSTEP_IN_USE;
    n += dynstep_stability_limit(s, 0.0, x) == DYNSTEP_IN_USE;
    n += dynstep_check(s, N, 0.0, q0, v0, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_start(s, N, 0.0, q0, v0) == DYNSTEP_IN_USE;
    n += dynstep_step(s, 0.1) == DYNSTEP_IN_USE;
    n += dynstep_get(s, N, x, NULL, NULL, NULL) == DYNSTEP_IN_USE;
    n += dynstep_energy(s, x) == DYNSTEP_IN_USE;
    n += dynstep_counts(s, counts) == DYNSTEP_IN_USE;
    n += dynstep_tableau(s, 2 * N, 1, x, i) == DYNSTEP_IN_USE;
    n += dynstep_set_observer(s, 0, 0) == DYNSTEP_IN_USE;
    n += dynstep_run(s, 1.0, 0.1) == DYNSTEP_IN_USE;
    n += dynstep_begin(s, 1.0, 0.1, 1, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, 0.0, 0, NULL) == DYNSTEP_IN_USE;
    n += dynstep_proceed(s, 1, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_IN_USE;
    n += dynstep_message(s, sizeof text, text) == DYNSTEP_IN_USE && strstr(text, "in use");
    return n;
}
enum { FUNCTIONS_OF_A_HANDLE = 58 };

static int invalid(intptr_t s)
{
    double x[4 * N];
    int i[16], n = 0;
    long long counts[DYNSTEP_COUNTS];
    char text[DYNSTEP_MESSAGE_LENGTH];
    n += dynstep_delete(&s) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_force(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_mass(s, 0, 0, 1, 0, 0, 1, 1) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_tangent(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_structure(s, 3, 0, 0, 0, 0, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_energy(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_constraint_jacobian(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_constraint_curvature(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_velocity_jacobian(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_velocity_curvature(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_reaction(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_reaction_jacobian(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_reaction_tangent(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_constraint(s, 0, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_velocity_constraint(s, 0, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_pattern(s, 1, 0, NULL, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_constraint_order(s, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_get_multipliers(s, 0, NULL, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_record_multipliers(s, 0, 0, NULL, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_residuals(s, N, 0.0, q0, v0, 0, NULL, NULL, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_matrix(s, 1, 1, 0, 0, 1, x) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_load(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_load_table(s, 0, 0, 0.0, 0.0, NULL, NULL, NULL, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_coupling(s, NULL, NULL, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_rhs(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_jacobian(s, 0, 0, 3, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_system_matrix(s, 1, 0, 0, x) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_source(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_start_ode(s, N, 0.0, q0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_get_ode(s, N, x, NULL, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_newmark(s, 0.25, 0.5) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_midpoint(s) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_generalized_alpha(s, 0.5, 0.5, 0.25, 0.5) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_soi2(s, 0.5, 0.5, 0.25, 0.5, 1) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_pade(s, 4, 4, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_backinterpolation(s, 4, 4, 0.5, 1) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_listing_estimate(s, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_alpha_options(s, 1, 1, 1, 1) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_start(s, 1) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_start_report(s, x) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_redundant_constraints(s, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_extrapolation(s, 0, 0, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_newton(s, 1, 1, 0.0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_properties(s, 0, NULL, NULL, i, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_stability_limit(s, 0.0, x) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_check(s, N, 0.0, q0, v0, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_start(s, N, 0.0, q0, v0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_step(s, 0.1) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_get(s, N, x, NULL, NULL, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_energy(s, x) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_counts(s, counts) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_tableau(s, 2 * N, 1, x, i) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_set_observer(s, 0, 0) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_run(s, 1.0, 0.1) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_begin(s, 1.0, 0.1, 1, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, 0.0, 0, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_proceed(s, 1, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_INVALID_HANDLE;
    n += dynstep_message(s, sizeof text, text) == DYNSTEP_INVALID_HANDLE && strstr(text, "handle");
    return n;
}

static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    struct orders *o = ctx;
    for (int i = 0; i < n; i++) f[i] = -(i + 1) * q[i] - 0.1 * v[i];
    if (!o) return 0;
    if (o->call) o->in_use += in_use(o->call);
    if (t < o->at) return 0;
    if (o->gives) f[n - 1] = o->give;
    return o->refuse;
}

static int mass(int n, double t, const double *q, const double *v, double *m, void *ctx)
{
    struct orders *o = ctx;
    (void)q, (void)v;
    for (int i = 0; i < n; i++) m[i] = 1.0;
    if (o->gives && t >= o->at) m[0] = o->give;
    return t < o->at ? 0 : o->refuse;
}

static int tangent(int n, double t, const double *q, const double *v, const double *a, double *k, double *c, void *ctx)
{
    struct orders *o = ctx;
    (void)q, (void)v, (void)a;
    for (int i = 0; i < n; i++) k[i] = i + 1, c[i] = 0.1;
    return t < o->at ? 0 : o->refuse;
}

static int load(int n, double t, double *p, void *ctx)
{
    struct orders *o = ctx;
    for (int i = 0; i < n; i++) p[i] = 1.0;
    if (o->call) o->in_use += in_use(o->call);
    if (o->gives && t >= o->at) p[0] = o->give;
    return t < o->at ? 0 : o->refuse;
}

static int energy(int n, double t, const double *q, const double *v, double *e, void *ctx)
{
    struct orders *o = ctx;
    (void)n, (void)t, (void)v;
    *e = o->gives ? o->give : q[0];
    if (o->call) o->in_use += in_use(o->call);
    return o->refuse;
}

static int observer(int n, double t, const double *q, const double *v, const double *a, void *ctx)
{
    struct orders *o = ctx;
    (void)n, (void)t, (void)q, (void)v, (void)a;
    if (o->call) o->in_use += in_use(o->call);
    return 0;
}

static void test_wild_handles(void)
{
    intptr_t s = dynstep_new(N), none = 0;
    const intptr_t wild[] = {0, 1, -1, 8, 4096, 12345, 0x7fffffff, -0x7fffffff - 1, s + 1, s + 8,
                             (int32_t)s, (uint32_t)s, INTPTR_MAX, INTPTR_MIN, s & 0xffffffffffff,
                             s ^ ((intptr_t)1 << 50), ~s};
    CHECK(dynstep_new(0) == 0);
    CHECK(dynstep_new(-3) == 0);
    CHECK(dynstep_new(INT_MAX) == 0);
    CHECK(dynstep_delete(&none) == 0);
    CHECK(dynstep_delete(NULL) == DYNSTEP_INVALID_INPUT);
    for (size_t i = 0; i < sizeof wild / sizeof *wild; i++) {
        /* deleting 0 is no mistake */
        CHECK(invalid(wild[i]) + (wild[i] == 0) == FUNCTIONS_OF_A_HANDLE);
    }
    CHECK(dynstep_set_midpoint(s) == 0);
    CHECK(dynstep_delete(&s) == 0 && s == 0);
    CHECK(invalid(s) == FUNCTIONS_OF_A_HANDLE - 1);
}

/* Deleted handles, while others come and go in the same memory */
static void test_stale_handles(void)
{
    intptr_t s = dynstep_new(N), stale = s, others[64];
    CHECK(invalid(s + 16) == FUNCTIONS_OF_A_HANDLE);
    CHECK(invalid(s - 16) == FUNCTIONS_OF_A_HANDLE);
    CHECK(dynstep_delete(&s) == 0);
    CHECK(invalid(stale) == FUNCTIONS_OF_A_HANDLE);
    for (int i = 0; i < 64; i++) others[i] = dynstep_new(1 + i);
    CHECK(invalid(stale) == FUNCTIONS_OF_A_HANDLE);
    for (int i = 0; i < 64; i++) {
        stale = others[i];
        CHECK(dynstep_delete(&others[i]) == 0);
        CHECK(invalid(stale) == FUNCTIONS_OF_A_HANDLE);
        s = dynstep_new(2);
        CHECK(invalid(stale) == FUNCTIONS_OF_A_HANDLE);
        CHECK(dynstep_delete(&s) == 0);
    }
}

static void test_systems(void)
{
    intptr_t s = dynstep_new(N);
    const double one[N * N] = {1.0, 0.0, 0.0, 1.0}, skew[N * N] = {1.0, 0.5, 0.25, 1.0};
    double bad[N] = {1.0, NAN}, samples[4] = {0.0, 1.0, 2.0, 3.0}, times[2] = {1.0, 1.0};
    struct orders o = {0};

    REFUSES(dynstep_start(s, N, 0.0, q0, v0), DYNSTEP_INVALID_INPUT, "force");
    REFUSES(dynstep_set_mass(s, ADDRESS(mass), 0, DYNSTEP_IDENTITY, 0, 0, 1, 1), DYNSTEP_INVALID_INPUT, "kind = 0");
    REFUSES(dynstep_set_mass(s, ADDRESS(mass), 0, 17, 0, 0, 1, 1), DYNSTEP_INVALID_INPUT, "kind = 17");
    REFUSES(dynstep_set_mass(s, ADDRESS(mass), 0, DYNSTEP_BANDED, 0, N, 0, 1), DYNSTEP_INVALID_INPUT, "ku = 2");
    REFUSES(dynstep_set_mass(s, ADDRESS(mass), 0, DYNSTEP_BANDED, -1, 0, 0, 1), DYNSTEP_INVALID_INPUT, "kl = -1");
    REFUSES(dynstep_set_mass(s, ADDRESS(mass), 0, DYNSTEP_BANDED, 0, 1, 1, 1), DYNSTEP_INVALID_INPUT, "symmetric");
    REFUSES(dynstep_set_structure(s, -1, 0, 0, 0, 0, 0, 0), DYNSTEP_INVALID_INPUT, "kind = -1");
    REFUSES(dynstep_set_structure(s, DYNSTEP_BANDED, 2, 0, 0, 0, 0, 0), DYNSTEP_INVALID_INPUT, "kl = 2");
    REFUSES(dynstep_set_matrix(s, 0, DYNSTEP_DENSE, 0, 0, 1, one), DYNSTEP_INVALID_INPUT, "which = 0");
    REFUSES(dynstep_set_matrix(s, 4, DYNSTEP_DENSE, 0, 0, 1, one), DYNSTEP_INVALID_INPUT, "which = 4");
    REFUSES(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_ZERO, 0, 0, 1, NULL), DYNSTEP_INVALID_INPUT, "mass");
    REFUSES(dynstep_set_matrix(s, DYNSTEP_MASS, 4, 0, 0, 1, one), DYNSTEP_INVALID_INPUT, "kind = 4");
    REFUSES(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DENSE, 0, 0, 1, NULL), DYNSTEP_INVALID_INPUT, "a is NULL");
    REFUSES(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DENSE, 0, 0, 1, skew), DYNSTEP_INVALID_INPUT, "K(2,1)");
    REFUSES(dynstep_set_matrix(s, DYNSTEP_DAMPING, DYNSTEP_DIAGONAL, 0, 0, 1, bad), DYNSTEP_INVALID_INPUT, "C(2,2)");
    REFUSES(dynstep_start(s, N, 0.0, q0, v0), DYNSTEP_INVALID_INPUT, "force");

    REFUSES(dynstep_set_load_table(s, 0, 2, 0.0, 1.0, NULL, samples, NULL, 0), DYNSTEP_INVALID_INPUT, "signals = 0");
    REFUSES(dynstep_set_load_table(s, N, 1, 0.0, 1.0, NULL, samples, NULL, 0), DYNSTEP_INVALID_INPUT, "ns = 1");
    REFUSES(dynstep_set_load_table(s, N, -2, 0.0, 1.0, NULL, samples, NULL, 0), DYNSTEP_INVALID_INPUT, "ns = -2");
    REFUSES(dynstep_set_load_table(s, N, 2, 0.0, 1.0, NULL, NULL, NULL, 0), DYNSTEP_INVALID_INPUT, "samples is NULL");
    REFUSES(dynstep_set_load_table(s, N, 2, 0.0, 0.0, NULL, samples, NULL, 0), DYNSTEP_INVALID_INPUT, "dt");
    REFUSES(dynstep_set_load_table(s, N, 2, NAN, 1.0, NULL, samples, NULL, 0), DYNSTEP_INVALID_INPUT, "t0");
    REFUSES(dynstep_set_load_table(s, N, 2, 0.0, 1.0, times, samples, NULL, 0), DYNSTEP_INVALID_INPUT, "increase");
    REFUSES(dynstep_set_load_table(s, N, 2, 0.0, 1.0, NULL, samples, NULL, 5), DYNSTEP_INVALID_INPUT, "5");
    REFUSES(dynstep_set_load_table(s, 1, 4, 0.0, 1.0, NULL, samples, NULL, 0), DYNSTEP_INVALID_INPUT, "pattern");
    REFUSES(dynstep_set_load_table(s, 1000000, 1000, 0.0, 1.0, NULL, samples, NULL, 0), DYNSTEP_INVALID_INPUT,
            "signals = 1000000");
    REFUSES(dynstep_set_load_table(s, 1, 4, 0.0, 1.0, NULL, samples, bad, 0), DYNSTEP_INVALID_INPUT, "pattern");
    samples[2] = INFINITY;
    REFUSES(dynstep_set_load_table(s, N, 2, 0.0, 1.0, NULL, samples, NULL, 0), DYNSTEP_INVALID_INPUT, "sample 2");

    /* things that do not go together */
    CHECK(dynstep_set_energy(s, ADDRESS(energy), ADDRESS(&o)) == 0);
    REFUSES(dynstep_start(s, N, 0.0, q0, v0), DYNSTEP_INVALID_INPUT, "set a force");
    CHECK(dynstep_set_energy(s, 0, 0) == 0);
    CHECK(dynstep_set_force(s, ADDRESS(force), 0) == 0);
    CHECK(dynstep_set_load(s, ADDRESS(load), ADDRESS(&o)) == 0);
    REFUSES(dynstep_start(s, N, 0.0, q0, v0), DYNSTEP_INVALID_INPUT, "load");
    CHECK(dynstep_set_load(s, 0, 0) == 0);
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DENSE, 0, 0, 1, one) == 0);
    REFUSES(dynstep_start(s, N, 0.0, q0, v0), DYNSTEP_INVALID_INPUT, "not both");
    CHECK(dynstep_set_force(s, 0, 0) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_delete(&s) == 0);
}

static void test_methods(void)
{
    intptr_t s = dynstep_new(N);
    const int falling[3] = {1, 3, 2}, zero[2] = {0, 1};
    double table[2 * N * 4];
    int numbers[2];

    CHECK(dynstep_set_force(s, ADDRESS(force), 0) == 0);
    REFUSES(dynstep_set_newmark(s, -0.25, 0.5), DYNSTEP_INVALID_INPUT, "beta");
    REFUSES(dynstep_set_newmark(s, NAN, 0.5), DYNSTEP_INVALID_INPUT, "beta");
    REFUSES(dynstep_set_newmark(s, 0.25, INFINITY), DYNSTEP_INVALID_INPUT, "gamma");
    REFUSES(dynstep_set_extrapolation(s, -1, DYNSTEP_HARMONIC, 0, NULL), DYNSTEP_INVALID_INPUT, "levels = -1");
    REFUSES(dynstep_set_extrapolation(s, 13, DYNSTEP_HARMONIC, 0, NULL), DYNSTEP_INVALID_INPUT, "levels = 13");
    REFUSES(dynstep_set_extrapolation(s, 2, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "sequence = 0");
    REFUSES(dynstep_set_extrapolation(s, 2, 7, 0, NULL), DYNSTEP_INVALID_INPUT, "sequence = 7");
    REFUSES(dynstep_set_extrapolation(s, 2, DYNSTEP_CUSTOM, 2, NULL), DYNSTEP_INVALID_INPUT, "custom");
    REFUSES(dynstep_set_extrapolation(s, 2, DYNSTEP_CUSTOM, 1, falling), DYNSTEP_INVALID_INPUT, "ncustom = 1");
    REFUSES(dynstep_set_extrapolation(s, 2, DYNSTEP_CUSTOM, -1, falling), DYNSTEP_INVALID_INPUT, "ncustom = -1");
    REFUSES(dynstep_set_extrapolation(s, INT_MAX, DYNSTEP_CUSTOM, INT_MAX, falling), DYNSTEP_INVALID_INPUT, "levels");
    /* numbers that are not used are not read */
    CHECK(dynstep_set_extrapolation(s, 2, DYNSTEP_CUSTOM, INT_MAX, falling) == 0);
    CHECK(dynstep_set_extrapolation(s, 0, 0, 0, NULL) == 0);
    REFUSES(dynstep_set_extrapolation(s, 3, DYNSTEP_CUSTOM, 3, falling), DYNSTEP_INVALID_INPUT, "increase");
    REFUSES(dynstep_set_extrapolation(s, 2, DYNSTEP_CUSTOM, 2, zero), DYNSTEP_INVALID_INPUT, "custom");
    REFUSES(dynstep_set_newton(s, 0, 1, 0.0), DYNSTEP_INVALID_INPUT, "limit");
    REFUSES(dynstep_set_newton(s, 1, -1, 0.0), DYNSTEP_INVALID_INPUT, "halvings");
    REFUSES(dynstep_set_newton(s, 1, 1, NAN), DYNSTEP_INVALID_INPUT, "tolerance");
    REFUSES(dynstep_tableau(s, 2 * N, 2, table, numbers), DYNSTEP_INVALID_INPUT, "extrapolation");
    CHECK(dynstep_set_extrapolation(s, 2, DYNSTEP_HARMONIC, 0, NULL) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_tableau(s, 2 * N, 2, table, numbers), DYNSTEP_INVALID_INPUT, "before the first step");
    CHECK(dynstep_step(s, 0.1) == 0);
    REFUSES(dynstep_tableau(s, N, 2, table, numbers), DYNSTEP_INVALID_INPUT, "size");
    REFUSES(dynstep_tableau(s, 2 * N, 3, table, numbers), DYNSTEP_INVALID_INPUT, "levels");
    REFUSES(dynstep_tableau(s, 2 * N, 2, NULL, numbers), DYNSTEP_INVALID_INPUT, "NULL");
    CHECK(dynstep_tableau(s, 2 * N, 2, table, numbers) == 0);
    CHECK(dynstep_set_newmark(s, 0.3, 0.6) == 0);
    REFUSES(dynstep_start(s, N, 0.0, q0, v0), DYNSTEP_INVALID_INPUT, "gamma = 1/2");
    REFUSES(dynstep_step(s, 0.1), DYNSTEP_INVALID_INPUT, "dynstep_start");
    CHECK(dynstep_delete(&s) == 0);
}

static void test_runs(void)
{
    intptr_t s = dynstep_new(N);
    const double falling[2] = {0.75, 0.5}, outside[1] = {2.0}, odd[1] = {NAN};
    double bad[N] = {0.0, NAN}, e, t[4];
    int count;

    CHECK(dynstep_set_force(s, ADDRESS(force), 0) == 0);
    REFUSES(dynstep_step(s, 0.1), DYNSTEP_INVALID_INPUT, "dynstep_start");
    REFUSES(dynstep_run(s, 1.0, 0.1), DYNSTEP_INVALID_INPUT, "dynstep_start");
    REFUSES(dynstep_get(s, N, &e, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "dynstep_start");
    REFUSES(dynstep_energy(s, &e), DYNSTEP_INVALID_INPUT, "dynstep_start");
    REFUSES(dynstep_start(s, N + 1, 0.0, q0, v0), DYNSTEP_INVALID_INPUT, "n = 3");
    REFUSES(dynstep_start(s, N, 0.0, NULL, v0), DYNSTEP_INVALID_INPUT, "q is NULL");
    REFUSES(dynstep_start(s, N, 0.0, q0, NULL), DYNSTEP_INVALID_INPUT, "v is NULL");
    REFUSES(dynstep_start(s, N, 0.0, q0, bad), DYNSTEP_INVALID_INPUT, "component 2 of v");
    REFUSES(dynstep_start(s, N, 0.0, bad, v0), DYNSTEP_INVALID_INPUT, "component 2 of q");
    REFUSES(dynstep_start(s, N, INFINITY, q0, v0), DYNSTEP_INVALID_INPUT, "t = ");
    REFUSES(dynstep_check(s, 1, 0.0, q0, v0, 0, NULL), DYNSTEP_INVALID_INPUT, "n = 1");
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_get(s, 1, &e, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "n = 1");
    REFUSES(dynstep_energy(s, &e), DYNSTEP_INVALID_INPUT, "no energy");
    REFUSES(dynstep_energy(s, NULL), DYNSTEP_INVALID_INPUT, "NULL");
    REFUSES(dynstep_counts(s, NULL), DYNSTEP_INVALID_INPUT, "NULL");
    REFUSES(dynstep_step(s, 0.0), DYNSTEP_INVALID_INPUT, "h = 0");
    REFUSES(dynstep_step(s, NAN), DYNSTEP_INVALID_INPUT, "h = ");
    REFUSES(dynstep_run(s, 1.0, -0.1), DYNSTEP_INVALID_INPUT, "h = -0.1");
    REFUSES(dynstep_run(s, 1.0, 0.0), DYNSTEP_INVALID_INPUT, "h ");
    REFUSES(dynstep_run(s, NAN, 0.1), DYNSTEP_INVALID_INPUT, "t_end");
    REFUSES(dynstep_run(s, 1.0, 1e-300), DYNSTEP_INVALID_INPUT, "h = ");
    REFUSES(dynstep_proceed(s, 1, 0, NULL, NULL, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "dynstep_begin");
    REFUSES(dynstep_begin(s, 1.0, 0.1, -1, 0, NULL), DYNSTEP_INVALID_INPUT, "every");
    REFUSES(dynstep_begin(s, 1.0, 0.1, 1, -1, NULL), DYNSTEP_INVALID_INPUT, "n_eval");
    REFUSES(dynstep_begin(s, 1.0, 0.1, 1, 2, NULL), DYNSTEP_INVALID_INPUT, "t_eval is NULL");
    REFUSES(dynstep_begin(s, 1.0, 0.1, 1, 2, falling), DYNSTEP_INVALID_INPUT, "t_eval(2)");
    REFUSES(dynstep_begin(s, 1.0, 0.1, 1, 1, outside), DYNSTEP_INVALID_INPUT, "t_eval(1)");
    REFUSES(dynstep_begin(s, 1.0, 0.1, 1, 1, odd), DYNSTEP_INVALID_INPUT, "t_eval(1)");
    CHECK(dynstep_begin(s, 1.0, 0.1, 1, 0, NULL) == 0);
    REFUSES(dynstep_proceed(s, 0, 4, &count, t, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "max_steps");
    REFUSES(dynstep_proceed(s, 1, -1, &count, t, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "capacity");
    REFUSES(dynstep_proceed(s, 1, 4, NULL, t, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "count");
    REFUSES(dynstep_proceed(s, 1, 4, &count, t, NULL, NULL, NULL), DYNSTEP_MORE, "call again");
    REFUSES(dynstep_proceed(s, 9, 1, &count, t, NULL, NULL, NULL), DYNSTEP_MORE, "room for 1");
    REFUSES(dynstep_proceed(s, 1, 0, NULL, NULL, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "capacity");
    CHECK(dynstep_step(s, 0.1) == 0);
    REFUSES(dynstep_proceed(s, 1, 4, &count, t, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "dynstep_begin");
    CHECK(dynstep_begin(s, 1.0, 0.1, 1, 0, NULL) == 0);
    CHECK(dynstep_set_newmark(s, 0.25, 0.5) == 0);
    REFUSES(dynstep_proceed(s, 1, 4, &count, t, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "dynstep_begin");
    REFUSES(dynstep_begin(s, 1.0, 0.1, 1, 0, NULL), DYNSTEP_INVALID_INPUT, "dynstep_start");
    CHECK(dynstep_delete(&s) == 0);
}

/* User functions that refuse or return NaN: code, time and sentence, and the state of the last good step */
static void test_user_functions(void)
{
    struct orders o = {.refuse = 3, .at = 0.45}, none = {0};
    const double one[N] = {1.0, 1.0};
    double t, e;
    intptr_t s = dynstep_new(N);

    CHECK(dynstep_set_force(s, ADDRESS(force), ADDRESS(&o)) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.125), DYNSTEP_CALLBACK_FAILED, "force refused");
    CHECK(dynstep_get(s, N, &t, NULL, NULL, NULL) == 0 && t == 0.375);
    o.refuse = -4;
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.125), DYNSTEP_CALLBACK_FAILED, "ierr = -4");
    REFUSES(dynstep_start(s, N, 0.5, q0, v0), DYNSTEP_CALLBACK_FAILED, "t = 0.5");
    REFUSES(dynstep_step(s, 0.125), DYNSTEP_INVALID_INPUT, "dynstep_start");
    o.refuse = 0;
    o.gives = 1;
    o.give = NAN;
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.125), DYNSTEP_NOT_FINITE, "component 2");
    CHECK(dynstep_get(s, N, &t, NULL, NULL, NULL) == 0 && t == 0.375);
    o.give = -INFINITY;
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.125), DYNSTEP_NOT_FINITE, "t = 0.5");
    CHECK(dynstep_set_force(s, ADDRESS(force), 0) == 0);

    CHECK(dynstep_set_energy(s, ADDRESS(energy), ADDRESS(&o)) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_energy(s, &e), DYNSTEP_NOT_FINITE, "energy");
    o = (struct orders){.refuse = 2};
    REFUSES(dynstep_energy(s, &e), DYNSTEP_CALLBACK_FAILED, "energy");

    o = (struct orders){.refuse = -1, .at = 0.45};
    CHECK(dynstep_set_mass(s, ADDRESS(mass), ADDRESS(&o), DYNSTEP_DIAGONAL, 0, 0, 1, 0) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.125), DYNSTEP_CALLBACK_FAILED, "mass gave up");
    o = (struct orders){.gives = 1, .give = 0.0};
    REFUSES(dynstep_start(s, N, 0.0, q0, v0), DYNSTEP_SINGULAR_MATRIX, "singular");
    o = (struct orders){.gives = 1, .give = NAN};
    REFUSES(dynstep_start(s, N, 0.0, q0, v0), DYNSTEP_NOT_FINITE, "mass");

    o = (struct orders){.refuse = -1, .at = 0.2};
    CHECK(dynstep_set_mass(s, ADDRESS(mass), ADDRESS(&none), DYNSTEP_DIAGONAL, 0, 0, 1, 1) == 0);
    CHECK(dynstep_set_tangent(s, ADDRESS(tangent), ADDRESS(&o)) == 0);
    CHECK(dynstep_set_structure(s, DYNSTEP_DIAGONAL, 0, 0, 1, 0, 0, 0) == 0);
    CHECK(dynstep_start(s, N, 0.25, q0, v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.125), DYNSTEP_CALLBACK_FAILED, "tangent");
    CHECK(dynstep_delete(&s) == 0);

    s = dynstep_new(N);
    o = (struct orders){.refuse = -9, .at = 0.45};
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DIAGONAL, 0, 0, 1, one) == 0);
    CHECK(dynstep_set_load(s, ADDRESS(load), ADDRESS(&o)) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.125), DYNSTEP_CALLBACK_FAILED, "t = 0.5");
    o = (struct orders){.gives = 1, .give = NAN, .at = 0.45};
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.125), DYNSTEP_NOT_FINITE, "t = 0.5");
    CHECK(dynstep_delete(&s) == 0);
}

/* A handle that is called from its own functions; other handles may be */
static int nested_force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    double inner;
    intptr_t s = dynstep_new(n);
    int failed = dynstep_set_force(s, ADDRESS(force), 0);
    failed = failed || dynstep_start(s, n, t, q, v);
    failed = failed || dynstep_step(s, 0.01);
    failed = failed || dynstep_get(s, n, &inner, NULL, NULL, f);
    ++*(int *)ctx;
    dynstep_delete(&s);
    return failed ? -1 : force(n, t, q, v, f, NULL);
}

static void test_own_functions(void)
{
    struct orders o = {0};
    const double one[N] = {1.0, 1.0};
    double e;
    int calls = 0;
    intptr_t s = dynstep_new(N);
    o.call = s;
    CHECK(dynstep_set_force(s, ADDRESS(force), ADDRESS(&o)) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(o.in_use == FUNCTIONS_OF_A_HANDLE);
    CHECK(dynstep_set_extrapolation(s, 2, DYNSTEP_HARMONIC, 0, NULL) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    o.in_use = 0;
    CHECK(dynstep_step(s, 0.1) == 0);
    CHECK(o.in_use >= 4 * FUNCTIONS_OF_A_HANDLE && o.in_use % FUNCTIONS_OF_A_HANDLE == 0);
    CHECK(dynstep_set_force(s, ADDRESS(force), 0) == 0);
    CHECK(dynstep_set_energy(s, ADDRESS(energy), ADDRESS(&o)) == 0);
    CHECK(dynstep_set_observer(s, ADDRESS(observer), ADDRESS(&o)) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    o.in_use = 0;
    CHECK(dynstep_run(s, 0.5, 0.1) == 0);
    CHECK(o.in_use == 5 * FUNCTIONS_OF_A_HANDLE);
    CHECK(dynstep_energy(s, &e) == 0);
    CHECK(o.in_use == 6 * FUNCTIONS_OF_A_HANDLE);
    CHECK(dynstep_delete(&s) == 0);

    s = dynstep_new(N);
    o.call = s;
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DIAGONAL, 0, 0, 1, one) == 0);
    CHECK(dynstep_set_load(s, ADDRESS(load), ADDRESS(&o)) == 0);
    o.in_use = 0;
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_step(s, 0.1) == 0);
    CHECK(o.in_use >= 2 * FUNCTIONS_OF_A_HANDLE && o.in_use % FUNCTIONS_OF_A_HANDLE == 0);
    CHECK(dynstep_delete(&s) == 0);

    s = dynstep_new(N);
    CHECK(dynstep_set_force(s, ADDRESS(nested_force), ADDRESS(&calls)) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_run(s, 0.5, 0.1) == 0);
    CHECK(calls > 5);
    CHECK(dynstep_delete(&s) == 0);
}

int main(int argc, char **argv)
{
#ifdef TRAPS
    /* a NaN that comes in must be told by a code, also where arithmetic with one ends the program */
    feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
#endif
    if (argc > 1 && strcmp(argv[1], "stale") == 0) {
        test_stale_handles();
        return finish();
    }
    test_wild_handles();
    test_systems();
    test_methods();
    test_runs();
    test_user_functions();
    test_own_functions();
    return finish();
}
