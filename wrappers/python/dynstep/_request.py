# SPDX-License-Identifier: BSD-3-Clause
"""What `solve` and `solve_ode` have in common: an interval, its steps, what is recorded of it."""

import re

import numpy as np

from . import _core
from ._arguments import array, flag, integer, vector
from ._events import Events
from ._functions import UserFunction
from ._handle import EVENT, SUCCESS, TOO_MANY_STEPS, Handle
from ._matrices import NOTHING
from ._progress import Progress
from ._record import NoRecord, Record
from ._run import MANY, drive

# A library's sentence counts events and switches from 1
_COUNTED = re.compile(r"\b(event|switch)( function)? (\d+)\b")


class Request:
    """The arguments of a run, checked; a context, since progress is shown while it lasts."""

    def __init__(self, t_span, steps, t_eval, every, dense_output, max_steps, progress, observer=None,
                 events=None, args=()):
        self.t0, self._t1 = _span(t_span)
        self._steps = steps
        self._every = integer("every", every, 0)
        self._t_eval = None if t_eval is None else times_within(t_eval, self.t0, self._t1)
        self._dense = flag("dense_output", dense_output)
        self._max_steps = None if max_steps is None else integer("max_steps", max_steps, 1, 2**62)
        self.events = Events(events, args)
        self._may_end_early = observer is not None or bool(self.events)
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
        if dense:
            handle.call(_core.dynstep_set_dense, 1)
        code = self._steps.begin(handle, self._t1, 0 if nothing else every, asked)
        if code != SUCCESS:                                      # such as a tolerance below rounding
            return present_point(handle) if self.has_begin else NoRecord(handle.sizes), code
        if nothing:
            record = NoRecord(handle.sizes)
        else:
            expected = MANY if self._expected is None else self._expected
            steps = min(expected, self._max_steps or expected)
            points = asked.size or steps//(every or steps + 1) + 3
            all_come = not asked.size and self._expected is not None and not self._may_end_early
            record = Record(handle.sizes, MANY if dense else points, points if all_come else 0, has_nodes=dense)
        return record, drive(handle, record, self._max_steps, self._progress, self.events)

    def choose(self, points, interpolant, ends):
        """(points, sol): those that were asked for, out of what was recorded, and what makes others of them; `ends` are the
        places where steps end."""
        if not self._dense or not points[0].size:
            return points, None
        t, *rest = at_ends = at_places(points, ends)
        sol = interpolant_through(points, ends, interpolant)
        if self._t_eval is not None:
            reached = self._t_eval[np.abs(self._t_eval - t[0]) <= abs(t[-1] - t[0])]
            return (reached, *sol._points(reached)), sol
        if self._every == 1:
            return at_ends, sol
        chosen = self._each(t)
        return (t[chosen], *(x[:, chosen] for x in rest)), sol

    def _each(self, t):
        """Places of each `every`-th step and of events, and the last one; 0: the last one alone."""
        last = t.size - 1
        if not self._every:
            return np.array([last])
        twice = np.zeros(t.size, bool)
        twice[1:] = np.diff(t) == 0.0
        twice[:-1] |= twice[1:]
        at_event = twice | np.isin(t, self._event_times)
        return np.union1d(np.union1d(np.flatnonzero(~at_event)[::self._every], np.flatnonzero(at_event)), last)

    def outcome(self, handle, system):
        """Times and states of events, as `Events.outcome` gives them."""
        found = self.events.outcome(handle, system.ordering)
        self._event_times = np.concatenate([*found[0], []]) if found[0] is not None else np.empty(0)
        return found

    def message(self, handle, system, code):
        """Sentence for a code."""
        return message_of(handle, system, code, self._max_steps, self.events)

    @property
    def what_is_left(self):
        """What `LeftRun` has to know beside the handle."""
        nothing = self._t_eval is not None and not self._t_eval.size
        return self.events, "nodes" if self._dense else "nothing" if nothing else "steps", self._t_eval


def at_places(points, places):
    """Some of the points."""
    return points if places.size == points[0].size else tuple(x[..., places] for x in points)


def interpolant_through(points, ends, interpolant):
    """What goes through recorded points; an action at the end, that changed the state, is left out."""
    t = points[0][ends]
    ends = ends[:np.flatnonzero(t == t[-1])[0] + 1]
    return interpolant(*(x[..., :ends[-1] + 1] for x in points), ends)


def present_point(handle):
    """A record of the last good point."""
    record = Record(handle.sizes, 1)
    get = _core.dynstep_get_ode if handle.first_order else _core.dynstep_get
    _, time, *present = handle.call(get, handle.n)
    t, q, v, a = record.room()
    t[0], q[:], a[:] = time, present[0], present[-1]
    if not handle.first_order:
        v[:] = present[1]
    record.add(1, lambda count, m, p: [x.reshape(count, -1) for x in
                                       handle.call(_core.dynstep_get_multipliers, m, p)[1:]], None)
    return record


def make_handle(system, method, observer=None, events=None):
    """A handle for a system and a method; `events` are those of a request."""
    handle = Handle(system.n, system.first_order)
    system._install(handle)
    method._install(handle)
    if observer is not None:
        function = UserFunction("observer", observer, "observer")
        if function.is_python:
            function.fun = _with_one_answer(observer)
        handle.bind(_core.dynstep_set_observer, function, order=system.ordering)
    if events is not None:
        events.install(handle, system.ordering)
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


def message_of(handle, system, code, max_steps, events):
    """Sentence for the code of a run."""
    if code == EVENT:
        return f"{events.last(handle)} ended the run at t = {handle.time:g}"
    return message(handle, system, code, max_steps)


def message(handle, system, code, max_steps=None):
    """Sentence for a code."""
    if code == SUCCESS:
        return "the end of the interval was reached"
    if code == TOO_MANY_STEPS:
        return (f"max_steps = {max_steps} steps were made, up to t = {handle.time:g}, before the end of the interval")
    text = _COUNTED.sub(lambda found: f"{'events' if found[1] == 'event' else 'switches'}[{int(found[3]) - 1}]", handle.sentence)
    if code < 0 and system.ordering is not None and "equation" in text:
        text += " (equations are counted in the order of system.ordering)"
    return text


def _span(t_span):
    span = array("t_span", t_span)
    if span.shape != (2,):
        raise ValueError(f"t_span has the shape {span.shape}, expected (2,): begin and end")
    return map(float, span)


def times_within(t_eval, t0, t1):
    """Times to record, of a run from t0 to t1."""
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
