# SPDX-License-Identifier: BSD-3-Clause
"""A crank turned by a motor moves a slider: a constraint that depends on time, and the moment that the motor needs.

usage: driven_crank.py [DRIFT.png]
"""
import sys

import numpy as np

import dynstep

R, ROD, M, J, RATE = 0.3, 0.7, 2.0, 0.05, 6.0   # crank, connecting rod, mass of the slider, inertia of the crank, rad/s


def constraint(t, q):                           # q = (angle of the crank, place of the slider)
    angle, x = q
    return [(x - R*np.cos(angle))**2 + (R*np.sin(angle))**2 - ROD**2, angle - RATE*t]


def jacobian(t, q):                             # (G, dg/dt); without it, differences would do
    angle, x = q
    return [[2*x*R*np.sin(angle), 2*(x - R*np.cos(angle))], [1.0, 0.0]], [0.0, -RATE]


crank = dynstep.MechanicalSystem(2, lambda t, q, v: [0.0, 0.0], [J, M], constraint=constraint,
                                 constraint_jacobian=jacobian)
solution = dynstep.solve(crank, (0, 3), q0=[0.0, R + ROD], v0=[RATE, 0.0], h=0.005)

t, (angle, x), moment = solution.t, solution.q, -solution.lam[1]
print(f"the slider goes from {x.min():.3f} to {x.max():.3f} m")
exact = R*np.cos(RATE*t) + np.sqrt(ROD**2 - (R*np.sin(RATE*t))**2)
print(f"largest error of its place {np.abs(x - exact).max():.1e}")
power = moment*solution.v[0]
work = 0.5*np.diff(t) @ (power[1:] + power[:-1])
kinetic = 0.5*(J*solution.v[0]**2 + M*solution.v[1]**2)
print(f"largest moment of the motor {np.abs(moment).max():.2f} N m; its work {work:.4f} J, "
      f"kinetic energy gained {kinetic[-1] - kinetic[0]:.4f} J")
if len(sys.argv) > 1:
    solution.plot_drift().figure.savefig(sys.argv[1])
