/* SPDX-License-Identifier: BSD-3-Clause */
/* Matrices and a sampled load, from C: 50 masses on springs, shaken at the foot by a pulse.  The run is
 * made in pieces; no points are lost between them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "dynstep.h"

enum { N = 50, SAMPLES = 41, ROOM = 16 };

static void stop_on_failure(intptr_t s, int code)
{
    char text[DYNSTEP_MESSAGE_LENGTH];
    if (code >= 0)
        return;
    dynstep_message(s, sizeof text, text);
    fprintf(stderr, "chain: %s\n", text);
    exit(1);
}

int main(void)
{
    static double k[3*N], ground[SAMPLES], pattern[N], q[N], v[N];
    static double t_out[ROOM], q_out[ROOM*N];
    const double dt = 0.05, stiffness = 1.0e3, pi = acos(-1.0);
    double peak = 0.0;
    int i, code, count;
    intptr_t s = dynstep_new(N);

    for (i = 0; i < N; i++) {                  /* K(i,i) in k[1+3i], K(i-1,i) above it, K(i+1,i) below */
        k[1 + 3*i] = i + 1 < N ? 2*stiffness : stiffness;
        if (i > 0)
            k[3*i] = k[2 + 3*(i - 1)] = -stiffness;
        pattern[i] = -1.0;                     /* -M e, and M = 1 */
    }
    for (i = 0; i < SAMPLES; i++)
        ground[i] = sin(pi*i*dt);              /* one wave of 2 s, in m/s^2 */

    dynstep_set_matrix(s, DYNSTEP_MASS, DYNSTEP_IDENTITY, 0, 0, 1, NULL);
    dynstep_set_matrix(s, DYNSTEP_STIFFNESS, DYNSTEP_BANDED, 1, 1, 1, k);
    dynstep_set_load_table(s, 1, SAMPLES, 0.0, dt, NULL, ground, pattern, DYNSTEP_OUTSIDE_ZERO);
    dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL);
    stop_on_failure(s, dynstep_start(s, N, 0.0, q, v));
    stop_on_failure(s, dynstep_begin(s, 6.0, dt/4, 4, 0, NULL));       /* record each fourth step */
    do {
        code = dynstep_proceed(s, 1000, ROOM, &count, t_out, q_out, NULL, NULL);
        stop_on_failure(s, code);
        for (i = 0; i < count; i++)
            peak = fmax(peak, fabs(q_out[i*N + N - 1]));
        printf("%3d points, up to t = %.2f s\n", count, t_out[count - 1]);
    } while (code == DYNSTEP_MORE);
    printf("peak of the free end: %.9f m\n", peak);
    dynstep_delete(&s);
    return 0;
}
