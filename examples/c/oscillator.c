/* SPDX-License-Identifier: BSD-3-Clause */
/* A force of one's own, from C: Duffing's oscillator q'' + c q' + q + q^3 = 0. */
#include <stdint.h>
#include <stdio.h>

#include "dynstep.h"

struct model {
    double damping;
    long forces;
};

static int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    struct model *m = ctx;
    (void)n, (void)t;
    m->forces++;
    f[0] = -m->damping*v[0] - q[0] - q[0]*q[0]*q[0];
    return 0;                      /* > 0: try a smaller step, < 0: give up */
}

static int watch(int n, double t, const double *q, const double *v, const double *a, void *ctx)
{
    (void)n, (void)v, (void)a, (void)ctx;
    if (t > 4.999)
        printf("t = %6.3f   q = %12.9f\n", t, q[0]);
    return 0;                      /* anything else ends the run */
}

int main(void)
{
    struct model model = {0.1, 0};
    double q = 1.0, v = 0.0, t;
    char text[DYNSTEP_MESSAGE_LENGTH];
    intptr_t s = dynstep_new(1);
    int code;

    dynstep_set_force(s, (intptr_t)force, (intptr_t)&model);
    dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL);        /* of Newmark, order 8 */
    dynstep_set_observer(s, (intptr_t)watch, 0);
    dynstep_start(s, 1, 0.0, &q, &v);
    code = dynstep_run(s, 5.5, 0.1);
    dynstep_message(s, sizeof text, text);
    dynstep_get(s, 1, &t, &q, &v, NULL);
    printf("code %d %s\nt = %g, q = %.12f, v = %.12f, %ld forces\n", code, text, t, q, v, model.forces);
    dynstep_delete(&s);
    return code;
}
