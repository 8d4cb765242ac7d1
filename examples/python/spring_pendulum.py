# SPDX-License-Identifier: BSD-3-Clause
"""A rod on a pin with a torsion spring and a damper, in absolute coordinates (Jay and Negrut 2008, eqs. (16)).

The two holonomic constraints hold one end at the origin; their multipliers are the forces of the pin.

usage: spring_pendulum.py [DRIFT.png]
"""
import sys

import numpy as np

import dynstep

M, L, K, C = 5.0, 2.0, 3000.0, 100.0            # mass, half length, spring, damper


def force(t, q, v):
    return [0.0, -9.81*M, -C*v[2] - K*(q[2] - 1.5*np.pi)]


def pin(t, q):
    return [q[0] - L*np.cos(q[2]), q[1] - L*np.sin(q[2])]


rod = dynstep.MechanicalSystem(3, force, [M, M, M*L**2/3], constraint=pin)
solution = dynstep.solve(rod, (0, 2), q0=[0.0, -L, 1.5*np.pi], v0=[10*L, 0.0, 10.0], h=2**-8)

print(f"angle {solution.q[2, -1]:.5f}, exact 4.72778")
print(f"force of the pin on the rod at the end: {-solution.lam[:, -1].round(2)}, exact [-10.45  49.28]")
print(f"largest force: {np.hypot(*solution.lam).max():.0f}")
drift = solution.constraint_drift
print(f"the pin moved by {drift.g.max():.1e}, its velocity is {drift.gv.max():.1e} at most")
if len(sys.argv) > 1:
    solution.plot_drift().figure.savefig(sys.argv[1])
