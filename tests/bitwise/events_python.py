# SPDX-License-Identifier: BSD-3-Clause
"""The problem with events of README.md by the Python package.

usage: events_python.py python|ctypes|numba      the kind of the functions
"""
import ctypes
import sys

import numpy as np

import dynstep
from dynstep import Event, signature

kind = sys.argv[1]


def force(n, t, q, v, f, side):
    f[0] = ((0.0 - q[0]*(1.0 + q[0]*q[0])) + 0.5*(q[1] - q[0])) - 0.125*v[0]
    f[1] = (0.0 - 2.0*q[1]) - 0.5*(q[1] - q[0])
    if side[0] > 0:
        f[1] = f[1] - 4.0*(q[1] - 0.125)
    return 0


def switches(n, count, t, q, v, s, ctx):
    s[0] = q[1] - 0.125
    return 0


def wall(n, count, t, q, v, s, ctx):
    s[0] = q[0] + 0.25
    return 0


def turn(n, count, t, q, v, s, ctx):
    s[0] = v[1]
    return 0


def action(n, which, t, q, v, ctx):
    v[0] = -(0.5*v[0])
    return 1


side = np.array([-1], np.int32)
options = {}
if kind == "python":
    def with_arrays(function, *sizes):
        def of_python(t, q, v):
            result = np.empty(sizes[-1])
            function(*sizes, t, q, v, result, side)
            return result
        return of_python

    def act(t, q, v):
        v = v.copy()
        action(2, 0, t, q, v, None)
        return q, v

    force, switches, wall, turn = with_arrays(force, 2), *(with_arrays(f, 2, 1) for f in (switches, wall, turn))
elif kind == "ctypes":
    def array(address, count=2, ctype=ctypes.c_double):
        return (ctype*count).from_address(address)

    def through_ctypes(function, name):
        def of_ctypes(n, *rest):
            if name == "force":
                t, q, v, f, ctx = rest
                return function(n, t, array(q), array(v), array(f), array(ctx, 1, ctypes.c_int32))
            if name == "action":
                which, t, q, v, ctx = rest
                return function(n, which, t, array(q), array(v), ctx)
            count, t, q, v, s, ctx = rest
            return function(n, count, t, array(q), array(v), array(s, count), ctx)
        return signature(name, "ctypes")(of_ctypes)

    force, switches, wall, turn, act = (through_ctypes(f, name) for f, name in (
        (force, "force"), (switches, "switches"), (wall, "event"), (turn, "event"), (action, "action")))
    options = {"user_data": side}
else:
    import numba
    inner = numba.njit(force)

    @numba.cfunc(signature("force"))
    def force(n, t, q, v, f, ctx):
        return inner(n, t, q, v, f, numba.carray(ctx, 1, numba.int32))

    switches, wall, turn, act = (numba.cfunc(signature(name))(f) for f, name in (
        (switches, "switches"), (wall, "event"), (turn, "event"), (action, "action")))
    options = {"user_data": side}


def run(problem, system, method):
    s = dynstep.solve(system, (0, 6), [1.0, 0.0], [0.0, 0.5], method, rtol=1e-8, atol=dict(q=1e-9, v=[1e-7, 1e-8]),
                      events=[Event(wall, -1, action=act), turn])
    assert s.success, s.message

    def show(name, *numbers):
        print(problem, name, *(f"{int(x):016X}" for x in np.concatenate(numbers).view(np.uint64)))

    for t, q, v, a in zip(s.t, s.q.T, s.v.T, s.a.T):
        show("point", [t], q, v, a)
    met = [(t, i, q, v) for i in (0, 1) for t, q, v in zip(s.t_events[i], s.q_events[i], s.v_events[i])]
    for t, i, q, v in sorted(met, key=lambda event: event[0]):
        show(f"event{i + 1}", [t], q, v)


side[0] = -1
without = dynstep.MechanicalSystem(2, force, **options)
extrapolation = dynstep.NewmarkExtrapolation(levels=4)
for method in (extrapolation, "bi"):
    run("f", without, method)
run("g", dynstep.MechanicalSystem(2, force, switches=switches, side=side, **options), extrapolation)
