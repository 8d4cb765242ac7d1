# SPDX-License-Identifier: BSD-3-Clause
"""Two pendulums on one spring, with a force in Python, and the same force compiled by numba.

The compiled one gets its numbers through a context pointer, runs without the interpreter's lock, and gives the
same bits.
"""
import time

import numpy as np

import dynstep

LENGTH, SPRING = 1.2, 0.8                       # m, N/m per kg


def force(t, q, v, length, spring):
    """Angular accelerations, M = 1."""
    pull = spring*(q[1] - q[0])
    return np.array([-9.81/length*np.sin(q[0]) + pull, -9.81/length*np.sin(q[1]) - pull])


def energy(t, q, v, length, spring):
    return 0.5*(v @ v) - 9.81/length*np.cos(q).sum() + 0.5*spring*(q[1] - q[0])**2


systems = {"Python": dynstep.MechanicalSystem(2, force, energy=energy, velocity_free=True, args=(LENGTH, SPRING))}
try:
    import numba
except ImportError:
    print("numba is not installed: Python alone")
else:
    @numba.cfunc(dynstep.signature("force"))
    def compiled(n, t, q, v, f, ctx):
        data = numba.carray(ctx, 2, numba.float64)
        pull = data[1]*(q[1] - q[0])
        f[0] = -9.81/data[0]*np.sin(q[0]) + pull
        f[1] = -9.81/data[0]*np.sin(q[1]) - pull
        return 0

    systems["numba"] = dynstep.MechanicalSystem(2, compiled, velocity_free=True, user_data=np.array([LENGTH, SPRING]))

for name, system in systems.items():
    begun = time.perf_counter()
    s = dynstep.solve(system, (0, 100), [2.0, -1.0], [0.0, 0.0], h=0.05)
    seconds = time.perf_counter() - begun
    print(f"{name:8} q(100) = {s.q[0, -1]:+.12f} {s.q[1, -1]:+.12f}   {s.counts['forces']} forces, "
          f"{1e6*seconds/s.counts['forces']:.2f} us each")
    if system.has_energy:
        e = s.energy()
        print(f"{'':8} energy {e[0]:.6f} J/kg m^2, largest change {np.abs(e - e[0]).max():.1e}")
