/* SPDX-License-Identifier: BSD-3-Clause */
/* The C interface: every way to describe a system, and every method, give the same motion. */
#include "checks.h"

/* Three masses in a row between walls: M = diag(2, 1, 1), C = 0.1 K', K = tridiagonal */
enum { N = 3 };
static const double mass[N] = {2.0, 1.0, 1.0};
static const double stiffness_band[3 * N] = {0.0, 3.0, -1.0, -1.0, 2.0, -1.0, -1.0, 2.0, 0.0};
static const double damping_band[3 * N] = {0.0, 0.3, -0.1, -0.1, 0.2, -0.1, -0.1, 0.2, 0.0};
static const double q0[N] = {1.0, 0.0, -0.5}, v0[N] = {0.0, 0.25, 0.0};
static const double t_end = 2.0, h = 0.0625;

static void residual(double t, const double *q, const double *v, double *f)
{
    for (int i = 0; i < N; i++) f[i] = t * (i + 1);
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++)
            if (i - j >= -1 && i - j <= 1)
                f[i] -= damping_band[1 + i - j + 3 * j] * v[j] + stiffness_band[1 + i - j + 3 * j] * q[j];
}

static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    if (ctx) ++*(int *)ctx;
    residual(t, q, v, f);
    return n == N ? 0 : -1;
}

static int undamped_force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    double none[N] = {0.0, 0.0, 0.0};
    (void)v;
    return force(n, t, q, none, f, ctx);
}

static int mass_diagonal(int n, double t, const double *q, const double *v, double *m, void *ctx)
{
    (void)t, (void)q, (void)v, (void)ctx;
    for (int i = 0; i < n; i++) m[i] = mass[i];
    return 0;
}

static int mass_banded(int n, double t, const double *q, const double *v, double *m, void *ctx)
{
    (void)t, (void)q, (void)v, (void)ctx;
    for (int i = 0; i < n; i++) m[1 + 3 * i] = mass[i];
    return 0;
}

static int mass_dense(int n, double t, const double *q, const double *v, double *m, void *ctx)
{
    (void)t, (void)q, (void)v, (void)ctx;
    for (int i = 0; i < n; i++) m[i + n * i] = mass[i];
    return 0;
}

static int tangent_banded(int n, double t, const double *q, const double *v, const double *a, double *k, double *c,
                          void *ctx)
{
    (void)t, (void)q, (void)v, (void)a;
    memcpy(k, stiffness_band, 3 * n * sizeof *k);
    if (c) memcpy(c, damping_band, 3 * n * sizeof *c);
    if (ctx) *(int *)ctx = c ? 1 : 2;
    return 0;
}

static int load(int n, double t, double *p, void *ctx)
{
    (void)ctx;
    for (int i = 0; i < n; i++) p[i] = t * (i + 1);
    return 0;
}

static int energy(int n, double t, const double *q, const double *v, double *e, void *ctx)
{
    (void)t, (void)q;
    *e = *(double *)ctx;
    for (int i = 0; i < n; i++) *e += 0.5 * mass[i] * v[i] * v[i];
    return 0;
}

/* Run a handle and compare its end with `expected` */
static double run(intptr_t s, const double *expected, double *q)
{
    double t = 0.0, v[N], a[N], error = 0.0;
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_run(s, t_end, h) == 0);
    CHECK(dynstep_get(s, N, &t, q, v, a) == 0);
    CHECK(t == t_end);
    for (int i = 0; i < N; i++) error = fmax(error, fabs(q[i] - expected[i]));
    return error;
}

static void set_linear(intptr_t s)
{
    CHECK(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_DIAGONAL, 0, 0, 1, mass) == 0);
    CHECK(dynstep_set_matrix(s, DYNSTEP_DAMPING, DYNSTEP_BANDED, 1, 1, 1, damping_band) == 0);
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_BANDED, 1, 1, 1, stiffness_band) == 0);
    CHECK(dynstep_set_load(s, ADDRESS(load), 0) == 0);
}

static void test_systems(double *reference)
{
    const double zero[N] = {0.0, 0.0, 0.0};
    double q[N], dense[N * N] = {3.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 2.0}, e, base = 0.5;
    intptr_t s = dynstep_new(N);
    int calls = 0, seen = 0;

    CHECK(s != 0);
    set_linear(s);
    run(s, zero, reference);

    /* the same load as a table, with a pattern and with as many signals as coordinates */
    double samples[2 * N] = {0.0, 0.0, 0.0, 4.0, 8.0, 12.0}, pattern[N] = {1.0, 2.0, 3.0};
    double signal[3] = {0.0, 1.0, 4.0}, times[3] = {0.0, 1.0, 4.0};
    CHECK(dynstep_set_load_table(s, N, 2, 0.0, 4.0, NULL, samples, NULL, DYNSTEP_OUTSIDE_HOLD) == 0);
    CHECK(run(s, reference, q) < 1e-14);
    CHECK(dynstep_set_load_table(s, 1, 3, 0.0, 0.0, times, signal, pattern, DYNSTEP_OUTSIDE_ZERO) == 0);
    CHECK(run(s, reference, q) < 1e-14);
    CHECK(dynstep_set_load_table(s, 0, 0, 0.0, 0.0, NULL, NULL, NULL, 0) == 0);
    CHECK(run(s, reference, q) > 1e-3);
    CHECK(dynstep_set_load(s, ADDRESS(load), 0) == 0);
    CHECK(run(s, reference, q) == 0.0);

    /* a dense matrix is the banded one */
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DENSE, 0, 0, 1, dense) == 0);
    CHECK(run(s, reference, q) < 1e-14);
    CHECK(dynstep_energy(s, &e) == 0 && e > 0.0);
    CHECK(dynstep_delete(&s) == 0 && s == 0);

    /* general systems: masses of all kinds, tangents by differences and by a function */
    s = dynstep_new(N);
    CHECK(dynstep_set_force(s, ADDRESS(force), ADDRESS(&calls)) == 0);
    CHECK(dynstep_set_mass(s, ADDRESS(mass_diagonal), 0, DYNSTEP_DIAGONAL, 0, 0, 1, 1) == 0);
    CHECK(run(s, reference, q) < 1e-12);
    CHECK(calls > 0);
    CHECK(dynstep_set_mass(s, ADDRESS(mass_banded), 0, DYNSTEP_BANDED, 1, 1, 0, 0) == 0);
    CHECK(run(s, reference, q) < 1e-12);
    CHECK(dynstep_set_mass(s, ADDRESS(mass_dense), 0, DYNSTEP_DENSE, 0, 0, 1, 1) == 0);
    CHECK(run(s, reference, q) < 1e-12);
    CHECK(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_DIAGONAL, 0, 0, 1, mass) == 0);
    CHECK(run(s, reference, q) < 1e-12);
    CHECK(dynstep_set_structure(s, DYNSTEP_BANDED, 1, 1, 1, 0, 0, 0) == 0);
    CHECK(run(s, reference, q) < 1e-12);
    CHECK(dynstep_set_tangent(s, ADDRESS(tangent_banded), ADDRESS(&seen)) == 0);
    CHECK(dynstep_set_structure(s, DYNSTEP_BANDED, 1, 1, 1, 1, 1, 0) == 0);
    CHECK(run(s, reference, q) < 1e-12);
    CHECK(seen == 1);
    CHECK(dynstep_set_energy(s, ADDRESS(energy), ADDRESS(&base)) == 0);
    run(s, reference, q);
    CHECK(dynstep_energy(s, &e) == 0 && e > 0.5);
    CHECK(dynstep_set_energy(s, 0, 0) == 0);

    /* without velocities: C is NULL */
    CHECK(dynstep_set_force(s, ADDRESS(undamped_force), 0) == 0);
    CHECK(dynstep_set_structure(s, DYNSTEP_BANDED, 1, 1, 1, 1, 1, 1) == 0);
    double undamped[N];
    run(s, zero, undamped);
    CHECK(seen == 2);
    CHECK(dynstep_set_tangent(s, 0, 0) == 0);
    CHECK(run(s, undamped, q) < 1e-12);
    CHECK(dynstep_delete(&s) == 0);

    /* and the identity, back from a mass that is not */
    s = dynstep_new(N);
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_BANDED, 1, 1, 1, stiffness_band) == 0);
    CHECK(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_IDENTITY, 0, 0, 1, NULL) == 0);
    CHECK(dynstep_set_matrix(s, DYNSTEP_DAMPING, DYNSTEP_ZERO, 0, 0, 1, NULL) == 0);
    CHECK(dynstep_set_load(s, ADDRESS(load), 0) == 0);
    run(s, zero, undamped);
    CHECK(dynstep_delete(&s) == 0);
    s = dynstep_new(N);
    CHECK(dynstep_set_force(s, ADDRESS(undamped_force), 0) == 0);
    CHECK(dynstep_set_mass(s, ADDRESS(mass_dense), 0, DYNSTEP_DENSE, 0, 0, 1, 1) == 0);
    CHECK(dynstep_set_mass(s, 0, 0, 0, 0, 0, 0, 0) == 0);
    CHECK(run(s, undamped, q) < 1e-12);
    CHECK(dynstep_delete(&s) == 0);
}

/* Error of q at t = 1 for q'' = -q, q = cos t */
static double error_of(intptr_t s, double step)
{
    double one = 1.0, zero = 0.0, q;
    CHECK(dynstep_start(s, 1, 0.0, &one, &zero) == 0);
    CHECK(dynstep_run(s, 1.0, step) == 0);
    CHECK(dynstep_get(s, 1, NULL, &q, NULL, NULL) == 0);
    return fabs(q - cos(1.0));
}

static void test_methods(void)
{
    const int custom[3] = {1, 3, 5};
    double one = 1.0, limit;
    char name[33], source[65];
    int facts[DYNSTEP_FACTS];
    intptr_t s = dynstep_new(1);

    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DIAGONAL, 0, 0, 1, &one) == 0);
    CHECK(dynstep_properties(s, sizeof name, name, NULL, facts, &limit) == 0);
    CHECK(strcmp(name, "newmark") == 0 && facts[DYNSTEP_FACT_ORDER] == 2 && facts[DYNSTEP_FACT_SYMMETRIC] == 1);
    CHECK(limit == HUGE_VAL);
    CHECK(fabs(log2(error_of(s, 0.1) / error_of(s, 0.05)) - 2.0) < 0.1);
    CHECK(dynstep_set_newmark(s, 0.0, 0.5) == 0);
    CHECK(dynstep_properties(s, 0, NULL, NULL, NULL, &limit) == 0);
    CHECK(fabs(limit - 2.0) < 1e-12);
    CHECK(dynstep_stability_limit(s, 0.0, &limit) == 0 && fabs(limit - 2.0) < 1e-6);
    CHECK(dynstep_stability_limit(s, -1.0, &limit) == DYNSTEP_INVALID_INPUT);
    CHECK(dynstep_stability_limit(s, 0.0, NULL) == DYNSTEP_INVALID_INPUT);
    CHECK(dynstep_set_newmark(s, 0.25, 0.5) == 0 && dynstep_set_extrapolation(s, 4, DYNSTEP_ROMBERG, 0, NULL) == 0);
    CHECK(dynstep_stability_limit(s, 0.02, &limit) == 0 && fabs(limit - 6.737963968) < 1e-6);
    CHECK(dynstep_set_newmark(s, 0.0, 0.5) == 0 && dynstep_set_extrapolation(s, 0, 0, 0, NULL) == 0);
    CHECK(fabs(log2(error_of(s, 0.1) / error_of(s, 0.05)) - 2.0) < 0.1);
    CHECK(dynstep_set_midpoint(s) == 0);
    CHECK(fabs(log2(error_of(s, 0.1) / error_of(s, 0.05)) - 2.0) < 0.1);

    /* the extrapolation lies over whatever base is set, in any order of the calls */
    CHECK(dynstep_set_extrapolation(s, 2, DYNSTEP_ROMBERG, 0, NULL) == 0);
    CHECK(fabs(log2(error_of(s, 0.2) / error_of(s, 0.1)) - 4.0) < 0.1);
    CHECK(dynstep_set_newmark(s, 1.0 / 6.0, 0.5) == 0);
    CHECK(fabs(log2(error_of(s, 0.2) / error_of(s, 0.1)) - 4.0) < 0.1);
    CHECK(dynstep_set_extrapolation(s, 3, DYNSTEP_CUSTOM, 3, custom) == 0);
    CHECK(fabs(log2(error_of(s, 0.5) / error_of(s, 0.25)) - 6.0) < 0.1);
    CHECK(dynstep_properties(s, sizeof source, NULL, source, facts, NULL) == 0);
    CHECK(facts[DYNSTEP_FACT_ORDER] == 6 && facts[DYNSTEP_FACT_STAGES] == 9 && strstr(source, "Austin"));
    for (int sequence = DYNSTEP_ROMBERG; sequence <= DYNSTEP_DOUBLE_HARMONIC; sequence++) {
        CHECK(dynstep_set_extrapolation(s, 4, sequence, 0, NULL) == 0);
        CHECK(error_of(s, 0.25) < 1e-10);
    }

    /* the table: its last entry is the result, its first column that of the base */
    double table[4 * 4 * 2], q;
    int numbers[4];
    CHECK(dynstep_start(s, 1, 0.0, (double[]){1.0}, (double[]){0.0}) == 0);
    CHECK(dynstep_step(s, 0.25) == 0);
    CHECK(dynstep_get(s, 1, NULL, &q, NULL, NULL) == 0);
    CHECK(dynstep_tableau(s, 2, 4, table, numbers) == 0);
    CHECK(numbers[0] == 2 && numbers[3] == 8);
    CHECK(fabs(table[3 * 2 + 3 * 2 * 4] - q) < 1e-15);
    CHECK(fabs(table[0] - q) > 1e-5 && fabs(table[0] - q) < 1e-2);
    CHECK(table[0 + 3 * 2 * 4] == 0.0);

    CHECK(dynstep_set_extrapolation(s, 0, 0, 0, NULL) == 0);
    CHECK(dynstep_properties(s, sizeof name, name, NULL, NULL, NULL) == 0);
    CHECK(strcmp(name, "newmark") == 0);
    CHECK(dynstep_set_newton(s, 7, 3, 1e-8) == 0);
    CHECK(dynstep_delete(&s) == 0);
}

static void test_counts(void)
{
    long long counts[DYNSTEP_COUNTS];
    const char *names[DYNSTEP_COUNTS] = {"steps", "substeps", "rejections", "forces", "masses", "tangents",
                                         "factorizations", "solves", "newton_iterations", "halvings",
                                         "constraints"};
    char name[32];
    int calls = 0;
    double q[N];
    intptr_t s = dynstep_new(N);
    for (int i = 0; i < DYNSTEP_COUNTS; i++) {
        CHECK(dynstep_count_name(i, sizeof name, name) == 0);
        CHECK(strcmp(name, names[i]) == 0);
    }
    CHECK(dynstep_count_name(DYNSTEP_COUNTS, sizeof name, name) == DYNSTEP_INVALID_INPUT && name[0] == '\0');
    CHECK(dynstep_counts(s, counts) == 0 && counts[DYNSTEP_COUNT_STEPS] == 0);
    CHECK(dynstep_set_force(s, ADDRESS(force), ADDRESS(&calls)) == 0);
    CHECK(dynstep_set_tangent(s, ADDRESS(tangent_banded), 0) == 0);
    CHECK(dynstep_set_structure(s, DYNSTEP_BANDED, 1, 1, 1, 1, 1, 0) == 0);
    run(s, v0, q);
    CHECK(dynstep_counts(s, counts) == 0);
    CHECK(counts[DYNSTEP_COUNT_STEPS] == 32);
    CHECK(counts[DYNSTEP_COUNT_FORCES] == calls);
    CHECK(counts[DYNSTEP_COUNT_FACTORIZATIONS] == 1 && counts[DYNSTEP_COUNT_TANGENTS] == 1);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_counts(s, counts) == 0 && counts[DYNSTEP_COUNT_STEPS] == 0);
    CHECK(dynstep_delete(&s) == 0);
}

static void test_texts(void)
{
    char words[64], short_words[8];
    const struct { int code; const char *word; } codes[] = {
        {DYNSTEP_SUCCESS, "success"}, {DYNSTEP_STOPPED, "observer"}, {DYNSTEP_MORE, "allowance"},
        {DYNSTEP_EVENT, "event"}, {DYNSTEP_INVALID_INPUT, "argument"}, {DYNSTEP_CALLBACK_FAILED, "procedure failed"},
        {DYNSTEP_NOT_CONVERGED, "Newton"}, {DYNSTEP_SINGULAR_MATRIX, "singular"}, {DYNSTEP_STEP_TOO_SMALL, "too small"},
        {DYNSTEP_NO_MEMORY, "memory"}, {DYNSTEP_INCONSISTENT_START, "start"}, {DYNSTEP_TOO_MANY_STEPS, "too many"},
        {DYNSTEP_IN_USE, "in use"}, {DYNSTEP_NOT_FINITE, "finite"}, {DYNSTEP_FILE_ERROR, "file"},
        {DYNSTEP_INVALID_HANDLE, "handle"}};
    CHECK(dynstep_version() == PROJECT_VERSION);
    CHECK(dynstep_status_text(DYNSTEP_SUCCESS, sizeof words, words) == 0 && strcmp(words, "success") == 0);
    CHECK(dynstep_status_text(DYNSTEP_SUCCESS, sizeof short_words, short_words) == 0);
    CHECK(strcmp(short_words, "success") == 0);
    CHECK(dynstep_status_text(DYNSTEP_IN_USE, sizeof short_words, short_words) == 0 && strlen(short_words) == 7);
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++) {
        CHECK(dynstep_status_text(codes[i].code, sizeof words, words) == 0 && strstr(words, codes[i].word) != NULL);
        if (!strstr(words, codes[i].word)) printf("     code %d: %s\n", codes[i].code, words);
    }
    CHECK(dynstep_status_text(99, sizeof words, words) == 0 && strstr(words, "unknown"));
    CHECK(dynstep_status_text(0, 0, NULL) == 0);
}

static void test_records(void)
{
    const char *path = "capi_systems.AT2";
    double dt = -1.0, values[8] = {0.0};
    char message[DYNSTEP_MESSAGE_LENGTH], text[4];
    int count = -1;
    FILE *file = fopen(path, "w");
    CHECK(file != NULL);
    fputs("A\nB\nC\nNPTS=    3, DT= .02000 SEC\n  .5  -.25\n  1.0\n", file);
    fclose(file);
    CHECK(dynstep_read_at2(path, 0, &dt, &count, NULL, 0, NULL) == 0);
    CHECK(count == 3 && dt == 0.02);
    CHECK(dynstep_read_at2(path, 2, &dt, &count, values, sizeof message, message) == 0);
    CHECK(count == 3 && values[0] == 0.5 && values[1] == -0.25 && values[2] == 0.0 && message[0] == '\0');
    CHECK(dynstep_read_at2(path, 8, &dt, &count, values, sizeof message, message) == 0);
    CHECK(values[2] == 1.0 && values[3] == 0.0);
    remove(path);
    CHECK(dynstep_read_at2(path, 8, &dt, &count, values, sizeof message, message) == DYNSTEP_FILE_ERROR);
    CHECK(count == 0 && strstr(message, path) != NULL);
    CHECK(dynstep_read_at2(path, 8, &dt, &count, values, sizeof text, text) == DYNSTEP_FILE_ERROR);
    CHECK(strlen(text) == 3);
    CHECK(dynstep_read_at2("", 8, &dt, &count, values, 0, NULL) < 0);
    CHECK(dynstep_read_at2(NULL, 8, &dt, &count, values, sizeof message, message) == DYNSTEP_INVALID_INPUT);
    CHECK(dynstep_read_at2(path, -1, &dt, &count, values, sizeof message, message) == DYNSTEP_INVALID_INPUT);
    CHECK(dynstep_read_at2(path, 8, &dt, &count, NULL, sizeof message, message) == DYNSTEP_INVALID_INPUT);
    CHECK(strstr(message, "values") != NULL);
}

/* The flexible arm by its matrices: a step of torque, closed and open, and what is refused */
static void test_arm(void)
{
    enum { SEGMENTS = 10, ORDER = SEGMENTS + 1 };
    const double thesis[DYNSTEP_ARM_PARAMETERS] = {0.01, 0.01, 0.01, 0.001, 1.0, 1.0, 0.01, 100.0};
    const double gains[DYNSTEP_ARM_GAINS] = {1.0, 2.0, 3.0, 5.0};
    const double torque[2] = {0.1, 0.1}, rest[ORDER] = {0.0};
    double m[3*ORDER], k[5*ORDER], same[5*ORDER], b[ORDER], kq[ORDER], cq[ORDER], q[ORDER], v[ORDER], t;
    double wrong[DYNSTEP_ARM_PARAMETERS];
    char message[DYNSTEP_MESSAGE_LENGTH];
    int n = -1;
    CHECK(dynstep_arm_matrices(DYNSTEP_EULER_BERNOULLI, DYNSTEP_ARM_CONSISTENT, SEGMENTS, NULL, NULL, 0, &n, NULL, NULL, NULL,
                               NULL, NULL, 0, NULL) == 0 && n == ORDER);
    CHECK(dynstep_arm_matrices(DYNSTEP_EULER_BERNOULLI, DYNSTEP_ARM_CONSISTENT, SEGMENTS, thesis, gains, n, &n, NULL, same,
                               NULL, kq, cq, sizeof message, message) == 0 && message[0] == '\0');
    CHECK(kq[0] == -2.0 && kq[n - 1] == 3.0 && cq[0] == -3.0 && cq[n - 1] == 5.0 && kq[1] == 0.0);
    CHECK(dynstep_arm_matrices(DYNSTEP_EULER_BERNOULLI, DYNSTEP_ARM_CONSISTENT, SEGMENTS, NULL, NULL, n, &n, m, k, b, kq, cq,
                               0, NULL) == 0);
    CHECK(memcmp(k, same, sizeof k) == 0);
    CHECK(m[1] == 0.01 && b[0] == 1.0 && b[1] == 0.0 && kq[0] == 18.655 - 1.5 && cq[n - 1] == 0.005);

    intptr_t s = dynstep_new(n);
    CHECK(dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_BANDED, 1, 1, 1, m) == 0);
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_BANDED, 2, 2, 1, k) == 0);
    CHECK(dynstep_set_load_table(s, 1, 2, 0.0, 2.0, NULL, torque, b, DYNSTEP_OUTSIDE_HOLD) == 0);
    CHECK(dynstep_set_pade(s, 4, 4, 0) == 0);
    CHECK(dynstep_start(s, n, 0.0, rest, rest) == 0 && dynstep_run(s, 2.0, 0.005) == 0);
    CHECK(dynstep_get(s, n, &t, q, v, NULL) == 0);
    CHECK(fabs(q[0] - 0.655736783452) < 1e-11);        /* an independent study; twelve digits */
    CHECK(dynstep_set_coupling(s, b, kq, cq) == 0);
    CHECK(dynstep_arm_straight(DYNSTEP_EULER_BERNOULLI, SEGMENTS, 0.5, n, q, 0, NULL) == 0 && q[0] == 0.5 && q[n - 1] == 0.5);
    CHECK(dynstep_start(s, n, 0.0, q, rest) == 0 && dynstep_run(s, 200.0, 0.05) == 0);
    CHECK(dynstep_get(s, n, &t, q, v, NULL) == 0);
    CHECK(fabs(q[0] - 0.1/18.655) < 1e-5);             /* u = 0 at rest; slowest pole -0.067 +- 3.183i */
    CHECK(dynstep_delete(&s) == 0);

    n = -1;
    CHECK(dynstep_arm_matrices(3, 0, SEGMENTS, NULL, NULL, 0, &n, NULL, NULL, NULL, NULL, NULL, sizeof message, message)
          == DYNSTEP_INVALID_INPUT && n == 0 && strstr(message, "beam"));
    CHECK(dynstep_arm_matrices(1, 3, SEGMENTS, NULL, NULL, 0, &n, NULL, NULL, NULL, NULL, NULL, sizeof message, message)
          == DYNSTEP_INVALID_INPUT && strstr(message, "variant"));
    CHECK(dynstep_arm_matrices(1, 0, 3, NULL, NULL, 0, &n, NULL, NULL, NULL, NULL, NULL, sizeof message, message)
          == DYNSTEP_INVALID_INPUT && strstr(message, "segments"));
    memcpy(wrong, thesis, sizeof wrong);
    wrong[0] = -1.0;
    CHECK(dynstep_arm_matrices(1, 0, SEGMENTS, wrong, NULL, 0, &n, NULL, NULL, NULL, NULL, NULL, sizeof message, message)
          == DYNSTEP_INVALID_INPUT && strstr(message, "eta"));
    CHECK(dynstep_arm_matrices(1, 0, SEGMENTS, NULL, NULL, -1, &n, NULL, NULL, NULL, NULL, NULL, sizeof message, message)
          == DYNSTEP_INVALID_INPUT && strstr(message, "capacity"));
    CHECK(dynstep_arm_matrices(1, 0, SEGMENTS, NULL, NULL, 0, NULL, NULL, NULL, NULL, NULL, NULL, sizeof message, message)
          == DYNSTEP_INVALID_INPUT && strstr(message, "NULL"));
    b[0] = 7.0;                                        /* no room: left alone */
    CHECK(dynstep_arm_matrices(1, 0, SEGMENTS, NULL, NULL, ORDER - 1, &n, m, k, b, kq, cq, 0, NULL) == 0);
    CHECK(n == ORDER && b[0] == 7.0);
    CHECK(dynstep_arm_straight(1, SEGMENTS, 1.0, ORDER + 1, q, sizeof message, message) == DYNSTEP_INVALID_INPUT);
    CHECK(strstr(message, "11 coordinates") != NULL);
    CHECK(dynstep_arm_straight(1, 1, 1.0, ORDER, q, sizeof message, message) == DYNSTEP_INVALID_INPUT);
    CHECK(strstr(message, "segments") != NULL);
    CHECK(dynstep_arm_straight(1, SEGMENTS, 1.0, ORDER, NULL, 0, NULL) == DYNSTEP_INVALID_INPUT);
}

int main(void)
{
    double reference[N];
    test_systems(reference);
    test_methods();
    test_counts();
    test_texts();
    test_records();
    test_arm();
    return finish();
}
