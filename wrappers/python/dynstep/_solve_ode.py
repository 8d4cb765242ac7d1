# SPDX-License-Identifier: BSD-3-Clause
"""The solution of a first-order system over an interval."""

import numpy as np

from . import _core
from ._arguments import vector
from ._compiled import recognise
from ._handle import SUCCESS
from ._interpolant import OdeInterpolant
from ._linear import LinearSystem
from ._mechanical import MechanicalSystem
from ._method_table import as_method
from ._ode import LinearOde, OdeSystem
from ._request import Request, make_handle
from ._resume import LeftRun
from ._run import warn_of_steps
from ._solution import OdeSolution
from ._steps import choose_steps


def solve_ode(system, t_span, y0, method="bi", *, h=None, rtol=None, atol=None, tol=None, controller="standard",
              h_first=None, h_max=None, h_min=None, t_eval=None, every=1, dense_output=False, events=None, observer=None,
              max_steps=None, progress=False, args=()):
    """Solution of y' = f(t,y) over an interval, in steps by tolerances, or of one length.

    Parameters
    ----------
    system : OdeSystem, LinearOde, or a function
        A function ``f(t, y, *args)``, Python or compiled, stands for ``OdeSystem(n, f, args=args)``.
    t_span : (float, float)
        Begin and end; the end may lie before the begin.
    y0 : array_like, shape (n,)
        y at the begin; a number where n = 1.
    method : Method or str
        ``BI(...)``, ``BIExtrapolation(...)``, ``Pade(...)``, or a shorthand; see :func:`methods`.
    h : float, optional
        Step length, as for :func:`solve`.  Default: steps follow the error estimate of the method, by `rtol` and `atol`.
    rtol, atol : float, optional
        As for :func:`solve`; `atol` may be an array of shape (n,).  Default: 1e-6 and 1e-8.
    tol : float, optional
        In place of rtol and atol, the norm of Xie 1995: a step may have the error tol*max(|y|, 1), |y| the
        largest component.
    controller : "standard" or "pi"
        With `tol`: how the next step follows from the error, Xie 1995, eqs. (3.15) and (3.16).  Where the solution is
        smooth, the estimate settles near 0.4 of what is allowed, with "pi" near 0.04: more steps, smaller errors.
    h_first, h_max : float, optional
        Without `h`: the first step, of the sign of t_span[1] - t_span[0] (default: chosen; with `tol` 1/128 of the interval), and
        the longest one (default: the interval; with `tol` 1/16 of it).
    h_min : float, optional
        As for :func:`solve`.
    t_eval, every, dense_output, max_steps, progress
        As for :func:`solve`; ``sol(t)`` gives y.
    events : callable, compiled function, Event, or a list of them, optional
        ``event(t, y, *args)``, as for :func:`solve`, with actions ``action(t, y, *args)`` that return None, a new y, or True.
        Compiled ones get y in q, and NULL in v.
    observer : callable or compiled function, optional
        ``observer(t, y, yp)`` sees each step; a true result ends the run.  A compiled one has the signature
        ``dynstep.signature("observer")``, y in q, y' in a, NULL in v.
    args : tuple
        Further arguments of Python functions, where `system` is a function; events and their actions get them, too.

    Returns
    -------
    OdeSolution
        Also where the integration fails: then ``success`` is False, ``message`` says why, and the trajectory up to
        there is kept; where f fails at the begin, that is y0 alone, with NaN for y'.

    Raises
    ------
    ValueError, TypeError
        An argument that cannot be; the message names it.
    MemoryError
        With `h`, without an observer and events: at once, where the machine's memory cannot hold the points to be recorded.
    Exception
        Whatever a Python function of the system, an event, an action, or the observer, raises.

    Notes
    -----
    Ctrl-C is seen within a second, also where all functions are compiled, or after the step that is being made, where that
    takes longer (a large dense factorization).  Without Python functions the
    interpreter's lock is free while steps are made.

    Examples
    --------
    >>> solution = dynstep.solve_ode(lambda t, y: -2*y, (0, 5), 1.0, h=0.1)
    >>> solution.t.shape, solution.y.shape
    ((51,), (1, 51))
    >>> dynstep.solve_ode(lambda t, y: -2*y, (0, 5), 1.0, rtol=1e-9).success
    True
    """
    y0 = vector("y0", y0)
    system = _system(system, y0.size, args)
    y0 = vector("y0", y0, system.n)
    method = as_method(method)
    steps = choose_steps(system, h, rtol, atol, tol, controller, h_first, h_max, h_min, every)
    request = Request(t_span, steps, t_eval, every, dense_output, max_steps, progress, observer, events, args)
    with request:
        handle = make_handle(system, method, observer, request.events)
        started = handle.call(_core.dynstep_start_ode, request.t0, y0 if system.ordering is None else y0[system.ordering])
        record, code = request.run(handle, started)
    t, y, _, yp, *_ = record.finish(system.ordering)
    met = request.outcome(handle, system)
    points, sol = request.choose((t, y, yp), OdeInterpolant, record.ends)
    if started != SUCCESS and request.has_begin:
        points = np.array([request.t0]), y0.reshape(-1, 1).copy(), np.full((system.n, 1), np.nan)
    return OdeSolution(*points, status=code, message=request.message(handle, system, code), counts=handle.counts(),
                       method=method, system=system, sol=sol, events=met[:2], warning=warn_of_steps(handle, stacklevel=2),
                       run=LeftRun(handle, *request.what_is_left))


def _system(system, n, args):
    """The system that an object or a function means."""
    if isinstance(system, (OdeSystem, LinearOde)):
        if np.size(args) or args is None:
            raise ValueError("args go with a function; a system has arguments of its own: OdeSystem(..., args=...)")
        return system
    if isinstance(system, (LinearSystem, MechanicalSystem)):
        raise TypeError(f"system is a {type(system).__name__}, which goes with solve; expected an OdeSystem, a LinearOde "
                        "or a function f(t, y)")
    if not callable(system) and recognise("system", system, "rhs") is None:
        raise TypeError(f"system must be an OdeSystem, a LinearOde or a function f(t, y), not {system!r}")
    return OdeSystem(n, system, args=args)
