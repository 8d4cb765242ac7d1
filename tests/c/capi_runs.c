/* SPDX-License-Identifier: BSD-3-Clause */
/* The C interface: runs.  However a run is cut into calls, the points are the same bits. */
#include <stdlib.h>

#include "checks.h"

enum { N = 2, MOST = 400 };

struct points {
    int count;
    double t[MOST], q[MOST * N], v[MOST * N], a[MOST * N];
};

/* Two coupled oscillators, a softening and a hardening one */
static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    const double *until = ctx;
    (void)n;
    f[0] = -q[0] + 0.25 * q[0] * q[0] * q[0] + 0.5 * (q[1] - q[0]) - 0.02 * v[0];
    f[1] = -q[1] * q[1] * q[1] - 0.5 * (q[1] - q[0]) + 0.1 * t;
    return until && t > *until ? -7 : 0;
}

static int stop_after(int n, double t, const double *q, const double *v, const double *a, void *ctx)
{
    (void)n, (void)t, (void)q, (void)v, (void)a;
    return --*(int *)ctx == 0;
}

static const double q0[N] = {0.75, -0.5}, v0[N] = {0.0, 0.25};

/* kind: 0 general with Newmark, 1 linear with Newmark, 2 general extrapolated, 3 linear extrapolated */
static intptr_t make(int kind)
{
    const double stiffness[N * N] = {1.5, -0.5, -0.5, 1.0}, damping[N] = {0.01, 0.02};
    intptr_t s = dynstep_new(N);
    if (kind % 2 == 0)
        CHECK(dynstep_set_force(s, ADDRESS(force), 0) == 0);
    else {
        CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DENSE, 0, 0, 1, stiffness) == 0);
        CHECK(dynstep_set_matrix(s, DYNSTEP_DAMPING, DYNSTEP_DIAGONAL, 0, 0, 1, damping) == 0);
    }
    if (kind >= 2) CHECK(dynstep_set_extrapolation(s, 3, DYNSTEP_HARMONIC, 0, NULL) == 0);
    return s;
}

static int collect(intptr_t s, int max_steps, int capacity, struct points *p)
{
    int code, count, calls = 0;
    p->count = 0;
    do {
        double t[MOST], q[MOST * N], v[MOST * N], a[MOST * N];
        code = dynstep_proceed(s, max_steps, capacity, &count, t, q, v, a);
        if (count > capacity || p->count + count > MOST || ++calls > 10000) {
            CHECK(!"too many points or calls");
            return code;
        }
        memcpy(p->t + p->count, t, count * sizeof *t);
        memcpy(p->q + p->count * N, q, count * N * sizeof *q);
        memcpy(p->v + p->count * N, v, count * N * sizeof *v);
        memcpy(p->a + p->count * N, a, count * N * sizeof *a);
        p->count += count;
    } while (code == DYNSTEP_MORE);
    return code;
}

static int same(const struct points *x, const struct points *y)
{
    return x->count == y->count && !memcmp(x->t, y->t, x->count * sizeof *x->t) &&
           !memcmp(x->q, y->q, x->count * N * sizeof *x->q) && !memcmp(x->v, y->v, x->count * N * sizeof *x->v) &&
           !memcmp(x->a, y->a, x->count * N * sizeof *x->a);
}

/* A run with steps of one length, or for every = CONTROLLED one whose steps follow the estimate, first and longest h */
enum { CONTROLLED = -1 };
static int begin(intptr_t s, double t_end, double h, int every, int n_eval, const double *t_eval)
{
    if (every != CONTROLLED) return dynstep_begin(s, t_end, h, every, n_eval, t_eval);
    return dynstep_begin_controlled(s, t_end, 1e-6, DYNSTEP_PI, DYNSTEP_SAFETY_IN_FRONT, h, fabs(h), n_eval, t_eval);
}

/* One run in a single call and in calls of all sizes */
static void cut(intptr_t s, double t_end, double h, int every, int n_eval, const double *t_eval, struct points *whole)
{
    static struct points parts;
    const int capacities[] = {1, 2, 3, 7, MOST}, steps[] = {1, 2, 5, 1000000};
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(begin(s, t_end, h, every, n_eval, t_eval) == 0);
    CHECK(collect(s, 1000000, MOST, whole) == 0);
    for (int i = 0; i < 5; i++)
        for (int j = 0; j < 4; j++) {
            CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
            CHECK(begin(s, t_end, h, every, n_eval, t_eval) == 0);
            CHECK(collect(s, steps[j], capacities[i], &parts) == 0);
            CHECK(same(whole, &parts));
            if (!same(whole, &parts))
                printf("     capacity %d, max_steps %d: %d points, not %d\n", capacities[i], steps[j], parts.count,
                       whole->count);
        }
}

static void test_cuts(int kind)
{
    static struct points whole, sparse;
    double times[40], back[3] = {-0.1, -0.11, -1.0};
    intptr_t s = make(kind);

    cut(s, 4.0, 0.125, 1, 0, NULL, &whole);
    CHECK(whole.count == 33 && whole.t[0] == 0.0 && whole.t[32] == 4.0);
    CHECK(!memcmp(whole.q, q0, sizeof q0) && !memcmp(whole.v, v0, sizeof v0));

    /* every fifth step, and the last */
    cut(s, 4.0, 0.125, 5, 0, NULL, &sparse);
    CHECK(sparse.count == 8 && sparse.t[7] == 4.0 && sparse.t[6] == 3.75);
    CHECK(!memcmp(sparse.q + N, whole.q + 5 * N, N * sizeof(double)));

    /* the last point alone; a shorter last step; backward */
    cut(s, 4.0, 0.125, 0, 0, NULL, &sparse);
    CHECK(sparse.count == 1 && !memcmp(sparse.q, whole.q + 32 * N, N * sizeof(double)));
    cut(s, 1.0, 0.15, 1, 0, NULL, &sparse);
    CHECK(sparse.count == 8 && sparse.t[7] == 1.0);
    cut(s, -1.0, -0.125, 3, 0, NULL, &sparse);
    CHECK(sparse.count == 4 && sparse.t[3] == -1.0);

    /* times: repeated, many inside one step, at both ends */
    int n = 0;
    times[n++] = 0.0;
    times[n++] = 0.0;
    for (int i = 1; i <= 20; i++) times[n++] = 0.5 + i / 256.0;
    times[n++] = 0.625;
    times[n++] = 0.625;
    for (int i = 1; i <= 9; i++) times[n++] = 3.0 + i / 16.0;
    times[n++] = 4.0;
    cut(s, 4.0, 0.125, 77, n, times, &sparse);
    CHECK(sparse.count == n && !memcmp(sparse.t, times, n * sizeof *times));
    CHECK(!memcmp(sparse.q + 22 * N, whole.q + 5 * N, N * sizeof(double)));
    CHECK(!memcmp(sparse.q + (n - 1) * N, whole.q + 32 * N, N * sizeof(double)));
    CHECK(fabs(sparse.q[N] - q0[0]) == 0.0);
    cut(s, -1.0, -0.125, 1, 3, back, &sparse);
    CHECK(sparse.count == 3 && sparse.t[2] == -1.0);

    /* single steps, and runs without points, end on the same bits */
    double t, q[N], v[N], a[N];
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    for (int i = 0; i < 32; i++) CHECK(dynstep_step(s, 0.125) == 0);
    CHECK(dynstep_get(s, N, &t, q, v, a) == 0);
    CHECK(t == 4.0 && !memcmp(q, whole.q + 32 * N, sizeof q) && !memcmp(v, whole.v + 32 * N, sizeof v) &&
          !memcmp(a, whole.a + 32 * N, sizeof a));
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_run(s, 4.0, 0.125) == 0);
    CHECK(dynstep_get(s, N, &t, q, v, a) == 0);
    CHECK(t == 4.0 && !memcmp(q, whole.q + 32 * N, sizeof q) && !memcmp(a, whole.a + 32 * N, sizeof a));
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_begin(s, 4.0, 0.125, 1, 0, NULL) == 0);
    while (dynstep_proceed(s, 3, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_MORE) continue;
    CHECK(dynstep_get(s, N, &t, q, NULL, NULL) == 0);
    CHECK(t == 4.0 && !memcmp(q, whole.q + 32 * N, sizeof q));
    CHECK(dynstep_proceed(s, 3, 0, NULL, NULL, NULL, NULL, NULL) == 0);

    /* a run to where one is already; its start is its end */
    CHECK(dynstep_begin(s, 4.0, 0.125, 1, 0, NULL) == 0);
    CHECK(collect(s, 1, 1, &sparse) == 0);
    CHECK(sparse.count == 1 && sparse.t[0] == 4.0);

    /* arrays that are not wanted */
    int count = -1;
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_begin(s, 4.0, 0.125, 1, 0, NULL) == 0);
    CHECK(dynstep_proceed(s, 100, 100, &count, NULL, NULL, sparse.v, NULL) == 0);
    CHECK(count == 33 && !memcmp(sparse.v, whole.v, 33 * N * sizeof(double)));
    CHECK(dynstep_delete(&s) == 0);
}

static void test_observer(int kind)
{
    static struct points whole, parts;
    double t;
    int left = 5;
    intptr_t s = make(kind);
    cut(s, 2.0, 0.125, 2, 0, NULL, &whole);
    CHECK(dynstep_set_observer(s, ADDRESS(stop_after), ADDRESS(&left)) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_begin(s, 2.0, 0.125, 2, 0, NULL) == 0);
    CHECK(collect(s, 100, 3, &parts) == DYNSTEP_STOPPED);
    CHECK(parts.count == 4 && parts.t[3] == 0.625);         /* 0, 2, 4, and the fifth step */
    CHECK(dynstep_get(s, N, &t, NULL, NULL, NULL) == 0 && t == 0.625);
    CHECK(collect(s, 100, 3, &parts) == 0);                 /* on to the end */
    CHECK(parts.count == 6 && !memcmp(parts.q, whole.q + 3 * N, 6 * N * sizeof(double)));
    left = 3;
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    CHECK(dynstep_run(s, 2.0, 0.125) == DYNSTEP_STOPPED);
    CHECK(dynstep_get(s, N, &t, NULL, NULL, NULL) == 0 && t == 0.375);
    CHECK(dynstep_set_observer(s, 0, 0) == 0);
    CHECK(dynstep_run(s, 2.0, 0.125) == 0);
    CHECK(dynstep_delete(&s) == 0);
}

/* A force that gives up in the middle: the points so far come, in any cut, and then the code */
static void test_failure(void)
{
    static struct points whole, parts;
    const int capacities[] = {1, 2, 3, 50};
    double until = 1.03, t, times[40];
    intptr_t s = make(0);
    CHECK(dynstep_set_force(s, ADDRESS(force), ADDRESS(&until)) == 0);
    for (int i = 0; i < 40; i++) times[i] = i / 20.0;
    for (int with_times = 0; with_times < 2; with_times++)
        for (int i = 3; i >= 0; i--) {
            CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
            CHECK(dynstep_begin(s, 2.0, 0.25, 3, with_times ? 40 : 0, times) == 0);
            CHECK(collect(s, 100, capacities[i], i == 3 ? &whole : &parts) == DYNSTEP_CALLBACK_FAILED);
            if (i == 3) CHECK(whole.count == (with_times ? 21 : 3));
            if (i < 3) CHECK(same(&whole, &parts));
            CHECK(dynstep_get(s, N, &t, NULL, NULL, NULL) == 0 && t == 1.0);
        }
    char text[DYNSTEP_MESSAGE_LENGTH];
    CHECK(dynstep_proceed(s, 1, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_INVALID_INPUT);
    CHECK(dynstep_proceed(s, 1, 1, &whole.count, NULL, NULL, NULL, NULL) == DYNSTEP_CALLBACK_FAILED);
    CHECK(dynstep_message(s, sizeof text, text) == 0 && strstr(text, "-7") != NULL);
    until = 10.0;                                           /* it can go on, too */
    CHECK(collect(s, 100, 5, &parts) == 0);
    CHECK(parts.count == 19);
    CHECK(dynstep_delete(&s) == 0);
}

/* Steps that follow the error estimate.  kind: as above, and 4 and 5 the systems of 0 and 1 by backinterpolation */
static void test_controlled(int kind)
{
    static struct points whole, sparse;
    double times[40], t, q[N], back[3] = {-0.1, -0.11, -1.0};
    long long counts[DYNSTEP_COUNTS];
    int n = 0, count, left = 5;
    intptr_t s = make(kind % 4);
    if (kind > 3) CHECK(dynstep_set_backinterpolation(s, 4, 4, 0.5, DYNSTEP_HALVES_TAYLOR) == 0);

    cut(s, 4.0, 0.0, CONTROLLED, 0, NULL, &whole);
    CHECK(whole.count > 10 && whole.t[whole.count - 1] == 4.0 && whole.t[1] <= 4.0 / 128);
    cut(s, 4.0, 1.0, CONTROLLED, 0, NULL, &whole);          /* the first steps are too long */
    CHECK(dynstep_counts(s, counts) == 0 && counts[DYNSTEP_COUNT_REJECTIONS] > 0);
    CHECK(counts[DYNSTEP_COUNT_STEPS] == whole.count - 1 && whole.t[1] < 1.0);
    for (int i = 1; i < whole.count; i++) CHECK(whole.t[i] - whole.t[i - 1] <= 1.0 && whole.t[i] > whole.t[i - 1]);

    /* times, many inside one step; the steps are the same */
    times[n++] = 0.0;
    for (int i = 1; i <= 20; i++) times[n++] = 0.5 + i / 4096.0;
    for (int i = 1; i <= 9; i++) times[n++] = 3.0 + i / 16.0;
    times[n++] = 4.0;
    times[n++] = 4.0;
    cut(s, 4.0, 1.0, CONTROLLED, n, times, &sparse);
    CHECK(sparse.count == n && !memcmp(sparse.t, times, n * sizeof *times));
    CHECK(!memcmp(sparse.q + (n - 1) * N, whole.q + (whole.count - 1) * N, N * sizeof *q));
    cut(s, -1.0, -0.125, CONTROLLED, 3, back, &sparse);
    CHECK(sparse.count == 3 && sparse.t[2] == -1.0);

    /* a call goes on until its room is used up, whatever the steps are */
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0 && begin(s, 4.0, 1.0, CONTROLLED, n, times) == 0);
    for (int i = 0; i < (n - 1) / 4; i++)
        CHECK(dynstep_proceed(s, 1000, 4, &count, sparse.t, NULL, NULL, NULL) == DYNSTEP_MORE && count == 4 &&
              sparse.t[3] == times[4 * i + 3]);

    /* a run to where one is already, with less room than times */
    for (int i = 0; i < 3; i++) back[i] = 0.0;
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0 && begin(s, 0.0, 0.0, CONTROLLED, 3, back) == 0);
    CHECK(collect(s, 1, 1, &sparse) == 0 && sparse.count == 3);

    /* nothing recorded; an observer; a tolerance that is not to be reached */
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0 && begin(s, 4.0, 1.0, CONTROLLED, 0, NULL) == 0);
    while (dynstep_proceed(s, 3, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_MORE) continue;
    CHECK(dynstep_get(s, N, &t, q, NULL, NULL) == 0 && t == 4.0 && !memcmp(q, whole.q + (whole.count - 1) * N, sizeof q));
    CHECK(dynstep_set_observer(s, ADDRESS(stop_after), ADDRESS(&left)) == 0);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0 && begin(s, 4.0, 1.0, CONTROLLED, 0, NULL) == 0);
    CHECK(collect(s, 100, 3, &sparse) == DYNSTEP_STOPPED && sparse.count == 6 && sparse.t[5] == whole.t[5]);
    CHECK(collect(s, 100, 3, &sparse) == 0 && sparse.count == whole.count - 6);
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_begin_controlled(s, 4.0, 1e-300, DYNSTEP_STANDARD, 1, 0.25, 0.0, 0, NULL), DYNSTEP_TOLERANCE_TOO_SMALL,
            "rounding");
    CHECK(dynstep_delete(&s) == 0);
}

static void test_refused_control(void)
{
    const int bad = DYNSTEP_INVALID_INPUT;
    const double times[2] = {0.5, 0.25};
    intptr_t s = make(2);
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, 0.0, 0, NULL), bad, "dynstep_start first");
    CHECK(dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_begin_controlled(s, 1.0, 0.0, 1, 1, 0.0, 0.0, 0, NULL), bad, "tolerance = 0");
    REFUSES(dynstep_begin_controlled(s, 1.0, NAN, 1, 1, 0.0, 0.0, 0, NULL), bad, "tolerance = ");
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 3, 1, 0.0, 0.0, 0, NULL), bad, "controller = 3");
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 2, 0, 0.0, 0.0, 0, NULL), bad, "safety_place = 0");
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, -0.1, 0.0, 0, NULL), bad, "h_first = -0.1");
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, -1.0, 0, NULL), bad, "h_max = -1");
    REFUSES(dynstep_begin_controlled(s, NAN, 1e-6, 1, 1, 0.0, 0.0, 0, NULL), bad, "t_end");
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, 0.0, -1, NULL), bad, "n_eval = -1");
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, 0.0, 2, NULL), bad, "t_eval is NULL");
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, 0.0, 2, times), bad, "t_eval(2)");
    REFUSES(dynstep_proceed(s, 1, 0, NULL, NULL, NULL, NULL, NULL), bad, "dynstep_begin first");
    CHECK(dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, 0.0, 0, NULL) == 0);
    CHECK(dynstep_proceed(s, 1000, 0, NULL, NULL, NULL, NULL, NULL) == 0);
    CHECK(dynstep_set_extrapolation(s, 0, 0, 0, NULL) == 0 && dynstep_start(s, N, 0.0, q0, v0) == 0);
    REFUSES(dynstep_begin_controlled(s, 1.0, 1e-6, 1, 1, 0.0, 0.0, 0, NULL), bad, "no error estimate");
    CHECK(dynstep_delete(&s) == 0);
}

int main(void)
{
    for (int kind = 2; kind < 6; kind++) test_controlled(kind);
    test_refused_control();
    for (int kind = 0; kind < 4; kind++) {
        test_cuts(kind);
        test_observer(kind);
    }
    test_failure();
    return finish();
}
