/* SPDX-License-Identifier: BSD-3-Clause */
/* The C interface: threads with a handle each do not disturb one another. */
#include <pthread.h>

#include "checks.h"

enum { N = 3, THREADS = 4, ROUNDS = 20 };

struct job {
    int who, code;
    double q[N], v[N], a[N];
};

static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    const struct job *job = ctx;
    for (int i = 0; i < n; i++) {
        double left = i > 0 ? q[i - 1] : 0.0, right = i < n - 1 ? q[i + 1] : 0.0;
        f[i] = left - 2.0 * q[i] + right - job->who * q[i] * q[i] * q[i] - 0.1 * v[i] + (t > 1.0 ? 0.5 : 0.0);
    }
    return 0;
}

static void *work(void *argument)
{
    struct job *job = argument;
    const double q0[N] = {1.0, 0.5, -0.25}, v0[N] = {0.0, 0.0, 1.0};
    char text[DYNSTEP_MESSAGE_LENGTH];
    for (int round = 0; round < ROUNDS; round++) {
        intptr_t s = dynstep_new(N);
        job->code = dynstep_set_force(s, ADDRESS(force), ADDRESS(job));
        if (!job->code) job->code = dynstep_set_structure(s, DYNSTEP_BANDED, 1, 1, 1, 0, 0, 0);
        if (!job->code && job->who % 2) job->code = dynstep_set_extrapolation(s, 4, DYNSTEP_ROMBERG, 0, NULL);
        if (!job->code) job->code = dynstep_start(s, N, 0.0, q0, v0);
        if (!job->code) job->code = dynstep_run(s, 2.0, 1.0 / 64.0);
        if (!job->code) job->code = dynstep_get(s, N, NULL, job->q, job->v, job->a);
        /* messages are made here, too */
        if (dynstep_step(s, NAN) != DYNSTEP_INVALID_INPUT || dynstep_message(s, sizeof text, text)) job->code = -99;
        if (dynstep_delete(&s)) job->code = -98;
    }
    return NULL;
}

int main(void)
{
    struct job alone[THREADS] = {{0}}, together[THREADS] = {{0}};
    pthread_t thread[THREADS];
    for (int i = 0; i < THREADS; i++) {
        alone[i].who = together[i].who = i;
        work(&alone[i]);
        CHECK(alone[i].code == 0);
    }
    for (int i = 0; i < THREADS; i++) CHECK(pthread_create(&thread[i], NULL, work, &together[i]) == 0);
    for (int i = 0; i < THREADS; i++) {
        CHECK(pthread_join(thread[i], NULL) == 0);
        CHECK(together[i].code == 0);
        CHECK(!memcmp(alone[i].q, together[i].q, sizeof alone[i].q));
        CHECK(!memcmp(alone[i].v, together[i].v, sizeof alone[i].v));
        CHECK(!memcmp(alone[i].a, together[i].a, sizeof alone[i].a));
    }
    return finish();
}
