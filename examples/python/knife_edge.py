# SPDX-License-Identifier: BSD-3-Clause
"""A skate on an inclined plane: a constraint on velocities that no constraint on coordinates can replace.

Spinning evenly, it does not slide down: it goes sideways on a cycloid.

usage: knife_edge.py [DRIFT.png]
"""
import sys

import numpy as np

import dynstep

PULL, SPIN = 2.9, 1.5                           # g sin(slope), m/s^2; turning rate, rad/s

# q = (x, y, phi): x down the slope, phi the heading; it cannot move across its heading
skate = dynstep.MechanicalSystem(
    3, lambda t, q, v: [PULL, 0.0, 0.0],
    velocity_constraint=lambda t, q, v: v[0]*np.sin(q[2]) - v[1]*np.cos(q[2]))
solution = dynstep.solve(skate, (0, 20), q0=[0, 0, 0], v0=[0, 0, SPIN], h=0.01)

t, (x, y, phi) = solution.t, solution.q
exact = PULL/(2*SPIN**2)*np.array([np.sin(SPIN*t)**2, SPIN*t - np.sin(SPIN*t)*np.cos(SPIN*t)])
print(f"after {t[-1]:g} s: x = {x[-1]:.4f}, y = {y[-1]:.4f}")
print(f"largest error {np.abs([x, y] - exact).max():.1e}, "
      f"of the force on the blade {np.abs(solution.psi[0] - 2*PULL*np.sin(SPIN*t)).max():.1e}")
print(f"largest velocity across the blade {solution.constraint_drift.k.max():.1e}")
if len(sys.argv) > 1:
    solution.plot_drift().figure.savefig(sys.argv[1])
