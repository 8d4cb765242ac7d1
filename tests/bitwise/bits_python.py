# SPDX-License-Identifier: BSD-3-Clause
"""The problems of README.md by the Python package.

usage: bits_python.py python|numba|ctypes|sparse    the kind of the functions; sparse: matrices of scipy
"""
import ctypes
import sys

import numpy as np

import dynstep
from dynstep import signature


def load(n, t, p, ctx):
    for i in range(n):
        p[i] = (i + 1)*(t - (0.25*t)*t)
    return 0


def force(n, t, q, v, f, ctx):
    d = q[0] - q[1]
    f[0] = ((0.0 - 4.0*(q[0] - ((q[0]*q[0])*q[0])/6.0)) - ((0.25*d)*v[1])*v[1]) - 0.125*v[0]
    f[1] = ((0.0 - 2.0*(q[1] - ((q[1]*q[1])*q[1])/6.0)) + ((0.25*d)*v[0])*v[0]) - 0.125*v[1]
    return 0


def mass(n, t, q, v, m, ctx):
    d = q[0] - q[1]
    m[0] = 2.0
    m[1] = 1.0 - (0.5*d)*d
    m[2] = m[1]
    m[3] = 1.5
    return 0


def with_arrays(function, shape):
    """The function as the package wants it from Python: arrays in, an array out."""
    def of_python(t, *qv):
        result = np.empty(shape)
        function(len(result), t, *qv, result.reshape(-1), None)
        return result
    return of_python


def through_ctypes(function, name):
    """A call-back of ctypes: addresses in, a code out."""
    def of_ctypes(n, t, *addresses):
        *arrays, context = addresses
        size = n*n if name == "mass" else n
        return function(n, t, *((ctypes.c_double*size).from_address(a) for a in arrays), context)
    return signature(name, "ctypes")(of_ctypes)


def all_runs(problem, system, q0, v0):
    for name, method, t_eval in (("newmark", "newmark", None), ("extrapolation", "newmark-extrapolation", None),
                                 ("times", "newmark", [0.1, 0.11, 0.5, 1.99])):
        s = dynstep.solve(system, (0, 2), q0, v0, method, h=1/32, t_eval=t_eval)
        assert s.success, s.message
        for t, q, v, a in zip(s.t, s.q.T, s.v.T, s.a.T):
            numbers = np.concatenate([[t], q, v, a]).view(np.uint64)
            print(problem, name, *(f"{int(x):016X}" for x in numbers))


kind = sys.argv[1]
if kind == "numba":
    import numba
    load, force, mass = (numba.cfunc(signature(f.__name__))(f) for f in (load, force, mass))
elif kind == "ctypes":
    load, force, mass = (through_ctypes(f, f.__name__) for f in (load, force, mass))
else:
    load, force, mass = with_arrays(load, 3), with_arrays(force, 2), with_arrays(mass, (2, 2))

M, K = np.array([2.0, 1.0, 1.0]), dynstep.banded([[0.0, -1.0, -1.0], [3.0, 2.0, 2.0], [-1.0, -1.0, 0.0]], 1, 1)
C = dynstep.banded(0.0625*K.ab, 1, 1)
if kind == "sparse":
    from scipy.sparse import csr_array, diags_array
    M, C, K = diags_array(M), csr_array(C.toarray()), csr_array(K.toarray())
all_runs("a", dynstep.LinearSystem(M, C, K, load), [1.0, 0.0, -0.5], [0.0, 0.25, 0.0])
all_runs("b", dynstep.MechanicalSystem(2, force, mass, mass_symmetric=True), [1.0, -0.5], [0.0, 0.25])
