/* SPDX-License-Identifier: BSD-3-Clause */
/* Order control, points inside steps, checkpoints and the stability warning through the C interface. */
#include <stdlib.h>

#include "checks.h"

static const char file[] = "capi_checkpoints.checkpoint";

/* Kepler's problem, e = 1/2: once around in 2 pi */
static int attract(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    const double r = hypot(q[0], q[1]);
    (void)n, (void)t, (void)v;
    if (ctx) ++*(int *)ctx;
    f[0] = -q[0]/(r*r*r);
    f[1] = -q[1]/(r*r*r);
    return 0;
}

static int crossing(int n, int count, double t, const double *q, const double *v, double *s, void *ctx)
{
    (void)n, (void)count, (void)t, (void)v, (void)ctx;
    s[0] = q[1];
    return 0;
}

static const double q0[2] = {0.5, 0.0}, v0[2] = {0.0, 1.7320508075688772}, period = 6.283185307179586;
static const double tolerance[1] = {1e-11};

static intptr_t new_planet(int vary)
{
    intptr_t s = dynstep_new(2);
    CHECK(dynstep_set_force(s, ADDRESS(attract), 0) == 0);
    CHECK(dynstep_set_structure(s, DYNSTEP_DENSE, 0, 0, 0, 0, 0, 1) == 0);
    CHECK(dynstep_set_newmark(s, 0.0, 0.5) == 0);
    CHECK(dynstep_set_extrapolation(s, 4, DYNSTEP_AUTOMATIC, 0, NULL) == 0);
    CHECK(dynstep_set_order_control(s, vary, 9) == 0);
    return s;
}

static int begin(intptr_t s)
{
    CHECK(dynstep_start(s, 2, 0.0, q0, v0) == 0);
    return dynstep_begin_within(s, period, 1e-10, 1, tolerance, 0.0, 0.0, 0.0, 0.0, 0.0, 0, NULL);
}

static double error_of(intptr_t s)
{
    double q[2];
    CHECK(dynstep_get(s, 2, NULL, q, NULL, NULL) == 0);
    return hypot(q[0] - q0[0], q[1] - q0[1]);
}

static long long forces_of(intptr_t s)
{
    long long counts[DYNSTEP_COUNTS];
    CHECK(dynstep_counts(s, counts) == 0);
    return counts[DYNSTEP_COUNT_FORCES];
}

/* The levels that the error chooses need less work, and single steps have `levels` as ever */
static void order_control(void)
{
    long long forces[2];
    for (int vary = 0; vary < 2; vary++) {
        intptr_t s = new_planet(vary);
        double table[4*9*9], q[2][2];
        int numbers[9];
        CHECK(begin(s) == 0);
        CHECK(dynstep_proceed(s, 1000, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_SUCCESS);
        CHECK(error_of(s) < 1e-7);
        forces[vary] = forces_of(s);
        if (vary) {
            CHECK(dynstep_tableau(s, 4, 9, table, numbers) == 0);
            CHECK(numbers[0] == 1 && numbers[1] == 2 && numbers[8] <= 9);
            REFUSES(dynstep_tableau(s, 4, 1, table, numbers), DYNSTEP_INVALID_INPUT, "the last step has");
        }
        /* nothing of the tolerances is left behind a new start */
        for (int twice = 0; twice < 2; twice++) {
            intptr_t fresh = twice ? new_planet(vary) : s;
            CHECK(dynstep_start(fresh, 2, 0.0, q0, v0) == 0);
            CHECK(dynstep_run(fresh, 1.0, 0.1) == 0);
            CHECK(dynstep_get(fresh, 2, NULL, q[twice], NULL, NULL) == 0);
            if (twice) CHECK(dynstep_delete(&fresh) == 0);
        }
        CHECK(memcmp(q[0], q[1], sizeof q[0]) == 0);
        REFUSES(dynstep_set_order_control(s, 1, 1), DYNSTEP_INVALID_INPUT, "max_levels = 1");
        REFUSES(dynstep_set_order_control(s, 1, 13), DYNSTEP_INVALID_INPUT, "max_levels = 13");
        CHECK(dynstep_set_order_control(s, 0, 0) == 0);
        CHECK(dynstep_delete(&s) == 0);
    }
    CHECK(10*forces[1] < 9*forces[0]);
}

#define MOST 4000
static double t_all[MOST], q_all[2*MOST], t_in[MOST], q_in[2*MOST];
static int kinds_all[MOST], kinds_in[MOST];

/* All points of the run that was begun, with room for `room` of them a call; returns how many */
static int collect(intptr_t s, int room, int most_steps, double *t, double *q, int *kinds, int *code)
{
    int total = 0, count, kind[MOST];
    do {
        *code = dynstep_proceed(s, most_steps, room, &count, t + total, q + 2*total, NULL, NULL);
        CHECK(dynstep_point_kinds(s, count, kind) == 0);
        memcpy(kinds + total, kind, count*sizeof *kind);
        total += count;
    } while (*code == DYNSTEP_MORE && most_steps > 100 && total < MOST - room);
    return total;
}

/* Points inside steps come in their order, the same ones with little room, and the ends are those of a run without them */
static void inner_points(void)
{
    intptr_t s = new_planet(1);
    int code, n, m, ends = 0, inner = 0, k = 0;
    CHECK(begin(s) == 0);
    n = collect(s, 500, 1000, t_all, q_all, kinds_all, &code);
    CHECK(code == DYNSTEP_SUCCESS && n > 10);
    for (int i = 0; i < n; i++) CHECK(kinds_all[i] == 0);
    CHECK(dynstep_set_dense(s, 1) == 0);
    CHECK(begin(s) == 0);
    m = collect(s, 500, 1000, t_in, q_in, kinds_in, &code);
    CHECK(code == DYNSTEP_SUCCESS);
    for (int i = 0; i < m; i++) {
        if (i) CHECK(t_in[i] > t_in[i - 1]);
        inner += kinds_in[i];
        if (kinds_in[i]) continue;
        CHECK(k < n && t_in[i] == t_all[k] && memcmp(q_in + 2*i, q_all + 2*k, 2*sizeof *q_in) == 0);
        k++;
        ends++;
    }
    CHECK(ends == n && inner >= 2*(n - 1));
    for (int room = 1; room < 9; room += 3) {
        CHECK(begin(s) == 0);
        CHECK(collect(s, room, 1000, t_all, q_all, kinds_all, &code) == m);
        CHECK(memcmp(t_all, t_in, m*sizeof *t_in) == 0 && memcmp(q_all, q_in, 2*m*sizeof *q_in) == 0);
        CHECK(memcmp(kinds_all, kinds_in, m*sizeof *kinds_in) == 0);
    }
    REFUSES(dynstep_point_kinds(s, m, kinds_all), DYNSTEP_INVALID_INPUT, "count");
    CHECK(dynstep_delete(&s) == 0);
}

/* A run that is left after some steps, and events, goes on in another integrator */
static void checkpoints(void)
{
    for (int dense = 0; dense < 2; dense++) {
        intptr_t s = new_planet(1), other = new_planet(1);
        int code, n, first, rest, met;
        CHECK(dynstep_set_events(s, 1, ADDRESS(crossing), 0, NULL, NULL) == 0);
        CHECK(dynstep_set_events(other, 1, ADDRESS(crossing), 0, NULL, NULL) == 0);
        CHECK(dynstep_set_dense(s, dense) == 0);
        CHECK(begin(s) == 0);
        n = collect(s, 500, 1000, t_all, q_all, kinds_all, &code);
        CHECK(code == DYNSTEP_SUCCESS);
        const long long forces = forces_of(s);
        CHECK(begin(s) == 0);
        first = collect(s, 500, 13, t_in, q_in, kinds_in, &code);
        CHECK(code == DYNSTEP_MORE);
        CHECK(dynstep_checkpoint(s, file) == 0);
        CHECK(dynstep_restore(other, file) == 0);
        rest = collect(other, 3, 1000, t_in + first, q_in + 2*first, kinds_in + first, &code);
        CHECK(code == DYNSTEP_SUCCESS && first + rest == n);
        CHECK(memcmp(t_all, t_in, n*sizeof *t_in) == 0 && memcmp(q_all, q_in, 2*n*sizeof *q_in) == 0);
        CHECK(memcmp(kinds_all, kinds_in, n*sizeof *kinds_in) == 0);
        CHECK(forces_of(other) == forces);
        CHECK(dynstep_event_count(other, &met) == 0 && met >= 1);
        CHECK(dynstep_delete(&s) == 0);
        CHECK(dynstep_delete(&other) == 0);
    }
}

static void refusals(void)
{
    intptr_t s = new_planet(1), t;
    int count;
    double time;
    REFUSES(dynstep_checkpoint(s, file), DYNSTEP_INVALID_INPUT, "dynstep_begin");
    REFUSES(dynstep_checkpoint(s, NULL), DYNSTEP_INVALID_INPUT, "path is NULL");
    REFUSES(dynstep_restore(s, "no/such/file"), DYNSTEP_FILE_ERROR, "no/such/file");
    CHECK(dynstep_set_dense(s, 1) == 0);
    CHECK(begin(s) == 0);
    REFUSES(dynstep_checkpoint(s, "no/such/folder/file"), DYNSTEP_FILE_ERROR, "no/such/folder");
    while (dynstep_proceed(s, 5, 1, &count, &time, NULL, NULL, NULL) == DYNSTEP_MORE && time <= 0.0) continue;
    REFUSES(dynstep_checkpoint(s, file), DYNSTEP_INVALID_INPUT, "wait");
    CHECK(dynstep_set_dense(s, 0) == 0);
    CHECK(begin(s) == 0);
    CHECK(dynstep_proceed(s, 5, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_MORE);
    CHECK(dynstep_checkpoint(s, file) == 0);
    t = s;
    s = new_planet(0);
    REFUSES(dynstep_restore(s, file), DYNSTEP_FILE_ERROR, file);
    REFUSES(dynstep_proceed(s, 5, 0, NULL, NULL, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "dynstep_begin");
    CHECK(dynstep_set_midpoint(s) == 0);
    REFUSES(dynstep_restore(s, file), DYNSTEP_FILE_ERROR, file);
    CHECK(dynstep_start(s, 2, 0.0, q0, v0) == 0);
    CHECK(dynstep_step(s, 0.1) == 0);
    CHECK(dynstep_delete(&s) == 0);
    CHECK(dynstep_delete(&t) == 0);
    remove(file);
}

/* A chain of two masses: omega is 100 and 1 */
static void warning(void)
{
    const double k[2] = {1.0, 1e4}, q[2] = {1.0, 0.0}, v[2] = {0.0, 0.0};
    char text[DYNSTEP_MESSAGE_LENGTH];
    intptr_t s = dynstep_new(2);
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DIAGONAL, 0, 0, 1, k) == 0);
    CHECK(dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL) == 0);
    CHECK(dynstep_get_warning(s, sizeof text, text) == 0 && text[0] == '\0');
    CHECK(dynstep_start(s, 2, 0.0, q, v) == 0);
    CHECK(dynstep_run(s, 1.0, 0.001) == 0);
    CHECK(dynstep_get_warning(s, sizeof text, text) == 0 && text[0] == '\0');
    CHECK(dynstep_run(s, 2.0, 0.1) == 0);
    CHECK(dynstep_get_warning(s, sizeof text, text) == 0 && strstr(text, "omega h = 10.0") != NULL);
    CHECK(dynstep_delete(&s) == 0);
    CHECK(dynstep_get_warning(s, sizeof text, text) == DYNSTEP_INVALID_HANDLE);
}

int main(void)
{
    order_control();
    inner_points();
    checkpoints();
    refusals();
    warning();
    return finish();
}
