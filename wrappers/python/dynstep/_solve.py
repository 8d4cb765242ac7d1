# SPDX-License-Identifier: BSD-3-Clause
"""The solution of a whole interval."""

import numpy as np

from . import _core
from ._arguments import array, flag, integer, number, vector
from ._drift import start_correction, warn_of_correction
from ._functions import UserFunction
from ._handle import INCONSISTENT_START, SUCCESS, TOO_MANY_STEPS, Handle
from ._interpolant import Interpolant
from ._linear import LinearSystem
from ._matrices import NOTHING
from ._mechanical import MechanicalSystem
from ._method_table import method_for
from ._progress import Progress
from ._record import NoRecord, Record
from ._run import drive, expected_steps
from ._solution import Solution


def solve(system, t_span, q0, v0, method=None, *, h, t_eval=None, every=1, dense_output=False,
          observer=None, max_steps=None, progress=False):
    """Motion of a mechanical system over an interval, in steps of one length.

    Parameters
    ----------
    system : LinearSystem or MechanicalSystem
    t_span : (float, float)
        Begin and end; the end may lie before the begin.
    q0, v0 : array_like, shape (n,)
        Coordinates and velocities at the begin; numbers where n = 1.
    method : Method or str, optional
        Such as ``Newmark()``, ``NewmarkExtrapolation(levels=4)``, ``SOI2(rho_inf=0.8)``, or a shorthand: see
        :func:`methods`.  Default: "newmark-extrapolation"; "soi2" for a system with constraints.
    h : float
        Step length, of the sign of t_span[1] - t_span[0].  The steps lie at t_span[0] + k*h; the last one is shorter
        where the interval is no whole number of steps.
    t_eval : array_like, shape (nt,), optional
        Times to record, in the order of the run.  Inside a step q, v, a are interpolated (degree 5), multipliers
        linearly.
    every : int
        Without `t_eval`: record the begin, each `every`-th step, and the end; 0: the end alone.
    dense_output : bool
        Record all steps and give ``Solution.sol``, which interpolates between them.
    observer : callable or compiled function, optional
        ``observer(t, q, v, a)`` sees each step; a true result ends the run.
    max_steps : int, optional
        After so many steps the run ends without success.
    progress : bool
        Show a bar on stderr (tqdm's where it is installed).

    Returns
    -------
    Solution
        Also where the integration fails: then ``success`` is False, ``message`` says why, and the trajectory up to
        there is kept.

    Raises
    ------
    ValueError, TypeError
        An argument that cannot be; the message names it.
    Exception
        Whatever a Python function of the system, or the observer, raises.

    Warns
    -----
    StartCorrected
        q0 or v0 did not fulfil the constraints, and was moved by more than 1e-8 of its size; what was found and moved
        is in ``Solution.start_correction``.

    Notes
    -----
    Ctrl-C is seen within a second, also where all functions are compiled.  Without Python functions the
    interpreter's lock is free while steps are made.

    Examples
    --------
    >>> system = dynstep.LinearSystem(M=2.0, K=8.0)
    >>> solution = dynstep.solve(system, (0, 10), 1.0, 0.0, h=0.1)
    >>> solution.t.shape, solution.q.shape
    ((101,), (1, 101))
    """
    if not isinstance(system, (LinearSystem, MechanicalSystem)):
        raise TypeError(f"system must be a LinearSystem or a MechanicalSystem, not {type(system).__name__}")
    method = method_for(system, method)
    t0, t1 = _span(t_span)
    q0, v0 = vector("q0", q0, system.n), vector("v0", v0, system.n)
    h = number("h", h)
    every = integer("every", every, 0)
    if t_eval is not None:
        t_eval = _times(t_eval, t0, t1)
    dense = flag("dense_output", dense_output)
    if max_steps is not None:
        max_steps = integer("max_steps", max_steps, 1, 2**62)
    expected = expected_steps(t0, t1, h)
    progress = Progress(expected) if flag("progress", progress) else None

    try:
        handle = make_handle(system, method, observer)
        code = start(handle, system, t0, q0, v0)
        record = NoRecord(system.n, handle.m, handle.p)
        correction = start_correction(handle) if code in (SUCCESS, INCONSISTENT_START) else None
        if code == SUCCESS:
            warn_of_correction(correction, q0, v0, stacklevel=2)
            asked = NOTHING if dense or t_eval is None else t_eval
            nothing = t_eval is not None and t_eval.size == 0 and not dense
            handle.call(_core.dynstep_begin, t1, h, 0 if nothing else 1 if dense else every, asked)
            if not nothing:
                steps = min(expected, max_steps or expected)
                record = Record(system.n, asked.size or steps//(1 if dense else every or steps + 1) + 3,
                                handle.m, handle.p)
            code = drive(handle, record, max_steps, progress)
    finally:
        if progress is not None:
            progress.close()

    points = record.finish(system.ordering)
    sol = None
    if dense and points[0].size:
        sol = Interpolant(*points)
        points = _choose(points, sol, t_eval, every)
    return Solution(*points, status=code, message=message(handle, system, code, max_steps), counts=handle.counts(),
                    method=method, system=system, sol=sol, start_correction=correction)


def make_handle(system, method, observer=None):
    """A handle for a system and a method."""
    handle = Handle(system.n)
    system._install(handle)
    method._install(handle)
    if observer is not None:
        handle.bind(_core.dynstep_set_observer, UserFunction("observer", observer, "observer"), order=system.ordering)
    return handle


def start(handle, system, t, q, v):
    """Code of the start at a point that the user gives."""
    system._install_constraints(handle, t, q, v)
    order = system.ordering
    return handle.call(_core.dynstep_start, t, *((q, v) if order is None else (q[order], v[order])))


def message(handle, system, code, max_steps=None):
    """Sentence for a code."""
    if code == SUCCESS:
        return "the end of the interval was reached"
    if code == TOO_MANY_STEPS:
        t = handle.call(_core.dynstep_get, handle.n)[1]
        return f"max_steps = {max_steps} steps were made, up to t = {t:g}, before the end of the interval"
    text = handle.sentence
    if code < 0 and system.ordering is not None and "equation" in text:
        text += " (equations are counted in the order of system.ordering)"
    return text


def _span(t_span):
    span = array("t_span", t_span)
    if span.shape != (2,):
        raise ValueError(f"t_span has the shape {span.shape}, expected (2,): begin and end")
    return map(float, span)


def _times(t_eval, t0, t1):
    times = vector("t_eval", t_eval)
    direction = -1.0 if t1 < t0 else 1.0
    outside = np.flatnonzero((direction*(times - t0) < 0.0) | (direction*(t1 - times) < 0.0))
    if outside.size:
        raise ValueError(f"t_eval[{outside[0]}] = {times[outside[0]]} lies outside t_span, {t0} to {t1}")
    disorder = np.flatnonzero(direction*np.diff(times) < 0.0)
    if disorder.size:
        at = disorder[0] + 1
        raise ValueError(f"t_eval[{at}] = {times[at]} comes after {times[at - 1]}; sort t_eval in the direction of "
                         "the run")
    return times


def _choose(points, sol, t_eval, every):
    """Points that were asked for, out of a record of all steps."""
    t, *rest = points
    if t_eval is not None:
        reached = t_eval[np.abs(t_eval - t[0]) <= abs(t[-1] - t[0])]
        return reached, *sol(reached), *sol.multipliers(reached)
    last = t.size - 1
    chosen = np.union1d(np.arange(0, t.size, every), last) if every else np.array([last])
    return points if every == 1 else (t[chosen], *(x[:, chosen] for x in rest))
