/* SPDX-License-Identifier: BSD-3-Clause */
/* A ball that bounces until it rests: an event with an action, in steps by tolerances. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "dynstep.h"

struct ball {
    double restitution, slow;      /* behind a bounce slower than that it lies on the floor */
    int rests;
};

static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    const struct ball *b = ctx;
    (void)n, (void)t, (void)q, (void)v;
    f[0] = b->rests ? 0.0 : -9.81;
    return 0;
}

static int height(int n, int count, double t, const double *q, const double *v, double *s, void *ctx)
{
    const struct ball *b = ctx;
    (void)n, (void)count, (void)t, (void)v;
    s[0] = b->rests ? 1.0 : q[0];  /* where the ball rests there is nothing to watch for */
    return 0;
}

static int bounce(int n, int which, double t, double *q, double *v, void *ctx)
{
    struct ball *b = ctx;
    (void)n, (void)which, (void)t;
    v[0] = -b->restitution*v[0];
    if (v[0] < b->slow) {
        b->rests = 1;
        q[0] = v[0] = 0.0;
    }
    return 1;                      /* something has changed */
}

int main(void)
{
    struct ball ball = {0.75, 1e-3, 0};
    const int down = -1;
    double q = 1.0, v = 0.0, t, times[30], speeds[30], expected, error = 0.0;
    char text[DYNSTEP_MESSAGE_LENGTH];
    intptr_t s = dynstep_new(1);
    int code, count, i;

    dynstep_set_force(s, (intptr_t)force, (intptr_t)&ball);
    dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL);
    dynstep_set_events(s, 1, (intptr_t)height, (intptr_t)&ball, &down, NULL);
    dynstep_set_event_action(s, (intptr_t)bounce, (intptr_t)&ball);
    dynstep_start(s, 1, 0.0, &q, &v);
    dynstep_begin_within(s, 5.0, 1e-6, 0, NULL, 0.0, 0.0, 0.0, 0.0, 0.0, 0, NULL);
    do                             /* in pieces, with the same bits */
        code = dynstep_proceed(s, 50, 0, NULL, NULL, NULL, NULL, NULL);
    while (code == DYNSTEP_MORE);
    dynstep_message(s, sizeof text, text);
    dynstep_get(s, 1, &t, &q, &v, NULL);
    dynstep_event_count(s, &count);
    printf("code %d %s\nt = %g, q = %g, v = %g, %d bounces\n", code, text, t, q, v, count);
    if (code != 0 || count != 30)
        return 1;
    dynstep_get_events(s, 0, count, NULL, times, NULL, speeds);
    expected = sqrt(2.0/9.81);     /* in closed form */
    for (i = 0; i < count; i++) {
        error = fmax(error, fabs(times[i] - expected));
        expected += 2.0*sqrt(2.0/9.81)*pow(ball.restitution, i + 1);
    }
    printf("it rests from t = %f, largest error of a time %.1e\n", times[count - 1], error);
    dynstep_delete(&s);
    return error > 1e-13 || v != 0.0;
}
