/* SPDX-License-Identifier: BSD-3-Clause */
/* dynstep: time integrators for mechanical systems, M(t,q,v) q'' = f(t,q,v), free or with constraints, and for
 * first-order systems, y' = f(t,y).  The C interface.
 *
 *   intptr_t s = dynstep_new(n);
 *   dynstep_set_force(s, (intptr_t)force, (intptr_t)&data);
 *   dynstep_set_extrapolation(s, 4, DYNSTEP_HARMONIC, 0, NULL);
 *   dynstep_start(s, n, 0.0, q, v);
 *   if (dynstep_run(s, 10.0, 0.01) < 0) { dynstep_message(s, sizeof text, text); puts(text); }
 *   dynstep_get(s, n, &t, q, v, a);
 *   dynstep_delete(&s);
 *
 * HANDLES.  A handle is one integrator: system, method, state, run, status.  Handles are independent
 * of each other and may live on different threads; one handle belongs to one thread at a time.  A
 * deleted or wild handle gives DYNSTEP_INVALID_HANDLE; that is a help in finding mistakes, not a
 * guarantee.  A call on a handle from its own user function gives DYNSTEP_IN_USE and changes nothing.
 *
 * ORDER.  The set functions may come in any order.  What is set takes effect at dynstep_start; after
 * a set function, dynstep_start must be called (again) before the next step or run.  A set function
 * that is called again replaces what it set before; one that fails changes nothing.
 *
 * MECHANICAL SYSTEMS belong to handles of dynstep_new.  Two kinds:
 *   general   dynstep_set_force, with dynstep_set_mass or a constant mass by dynstep_set_matrix,
 *             dynstep_set_tangent, dynstep_set_structure, dynstep_set_energy where they apply; with
 *             constraints, dynstep_set_constraint and its relatives;
 *   linear    M q'' + C q' + K q = p(t): no force, but dynstep_set_matrix, and dynstep_set_load
 *             or dynstep_set_load_table (the one set last counts) where there is a load, and
 *             dynstep_set_coupling where there is feedback.
 * What is not set: M is the identity, C, K and p are zero, tangents are taken by differences.
 *
 * FIRST-ORDER SYSTEMS belong to handles of dynstep_new_ode.  Two kinds:
 *   general   y' = f(t,y): dynstep_set_rhs, and dynstep_set_jacobian where it applies;
 *   linear    y' = A y + b(t): dynstep_set_system_matrix, and dynstep_set_source or
 *             dynstep_set_load_table (the one set last counts) where there is a source.
 * They start by dynstep_start_ode and are asked by dynstep_get_ode.  In the functions for runs y has the place
 * of q, y' that of a, and v is not there: dynstep_proceed does not write v_out, and functions of an observer, of events
 * and of switches get v = NULL.
 * A function that is for the other kind of handle gives DYNSTEP_INVALID_INPUT and changes nothing.
 *
 * FUNCTIONS AND CONTEXTS are passed as addresses, (intptr_t)function and (intptr_t)&data.  A function
 * address of 0 takes the function away.  They must stay valid while the handle uses them.  User
 * functions return 0 (fine), > 0 (outside the model's domain: a smaller step may help) or < 0 (give
 * up); they must return, neither by longjmp nor by a C++ exception.  Their array arguments are theirs
 * only during the call; a value that is not finite is reported as DYNSTEP_NOT_FINITE.
 *
 * ARRAYS that are passed in are copied.  Vectors have n entries.  Matrices are stored by columns, as
 * in LAPACK:
 *   DYNSTEP_ZERO, DYNSTEP_IDENTITY   nothing stored
 *   DYNSTEP_DIAGONAL                 a[i]                              is A(i,i)
 *   DYNSTEP_BANDED                   a[(ku + i - j) + j*(kl + ku + 1)] is A(i,j), -ku <= i-j <= kl
 *   DYNSTEP_DENSE                    a[i + j*n]                        is A(i,j)      (i, j from 0)
 * with 0 <= kl, ku < n read for DYNSTEP_BANDED only.  A symmetric matrix is stored whole.  Flags are 0
 * or 1.
 *
 * CODES.  Functions return one of the codes below unless they say otherwise: 0 done, > 0 done with
 * news, < 0 failed.  A failed run leaves the state at the last accepted step.  dynstep_message gives
 * the sentence that belongs to the last code of a handle; it counts components, rows, samples and times
 * from 1. */
#ifndef DYNSTEP_H
#define DYNSTEP_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum dynstep_code {
    DYNSTEP_SUCCESS = 0,
    DYNSTEP_STOPPED = 1,             /* an observer asked to stop */
    DYNSTEP_MORE = 2,                /* allowance of steps or room for points used up: call again */
    DYNSTEP_EVENT = 3,               /* a terminal event was met */
    DYNSTEP_INVALID_INPUT = -1,      /* an argument is out of its range; the message names it */
    DYNSTEP_CALLBACK_FAILED = -2,    /* a user function refused */
    DYNSTEP_NOT_CONVERGED = -3,      /* Newton's iteration did not converge */
    DYNSTEP_SINGULAR_MATRIX = -4,    /* a matrix is singular or indefinite */
    DYNSTEP_STEP_TOO_SMALL = -5,     /* the step length reached its lower limit */
    DYNSTEP_NO_MEMORY = -6,          /* an allocation failed */
    DYNSTEP_INCONSISTENT_START = -7, /* the start does not fit the equations */
    DYNSTEP_TOO_MANY_STEPS = -8,     /* a limit on steps was reached */
    DYNSTEP_IN_USE = -9,             /* called from a user function of the same handle */
    DYNSTEP_NOT_FINITE = -10,        /* a user function gave NaN or infinity */
    DYNSTEP_FILE_ERROR = -11,        /* a file cannot be read or is not what it should be */
    DYNSTEP_INVALID_HANDLE = -12,    /* not a handle, or one that was deleted */
    DYNSTEP_TOO_MANY_EVENTS = -13,   /* events one after the other without a step between: chatter, bounces that come to rest */
    DYNSTEP_TOLERANCE_TOO_SMALL = -14    /* rounding does not allow the accuracy asked for */
};

enum dynstep_kind {                  /* how a matrix is stored */
    DYNSTEP_ZERO = -1, DYNSTEP_IDENTITY = 0, DYNSTEP_DIAGONAL = 1, DYNSTEP_BANDED = 2, DYNSTEP_DENSE = 3
};

enum dynstep_matrix {                /* which matrix of a linear system */
    DYNSTEP_MASS = 1, DYNSTEP_DAMPING = 2, DYNSTEP_STIFFNESS = 3
};

enum dynstep_jacobian {              /* which pattern */
    DYNSTEP_CONSTRAINT_JACOBIAN = 1, /* G = dg/dq */
    DYNSTEP_VELOCITY_JACOBIAN = 2    /* K = dk/dv */
};

enum dynstep_outside {               /* the load before the first and after the last sample */
    DYNSTEP_OUTSIDE_ZERO = 0, DYNSTEP_OUTSIDE_HOLD = 1
};

enum dynstep_sequence {              /* sub-steps of the rows of an extrapolation table */
    DYNSTEP_ROMBERG = 1,             /* 1, 2, 4, 8, 16, ... */
    DYNSTEP_BULIRSCH = 2,            /* 1, 2, 4, 6, 8, 12, 16, 24, ... */
    DYNSTEP_HARMONIC = 3,            /* 1, 2, 3, 4, ... */
    DYNSTEP_DOUBLE_HARMONIC = 4,     /* 2, 4, 6, 8, ... */
    DYNSTEP_CUSTOM = 5,              /* the caller's own numbers */
    DYNSTEP_AUTOMATIC = 6            /* DYNSTEP_HARMONIC, under tolerances below 1e-13 DYNSTEP_DOUBLE_HARMONIC */
};

enum dynstep_estimate {              /* of the errors of SOI2's steps */
    DYNSTEP_ESTIMATE_LARGER = 1,     /* that along the constraints, but at least a part of the raw one */
    DYNSTEP_ESTIMATE_PROJECTED = 2,  /* that along the constraints */
    DYNSTEP_ESTIMATE_RAW = 3         /* as it comes, with the part that the constraints take away */
};

enum dynstep_halves {                /* of dynstep_set_backinterpolation */
    DYNSTEP_HALVES_TAYLOR = 1,       /* Runge-Kutta halves of orders p and q */
    DYNSTEP_HALVES_FEHLBERG = 2      /* RKF45's fifth order both ways, as in the thesis's listings */
};

enum dynstep_controller {            /* of dynstep_begin_controlled: the next step after one with the error err */
    DYNSTEP_STANDARD = 1,            /* 0.8 h (tau/err)^k */
    DYNSTEP_PI = 2                   /* 0.8 h (tau/err)^(0.3 k) (err_before/err)^(0.4 k) */
};

enum dynstep_safety_place {          /* of the 0.8 in DYNSTEP_PI */
    DYNSTEP_SAFETY_IN_FRONT = 1,     /* as above */
    DYNSTEP_SAFETY_INSIDE = 2        /* h (0.8 tau/err)^(0.3 k) ..., as in the thesis's listings */
};

enum dynstep_variant {               /* of dynstep_set_soi2 */
    DYNSTEP_SOI2 = 1,                /* Jay & Negrut 2008, eqs. (13), (14) */
    DYNSTEP_REDUCED = 2,             /* their section 6: one set of multipliers psi */
    DYNSTEP_INDEX3 = 3               /* without the constraints on velocities: a baseline to compare with */
};

enum dynstep_mass_at {               /* M_alpha of a step */
    DYNSTEP_MASS_STORED = 1,         /* as the step before left it, corrected by (14b) */
    DYNSTEP_MASS_RECOMPUTED = 2      /* evaluated anew */
};

enum dynstep_form {                  /* how a rational step is put together from its poles */
    DYNSTEP_FORM_AUTOMATIC = 0,      /* a sum where it loses less than a factor of 100 of rounding, else a product */
    DYNSTEP_FORM_PARALLEL = 1,       /* a sum of partial fractions, the fastest; not where p > q */
    DYNSTEP_FORM_PRODUCT = 2,        /* one pair of poles after the other */
    DYNSTEP_FORM_REFINED = 3         /* and each solution corrected by its residual: undamped runs do not drift */
};

enum dynstep_start_mode {            /* a start that is off the constraints */
    DYNSTEP_START_PROJECT = 1,       /* is moved onto them, by the smallest change in the norm of M */
    DYNSTEP_START_REFUSE = 2,        /* gives DYNSTEP_INCONSISTENT_START */
    DYNSTEP_START_KEEP = 3           /* is taken as it is */
};

enum dynstep_count {                 /* places in the counters of dynstep_counts */
    DYNSTEP_COUNT_STEPS = 0, DYNSTEP_COUNT_SUBSTEPS, DYNSTEP_COUNT_REJECTIONS, DYNSTEP_COUNT_FORCES,
    DYNSTEP_COUNT_MASSES, DYNSTEP_COUNT_TANGENTS, DYNSTEP_COUNT_FACTORIZATIONS, DYNSTEP_COUNT_SOLVES,
    DYNSTEP_COUNT_NEWTON_ITERATIONS, DYNSTEP_COUNT_HALVINGS, DYNSTEP_COUNT_CONSTRAINTS,
    DYNSTEP_COUNTS                   /* how many there are: 11 */
};

enum dynstep_fact {                  /* places in the integers of dynstep_properties */
    DYNSTEP_FACT_ORDER = 0,          /* of q and v */
    DYNSTEP_FACT_ACCELERATION_ORDER, /* of a */
    DYNSTEP_FACT_MULTIPLIER_ORDER,   /* 0: takes no constraints */
    DYNSTEP_FACT_ERROR_ORDER,        /* of the error estimate; 0: none */
    DYNSTEP_FACT_STAGES,             /* implicit solves (or force evaluations) a step */
    DYNSTEP_FACT_SYMMETRIC,          /* 1: may be the base of an extrapolation */
    DYNSTEP_FACT_MECHANICAL,         /* 1: needs a mechanical system */
    DYNSTEP_FACTS                    /* how many there are: 7 */
};

enum dynstep_family {                /* of stability functions R(z) */
    DYNSTEP_FAMILY_TAYLOR = 1,       /* P_p(alpha z)/P_q(-(1 - alpha) z), P_k: Taylor polynomial of e^z, degree k <= 6 */
    DYNSTEP_FAMILY_FEHLBERG = 2,     /* the same with the polynomial of RKF45's fifth order, z^6/2080, in both places */
    DYNSTEP_FAMILY_PADE = 3          /* Pade's approximation, p, q <= 8 */
};

enum dynstep_property {              /* of dynstep_alpha_windows */
    DYNSTEP_I_STABLE = 1,            /* |R(iy)| <= 1 for all y */
    DYNSTEP_A_STABLE = 2,            /* |R(z)| <= 1 for Re z <= 0 */
    DYNSTEP_F_STABLE = 3,            /* ... and for no other z */
    DYNSTEP_L_STABLE = 4             /* A-stable, and R(infinity) = 0 */
};

enum dynstep_stability_flag {        /* places in the flags of dynstep_stability_facts_of */
    DYNSTEP_STABILITY_P = 0, DYNSTEP_STABILITY_Q,     /* degrees of N and D */
    DYNSTEP_STABILITY_ORDER,                          /* R(z) - e^z = O(z^(order + 1)) */
    DYNSTEP_STABILITY_INTERVALS,                      /* how many intervals of the imaginary axis */
    DYNSTEP_STABILITY_IS_I, DYNSTEP_STABILITY_IS_A, DYNSTEP_STABILITY_IS_F, DYNSTEP_STABILITY_IS_L,   /* 1: has it */
    DYNSTEP_STABILITY_FLAGS                           /* how many there are: 8 */
};

enum dynstep_stability_number {      /* places in the numbers; HUGE_VAL stands for infinity */
    DYNSTEP_STABILITY_ANGLE = 0,     /* phi of A(phi) in degrees: |R| <= 1 for |arg(-z)| <= phi */
    DYNSTEP_STABILITY_AT_INFINITY,   /* |R(infinity)| */
    DYNSTEP_STABILITY_GROWTH,        /* largest |R(iy)| - 1 */
    DYNSTEP_STABILITY_GROWTH_AT,     /* a y where it is */
    DYNSTEP_STABILITY_REAL_LIMIT,    /* |R(x)| <= 1 for -limit <= x <= 0 */
    DYNSTEP_STABILITY_POSITIVE_LIMIT,/* end of the unstable region on the positive real axis */
    DYNSTEP_STABILITY_NUMBERS        /* how many there are: 6 */
};

enum dynstep_beam {                  /* of the flexible arm */
    DYNSTEP_EULER_BERNOULLI = 1,     /* rotation is the slope of the deflection */
    DYNSTEP_TIMOSHENKO = 2           /* with shear deformation */
};

enum dynstep_arm_variant {           /* of its matrices */
    DYNSTEP_ARM_CONSISTENT = 0,      /* the equations of the thesis */
    DYNSTEP_ARM_LISTING = 1,         /* Euler-Bernoulli, with the wrong sign of its listing, which pins the tip */
    DYNSTEP_ARM_SYMMETRIC = 2        /* Timoshenko, K from the strain energy */
};

#define DYNSTEP_ARM_PARAMETERS 8
#define DYNSTEP_ARM_GAINS 4
#define DYNSTEP_MAX_DEGREE 16        /* of N and D */
#define DYNSTEP_MAX_LEVELS 12        /* of an extrapolation */
#define DYNSTEP_MESSAGE_LENGTH 321   /* room for any message, with its final zero */

/* ---- User functions ---- */

/* f(t,q,v), all forces on the right-hand side */
typedef int dynstep_force(int n, double t, const double *q, const double *v, double *f, void *ctx);

/* M(t,q,v) in the storage of the kind that was set, zero on entry */
typedef int dynstep_mass(int n, double t, const double *q, const double *v, double *m, void *ctx);

/* K = -d(f - M a)/dq and C = -d(f - M a)/dv at fixed a, in the storage of the kind that was set, zero
 * on entry; c is NULL where the system is velocity-free */
typedef int dynstep_tangent(int n, double t, const double *q, const double *v, const double *a, double *k,
                            double *c, void *ctx);

/* Energy of the system, conserved or not */
typedef int dynstep_energy_function(int n, double t, const double *q, const double *v, double *energy,
                                    void *ctx);

/* g(t,q), holonomic constraints: m of them */
typedef int dynstep_constraint(int n, int m, double t, const double *q, double *g, void *ctx);

/* G = dg/dq by rows, gq[j + i*n] is G(i,j), or its values in the order of the pattern that was set; and
 * gt = dg/dt.  Both are zero on entry. */
typedef int dynstep_constraint_jacobian(int n, int m, double t, const double *q, double *gq, double *gt,
                                        void *ctx);

/* c = g'' - G q'' = g_tt + 2 g_tq v + g_qq(v,v) */
typedef int dynstep_constraint_curvature(int n, int m, double t, const double *q, const double *v, double *c,
                                         void *ctx);

/* k(t,q,v), constraints on velocities: p of them */
typedef int dynstep_velocity_constraint(int n, int p, double t, const double *q, const double *v, double *k,
                                        void *ctx);

/* K = dk/dv, stored as G is and zero on entry */
typedef int dynstep_velocity_jacobian(int n, int p, double t, const double *q, const double *v, double *kv,
                                      void *ctx);

/* c = k' - K q'' = k_t + k_q v */
typedef int dynstep_velocity_curvature(int n, int p, double t, const double *q, const double *v, double *c,
                                       void *ctx);

/* r(t,q,v,lambda,psi), the forces by which the constraints act, where they are not -G' lambda - K' psi */
typedef int dynstep_reaction(int n, int m, int p, double t, const double *q, const double *v,
                             const double *lambda, const double *psi, double *r, void *ctx);

/* dr/dlambda and dr/dpsi by columns, rl[i + j*n] is dr(i)/dlambda(j).  Both are zero on entry. */
typedef int dynstep_reaction_jacobian(int n, int m, int p, double t, const double *q, const double *v,
                                      const double *lambda, const double *psi, double *rl, double *rp, void *ctx);

/* k = -dr/dq and c = -dr/dv in the storage that dynstep_set_structure tells, zero on entry; c is NULL where
 * the system is velocity-free */
typedef int dynstep_reaction_tangent(int n, int m, int p, double t, const double *q, const double *v,
                                     const double *lambda, const double *psi, double *k, double *c, void *ctx);

/* p(t) of a linear system, b(t) of a linear first-order system */
typedef int dynstep_load(int n, double t, double *p, void *ctx);

/* f(t,y), the right-hand side of a first-order system */
typedef int dynstep_rhs(int n, double t, const double *y, double *f, void *ctx);

/* df/dy in the storage of the kind that was set, zero on entry */
typedef int dynstep_jacobian_function(int n, double t, const double *y, double *jac, void *ctx);

/* Sees each accepted step of a run (q = y, v = NULL and a = y' for a first-order system); a result other than 0 ends the run with DYNSTEP_STOPPED */
typedef int dynstep_observer(int n, double t, const double *q, const double *v, const double *a, void *ctx);

/* s[count] at t, q and v (y and NULL for a first-order system): functions whose zeros are events of a run, or are the
 * surfaces where the right side of a system is not smooth.  Smooth themselves where the motion is. */
typedef int dynstep_event_function(int n, int count, double t, const double *q, const double *v, double *s, void *ctx);
typedef dynstep_event_function dynstep_switch_function;

/* What is done at event `which` (from 0) before the run goes on.  0: nothing is changed, whatever q and v (y and NULL)
 * hold now; 1: it has written q or v, or has changed parameters of the system; < 0: give up. */
typedef int dynstep_event_action(int n, int which, double t, double *q, double *v, void *ctx);

/* ---- Handles ---- */

/* Version of the library, 10000*major + 100*minor + patch */
int dynstep_version(void);

/* Integrator of a system of n >= 1 coordinates, by default with Newmark's method, beta = 1/4 and
 * gamma = 1/2.  0 where n < 1 or n > INT_MAX/2, where the memory is used up, or where addresses have more
 * than 48 bits. */
intptr_t dynstep_new(int n);

/* Integrator of a first-order system of n >= 1 unknowns, by default with backinterpolation, p = q = 4, alpha = 1/2.  0 where n < 1, and as above. */
intptr_t dynstep_new_ode(int n);

/* Free the integrator and set *handle to 0.  A handle of 0 is left alone. */
int dynstep_delete(intptr_t *handle);

/* Sentence that belongs to the last code of the handle, blank on success, cut to length - 1 characters
 * and ended by zero.  DYNSTEP_MESSAGE_LENGTH is always enough.  Returns 0; for a bad handle, and for one
 * in use, it returns that code and says so in the buffer. */
int dynstep_message(intptr_t handle, int length, char *buffer);

/* A few words for a code, cut and ended in the same way; any code is allowed */
int dynstep_status_text(int code, int length, char *buffer);

/* ---- The system: general ---- */

int dynstep_set_force(intptr_t handle, intptr_t fun, intptr_t ctx);                     /* dynstep_force */

/* Mass by a function: kind is DYNSTEP_DIAGONAL, _BANDED or _DENSE; constant = 1 where M depends on
 * nothing.  fun = 0 goes back to the identity (the other arguments are then not read). */
int dynstep_set_mass(intptr_t handle, intptr_t fun, intptr_t ctx, int kind, int kl, int ku, int symmetric,
                     int constant);                                                      /* dynstep_mass */

/* Tangents by a function, in the storage that dynstep_set_structure tells; fun = 0: by differences */
int dynstep_set_tangent(intptr_t handle, intptr_t fun, intptr_t ctx);                 /* dynstep_tangent */

/* What the library may assume of K and C, and of the force.  Without this call: dense, not
 * symmetric, not constant, not linear, not velocity-free.
 *   kind, kl, ku     DYNSTEP_DIAGONAL, _BANDED or _DENSE
 *   symmetric        K and C are symmetric
 *   constant         K and C depend on nothing
 *   linear           f is linear in q and v, and M depends on t at most: one Newton correction is exact
 *                    (believed where a tangent function is given; differences are too rough for that)
 *   velocity_free    f and M do not depend on v: there is no C
 * What is declared is believed; dynstep_check compares it with what the functions do. */
int dynstep_set_structure(intptr_t handle, int kind, int kl, int ku, int symmetric, int constant, int linear,
                          int velocity_free);

int dynstep_set_energy(intptr_t handle, intptr_t fun, intptr_t ctx);          /* dynstep_energy_function */

/* ---- The system: constraints ---- */

/* M q'' = f + r,  g(t,q) = 0,  k(t,q,v) = 0, with multipliers lambda of g and psi of k, and the reactions
 * r = -G' lambda - K' psi unless dynstep_set_reaction gives other ones.  Constraints go with a force. */

/* m constraints g, 1 <= m <= n.  fun = 0 takes them away, with their Jacobian, curvature and pattern (m is
 * then not read). */
int dynstep_set_constraint(intptr_t handle, int m, intptr_t fun, intptr_t ctx);     /* dynstep_constraint */

/* fun = 0: by differences, here and below */
int dynstep_set_constraint_jacobian(intptr_t handle, intptr_t fun, intptr_t ctx);
int dynstep_set_constraint_curvature(intptr_t handle, intptr_t fun, intptr_t ctx);

/* p constraints k, 1 <= p <= n, in the same way */
int dynstep_set_velocity_constraint(intptr_t handle, int p, intptr_t fun, intptr_t ctx);
int dynstep_set_velocity_jacobian(intptr_t handle, intptr_t fun, intptr_t ctx);
int dynstep_set_velocity_curvature(intptr_t handle, intptr_t fun, intptr_t ctx);

/* fun = 0: r = -G' lambda - K' psi; takes the Jacobian of a reaction away, too */
int dynstep_set_reaction(intptr_t handle, intptr_t fun, intptr_t ctx);                /* dynstep_reaction */
int dynstep_set_reaction_jacobian(intptr_t handle, intptr_t fun, intptr_t ctx);

/* Of any reaction; fun = 0: left out of the iteration matrix, on which the speed of Newton's iteration
 * depends, nothing else */
int dynstep_set_reaction_tangent(intptr_t handle, intptr_t fun, intptr_t ctx);

/* Places of G or K (`which`, enum dynstep_jacobian) that may differ from zero: row i has those columns
 * column[first[i]] .. column[first[i+1] - 1], which increase.  rows is m or p; first has rows + 1 numbers,
 * first[0] = 0.  rows = 0: all places (first and column are then not read). */
int dynstep_set_pattern(intptr_t handle, int which, int rows, const int *first, const int *column);

/* Order of the unknowns in the band of the equations, best body by body: a permutation of 0 .. n-1
 * (coordinates), n .. n+m-1 (lambda), n+m .. n+m+p-1 (psi).  count = n + m + p; 0: the library looks for
 * an order. */
int dynstep_set_constraint_order(intptr_t handle, int count, const int *order);

/* ---- The system: linear ---- */

/* Matrix `which` (enum dynstep_matrix).  DYNSTEP_ZERO and _IDENTITY read no array; M must not be zero.
 * A mass matrix may also go with a force; it replaces a mass function, and the other way round. */
int dynstep_set_matrix(intptr_t handle, int which, int kind, int kl, int ku, int symmetric, const double *a);

int dynstep_set_load(intptr_t handle, intptr_t fun, intptr_t ctx);                       /* dynstep_load */

/* Load (or source of a first-order system) by samples, p(t) = B s(t) with s linear between its samples.
 *   signals      how many signals
 *   ns           how many samples of each, >= 2
 *   t0, dt       time of the first sample and interval > 0; read where times is NULL
 *   times        [ns] increasing, or NULL
 *   samples      signal j at sample i in samples[j + i*signals]
 *   pattern      B: coordinate i of signal j in pattern[i + j*n]; NULL: the identity, signals = n
 *   outside      enum dynstep_outside
 * ns = 0 takes the table away (the other arguments are then not read). */
int dynstep_set_load_table(intptr_t handle, int signals, int ns, double t0, double dt, const double *times,
                           const double *samples, const double *pattern, int outside);

/* Feedback of a linear system: M q'' + C q' + K q = p(t) - b (k.q + c.q'), a force along b by gains k and c of any
 * coordinates, which would fill the band of C and K.  b, k, c: [n]; k or c NULL: zeros; b NULL takes the coupling
 * away (the others are then not read).  Newmark's method and its relatives refuse a coupling. */
int dynstep_set_coupling(intptr_t handle, const double *b, const double *k, const double *c);

/* ---- The system: of first order ---- */

int dynstep_set_rhs(intptr_t handle, intptr_t fun, intptr_t ctx);                       /* dynstep_rhs */

/* Jacobian by a function, or by differences (fun = 0), in the storage of kind DYNSTEP_DIAGONAL, _BANDED (with kl,
 * ku) or _DENSE.  Without this call: dense, by differences.  What is declared is believed: with entries outside of
 * it the iteration of a step converges slowly, or not at all.  The result does not depend on it otherwise. */
int dynstep_set_jacobian(intptr_t handle, intptr_t fun, intptr_t ctx, int kind, int kl,
                         int ku);                                         /* dynstep_jacobian_function */

/* A of y' = A y + b(t); any kind of enum dynstep_kind */
int dynstep_set_system_matrix(intptr_t handle, int kind, int kl, int ku, const double *a);

/* b(t); a table is given by dynstep_set_load_table */
int dynstep_set_source(intptr_t handle, intptr_t fun, intptr_t ctx);                    /* dynstep_load */

/* ---- The system: switches ---- */

/* A right side (or force) that is smooth on each side of surfaces alone - a contact, a dead zone, dry friction - declares
 * them: `count` >= 1 functions that change their sign there.  A run ends a step at each crossing, and starts anew behind
 * it, with the accuracy of the method.
 *   side     int array [count] of the caller, which must stay valid, or NULL.  The library writes +1 or -1 there: the
 *            side of each surface that the right side is taken on.  It changes between steps alone, so that a right side
 *            that asks side[i] in place of the sign of s[i] is smooth inside each step; it must ask side[i] where it jumps
 *            at the surface.  dynstep_start sets it by the signs of the functions (+1 at a zero).
 * fun = 0 takes the switches away (count and side are then not read).  Switches go with a force or a right-hand side.
 * dynstep_step does not look at them: the sides stay as they are.  Handles that share an array `side` must not be used by
 * two threads at once. */
int dynstep_set_switches(intptr_t handle, int count, intptr_t fun, intptr_t ctx,
                         int *side);                                     /* dynstep_switch_function */

/* ---- The method ---- */

/* Newmark's method, alone or under an extrapolation (which wants gamma = 1/2); beta >= 0 */
int dynstep_set_newmark(intptr_t handle, double beta, double gamma);

/* The implicit midpoint rule, alone or under an extrapolation */
int dynstep_set_midpoint(intptr_t handle);

/* Generalized-alpha without constraints: alpha_m and alpha_f not 1, beta and gamma >= 0 */
int dynstep_set_generalized_alpha(intptr_t handle, double alpha_m, double alpha_f, double beta, double gamma);

/* SOI2, with constraints or without; variant: enum dynstep_variant.  Constraints need beta > 0, gamma > 0. */
int dynstep_set_soi2(intptr_t handle, double alpha_m, double alpha_f, double beta, double gamma, int variant);

/* coefficients[4] = alpha_m, alpha_f, beta, gamma of the spectral radius rho_inf at infinite frequency,
 * 0 <= rho_inf <= 1, for the two functions above.  HHT-alpha has 0, -alpha, (1 - alpha)^2/4, 1/2 - alpha,
 * with -1/3 <= alpha <= 0; Newmark's method 0, 0, beta, gamma. */
int dynstep_alpha_coefficients(double rho_inf, double *coefficients);

/* Options of both, by default DYNSTEP_MASS_STORED, 1, 1, 1.
 *   mass_at               enum dynstep_mass_at
 *   adjust_acceleration   (14a) where the step length changes; 0: not, and the order falls to 1
 *   adjust_momentum       (14b), in the same way
 *   second_order_start    1: the first step is repeated once, and a and the multipliers are of second order
 *                         from the first step; 0: a_alpha = a0 */
int dynstep_set_alpha_options(intptr_t handle, int mass_at, int adjust_acceleration, int adjust_momentum,
                              int second_order_start);

/* Which error runs by tolerances look at with SOI2: enum dynstep_estimate, by default DYNSTEP_ESTIMATE_LARGER, which stays
 * safe near configurations where constraints begin to depend on each other.  Without constraints all are the same. */
int dynstep_set_estimate(intptr_t handle, int estimate);

/* What these methods do with a start that is off the constraints: enum dynstep_start_mode, by default
 * DYNSTEP_START_PROJECT */
int dynstep_set_start(intptr_t handle, int mode);

/* Pade's approximation of the exponential, degrees p of the numerator and q of the denominator, 0 .. 8, order p + q, for
 * linear systems (Xie 1995, section 2.3).  p = q: undamped modes keep their amplitude; q = p + 1, p + 2: stiff modes
 * are damped at once.  form: enum dynstep_form, which changes rounding errors and cost alone. */
int dynstep_set_pade(intptr_t handle, int p, int q, int form);

/* Backinterpolation (Xie 1995): a half-step forward over alpha h, and one backward over (1 - alpha) h from the unknown
 * end; for first-order and for mechanical systems without constraints.
 *   p, q     orders of the two, 1 .. 5 (p is not read for alpha = 0, q for alpha = 1)
 *   alpha    0 .. 1.  With p = q and alpha = 1/2 the method is symmetric, and undamped modes keep their amplitude where
 *            p <= 4; orders (4, 5) want 0.4363 <= alpha <= 0.4486.  q = 5 has poles in the left half-plane.
 *   halves   enum dynstep_halves; p and q are not read for DYNSTEP_HALVES_FEHLBERG */
int dynstep_set_backinterpolation(intptr_t handle, int p, int q, double alpha, int halves);

/* Error estimate of DYNSTEP_HALVES_FEHLBERG.  listing = 0, the default: the sum of the errors of both halves, which is
 * the error of the step; 1: their difference, as in the thesis's listings, which nearly vanishes at alpha = 1/2. */
int dynstep_set_listing_estimate(intptr_t handle, int listing);

/* Extrapolation over the method above, which is symmetric: each level but the first adds 2 to its order, so that it is
 * 2*levels over a method of order 2.
 *   levels             1..DYNSTEP_MAX_LEVELS; 0 takes the extrapolation away
 *   sequence           enum dynstep_sequence
 *   ncustom, custom    for DYNSTEP_CUSTOM: increasing numbers, 1..30000, `levels` of them or more; else 0, NULL */
int dynstep_set_extrapolation(intptr_t handle, int levels, int sequence, int ncustom, const int *custom);

/* vary = 1: in runs by tolerances the error chooses the levels of an extrapolation, step by step: row after row of the table
 * is made until the error is small enough, and length and levels of the next step are those with the least work for a unit of
 * time.  Runs with steps of one length, and single steps, have `levels` as before.
 *   max_levels   2..DYNSTEP_MAX_LEVELS, 9 is a good choice; all of them need memory.  Not read where vary = 0 */
int dynstep_set_order_control(intptr_t handle, int vary, int max_levels);

/* Newton's iteration: most corrections per step (>= 1, default 25), most halvings of one (>= 0, default
 * 20), tolerance of the correction of q and v relative to their largest component (0, the default: to
 * round-off, which extrapolation wants) */
int dynstep_set_newton(intptr_t handle, int limit, int halvings, double tolerance);

/* Facts about the method that is set.  name and source (paper and equation) have room for `length`
 * characters, integers for DYNSTEP_FACTS (enum dynstep_fact); stability_limit is the largest omega*h at
 * which an undamped oscillator does not grow: HUGE_VAL if there is none, 0 if it grows at every step, -1
 * if not known.  NULL: not wanted. */
int dynstep_properties(intptr_t handle, int length, char *name, char *source, int *integers,
                       double *stability_limit);

/* Largest omega*h at which an oscillator of this damping ratio (>= 0) grows by less than 1e-12 a step, for
 * Newmark's method with gamma = 1/2, the midpoint rule, and their extrapolations; HUGE_VAL if there is
 * none.  Takes some milliseconds. */
int dynstep_stability_limit(intptr_t handle, double damping_ratio, double *limit);

/* ---- Stability, accuracy, damping ----
 *
 * R(z) = N(z)/D(z) is what one step does to y' = lambda y, z = h lambda.  num and den are its coefficients in
 * ascending powers, num[0] = den[0] = 1, nnum and nden of them, at most DYNSTEP_MAX_DEGREE + 1.  Complex numbers are
 * pairs of doubles (C99's double complex).  The handle, of any kind, takes the message; its system is not used.  Arrays of
 * results may be NULL: not wanted, unless it is said otherwise. */

/* Coefficients of a family's member, DYNSTEP_MAX_DEGREE + 1 each; what is not read (alpha, or p and q) may be anything */
int dynstep_rational_coefficients(intptr_t handle, int family, int p, int q, double alpha, double *num, double *den);

/* Facts, by the signs of polynomials and not by looking at points.  intervals: pairs of y with |R(iy)| <= 1 between
 * them, room for 2*(DYNSTEP_MAX_DEGREE + 2); poles and zeros: room for 2*DYNSTEP_MAX_DEGREE each. */
int dynstep_stability_facts_of(intptr_t handle, int nnum, const double *num, int nden, const double *den, int *flags,
                               double *numbers, double *intervals, double *poles, double *zeros);

/* Where |R| = 1 on rays of the upper half-plane: `rays` (>= 2) from 0 to pi, and one through each pole and zero of R, so
 * that no unstable or stable region is missed.  counts[2]: rays and crossings.  With room for these (nangles,
 * ncrossings) also: angles[nangles] in radians; begins[nangles], 1 stable near 0, -1 unstable, 0 neither; ray i has
 * crossings[first[i]] .. crossings[first[i + 1] - 1], first has nangles + 1. */
int dynstep_stability_rays(intptr_t handle, int nnum, const double *num, int nden, const double *den, int rays, int nangles,
                           double *angles, int *begins, int *first, int ncrossings, double *crossings, int *counts);

/* The whole curves |R| = 1.  counts[3]: curves, points, and 1 where all of them are closed.  With room (nfirst >= curves + 1,
 * npoints) also: curve i has the (complex) points first[i] .. first[i + 1] - 1.  None where it is the imaginary axis. */
int dynstep_stability_boundary(intptr_t handle, int nnum, const double *num, int nden, const double *den, int nfirst,
                               int *first, int npoints, double *points, int *counts);

/* R at nz points; infinity at a pole */
int dynstep_rational_values(intptr_t handle, int nnum, const double *num, int nden, const double *den, int nz,
                            const double *z, double *values);

/* Spectral radius of one step of the handle's own method on q'' + 2 zeta w q' + w^2 q = 0, whose eigenvalues times h are z
 * and its conjugate, at nz points; HUGE_VAL where the method refuses the step */
int dynstep_spectral_radii(intptr_t handle, int nz, const double *z, double *radii);

/* Smallest step at which the error on [0, t_end] passes the tolerance, for x' = A x, x(0) = x0[2], A = [0 1; -1 2 cos theta], at
 * nangles angles theta in radians (Xie 1995, section 3.2) */
int dynstep_accuracy_limits(intptr_t handle, int nnum, const double *num, int nden, const double *den, int nangles,
                            const double *angles, const double *x0, double tolerance, double t_end, double *limits);

/* For which alpha DYNSTEP_FAMILY_TAYLOR or _FEHLBERG has a property: count[1] intervals; with room for them (nwindows)
 * also their ends, in pairs */
int dynstep_alpha_windows(intptr_t handle, int family, int p, int q, int property, int nwindows, double *windows,
                          int *count);

/* ---- Start and steps ---- */

/* Compare the functions and what is declared of them with differences, at t, q and v.  Returns
 * DYNSTEP_INVALID_INPUT where something does not fit: the message is the first finding, and `report`
 * (room for length characters, or NULL) takes all of them, a line each. */
int dynstep_check(intptr_t handle, int n, double t, const double *q, const double *v, int length,
                  char *report);

/* Put system, method and state together, compute accelerations and multipliers, set the counters to zero.
 * With constraints q and v are moved onto them (dynstep_set_start); dynstep_get tells where they are. */
int dynstep_start(intptr_t handle, int n, double t, const double *q, const double *v);

/* The same for a first-order system: computes y' */
int dynstep_start_ode(intptr_t handle, int n, double t, const double *y);

/* What the last dynstep_start found and moved with generalized-alpha or SOI2, also where it failed:
 * report[5] = largest |g|, |g'|, |k| (these two at the projected q), largest change of a coordinate, of a
 * velocity */
int dynstep_start_report(intptr_t handle, double *report);

/* Which constraints depend on each other at the start, in words; blank where none do.  Cut and ended as
 * dynstep_message does. */
int dynstep_redundant_constraints(intptr_t handle, int length, char *buffer);

/* One step of length h, of either sign.  Steps of one length that follow each other end at t0 + k*h.
 * The observer is not asked.  A run that was begun is over. */
int dynstep_step(intptr_t handle, double h);

/* Last accepted point; NULL: not wanted */
int dynstep_get(intptr_t handle, int n, double *t, double *q, double *v, double *a);

/* The same for a first-order system, yp = y' */
int dynstep_get_ode(intptr_t handle, int n, double *t, double *y, double *yp);

/* Multipliers of the last accepted point, lambda[m] and psi[p]; NULL: not wanted */
int dynstep_get_multipliers(intptr_t handle, int m, double *lambda, int p, double *psi);

/* How well the constraints hold at t, q and v: g[m] = g(t,q), gv[m] = G v + dg/dt, k[p] = k(t,q,v).  NULL:
 * not wanted, and then not evaluated.  Needs no start. */
int dynstep_residuals(intptr_t handle, int n, double t, const double *q, const double *v, int m, double *g,
                      double *gv, int p, double *k);

/* Energy of the last accepted point, of a system that has one: by dynstep_set_energy, or a linear one
 * with symmetric M and K, (v'Mv + q'Kq)/2 */
int dynstep_energy(intptr_t handle, double *energy);

/* Work since dynstep_start: counts[DYNSTEP_COUNTS], enum dynstep_count */
int dynstep_counts(intptr_t handle, long long *counts);

/* Name of counter i, 0 <= i < DYNSTEP_COUNTS, such as "forces" */
int dynstep_count_name(int i, int length, char *buffer);

/* Extrapolation table of the last step: numbers[j] sub-steps in row j, and component i of [q; v] in row j,
 * column k <= j in table[i + j*size + k*size*levels] (i < size = 2n; j, k < levels; all from 0).  For a first-order
 * system: of y, and size = n.  Under dynstep_set_order_control the step may have fewer rows than `levels`: what is left over
 * is zero. */
int dynstep_tableau(intptr_t handle, int size, int levels, double *table, int *numbers);

/* ---- Runs ---- */

/* Observer of runs; fun = 0: none.  Needs no new start. */
int dynstep_set_observer(intptr_t handle, intptr_t fun, intptr_t ctx);               /* dynstep_observer */

/* A whole run to t_end in steps of h (the last one shorter if need be), nothing recorded */
int dynstep_run(intptr_t handle, double t_end, double h);

/* Begin a run to t_end in steps of h, of the sign of t_end - t, from the present point; make no step.
 * What is recorded:
 *   n_eval > 0    the points at the times t_eval[n_eval], in the order of the run, repeats allowed;
 *                 inside a step they are interpolated from q, v, a at both ends.  `every` is not read.
 *   n_eval = 0    (t_eval is not read) the start, each `every`-th step, and the last point reached;
 *                 every = 0: the last point alone */
int dynstep_begin(intptr_t handle, double t_end, double h, int every, int n_eval, const double *t_eval);

/* Begin a run to t_end in steps whose length follows the error estimate of the method, from the present point; make no
 * step.  A step is good where the root of the mean of (e(i)/(atol(i) + rtol |y(i)|))^2, over all components of [q; v] or of
 * y, is 1 at most, e the estimated error; else it is thrown away, and a shorter one tried.  Errors of steps add up along the
 * run.
 *   rtol            >= 0
 *   n_atol, atol    atol[n_atol] >= 0: one for all components, or one for each of [q; v] (2*n) or of y (n); n_atol = 0: 1e-8
 *                   (atol is then not read).  rtol and an atol must not both be 0.
 *   atol_lambda, atol_psi   the same for the multipliers, beside rtol; 0: their errors are not looked at
 *   h_first         first step, of the sign of t_end - t; 0: the library chooses
 *   h_max           longest step; 0: |t_end - t|
 *   h_min           >= 0, a shorter step than that gives DYNSTEP_STEP_TOO_SMALL, the last one before t_end or an event apart
 *   n_eval, t_eval  as above; n_eval = 0: the start and each step are recorded
 * Methods without an error estimate are refused (DYNSTEP_FACT_ERROR_ORDER tells).  DYNSTEP_TOLERANCE_TOO_SMALL, here or on
 * the way: the tolerance is below the rounding errors of the state; the message tells what is possible. */
int dynstep_begin_within(intptr_t handle, double t_end, double rtol, int n_atol, const double *atol, double atol_lambda,
                         double atol_psi, double h_first, double h_max, double h_min, int n_eval, const double *t_eval);

/* The same with the norm and the controllers of Xie 1995, section 3.4.
 *   tolerance       > 0.  A step may have the error tau = tolerance*max(|y|, 1), |y| the largest component of y (of q and v);
 *                   one with a larger error is a rejection: it is thrown away, and a shorter one tried.  Errors of steps add
 *                   up along the run.
 *   controller      enum dynstep_controller; k = 1/(e + 1), e the order of the estimate
 *   safety_place    enum dynstep_safety_place, of DYNSTEP_PI
 *   h_first         first step, of the sign of t_end - t; 0: (t_end - t)/128
 *   h_max           longest step; 0: |t_end - t|/16
 *   n_eval, t_eval  as above; n_eval = 0: the start and each step are recorded
 * A step that fails is tried again with half its length where that may help.  DYNSTEP_STEP_TOO_SMALL: that came to the
 * rounding of t. */
int dynstep_begin_controlled(intptr_t handle, double t_end, double tolerance, int controller, int safety_place,
                             double h_first, double h_max, int n_eval, const double *t_eval);

/* Go on with the run that was begun, of either kind, for at most max_steps >= 1 steps, until t_end, until the room is used
 * up, or until something happens.
 *   capacity        room for points in the arrays below
 *   *count          points written by this call, 0..capacity
 *   t_out           [capacity] times
 *   q_out, v_out, a_out   point i in q_out[i*n] .. q_out[i*n + n-1]; NULL: not wanted.  For a first-order system y
 *                   in q_out and y' in a_out; v_out is left alone
 * Returns DYNSTEP_MORE where max_steps or the room is used up; call again to go on.  The points and their
 * bits do not depend on how a run is cut into calls, and none is lost: one that finds no room comes with the
 * next call, and so does any code but DYNSTEP_MORE.  After DYNSTEP_STOPPED or DYNSTEP_EVENT a further call goes on, too.
 * capacity = 0 records nothing; it must then be 0 in all calls of the run (count and arrays may be NULL). */
int dynstep_proceed(intptr_t handle, int max_steps, int capacity, int *count, double *t_out, double *q_out,
                    double *v_out, double *a_out);

/* Multipliers of the points that the last dynstep_proceed wrote, `count` as it told: those of point i in
 * lambda_out[i*m] .. lambda_out[i*m + m-1] and psi_out[i*p] .. psi_out[i*p + p-1]; NULL: not wanted.  Between
 * the ends of a step they lie on a straight line. */
int dynstep_record_multipliers(intptr_t handle, int count, int m, double *lambda_out, int p, double *psi_out);

/* on = 1: runs that are begun after this call record points inside each step that is recorded, too, before its end: as many
 * as the order of the method wants of a polynomial through [q, v] and [v, a] (or y and y') at all points of the step.  They
 * are ends of real steps, made beside those of the run, whose work is counted.  Not with t_eval, whose points have that order
 * anyway; not with capacity = 0.  on = 0: none. */
int dynstep_set_dense(intptr_t handle, int on);

/* kinds[count] of the points that the last dynstep_proceed wrote, `count` as it told: 0 the start, the end of a step or an
 * event, 1 inside a step */
int dynstep_point_kinds(intptr_t handle, int count, int *kinds);

/* What the last run has to warn of, in a sentence with numbers: steps beyond the stability limit of the method, an extrapolation
 * whose columns diverge.  Blank where there is nothing.  Cut and ended as dynstep_message does. */
int dynstep_get_warning(intptr_t handle, int length, char *buffer);

/* Write all that the rest of a run depends on to a file: state, method, counters, what is recorded next.  One of this name
 * is replaced.  For a run that was left, at its end, or behind a failure, after all its recorded points were taken.  The
 * format is told in docs/howto/restarting.md. */
int dynstep_checkpoint(intptr_t handle, const char *path);

/* Read it, in place of dynstep_start and dynstep_begin: the run was of any kind, dynstep_proceed goes on with the same bits and
 * counters.  System, method, observer and events are set before as they were; what the caller's own functions remember is
 * theirs.  t_end, tolerances, t_eval, events that were met come from the file.  DYNSTEP_FILE_ERROR: the file cannot be read, is
 * not whole, or belongs to another system or method; there is no run then. */
int dynstep_restore(intptr_t handle, const char *path);

/* ---- Events ---- */

/* Functions that runs of any kind watch: count >= 1 of them.  Where one goes through zero inside a step, that step is made
 * again, for real, up to the zero, so that the state there has the accuracy of the method.  Without t_eval it is recorded;
 * where the action changed something, the state behind it is recorded, too, at the same time.
 *   direction   [count] 1: only from minus to plus, -1: only from plus to minus, in the direction of the run; 0: both.
 *               NULL: all both
 *   terminal    [count] other than 0: the run ends there with DYNSTEP_EVENT.  NULL: none
 * fun = 0 takes the events away (count and arrays are then not read).  Needs no new start, but a run that was begun is
 * over.  Zeros at the start of a run are no events.  Events that follow each other without end give
 * DYNSTEP_TOO_MANY_EVENTS.  dynstep_step does not look at events. */
int dynstep_set_events(intptr_t handle, int count, intptr_t fun, intptr_t ctx, const int *direction,
                       const int *terminal);                              /* dynstep_event_function */

/* What is done at events; fun = 0: nothing.  May be set at any time, also in a run.  Behind an action that has changed
 * something the method starts anew, with new accelerations, and moves q and v onto the constraints if need be. */
int dynstep_set_event_action(intptr_t handle, intptr_t fun, intptr_t ctx);   /* dynstep_event_action */

/* How many events there were since the last run was begun */
int dynstep_event_count(intptr_t handle, int *count);

/* Events first .. first + count - 1 of these (from 0), in the order in which they were met: which[count] functions (from 0),
 * times t[count], and the states before an action, q and v as in dynstep_proceed; NULL: not wanted */
int dynstep_get_events(intptr_t handle, int first, int count, int *which, double *t, double *q, double *v);

/* ---- Records ---- */

/* Ground motion in a PEER .AT2 file: interval dt in seconds, values as the file has them.  *count is the
 * number of values in the file; min(*count, capacity) of them are written.  Call it with capacity = 0
 * and values = NULL to learn the count.  message (room for length characters, or NULL) says what was
 * wrong. */
int dynstep_read_at2(const char *path, int capacity, double *dt, int *count, double *values, int length,
                     char *message);

/* ---- Models ---- */

/* One-link flexible arm on a hub, with a tip load (Xie 1995, chapters 4 and 5): M q'' + K q = b u, closed by
 * u = -g1 theta - g2 theta' - g3 w - g4 w', theta the angle of the hub and w the deflection of the tip.
 *   beam, variant    enum dynstep_beam, enum dynstep_arm_variant
 *   segments         4 or more; 2 or more for DYNSTEP_TIMOSHENKO
 *   parameters       [8] eta, mu, kappa, zeta, alpha, beta, delta, gamma: inertia of the hub, mass of the load, its
 *                    inertia, distance of its mass centre, mass, bending rigidity, rotatory inertia (over alpha), shear
 *                    rigidity of the beam, dimensionless; NULL: those of the thesis, eqs. (4.37), (5.23)
 *   gains            [4] g1 .. g4; NULL: those of the thesis, eqs. (4.38), (5.24)
 *   capacity         coordinates for which the arrays have room; where it is less than *n, they are left alone
 *   n                how many coordinates: theta, z1, z2, ... or theta, phi1, z1, phi2, z2, ...; theta is the first one,
 *                    the deflection of the tip, with the hub's rotation in it, the last one
 *   m, k             [3*n], [5*n] matrices, DYNSTEP_BANDED with kl = ku = 1 and kl = ku = 2
 *   b, gain_q, gain_v   [n] the arguments of dynstep_set_coupling
 * Arrays may be NULL.  Call it with capacity = 0 to learn n.  message as for dynstep_read_at2. */
int dynstep_arm_matrices(int beam, int variant, int segments, const double *parameters, const double *gains, int capacity,
                         int *n, double *m, double *k, double *b, double *gain_q, double *gain_v, int length,
                         char *message);

/* The undeformed arm with its hub at an angle, q[n]; n as dynstep_arm_matrices tells */
int dynstep_arm_straight(int beam, int segments, double angle, int n, double *q, int length, char *message);

#ifdef __cplusplus
}
#endif
#endif
