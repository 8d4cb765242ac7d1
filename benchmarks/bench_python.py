# SPDX-License-Identifier: BSD-3-Clause
"""Python against Fortran: a chain of 1000 masses, 1000 steps; and the cost of a force by its kind.

usage: bench_python.py BENCH_CHAIN      (the program bench_chain)
"""
import subprocess
import sys
import time

import numpy as np

import dynstep

N, STEPS, ROUNDS = 1000, 1000, 5
METHODS = ["newmark", "newmark-extrapolation"]


def seconds(work, repeats):
    """Least CPU time of this thread."""
    best = np.inf
    for _ in range(repeats):
        begun = time.thread_time()
        work()
        best = min(best, time.thread_time() - begun)
    return best


def chain(method, every):
    ab = np.full((3, N), -1.0)
    ab[1] = 2.0
    system = dynstep.LinearSystem(np.ones(N), K=dynstep.banded(ab, 1, 1))
    q0 = np.sin(0.01*np.arange(1, N + 1))
    s = dynstep.solve(system, (0, 100), q0, np.zeros(N), method, h=0.1, every=every)
    assert s.success and s.counts["steps"] == STEPS


def against_fortran(program):
    fortran = np.full(4, np.inf)
    python = np.full(4, np.inf)
    for _ in range(ROUNDS):                  # in turns: a busy machine slows both
        fortran = np.minimum(fortran, [float(x) for x in subprocess.run(
            [program], capture_output=True, text=True, check=True).stdout.split()])
        python = np.minimum(python, [seconds(lambda m=m, e=e: chain(m, e), 5) for m in METHODS for e in (0, 1)])
    print(f"\nchain of {N} masses, {STEPS} steps, from matrices      Fortran [ms]  Python [ms]   ratio   goal")
    cases = [f"{m}, {'all points' if e else 'the last point'} kept" for m in METHODS for e in (0, 1)]
    for case, f, p in zip(cases, fortran, python):
        print(f"  {case:46}{1e3*f:12.2f}{1e3*p:13.2f}{p/f:8.2f}   <= 1.1")


def kinds_of_forces():
    forces = {"Python function, numpy": lambda t, q, v: -q}
    alone = seconds(lambda: [forces["Python function, numpy"](0.0, Q, Q) for _ in range(10000)], 5)/1e4
    try:
        import numba
    except ImportError:
        pass
    else:
        @numba.cfunc(dynstep.signature("force"))
        def compiled(n, t, q, v, f, ctx):
            for i in range(n):
                f[i] = -q[i]
            return 0
        forces["numba.cfunc"] = compiled
        forces["numba.cfunc through ctypes"] = compiled.ctypes
    print("\na step of central differences with one force, n = 3      [us]")
    print(f"  {'(the Python function alone, outside a run)':50}{1e6*alone:8.3f}")
    for name, force in forces.items():
        system = dynstep.MechanicalSystem(3, force, velocity_free=True)
        work = seconds(lambda s=system: dynstep.solve(s, (0, 1000), Q, 0*Q, "central-difference", h=0.1, every=0), 7)
        print(f"  {name:50}{1e6*work/10000:8.3f}")


Q = np.ones(3)
kinds_of_forces()
against_fortran(sys.argv[1])
