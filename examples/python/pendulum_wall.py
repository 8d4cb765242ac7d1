# SPDX-License-Identifier: BSD-3-Clause
"""A pendulum in Cartesian coordinates that hits a wall: an impact on a system with a constraint.

The wall pushes with an impulse p along its normal n, and the rod answers with another one along G^T, so that it keeps its
length:  M (v+ - v-) = n p + G^T r,  G v+ = 0,  n.v+ = -e n.v-

usage: pendulum_wall.py [PATH.png]
"""
import sys

import numpy as np

import dynstep

GRAVITY, LENGTH, MASS, WALL, RESTITUTION = 9.81, 1.0, 2.0, -0.3, 0.8


def impact(t, q, v):
    normal, G = np.array([[1.0, 0.0]]), q[None, :]
    rows = np.vstack([normal, G])               # [n; G] M^-1 [n; G]^T (p, r) = [-(1 + e) n.v-; 0]
    impulses = np.linalg.solve(rows @ rows.T/MASS, [-(1 + RESTITUTION)*v[0], 0.0])
    return q, v + rows.T @ impulses/MASS


pendulum = dynstep.MechanicalSystem(
    2, lambda t, q, v: [0.0, -MASS*GRAVITY], [MASS, MASS],
    constraint=lambda t, q: (q @ q - LENGTH**2)/2, constraint_jacobian=lambda t, q: [q])
wall = dynstep.Event(lambda t, q, v: q[0] - WALL, direction=-1, action=impact)
start = LENGTH*np.array([np.sin(np.pi/3), -np.cos(np.pi/3)])


def run(rtol):
    s = dynstep.solve(pendulum, (0, 6), start, [0.0, 0.0], rtol=rtol, atol=rtol, events=wall)
    impacts = s.t_events[0].size
    # each impact leaves e^2 of the energy above the wall
    at_wall = MASS*GRAVITY*s.q_events[0][:, 1]
    kinetic = MASS*GRAVITY*start[1] - at_wall[0]
    energy = (MASS*s.v**2).sum(axis=0)/2 + MASS*GRAVITY*s.q[1]
    error = abs(energy[-1] - at_wall[0] - kinetic*RESTITUTION**(2*impacts))
    drift = max(np.abs((s.q**2).sum(axis=0) - LENGTH**2).max()/2, np.abs((s.q*s.v).sum(axis=0)).max())
    print(s)
    print(f"rtol {rtol:.0e}: {impacts} impacts, energy wrong by {error:.1e} J, g and G v up to {drift:.1e}")
    assert s.success and impacts == 4 and drift < 1e-13
    return s, error


coarse, fine = run(1e-6), run(1e-8)
assert fine[1] < coarse[1]/18                    # order 2 and estimates of order 3: errors fall as rtol^(2/3), here by 21.5

if len(sys.argv) > 1:
    import matplotlib.pyplot as plt

    solution = fine[0]
    plt.plot(solution.t, np.degrees(np.arctan2(solution.q[0], -solution.q[1])))
    plt.axhline(np.degrees(np.arcsin(WALL/LENGTH)), color="gray")
    plt.xlabel("t [s]")
    plt.ylabel("angle [degrees]")
    plt.savefig(sys.argv[1])
