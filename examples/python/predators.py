# SPDX-License-Identifier: BSD-3-Clause
"""Predators and prey (Lotka and Volterra): what the motion conserves, by backinterpolation of two kinds.

usage: predators.py [FIGURE.png]      draws a figure where a name is given
"""
import sys

import numpy as np

import dynstep


def rhs(t, y, k):
    prey, predators = y
    return [prey*(1 - k*predators), -predators*(1 - k*prey)]


def jacobian(t, y, k):
    prey, predators = y
    return [[1 - k*predators, -k*prey], [k*predators, k*prey - 1]]


def invariant(y, k):
    return k*y.sum(axis=0) - np.log(y).sum(axis=0)


k = 0.1
system = dynstep.OdeSystem(2, rhs, jacobian, args=(k,))
for method in "bi", "bi45", dynstep.BI(order=2):
    solution = dynstep.solve_ode(system, t_span=(0, 30), y0=[20.0, 10.0], method=method, h=0.05)
    v = invariant(solution.y, k)
    print(f"{solution.method!r}: invariant changes by {np.ptp(v):.1e}, {solution.counts['forces']} evaluations of f")
    assert solution.success and np.ptp(v) < 1e-2

if len(sys.argv) > 1:
    import matplotlib.pyplot as plt
    solution.plot()
    plt.savefig(sys.argv[1])
