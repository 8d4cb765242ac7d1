# SPDX-License-Identifier: BSD-3-Clause
"""The first-order problem of README.md by the Python package.

usage: odes_python.py python|numba      the kind of the function
"""
import sys

import numpy as np

import dynstep


def rhs(n, t, y, f, ctx):
    f[0] = y[0]*(1.0 - y[1])
    f[1] = y[1]*(y[0] - 1.0) + 0.125*t
    return 0


def of_python(t, y):
    f = np.empty(2)
    rhs(2, t, y, f, None)
    return f


if sys.argv[1] == "numba":
    import numba
    system = numba.cfunc(dynstep.signature("rhs"))(rhs)
else:
    system = of_python
even = {"h": 1/32}
for name, method, run in (("bi", "bi", even), ("times", "bi", {**even, "t_eval": [0.1, 0.11, 0.5, 1.99]}),
                          ("control", "bi", {"tol": 1e-6, "controller": "pi", "h_first": 0.125}), ("bi45", "bi45", even)):
    s = dynstep.solve_ode(system, (0, 2), [2.0, 3.0], method, **run)
    assert s.success, s.message
    for t, y, yp in zip(s.t, s.y.T, s.yp.T):
        print("e", name, *(f"{int(x):016X}" for x in np.concatenate([[t], y, yp]).view(np.uint64)))
