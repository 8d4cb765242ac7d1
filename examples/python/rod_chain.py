# SPDX-License-Identifier: BSD-3-Clause
"""A hanging chain of many rods: a declared pattern of the constraints makes a step linear in their number.

usage: rod_chain.py [NUMBER OF RODS [DRIFT.png]]
"""
import sys
import time
from math import cos, sin

import numpy as np

import dynstep

RODS = int(sys.argv[1]) if len(sys.argv) > 1 else 100
HALF = 0.5                                      # half of a rod's length, m; its mass is 1 kg

# q = (x, y, angle) of each rod.  Row 2 i is x of joint i: x, angle of the rod before, and x, angle of rod i; row
# 2 i + 1 is y.  The first rod hangs at the origin.
rows = [[3*i - 3 + k, 3*i - 1, 3*i + k, 3*i + 2][2 if i == 0 else 0:] for i in range(RODS) for k in (0, 1)]
pattern = np.cumsum([0] + [len(row) for row in rows]), np.concatenate(rows)


def joints(t, q):
    x, y, angle = q.reshape(RODS, 3).T
    c, s = HALF*np.cos(angle), HALF*np.sin(angle)
    before = np.array([np.append(0.0, (x + c)[:-1]), np.append(0.0, (y + s)[:-1])])
    return (np.array([x - c, y - s]) - before).T.ravel()


def jacobian(t, q):                             # the values, in the order of the pattern
    by_angle = HALF*np.array([np.sin(q[2::3]), -np.cos(q[2::3])]).T
    values = np.ones((RODS, 2, 4))
    values[1:, :, 0], values[1:, :, 1], values[:, :, 3] = -1.0, by_angle[:-1], by_angle
    return values.ravel()[np.r_[2:4, 6:values.size]]


weight = np.tile([0.0, -9.81, 0.0], RODS)
kinds = {"Python": {"force": lambda t, q, v: weight, "constraint": joints, "constraint_jacobian": jacobian}}
try:
    import numba
except ImportError:
    print("numba is not installed: Python alone")
else:
    @numba.cfunc(dynstep.signature("force"))
    def force(n, t, q, v, f, ctx):
        for i in range(n//3):
            f[3*i] = f[3*i + 2] = 0.0
            f[3*i + 1] = -9.81
        return 0

    @numba.cfunc(dynstep.signature("constraint"))
    def constraint(n, m, t, q, g, ctx):
        x = y = 0.0
        for i in range(n//3):
            c, s = HALF*cos(q[3*i + 2]), HALF*sin(q[3*i + 2])
            g[2*i], g[2*i + 1] = q[3*i] - c - x, q[3*i + 1] - s - y
            x, y = q[3*i] + c, q[3*i + 1] + s
        return 0

    @numba.cfunc(dynstep.signature("constraint_jacobian"))
    def compiled_jacobian(n, m, t, q, gq, gt, ctx):
        for i in range(n//3):
            e, s, c = 8*i - 4, HALF*sin(q[3*i + 2]), HALF*cos(q[3*i + 2])
            if i > 0:
                gq[e], gq[e + 4] = -1.0, -1.0
                gq[e + 1], gq[e + 5] = HALF*sin(q[3*i - 1]), -HALF*cos(q[3*i - 1])
            e += 2 if i > 0 else 4
            gq[e], gq[e + 1] = 1.0, s
            e += 4 if i > 0 else 2
            gq[e], gq[e + 1] = 1.0, -c
        return 0

    kinds["numba"] = {"force": force, "constraint": constraint, "constraint_jacobian": compiled_jacobian}

mass = np.tile([1.0, 1.0, (2*HALF)**2/12], RODS)
start = np.array([(2*np.arange(RODS) + 1)*HALF, np.zeros(RODS), np.zeros(RODS)]).T.ravel()
for kind, functions in kinds.items():
    chain = dynstep.MechanicalSystem(3*RODS, mass=mass, tangent_kind="diagonal", velocity_free=True,
                                     constraint_pattern=pattern, **functions)
    begun = time.perf_counter()
    s = dynstep.solve(chain, (0, 0.5), start, np.zeros(3*RODS), h=0.001)
    nanoseconds = 1e9*(time.perf_counter() - begun)/s.counts["steps"]/RODS
    print(f"{kind:6} {nanoseconds:.0f} ns for each of {RODS} rods and steps; "
          f"{s.counts['newton_iterations']/s.counts['steps']:.2f} corrections a step")
    print(f"{'':6} its end fell by {-s.q[-2, -1]:.6f} m, joints opened by {s.constraint_drift.g.max():.1e} at most")
if len(sys.argv) > 2:
    s.plot_drift().figure.savefig(sys.argv[2])
