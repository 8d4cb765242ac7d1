/* SPDX-License-Identifier: BSD-3-Clause */
/* The C interface: stability, accuracy and damping. */
#include "checks.h"

enum { MOST = DYNSTEP_MAX_DEGREE };

static const double none[1] = {1.0}, euler[2] = {1.0, -1.0};       /* backward Euler, 1/(1 - z) */

static void test_facts(void)
{
    intptr_t s = dynstep_new(1);
    double num[MOST + 1], den[MOST + 1], numbers[DYNSTEP_STABILITY_NUMBERS], intervals[2 * (MOST + 2)];
    double poles[2 * MOST], zeros[2 * MOST];
    int flags[DYNSTEP_STABILITY_FLAGS];
    CHECK(dynstep_rational_coefficients(s, DYNSTEP_FAMILY_TAYLOR, 4, 5, 0.47, num, den) == 0);
    CHECK(num[0] == 1.0 && num[5] == 0.0 && fabs(den[1] + 0.53) < 1e-15);
    CHECK(dynstep_stability_facts_of(s, 5, num, 6, den, flags, numbers, intervals, poles, zeros) == 0);
    CHECK(flags[DYNSTEP_STABILITY_P] == 4 && flags[DYNSTEP_STABILITY_Q] == 5 && flags[DYNSTEP_STABILITY_ORDER] == 4);
    CHECK(flags[DYNSTEP_STABILITY_IS_A] == 0 && flags[DYNSTEP_STABILITY_IS_I] == 0);
    CHECK(flags[DYNSTEP_STABILITY_INTERVALS] == 2 && intervals[0] == 0.0 && isinf(intervals[3]));
    CHECK(fabs(numbers[DYNSTEP_STABILITY_ANGLE] - 81.49127969126) < 1e-9);
    CHECK(isinf(numbers[DYNSTEP_STABILITY_REAL_LIMIT]));
    CHECK(fabs(numbers[DYNSTEP_STABILITY_POSITIVE_LIMIT] - 16.61666) < 1e-5);
    int left = 0;
    for (int i = 0; i < 5; i++) left += poles[2 * i] < 0.0;
    CHECK(left == 2);
    CHECK(dynstep_rational_coefficients(s, DYNSTEP_FAMILY_FEHLBERG, 99, -1, 0.5, num, den) == 0);
    CHECK(fabs(num[6] * 64.0 * 2080.0 - 1.0) < 1e-14);
    CHECK(dynstep_rational_coefficients(s, DYNSTEP_FAMILY_PADE, 3, 4, NAN, num, den) == 0);
    CHECK(dynstep_stability_facts_of(s, 4, num, 5, den, flags, NULL, NULL, NULL, NULL) == 0);
    CHECK(flags[DYNSTEP_STABILITY_IS_L] == 1 && flags[DYNSTEP_STABILITY_ORDER] == 7);
    REFUSES(dynstep_rational_coefficients(s, 4, 1, 1, 0.5, num, den), DYNSTEP_INVALID_INPUT, "family = 4");
    REFUSES(dynstep_rational_coefficients(s, DYNSTEP_FAMILY_PADE, 9, 1, 0.5, num, den), DYNSTEP_INVALID_INPUT, "p = 9");
    REFUSES(dynstep_stability_facts_of(s, 0, num, 5, den, flags, NULL, NULL, NULL, NULL), DYNSTEP_INVALID_INPUT,
            "num or den");
    CHECK(dynstep_delete(&s) == 0);
}

static void test_domain(void)
{
    intptr_t s = dynstep_new_ode(1);
    double angles[8], crossings[8], points[2 * 4000];
    int begins[8], first[64], counts[3];
    CHECK(dynstep_stability_rays(s, 1, none, 2, euler, 3, 0, NULL, NULL, NULL, 0, NULL, counts) == 0);
    CHECK(counts[0] == 3 && counts[1] == 1);
    CHECK(dynstep_stability_rays(s, 1, none, 2, euler, 3, 8, angles, begins, first, 8, crossings, counts) == 0);
    CHECK(begins[0] == -1 && begins[2] == 1 && first[0] == 0 && first[1] == 1 && first[3] == 1);
    CHECK(fabs(crossings[0] - 2.0) < 1e-14);
    CHECK(dynstep_stability_boundary(s, 1, none, 2, euler, 64, first, 4000, points, counts) == 0);
    CHECK(counts[0] == 1 && counts[2] == 1 && first[1] == counts[1]);
    double worst = 0.0;
    for (int i = 0; i < counts[1]; i++) worst = fmax(worst, fabs(hypot(points[2 * i] - 1.0, points[2 * i + 1]) - 1.0));
    CHECK(worst < 1e-12);
    REFUSES(dynstep_stability_rays(s, 1, none, 2, euler, 1, 0, NULL, NULL, NULL, 0, NULL, counts), DYNSTEP_INVALID_INPUT,
            "rays = 1");
    CHECK(dynstep_delete(&s) == 0);
}

static void test_values(void)
{
    intptr_t s = dynstep_new(1);
    double z[6] = {-1.0, 0.0, 0.0, 1.0, 1.0, 0.0}, r[6], radii[3], h[1], x0[2] = {1.0, 0.0}, angle[1] = {1.5707963267948966};
    double windows[4];
    int count;
    CHECK(dynstep_rational_values(s, 1, none, 2, euler, 3, z, r) == 0);
    CHECK(r[0] == 0.5 && r[1] == 0.0 && fabs(r[2] - 0.5) < 1e-15 && fabs(r[3] - 0.5) < 1e-15 && isinf(r[4]));
    CHECK(dynstep_set_newmark(s, 0.25, 0.5) == 0);
    CHECK(dynstep_spectral_radii(s, 2, z, radii) == 0);
    CHECK(fabs(radii[0] - 1.0 / 3.0) < 1e-7 && fabs(radii[1] - 1.0) < 1e-14);
    CHECK(dynstep_accuracy_limits(s, 1, none, 2, euler, 1, angle, x0, 0.01, 1.0, h) == 0);
    CHECK(h[0] > 0.001 && h[0] < 0.1);
    CHECK(dynstep_alpha_windows(s, DYNSTEP_FAMILY_TAYLOR, 4, 5, DYNSTEP_I_STABLE, 2, windows, &count) == 0);
    CHECK(count == 1 && fabs(windows[0] - 0.4362200209669922) < 1e-10 && fabs(windows[1] - 0.4486146148450476) < 1e-10);
    REFUSES(dynstep_rational_values(s, 1, none, 2, euler, -1, z, r), DYNSTEP_INVALID_INPUT, "negative");
    REFUSES(dynstep_spectral_radii(s, 1, NULL, radii), DYNSTEP_INVALID_INPUT, "NULL");
    REFUSES(dynstep_accuracy_limits(s, 1, none, 2, euler, 1, angle, NULL, 0.01, 1.0, h), DYNSTEP_INVALID_INPUT, "x0 is NULL");
    REFUSES(dynstep_accuracy_limits(s, 1, none, 2, euler, 1, angle, x0, -1.0, 1.0, h), DYNSTEP_INVALID_INPUT, "tolerance");
    REFUSES(dynstep_alpha_windows(s, DYNSTEP_FAMILY_PADE, 1, 1, DYNSTEP_I_STABLE, 2, windows, &count), DYNSTEP_INVALID_INPUT,
            "halves");
    CHECK(dynstep_delete(&s) == 0);
}

int main(void)
{
    test_facts();
    test_domain();
    test_values();
    return finish();
}
