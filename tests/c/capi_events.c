/* SPDX-License-Identifier: BSD-3-Clause */
/* Tolerances, events, actions and switches through the C interface: a ball that bounces, an oscillator whose spring changes
 * at the origin, known by formulas, and every refusal. */
#include <stdlib.h>

#include "checks.h"

static const double gravity = 9.81;

/* ---- A ball that bounces ---- */

typedef struct {
    double restitution, height;
    int actions, last_which, gives_up_at;
    double answer;                 /* what the event function returns in place of the height, where it is not 0 */
    intptr_t handle;
    int code_inside;
} ball;

static int fall(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    (void)n, (void)t, (void)q, (void)v, (void)ctx;
    f[0] = -gravity;
    return 0;
}

static int fall_ode(int n, double t, const double *y, double *f, void *ctx)
{
    (void)n, (void)t, (void)ctx;
    f[0] = y[1];
    f[1] = -gravity;
    return 0;
}

/* The floor, and the top of the motion */
static int floor_and_top(int n, int count, double t, const double *q, const double *v, double *s, void *ctx)
{
    ball *b = ctx;
    (void)n, (void)t;
    s[0] = b->answer != 0.0 ? b->answer : q[0];
    if (count > 1) s[1] = v ? v[0] : q[1];
    return 0;
}

static int bounce(int n, int which, double t, double *q, double *v, void *ctx)
{
    ball *b = ctx;
    (void)n, (void)t;
    b->last_which = which;
    b->actions++;
    b->code_inside = dynstep_get(b->handle, 1, NULL, NULL, NULL, NULL);
    if (b->gives_up_at == b->actions) return -1;
    if (which != 0) {
        q[0] = 1e9;                /* nothing is changed by that */
        return 0;
    }
    (v ? v : q + 1)[0] *= -b->restitution;
    return 1;
}

static intptr_t new_ball(ball *b)
{
    intptr_t s = dynstep_new(1);
    const int direction[2] = {-1, -1};
    CHECK(dynstep_set_force(s, ADDRESS(fall), 0) == 0);
    CHECK(dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL) == 0);
    CHECK(dynstep_set_events(s, 2, ADDRESS(floor_and_top), ADDRESS(b), direction, NULL) == 0);
    CHECK(dynstep_set_event_action(s, ADDRESS(bounce), ADDRESS(b)) == 0);
    b->handle = s;
    return s;
}

/* Times of the first `most` bounces; the ball starts at rest from 1 */
static int bounces(double restitution, int most, double *t)
{
    double at = sqrt(2.0 / gravity), v = gravity * at;
    for (int i = 0; i < most; i++) {
        t[i] = at;
        v *= restitution;
        at += 2.0 * v / gravity;
    }
    return most;
}

/* Six bounces and six tops up to t = 3: met in order, with states before the action, and recorded before and behind it */
static void test_ball(int capacity, int max_steps)
{
    enum { ROOM = 400 };
    ball b = {.restitution = 0.8};
    intptr_t s = new_ball(&b);
    const double q0 = 1.0, v0 = 0.0;
    double t[ROOM], q[ROOM], v[ROOM], a[ROOM], expected[7], et[40], eq[40], ev[40];
    int which[40], code, total = 0, count, met, floors = 0, pairs = 0;
    CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
    CHECK(dynstep_event_count(s, &met) == 0 && met == 0);
    CHECK(dynstep_begin_within(s, 3.0, 1e-10, 0, NULL, 0.0, 0.0, 0.0, 0.0, 0.0, 0, NULL) == 0);
    do {
        code = dynstep_proceed(s, max_steps, capacity, &count, t + total, q + total, v + total, a + total);
        CHECK(code >= 0 && count >= 0 && count <= capacity);
        total += count;
    } while (code == DYNSTEP_MORE && total + capacity <= ROOM);
    CHECK(code == 0);
    CHECK(b.code_inside == DYNSTEP_IN_USE);
    CHECK(dynstep_event_count(s, &met) == 0 && met > 8 && met <= 40);
    CHECK(dynstep_get_events(s, 0, met, which, et, eq, ev) == 0);
    CHECK(b.actions == met && b.last_which == which[met - 1]);
    bounces(0.8, 7, expected);
    for (int i = 0; i < met; i++) {
        if (which[i] == 1) {
            CHECK(fabs(ev[i]) < 1e-12 && eq[i] > 0.0);
            continue;
        }
        CHECK(floors < 7 && fabs(et[i] - expected[floors]) < 1e-12);
        CHECK(fabs(eq[i]) < 1e-13 && ev[i] < 0.0);
        floors++;
    }
    CHECK(floors == 6);
    CHECK(t[0] == 0.0 && t[total - 1] == 3.0);
    for (int i = 1; i < total; i++) {
        CHECK(t[i] >= t[i - 1]);
        if (t[i] > t[i - 1]) continue;
        CHECK(q[i] == q[i - 1] && v[i] == -0.8 * v[i - 1] && a[i] == a[i - 1]);
        pairs++;
    }
    CHECK(pairs == floors);
    /* some of them, from the middle */
    double one;
    CHECK(dynstep_get_events(s, 3, 1, NULL, &one, NULL, NULL) == 0 && one == et[3]);
    REFUSES(dynstep_get_events(s, 0, met + 1, which, et, NULL, NULL), DYNSTEP_INVALID_INPUT, "beyond");
    REFUSES(dynstep_get_events(s, -1, 1, which, et, NULL, NULL), DYNSTEP_INVALID_INPUT, "first = -1");
    CHECK(dynstep_delete(&s) == 0);
}

/* A run in pieces of any size has the same points */
static void test_pieces(void)
{
    enum { ROOM = 400 };
    double t[2][ROOM], v[2][ROOM];
    int total[2] = {0, 0};
    for (int k = 0; k < 2; k++) {
        ball b = {.restitution = 0.5};
        intptr_t s = new_ball(&b);
        const double q0 = 1.0, v0 = 0.0;
        int code, count, room = k ? 1 : ROOM;
        CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
        CHECK(dynstep_begin(s, 1.0, 0.05, 1, 0, NULL) == 0);
        do {
            code = dynstep_proceed(s, k ? 3 : 1000, room, &count, t[k] + total[k], NULL, v[k] + total[k], NULL);
            total[k] += count;
        } while (code == DYNSTEP_MORE && total[k] + room <= ROOM);
        CHECK(code == 0);
        CHECK(dynstep_delete(&s) == 0);
    }
    CHECK(total[0] == total[1] && total[0] > 22);
    CHECK(memcmp(t[0], t[1], sizeof(double) * (size_t)total[0]) == 0);
    CHECK(memcmp(v[0], v[1], sizeof(double) * (size_t)total[0]) == 0);
}

/* Terminal events end a run, which may go on; actions and events may be taken away */
static void test_terminal(void)
{
    ball b = {.restitution = 0.8};
    intptr_t s = new_ball(&b);
    const int terminal[2] = {1, 0}, direction[2] = {-1, 0};
    const double q0 = 1.0, v0 = 0.0;
    double t, v, expected[2];
    int met;
    bounces(0.8, 2, expected);
    CHECK(dynstep_set_events(s, 2, ADDRESS(floor_and_top), ADDRESS(&b), direction, terminal) == 0);
    CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
    CHECK(dynstep_begin(s, 3.0, 0.1, 1, 0, NULL) == 0);
    REFUSES(dynstep_proceed(s, 1000, 0, NULL, NULL, NULL, NULL, NULL), DYNSTEP_EVENT, "event 1 ended the run");
    CHECK(dynstep_get(s, 1, &t, NULL, &v, NULL) == 0 && fabs(t - expected[0]) < 1e-12 && v > 0.0);
    CHECK(dynstep_proceed(s, 1000, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_EVENT);
    CHECK(dynstep_get(s, 1, &t, NULL, &v, NULL) == 0 && fabs(t - expected[1]) < 1e-12);
    /* no action any more, in the middle of the run: it falls through */
    CHECK(dynstep_set_event_action(s, 0, 0) == 0);
    CHECK(dynstep_proceed(s, 1000, 0, NULL, NULL, NULL, NULL, NULL) == DYNSTEP_EVENT);
    CHECK(dynstep_proceed(s, 1000, 0, NULL, NULL, NULL, NULL, NULL) == 0);
    CHECK(dynstep_get(s, 1, &t, NULL, &v, NULL) == 0 && t == 3.0 && v < 0.0);
    CHECK(dynstep_event_count(s, &met) == 0 && met > 3);
    /* no events any more: the run is over, another one needs no start */
    CHECK(dynstep_begin(s, 4.0, 0.1, 1, 0, NULL) == 0);
    CHECK(dynstep_set_events(s, 0, 0, 0, NULL, NULL) == 0);
    REFUSES(dynstep_proceed(s, 1000, 0, NULL, NULL, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "dynstep_begin first");
    CHECK(dynstep_run(s, 4.0, 0.1) == 0);
    CHECK(dynstep_event_count(s, &met) == 0 && met == 0);
    CHECK(dynstep_delete(&s) == 0);
}

/* First order: v is not there */
static void test_first_order(void)
{
    ball b = {.restitution = 0.8};
    intptr_t s = dynstep_new_ode(2);
    const int direction[1] = {-1};
    const double y0[2] = {1.0, 0.0};
    double expected[7], t[7], y[14], unused = 7.0;
    int met;
    b.handle = s;
    CHECK(dynstep_set_rhs(s, ADDRESS(fall_ode), 0) == 0);
    CHECK(dynstep_set_events(s, 1, ADDRESS(floor_and_top), ADDRESS(&b), direction, NULL) == 0);
    CHECK(dynstep_set_event_action(s, ADDRESS(bounce), ADDRESS(&b)) == 0);
    CHECK(dynstep_start_ode(s, 2, 0.0, y0) == 0);
    CHECK(dynstep_run(s, 3.0, 0.1) == 0);
    CHECK(dynstep_event_count(s, &met) == 0 && met == bounces(0.8, 6, expected));
    CHECK(dynstep_get_events(s, 0, met, NULL, t, y, &unused) == 0 && unused == 7.0);
    for (int i = 0; i < met; i++) CHECK(fabs(t[i] - expected[i]) < 1e-12 && fabs(y[2*i]) < 1e-12 && y[2*i + 1] < 0.0);
    CHECK(dynstep_delete(&s) == 0);
}

static void test_failures(void)
{
    ball b = {.restitution = 0.8, .gives_up_at = 2};
    intptr_t s = new_ball(&b);
    const double q0 = 1.0, v0 = 0.0, nan = strtod("nan", NULL);
    const int direction[2] = {0, 2};
    double t;
    int met;
    CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
    REFUSES(dynstep_run(s, 3.0, 0.1), DYNSTEP_CALLBACK_FAILED, "action at event");
    CHECK(dynstep_get(s, 1, &t, NULL, NULL, NULL) == 0 && t > 0.4 && t < 3.0);
    b.gives_up_at = 0;
    /* it comes to rest at t = 4.06 */
    CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
    REFUSES(dynstep_run(s, 5.0, 0.1), DYNSTEP_TOO_MANY_EVENTS, "bounces to an end");
    CHECK(dynstep_get(s, 1, &t, NULL, NULL, NULL) == 0 && fabs(t - sqrt(2.0 / gravity) * 9.0) < 1e-6);
    b.answer = nan;
    CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.1), DYNSTEP_NOT_FINITE, "event function 1");
    REFUSES(dynstep_set_events(s, 0, ADDRESS(floor_and_top), 0, NULL, NULL), DYNSTEP_INVALID_INPUT, "count = 0");
    REFUSES(dynstep_set_events(s, -1, ADDRESS(floor_and_top), 0, direction, NULL), DYNSTEP_INVALID_INPUT, "count = -1");
    REFUSES(dynstep_set_events(s, 2, ADDRESS(floor_and_top), 0, direction, NULL), DYNSTEP_INVALID_INPUT,
            "direction of event 2 is 2");
    REFUSES(dynstep_event_count(s, NULL), DYNSTEP_INVALID_INPUT, "count is NULL");
    CHECK(dynstep_delete(&s) == 0);
    CHECK(dynstep_event_count(s, &met) == DYNSTEP_INVALID_HANDLE);
    CHECK(dynstep_set_events(s, 1, 0, 0, NULL, NULL) == DYNSTEP_INVALID_HANDLE);
    CHECK(dynstep_set_event_action(s, 0, 0) == DYNSTEP_INVALID_HANDLE);
    CHECK(dynstep_get_events(s, 0, 0, NULL, NULL, NULL, NULL) == DYNSTEP_INVALID_HANDLE);
    CHECK(dynstep_set_switches(s, 1, 0, 0, NULL) == DYNSTEP_INVALID_HANDLE);
    CHECK(dynstep_begin_within(s, 1.0, 0.0, 0, NULL, 0.0, 0.0, 0.0, 0.0, 0.0, 0, NULL) == DYNSTEP_INVALID_HANDLE);
}

/* ---- A spring that is 4 times as stiff on one side ---- */

typedef struct {
    int side[1];
    int calls_on_wrong_side;
} spring;

/* q = cos t to -sqrt(4) q..: half periods pi and pi/2 */
static int pull(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    spring *p = ctx;
    (void)n, (void)t, (void)v;
    f[0] = -(p->side[0] > 0 ? 1.0 : 4.0) * q[0];
    /* a trial may go beyond the origin, but not by more than a step */
    if (p->side[0] * q[0] < -0.5) p->calls_on_wrong_side++;
    return 0;
}

static int pull_ode(int n, double t, const double *y, double *f, void *ctx)
{
    (void)n;
    f[0] = y[1];
    return pull(1, t, y, y + 1, f + 1, ctx);
}

static int origin(int n, int count, double t, const double *q, const double *v, double *s, void *ctx)
{
    (void)n, (void)count, (void)t, (void)ctx, (void)v;
    s[0] = q[0];
    return 0;
}

/* From 1 at rest: cos t to pi/2, then -sin(2 (t - pi/2))/2 for pi/2, then sin, for pi */
static double exact(double t)
{
    const double pi = acos(-1.0);
    t = fmod(t, 1.5 * pi);
    return t < 0.5 * pi ? cos(t) : t < pi ? -0.5 * sin(2.0 * (t - 0.5 * pi)) : sin(t - pi);
}

static void test_switches(int first_order, int within)
{
    spring p = {{0}, 0};
    intptr_t s = first_order ? dynstep_new_ode(2) : dynstep_new(1);
    const double y0[2] = {1.0, 0.0};
    double q[2];
    int met;
    if (first_order) {
        CHECK(dynstep_set_rhs(s, ADDRESS(pull_ode), ADDRESS(&p)) == 0);
    } else {
        CHECK(dynstep_set_force(s, ADDRESS(pull), ADDRESS(&p)) == 0);
        CHECK(dynstep_set_extrapolation(s, 5, DYNSTEP_HARMONIC, 0, NULL) == 0);
    }
    CHECK(dynstep_set_switches(s, 1, ADDRESS(origin), 0, p.side) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.1), DYNSTEP_INVALID_INPUT, "first");
    CHECK((first_order ? dynstep_start_ode(s, 2, 0.0, y0) : dynstep_start(s, 1, 0.0, y0, y0 + 1)) == 0);
    CHECK(p.side[0] == 1);
    for (int i = 1; i <= 20; i++) {
        const double t_end = 0.5 * i;
        if (within) {
            const double atol[2] = {1e-11, 1e-11};
            CHECK(dynstep_begin_within(s, t_end, 1e-11, 2, atol, 0.0, 0.0, 0.0, 0.0, 0.0, 0, NULL) == 0);
            CHECK(dynstep_proceed(s, 10000, 0, NULL, NULL, NULL, NULL, NULL) == 0);
        } else
            CHECK(dynstep_run(s, t_end, 0.1) == 0);
        CHECK((first_order ? dynstep_get_ode(s, 2, NULL, q, NULL) : dynstep_get(s, 1, NULL, q, NULL, NULL)) == 0);
        /* at most, measured: 6e-15 by extrapolation, 3e-6 by backinterpolation of order 4, 3e-11 within the tolerance */
        CHECK(fabs(q[0] - exact(t_end)) < (within ? 1e-10 : first_order ? 1e-5 : 1e-13));
        CHECK(p.side[0] == (exact(t_end) > 0.0 ? 1 : -1));
    }
    CHECK(p.calls_on_wrong_side == 0);
    CHECK(dynstep_event_count(s, &met) == 0 && met == 0);          /* a switch is no event of the user's */
    /* the same handle without them: the right side keeps one side */
    CHECK(dynstep_set_switches(s, 0, 0, 0, NULL) == 0);
    p.side[0] = 1;
    CHECK((first_order ? dynstep_start_ode(s, 2, 0.0, y0) : dynstep_start(s, 1, 0.0, y0, y0 + 1)) == 0);
    CHECK(dynstep_run(s, 3.0, 0.1) == 0 && p.side[0] == 1);
    CHECK((first_order ? dynstep_get_ode(s, 2, NULL, q, NULL) : dynstep_get(s, 1, NULL, q, NULL, NULL)) == 0);
    CHECK(fabs(q[0] - cos(3.0)) < 1e-7);
    REFUSES(dynstep_set_switches(s, 0, ADDRESS(origin), 0, NULL), DYNSTEP_INVALID_INPUT, "count = 0");
    CHECK(dynstep_delete(&s) == 0);
}

/* Two handles may write into one array in turns */
static void test_shared_sides(void)
{
    spring p = {{0}, 0};
    intptr_t two[2];
    const double q0[2] = {1.0, -0.5}, v0 = 0.0;
    double q;
    for (int k = 0; k < 2; k++) {
        two[k] = dynstep_new(1);
        CHECK(dynstep_set_force(two[k], ADDRESS(pull), ADDRESS(&p)) == 0);
        CHECK(dynstep_set_extrapolation(two[k], 5, DYNSTEP_HARMONIC, 0, NULL) == 0);
        CHECK(dynstep_set_switches(two[k], 1, ADDRESS(origin), 0, p.side) == 0);
        CHECK(dynstep_start(two[k], 1, 0.0, q0 + k, &v0) == 0);
        CHECK(p.side[0] == (k ? -1 : 1));
    }
    for (int i = 0; i < 10; i++) {
        CHECK(dynstep_step(two[0], 0.05) == 0 && p.side[0] == 1);
        CHECK(dynstep_step(two[1], 0.05) == 0 && p.side[0] == -1);
    }
    CHECK(dynstep_get(two[0], 1, NULL, &q, NULL, NULL) == 0 && fabs(q - cos(0.5)) < 1e-13);
    CHECK(dynstep_get(two[1], 1, NULL, &q, NULL, NULL) == 0 && fabs(q + 0.5 * cos(1.0)) < 1e-13);
    for (int k = 0; k < 2; k++) CHECK(dynstep_delete(&two[k]) == 0);
}

static int not_a_number(int n, int count, double t, const double *q, const double *v, double *s, void *ctx)
{
    (void)n, (void)count, (void)q, (void)v, (void)ctx;
    s[0] = t > 0.25 ? strtod("nan", NULL) : 1.0;
    return 0;
}

static int gives_up(int n, int count, double t, const double *q, const double *v, double *s, void *ctx)
{
    (void)n, (void)count, (void)q, (void)v, (void)ctx;
    s[0] = 1.0;
    return t > 0.25 ? -7 : 0;
}

static void test_switch_failures(void)
{
    intptr_t s = dynstep_new(1);
    spring p = {{0}, 0};
    const double q0 = 1.0, v0 = 0.0, one = 1.0;
    double t;
    CHECK(dynstep_set_switches(s, 1, ADDRESS(not_a_number), 0, NULL) == 0);
    REFUSES(dynstep_start(s, 1, 0.0, &q0, &v0), DYNSTEP_INVALID_INPUT, "switches go with one");
    CHECK(dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_DIAGONAL, 0, 0, 1, &one) == 0);
    REFUSES(dynstep_start(s, 1, 0.0, &q0, &v0), DYNSTEP_INVALID_INPUT, "switches go with one");
    CHECK(dynstep_delete(&s) == 0);
    s = dynstep_new(1);
    CHECK(dynstep_set_force(s, ADDRESS(pull), ADDRESS(&p)) == 0);
    CHECK(dynstep_set_switches(s, 1, ADDRESS(not_a_number), 0, NULL) == 0);
    CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.1), DYNSTEP_NOT_FINITE, "switch function 1");
    CHECK(dynstep_get(s, 1, &t, NULL, NULL, NULL) == 0 && fabs(t - 0.2) < 1e-15);
    CHECK(dynstep_start(s, 1, 1.0, &q0, &v0) < 0);
    CHECK(dynstep_set_switches(s, 1, ADDRESS(gives_up), 0, NULL) == 0);
    CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
    REFUSES(dynstep_run(s, 1.0, 0.1), DYNSTEP_CALLBACK_FAILED, "-7");
    CHECK(dynstep_delete(&s) == 0);
}

/* ---- Tolerances ---- */

static int swing(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    (void)n, (void)t, (void)v, (void)ctx;
    f[0] = -q[0];
    return 0;
}

static void test_within(void)
{
    intptr_t s = dynstep_new(1);
    const double q0 = 1.0, v0 = 0.0, two[2] = {1e-6, 1e-4}, three[3] = {1e-6, 1e-6, 1e-6}, zero = 0.0, minus = -1.0;
    double q, t;
    long long counts[DYNSTEP_COUNTS], before;
    CHECK(dynstep_set_force(s, ADDRESS(swing), 0) == 0);
    CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
    REFUSES(dynstep_begin_within(s, 5.0, 1e-6, 0, NULL, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "error");
    CHECK(dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL) == 0);
    REFUSES(dynstep_begin_within(s, 5.0, 1e-6, 0, NULL, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "dynstep_start");
    before = 0;
    for (int k = 4; k <= 10; k += 2) {
        const double tolerance = pow(10.0, -k);
        CHECK(dynstep_start(s, 1, 0.0, &q0, &v0) == 0);
        CHECK(dynstep_begin_within(s, 5.0, tolerance, 1, &tolerance, 0, 0, 0, 0, 0, 0, NULL) == 0);
        CHECK(dynstep_proceed(s, 100000, 0, NULL, NULL, NULL, NULL, NULL) == 0);
        CHECK(dynstep_get(s, 1, NULL, &q, NULL, NULL) == 0 && fabs(q - cos(5.0)) < 5.0 * tolerance);
        CHECK(dynstep_counts(s, counts) == 0 && counts[DYNSTEP_COUNT_STEPS] > before);
        before = counts[DYNSTEP_COUNT_STEPS];
    }
    CHECK(dynstep_begin_within(s, 6.0, 0.0, 2, two, 0, 0, 0.01, 0.02, 0, 0, NULL) == 0);
    CHECK(dynstep_proceed(s, 100000, 0, NULL, NULL, NULL, NULL, NULL) == 0);
    CHECK(dynstep_counts(s, counts) == 0 && counts[DYNSTEP_COUNT_STEPS] >= 50);
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 3, three, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "atol has 3 values");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 1, NULL, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "atol is NULL");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, -1, three, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "n_atol = -1");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 0, NULL, 0, 0, 0, 0, 0, -1, NULL), DYNSTEP_INVALID_INPUT, "n_eval = -1");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 0, NULL, 0, 0, 0, 0, 0, 1, NULL), DYNSTEP_INVALID_INPUT, "t_eval is NULL");
    REFUSES(dynstep_begin_within(s, 9.0, -1e-6, 0, NULL, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "rtol");
    REFUSES(dynstep_begin_within(s, 9.0, 0.0, 1, &zero, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "must be positive");
    REFUSES(dynstep_begin_within(s, 9.0, 0.0, 1, &minus, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "atol(1)");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 0, NULL, -1.0, 0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "atol_lambda");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 0, NULL, 0, -1.0, 0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "atol_psi");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 0, NULL, 0, 0, -1.0, 0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "h_first");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 0, NULL, 0, 0, 0, -1.0, 0, 0, NULL), DYNSTEP_INVALID_INPUT, "h_max");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-6, 0, NULL, 0, 0, 0, 0, -1.0, 0, NULL), DYNSTEP_INVALID_INPUT, "h_min");
    REFUSES(dynstep_begin_within(s, 9.0, 1e-16, 1, &zero, 0, 0, 0, 0, 0, 0, NULL), DYNSTEP_TOLERANCE_TOO_SMALL, "rounding");
    REFUSES(dynstep_proceed(s, 1, 0, NULL, NULL, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT, "dynstep_begin first");
    CHECK(dynstep_begin_within(s, 9.0, 1e-12, 0, NULL, 0, 0, 0.5, 0, 0.4, 0, NULL) == 0);
    REFUSES(dynstep_proceed(s, 10000, 0, NULL, NULL, NULL, NULL, NULL), DYNSTEP_STEP_TOO_SMALL, "h_min");
    CHECK(dynstep_get(s, 1, &t, NULL, NULL, NULL) == 0 && t >= 6.0 && t < 9.0);
    CHECK(dynstep_delete(&s) == 0);
}

int main(void)
{
    char text[DYNSTEP_MESSAGE_LENGTH];
    test_ball(50, 1000);
    test_ball(1, 1000);
    test_ball(7, 1);
    test_pieces();
    test_terminal();
    test_first_order();
    test_failures();
    for (int k = 0; k < 4; k++) test_switches(k % 2, k / 2);
    test_shared_sides();
    test_switch_failures();
    test_within();
    for (int code = DYNSTEP_TOLERANCE_TOO_SMALL; code <= DYNSTEP_EVENT; code++)
        CHECK(dynstep_status_text(code, sizeof text, text) == 0 && !strstr(text, "unknown"));
    return finish();
}
