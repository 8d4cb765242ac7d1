# SPDX-License-Identifier: BSD-3-Clause
"""The solution of a whole interval."""

from . import _core
from ._arguments import vector
from ._drift import start_correction, warn_of_correction
from ._handle import INCONSISTENT_START, SUCCESS
from ._interpolant import Interpolant
from ._linear import LinearSystem
from ._mechanical import MechanicalSystem
from ._method_table import method_for
from ._request import Request, make_handle
from ._resume import LeftRun
from ._run import warn_of_steps
from ._solution import Solution
from ._steps import choose_steps


def solve(system, t_span, q0, v0, method=None, *, h=None, rtol=None, atol=None, tol=None, controller="standard",
          h_first=None, h_max=None, h_min=None, t_eval=None, every=1, dense_output=False, events=None, observer=None,
          max_steps=None, progress=False):
    """Motion of a mechanical system over an interval, in steps by tolerances, or of one length.

    Parameters
    ----------
    system : LinearSystem or MechanicalSystem
    t_span : (float, float)
        Begin and end; the end may lie before the begin.
    q0, v0 : array_like, shape (n,)
        Coordinates and velocities at the begin; numbers where n = 1.
    method : Method or str, optional
        Such as ``Newmark()``, ``NewmarkExtrapolation(levels=4)``, ``SOI2(rho_inf=0.8)``, or a shorthand: see
        :func:`methods`.  Default: "newmark-extrapolation"; "soi2" for a system with constraints, "pade" for
        one with feedback.
    h : float, optional
        Step length, of the sign of t_span[1] - t_span[0].  The steps lie at t_span[0] + k*h; the last
        one is shorter where the interval is no whole number of steps.  Default: steps follow the error estimate of the method,
        by `rtol` and `atol`; BI, Pade, SOI2, generalized-alpha and extrapolations of two levels or more have an estimate,
        others are a ValueError.
    rtol, atol : float, optional
        A step is good where the root of the mean of (e/(atol + rtol*abs(y)))**2, over all coordinates and velocities y with
        their estimated errors e, is at most 1; else it is thrown away (``counts["rejections"]``), and a shorter one tried.
        Errors of steps add up, and the system may magnify them.  Default: 1e-6 and 1e-8.  `atol` may also be an array of
        shape (2*n,), for [q, v], a tuple ``(q, v)``, or a dictionary with the keys q, v, and with constraints lam, psi, of
        numbers or (q, v) arrays of shape (n,): ``dict(q=1e-9, v=1e-6, lam=1e-3)``.  Kinds that are left out have 1e-8;
        multipliers that are left out are not looked at.
    tol : float, optional
        In place of rtol and atol, the norm of Xie 1995: a step may have the error tol*max(|y|, 1), |y| the
        largest of the coordinates and velocities.
    controller : "standard" or "pi"
        With `tol`: how the next step follows from the error, Xie 1995, eqs. (3.15) and (3.16).  Where the solution is
        smooth, the estimate settles near 0.4 of what is allowed, with "pi" near 0.04: more steps, smaller errors.
    h_first, h_max : float, optional
        Without `h`: the first step, of the sign of t_span[1] - t_span[0] (default: chosen; with `tol` 1/128 of the interval), and
        the longest one (default: the interval; with `tol` 1/16 of it).
    h_min : float, optional
        With rtol and atol: where a step would have to be shorter than this, the run ends without success; the last one
        before the end or an event may be shorter.
    t_eval : array_like, shape (nt,), optional
        Times to record, in the order of the run.  Inside a step q, v, a have the order of the method, too; multipliers are
        interpolated linearly.
    every : int
        With `h`, without `t_eval`: record the begin, each `every`-th step, and the end; 0: the end alone.  Without `h` each
        step is recorded.
    dense_output : bool
        Give ``Solution.sol``, an interpolant over the whole run that has the order of the method: beside each step real
        ones of parts of its length are made, whose work is counted.
    events : callable, compiled function, Event, or a list of them, optional
        ``event(t, q, v)`` returns a number; where it goes through zero inside a step, that step is made again, for real, up to
        the zero.  As scipy's events these may have attributes: `direction` (> 0: only from minus to plus, < 0: from plus to
        minus) and `terminal` (True: the run ends there; a number: after so many); and `action`, a function
        ``action(t, q, v)`` that returns None, or ``(q, v)`` to go on with, or True after it has changed parameters of the
        system.  Behind a change the method starts anew.  Without `t_eval` the states at events are recorded, those
        before and behind a change both.  See :class:`Event`.
    observer : callable or compiled function, optional
        ``observer(t, q, v, a)`` sees each step; a true result ends the run.
    max_steps : int, optional
        After so many steps the run ends without success; :meth:`Solution.resume` goes on.
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
    MemoryError
        With `h`, without an observer and events: at once, where the machine's memory cannot hold the points to be recorded.
    Exception
        Whatever a Python function of the system, an event, an action, or the observer, raises.

    Warns
    -----
    StartCorrected
        q0 or v0 did not fulfil the constraints, and was moved by more than 1e-8 of its size; what was found and moved
        is in ``Solution.start_correction``.
    StabilityWarning
        The steps are longer than the method bears; the sentence, with numbers, is in ``Solution.warning``.

    Notes
    -----
    Ctrl-C is seen within a second, also where all functions are compiled, or after the step that is being made, where that
    takes longer (a large dense factorization).  Without Python functions the
    interpreter's lock is free while steps are made.

    Examples
    --------
    >>> system = dynstep.LinearSystem(M=2.0, K=8.0)
    >>> solution = dynstep.solve(system, (0, 10), 1.0, 0.0, h=0.1)
    >>> solution.t.shape, solution.q.shape
    ((101,), (1, 101))
    >>> float(round(dynstep.solve(system, (0, 10), 1.0, 0.0, rtol=1e-9).q[0, -1], 6))      # cos(2*10)
    0.408082
    """
    check_mechanical(system)
    method = method_for(system, method)
    q0, v0 = vector("q0", q0, system.n), vector("v0", v0, system.n)
    steps = choose_steps(system, h, rtol, atol, tol, controller, h_first, h_max, h_min, every)
    request = Request(t_span, steps, t_eval, every, dense_output, max_steps, progress, observer, events)
    with request:
        handle = make_handle(system, method, observer, request.events)
        code = start(handle, system, request.t0, q0, v0)
        correction = start_correction(handle) if code in (SUCCESS, INCONSISTENT_START) else None
        if code == SUCCESS:
            warn_of_correction(correction, q0, v0, stacklevel=2)
        record, code = request.run(handle, code)
    met = request.outcome(handle, system)
    points, sol = request.choose(record.finish(system.ordering), Interpolant, record.ends)
    return Solution(*points, status=code, message=request.message(handle, system, code), counts=handle.counts(),
                    method=method, system=system, sol=sol, start_correction=correction, events=met,
                    warning=warn_of_steps(handle, stacklevel=2), run=LeftRun(handle, *request.what_is_left))


def check_mechanical(system):
    """`solve` and `Integrator` take mechanical systems."""
    if isinstance(system, (LinearSystem, MechanicalSystem)):
        return
    hint = ", which goes with solve_ode" if getattr(system, "first_order", False) is True else ""
    raise TypeError(f"system must be a LinearSystem or a MechanicalSystem, not {type(system).__name__}{hint}")


def start(handle, system, t, q, v):
    """Code of the start at a point that the user gives."""
    system._install_constraints(handle, t, q, v)
    order = system.ordering
    return handle.call(_core.dynstep_start, t, *((q, v) if order is None else (q[order], v[order])))
