# SPDX-License-Identifier: BSD-3-Clause
"""Constraints from Python against Fortran: the rod on a pin of Jay and Negrut 2008, eqs. (16), 20000 steps of SOI2.

usage: bench_constraints.py BENCH_ROD      (the program bench_rod)
"""
import math
import subprocess
import sys
import time

import numpy as np

import dynstep

M, L, K, C = 5.0, 2.0, 3000.0, 100.0
STEPS, H, ROUNDS = 20000, 1e-3, 5
GOAL = 2.5                                      # us a step with compiled functions


def force(t, q, v):
    return np.array([0.0, -9.81*M, -C*v[2] - K*(q[2] - 1.5*math.pi)])


def tangent(t, q, v, a):
    return np.array([0.0, 0.0, K]), np.array([0.0, 0.0, C])


def constraint(t, q):
    return np.array([q[0] - L*math.cos(q[2]), q[1] - L*math.sin(q[2])])


def constraint_jacobian(t, q):
    return np.array([[1.0, 0.0, L*math.sin(q[2])], [0.0, 1.0, -L*math.cos(q[2])]])


def constraint_curvature(t, q, v):
    return np.array([L*v[2]**2*math.cos(q[2]), L*v[2]**2*math.sin(q[2])])


def reaction_tangent(t, q, v, lam, psi):
    return np.array([0.0, 0.0, L*(math.cos(q[2])*lam[0] + math.sin(q[2])*lam[1])]), np.zeros(3)


def by_numba():
    import numba

    def cfunc(function):
        return numba.cfunc(dynstep.signature(function.__name__))(function)

    @cfunc
    def force(n, t, q, v, f, ctx):
        f[0] = 0.0
        f[1] = -9.81*M
        f[2] = -C*v[2] - K*(q[2] - 1.5*math.pi)
        return 0

    @cfunc
    def tangent(n, t, q, v, a, k, c, ctx):
        k[2] = K
        c[2] = C
        return 0

    @cfunc
    def constraint(n, m, t, q, g, ctx):
        g[0] = q[0] - L*math.cos(q[2])
        g[1] = q[1] - L*math.sin(q[2])
        return 0

    @cfunc
    def constraint_jacobian(n, m, t, q, gq, gt, ctx):
        gq[0] = gq[4] = 1.0
        gq[2] = L*math.sin(q[2])
        gq[5] = -L*math.cos(q[2])
        return 0

    @cfunc
    def constraint_curvature(n, m, t, q, v, c, ctx):
        c[0] = L*v[2]**2*math.cos(q[2])
        c[1] = L*v[2]**2*math.sin(q[2])
        return 0

    @cfunc
    def reaction_tangent(n, m, p, t, q, v, lam, psi, k, c, ctx):
        k[2] = L*(math.cos(q[2])*lam[0] + math.sin(q[2])*lam[1])
        return 0

    return {"force": force, "tangent": tangent, "constraint": constraint, "constraint_jacobian": constraint_jacobian,
            "constraint_curvature": constraint_curvature, "reaction_tangent": reaction_tangent, "constraints": 2}


def seconds(functions):
    """CPU time of this thread for a run."""
    system = dynstep.MechanicalSystem(3, mass=[M, M, M*L**2/3], tangent_kind="diagonal", tangent_symmetric=True,
                                      tangent_constant=True, **functions)
    begun = time.thread_time()
    s = dynstep.solve(system, (0, STEPS*H), [0.0, -L, 1.5*math.pi], [10*L, 0.0, 10.0], "soi2", h=H, every=0)
    elapsed = time.thread_time() - begun
    assert s.success and s.counts["steps"] == STEPS, s.message
    return elapsed


kinds = {"Python functions": {f.__name__: f for f in (force, tangent, constraint, constraint_jacobian,
                                                      constraint_curvature, reaction_tangent)}}
try:
    kinds["numba.cfunc"] = by_numba()
except ImportError:
    pass
best = dict.fromkeys(["Fortran", *kinds], np.inf)
for _ in range(ROUNDS):                         # in turns: a busy machine slows all
    fortran = subprocess.run([sys.argv[1]], capture_output=True, text=True, check=True).stdout
    best["Fortran"] = min(best["Fortran"], float(fortran))
    for kind, functions in kinds.items():
        best[kind] = min(best[kind], seconds(functions))
print(f"rod on a pin, eqs. (16), {STEPS} steps of SOI2          [us a step]   to Fortran   goal")
for kind, time_of in best.items():
    goal = f"<= {GOAL} us" if kind == "numba.cfunc" else ""
    print(f"  {kind:46}{1e6*time_of/STEPS:12.2f}{time_of/best['Fortran']:13.2f}   {goal}")
