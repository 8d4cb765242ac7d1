# SPDX-License-Identifier: BSD-3-Clause
"""What is watched for in a run, what is done there, and what was met."""

from collections import Counter

import numpy as np

from . import _core
from ._arguments import LARGEST_INTEGER, integer, number
from ._compiled import recognise
from ._functions import UserFunction, further_arguments

_EACH_EVENT, _EACH_ACTION = _core.python_function(104), _core.python_function(105)


class Event:
    """A function whose zeros are events, with what belongs to it; an alternative to attributes of the function, and the way
    for compiled functions that take none.

    Parameters
    ----------
    function : callable or compiled function
        ``function(t, q, v)``, with :func:`solve_ode` ``function(t, y)``, returns a number.  A compiled one has the signature
        ``dynstep.signature("event")``.
    direction : float
        > 0: only zeros from minus to plus, < 0: from plus to minus, both in the direction of the run; 0: all.
    terminal : bool or int
        True: the run ends at the event; a number: when it has been met so often.
    action : callable or compiled function, optional
        ``action(t, q, v)``, with :func:`solve_ode` ``action(t, y)``, returns None where nothing is changed; ``(q, v)`` (or y),
        the values that the run goes on with; or True after it has changed parameters of the system.  The arrays that it gets
        cannot be written to.  A compiled one has the signature ``dynstep.signature("action")``.
    user_data : optional
        What compiled functions get as their context; see :func:`compiled`.

    Examples
    --------
    >>> floor = dynstep.Event(lambda t, q, v: q[0], direction=-1, action=lambda t, q, v: (q, -0.8*v))
    >>> ball = dynstep.MechanicalSystem(1, lambda t, q, v: [-9.81])
    >>> dynstep.solve(ball, (0, 2), 1.0, 0.0, events=floor).t_events
    """

    def __init__(self, function, direction=0, terminal=False, action=None, user_data=None):
        self.function = function
        self.direction = direction
        self.terminal = terminal
        self.action = action
        self.user_data = user_data

    def __repr__(self):
        return (f"Event({self.function!r}, direction={self.direction!r}, terminal={self.terminal!r}, "
                f"action={self.action!r})")


class Events:
    """The events of a run.

    given    None, one event, or several
    args     further arguments of Python functions
    """

    def __init__(self, given, args=()):
        self.met_before = 0              # events of the run before it was left and taken up
        self._given = given is not None
        args = further_arguments(args)
        self._functions, self._actions, self._direction, self._most = [], [], [], []
        for i, event in enumerate(_as_list(given)):
            name = f"events[{i}]"
            owned = isinstance(event, Event)
            data = event.user_data if owned else None
            self._functions.append(UserFunction(name, event.function if owned else event, "event", data, args))
            action = getattr(event, "action", None)
            self._actions.append(None if action is None else UserFunction(f"action of {name}", action, "action", data, args))
            self._direction.append(np.sign(number(f"direction of {name}", getattr(event, "direction", 0))))
            terminal = getattr(event, "terminal", False)
            if isinstance(terminal, (bool, np.bool_)) or terminal is None:
                terminal = int(bool(terminal))
            self._most.append(integer(f"terminal of {name}", terminal, 0, LARGEST_INTEGER))

    def __bool__(self):
        return bool(self._functions)

    def install(self, handle, order):
        """Give all to a handle; `order` is that of its system."""
        if not self:
            return
        handle.bind(_core.dynstep_set_events, _Table(_EACH_EVENT, self._functions), np.array(self._direction, np.int32),
                    np.array([most > 0 for most in self._most], np.int32), order=order)
        if any(action is not None for action in self._actions):
            handle.bind(_core.dynstep_set_event_action, _Table(_EACH_ACTION, self._actions), order=order)

    def go_on(self, handle):
        """True where a terminal event has not been met as often as it must be, since the run was begun or taken up."""
        which = self._met(handle)[0][self.met_before:]
        return Counter(which.tolist())[int(which[-1])] < self._most[which[-1]]

    def outcome(self, handle, order):
        """(t, q, v), each a list of arrays [met] or [met, n] with a place for each event; None where no events were asked
        for."""
        if not self._given:
            return None, None, None
        which, t, q, v = (x[self.met_before:] for x in self._met(handle))
        if order is not None:
            place = np.argsort(order)
            q, v = q[:, place], v[:, place]
        return tuple([x[which == i] for i in range(len(self._functions))] for x in (t, q, v))

    def last(self, handle):
        """Name of the last event."""
        return f"events[{self._met(handle)[0][-1]}]"

    @staticmethod
    def count(handle):
        """How many were met since the run was begun."""
        return handle.call(_core.dynstep_event_count)[1]

    @staticmethod
    def _met(handle):
        """which, t, q, v of all events."""
        count = Events.count(handle)
        which, t = np.empty(count, np.int32), np.empty(count)
        q, v = np.empty((count, handle.n)), np.empty((count, handle.n))
        handle.call(_core.dynstep_get_events, 0, which, t, q.reshape(-1), v.reshape(-1))
        return which, t, q, v


class _Table:
    """Functions of one kind, with a context each, for one function of the library's; None: there is none."""

    def __init__(self, address, functions):
        self._address = address
        self._functions = functions

    def bind(self, failure, order=None):
        """As `UserFunction.bind`."""
        bound = [(0, 0, None) if f is None else f.bind(failure, order=order) for f in self._functions]
        table = np.array([pair for address, context, _ in bound for pair in (address, context)], np.intp)
        return self._address, table.ctypes.data, (table, bound)


def _as_list(given):
    if given is None:
        return []
    if isinstance(given, Event) or callable(given) or recognise("events", given, "event") is not None:
        return [given]
    if isinstance(given, (list, tuple)):
        return list(given)
    raise TypeError(f"events must be a function, an Event, or a list of them, not {given!r}")
