# SPDX-License-Identifier: BSD-3-Clause
"""What `solve` and `solve_ode` have in common: an interval, its steps, what is recorded of it."""

import numpy as np

from . import _core
from ._arguments import array, choice, flag, integer, number, vector
from ._functions import UserFunction
from ._handle import SUCCESS, TOO_MANY_STEPS, Handle
from ._matrices import NOTHING
from ._progress import Progress
from ._record import NoRecord, Record
from ._run import MANY, drive, expected_steps


_CONTROLLERS = {"standard": 1, "pi": 2}
_IN_FRONT = 1                            # place of the 0.8 of "pi"


class EvenSteps:
    """Steps of one length."""

    def __init__(self, h):
        self._h = number("h", h)

    def expected(self, t0, t1):
        """Number of steps, for room and progress."""
        return expected_steps(t0, t1, self._h)

    def begin(self, handle, t1, every, t_eval):
        handle.call(_core.dynstep_begin, t1, self._h, every, t_eval)


class ControlledSteps:
    """Steps that follow the error estimate of the method."""

    def __init__(self, tol, controller, h_first, h_max):
        tol = number("tol", tol)
        if not tol > 0.0:
            raise ValueError(f"tol = {tol:g} must be positive")
        self._control = (tol, choice("controller", controller, _CONTROLLERS), _IN_FRONT,
                         0.0 if h_first is None else number("h_first", h_first),
                         0.0 if h_max is None else number("h_max", h_max))

    def expected(self, t0, t1):
        """None: not known."""
        return None

    def begin(self, handle, t1, every, t_eval):
        handle.call(_core.dynstep_begin_controlled, t1, *self._control, t_eval)


def choose_steps(h, tol, controller, h_first, h_max, every):
    """What the arguments ask for."""
    if (h is None) == (tol is None):
        raise ValueError("exactly one of h and tol must be given: h for steps of one length, tol for steps that follow the "
                         "error estimate of the method")
    if tol is not None:
        if every != 1:
            raise ValueError(f"every = {every!r} goes with h; with tol choose points by t_eval")
        return ControlledSteps(tol, controller, h_first, h_max)
    if h_first is not None or h_max is not None or choice("controller", controller, _CONTROLLERS) != 1:
        raise ValueError("controller, h_first and h_max go with tol, not with h")
    return EvenSteps(h)


class Request:
    """The arguments of a run, checked; a context, since progress is shown while it lasts."""

    def __init__(self, t_span, steps, t_eval, every, dense_output, max_steps, progress, observer=None):
        self.t0, self._t1 = _span(t_span)
        self._steps = steps
        self._every = integer("every", every, 0)
        self._t_eval = None if t_eval is None else _times(t_eval, self.t0, self._t1)
        self._dense = flag("dense_output", dense_output)
        self._max_steps = None if max_steps is None else integer("max_steps", max_steps, 1, 2**62)
        self._observed = observer is not None                    # it may end the run early
        self._expected = steps.expected(self.t0, self._t1)
        self._progress = Progress(self._expected) if flag("progress", progress) else None

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        if self._progress is not None:
            self._progress.close()

    @property
    def has_begin(self):
        """The begin is a point to be recorded."""
        return self._t_eval is None or self.t0 in self._t_eval

    def run(self, handle, code):
        """(record, code) of the run of a handle whose start gave `code`."""
        if code != SUCCESS:
            return NoRecord(handle.sizes), code
        dense, t_eval = self._dense, self._t_eval
        asked = NOTHING if dense or t_eval is None else t_eval
        nothing = t_eval is not None and t_eval.size == 0 and not dense
        every = 1 if dense else self._every
        self._steps.begin(handle, self._t1, 0 if nothing else every, asked)
        if nothing:
            record = NoRecord(handle.sizes)
        else:
            expected = MANY if self._expected is None else self._expected
            steps = min(expected, self._max_steps or expected)
            record = Record(handle.sizes, asked.size or steps//(every or steps + 1) + 3,
                            all_come=not asked.size and self._expected is not None and not self._observed)
        return record, drive(handle, record, self._max_steps, self._progress)

    def choose(self, points, interpolant):
        """(points, sol): those that were asked for, out of what was recorded, and what makes others of them."""
        t, *rest = points
        if not self._dense or not t.size:
            return points, None
        sol = interpolant(*points)
        if self._t_eval is not None:
            reached = self._t_eval[np.abs(self._t_eval - t[0]) <= abs(t[-1] - t[0])]
            return (reached, *sol._points(reached)), sol
        if self._every == 1:
            return points, sol
        last = t.size - 1
        chosen = np.union1d(np.arange(0, t.size, self._every), last) if self._every else np.array([last])
        return (t[chosen], *(x[:, chosen] for x in rest)), sol

    def message(self, handle, system, code):
        """Sentence for a code."""
        return message(handle, system, code, self._max_steps)


def make_handle(system, method, observer=None):
    """A handle for a system and a method."""
    handle = Handle(system.n, system.first_order)
    system._install(handle)
    method._install(handle)
    if observer is not None:
        function = UserFunction("observer", observer, "observer")
        if function.is_python:
            function.fun = _with_one_answer(observer)
        handle.bind(_core.dynstep_set_observer, function, order=system.ordering)
    return handle


def _with_one_answer(observer):
    """The same observer; an array for an answer is refused by name."""
    def observed(*point):
        answer = observer(*point)
        if isinstance(answer, np.ndarray) and answer.size != 1:
            raise ValueError(f"observer returned an array of shape {answer.shape}, expected true to end the run, or false: "
                             "say which, for example by numpy's any() or all()")
        return answer
    return observed


def message(handle, system, code, max_steps=None):
    """Sentence for a code."""
    if code == SUCCESS:
        return "the end of the interval was reached"
    if code == TOO_MANY_STEPS:
        return (f"max_steps = {max_steps} steps were made, up to t = {handle.time:g}, before the end of the interval")
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
