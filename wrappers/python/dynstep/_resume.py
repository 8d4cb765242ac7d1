# SPDX-License-Identifier: BSD-3-Clause
"""Runs that are left and taken up again, in the same program or from a checkpoint."""

import os

import numpy as np

from . import _core
from ._arguments import flag, integer
from ._events import Events
from ._handle import FILE_ERROR, SUCCESS
from ._interpolant import Interpolant, OdeInterpolant
from ._linear import LinearSystem
from ._mechanical import MechanicalSystem
from ._method_table import as_method, method_for
from ._ode import LinearOde, OdeSystem
from ._progress import Progress
from ._record import NoRecord, Record
from ._request import at_places, interpolant_through, make_handle, message_of, present_point, times_within
from ._run import MANY, drive, warn_of_steps
from ._solution import OdeSolution, Solution


class LeftRun:
    """A run that can go on: what a Solution keeps for that.

    events     of the run
    records    "steps"; "nodes": those inside steps, too; "nothing"
    t_eval     times that are asked for, where nodes are recorded; None: ends of steps
    """

    def __init__(self, handle, events, records, t_eval=None):
        self._handle = handle
        self._events = events
        self._records = records
        self._t_eval = t_eval

    def checkpoint(self, path):
        """See `Solution.checkpoint`."""
        handle = self._handle
        code = handle.call(_core.dynstep_checkpoint, os.fsencode(path), refuse=False)
        if code != SUCCESS:
            raise (OSError if code == FILE_ERROR else ValueError)(handle.sentence)

    def go_on(self, system, method, max_steps, progress, stacklevel):
        """A Solution with what comes from here on."""
        handle = self._handle
        max_steps = None if max_steps is None else integer("max_steps", max_steps, 1, 2**62)
        self._events.met_before = self._events.count(handle)
        begin = present_point(handle).finish(system.ordering) if self._records == "nodes" else None
        record = NoRecord(handle.sizes) if self._records == "nothing" else \
            Record(handle.sizes, MANY, has_nodes=self._records == "nodes")
        bar = Progress(None) if flag("progress", progress) else None
        try:
            code = drive(handle, record, max_steps, bar, self._events)
        finally:
            if bar is not None:
                bar.close()
        met = self._events.outcome(handle, system.ordering)
        points, sol = self._choose(record.finish(system.ordering), record.ends, begin)
        facts = dict(status=code, message=message_of(handle, system, code, max_steps, self._events), counts=handle.counts(),
                     method=method, system=system, sol=sol, warning=warn_of_steps(handle, stacklevel + 1), run=self)
        if handle.first_order:
            t, y, _, yp, *_ = points
            return OdeSolution(t, y, yp, events=met[:2], **facts)
        return Solution(*points, events=met, **facts)

    def _choose(self, points, ends, begin):
        """(points, sol): what was asked for, and the interpolant from the begin of this piece on."""
        if begin is None or not points[0].size:
            return points, None
        at_ends = at_places(points, ends)
        if points[0][0] != begin[0][0]:
            points = tuple(np.concatenate(pair, axis=-1) for pair in zip(begin, points))
            ends = np.concatenate(([0], ends + 1))
        if self._handle.first_order:
            t, y, _, yp, *_ = points
            sol = interpolant_through((t, y, yp), ends, OdeInterpolant)
        else:
            sol = interpolant_through(points, ends, Interpolant)
        if self._t_eval is None:
            return at_ends, sol
        t = points[0]
        reached = self._t_eval[(np.abs(self._t_eval - t[0]) <= abs(t[-1] - t[0])) & (self._t_eval != begin[0][0])
                               & ((self._t_eval - t[0])*(t[-1] - t[0]) >= 0)]
        values = sol._points(reached)
        if self._handle.first_order:
            nothing = np.empty((0, reached.size))
            values = values[0], nothing, values[1], nothing, nothing
        return (reached, *values), sol


def resume(system, path, method=None, *, t_eval=None, events=None, observer=None, max_steps=None, progress=False, args=()):
    """Go on with a run of :func:`solve` or :func:`solve_ode` from a file of :meth:`Solution.checkpoint`, with the same bits.

    Parameters
    ----------
    system
        The one of the run, with the parameters that it had; for :func:`solve_ode` also a function ``f(t, y)``.
    path : str or path
        The file.
    method : Method or str, optional
        The one of the run; the default is that of the function that made it.
    t_eval : array_like, optional
        Where the run has ``dense_output``: times to record.  Other runs go on with the `t_eval` that they have, in the file.
    events, observer, progress, args
        As they were.
    max_steps : int, optional
        After so many steps more the run is left again.

    Returns
    -------
    Solution or OdeSolution
        What follows the point at which the run was left: that one is not in it again.  `t_events` are those that are met from
        there on, `counts` is for the whole run.  ``sol``, where the run has ``dense_output``, begins at that point.

    Raises
    ------
    OSError
        The file cannot be opened.
    ValueError
        It is not whole, or belongs to another system, method or number of events; the message names the line.

    Notes
    -----
    End of the interval, step length or tolerances, dense output, and what is recorded come from the file.  What functions of
    the program remember is theirs: parameters that an action has changed are set before.

    Examples
    --------
    >>> system = dynstep.LinearSystem(M=2.0, K=8.0)
    >>> dynstep.solve(system, (0, 10), 1.0, 0.0, h=0.1, max_steps=50).checkpoint("half.checkpoint")
    >>> dynstep.resume(system, "half.checkpoint").t[[0, -1]]
    """
    found = _Checkpoint(path)
    system, method = _system_and_method(system, method, found, args)
    watched = Events(events, args)
    if t_eval is not None and not found.has_nodes:
        raise ValueError("t_eval goes with a run that has dense_output; this one goes on to record what it recorded before")
    handle = make_handle(system, method, observer, watched)
    if not system.first_order and found.y.size:
        n = system.n
        place = slice(None) if system.ordering is None else np.argsort(system.ordering)
        system._install_constraints(handle, found.t, found.y[:n][place], found.y[n:][place])
    code = handle.call(_core.dynstep_restore, os.fsencode(path), refuse=False)
    if code != SUCCESS:
        raise ValueError(handle.sentence)
    times = None if t_eval is None else times_within(t_eval, found.t, found.t_end)
    left = LeftRun(handle, watched, "nodes" if found.has_nodes else "steps", times)
    return left.go_on(system, method, max_steps, progress, stacklevel=2)


def _system_and_method(system, method, found, args):
    """Both, as solve and solve_ode take them."""
    if isinstance(system, (LinearSystem, MechanicalSystem)):
        if found.y.size not in (0, 2*system.n):
            raise ValueError(f"the file has a state of {found.y.size} numbers, the system one of {2*system.n}")
        return system, method_for(system, method)
    if not isinstance(system, (OdeSystem, LinearOde)):
        system = OdeSystem(found.y.size, system, args=args)
    return system, as_method("bi" if method is None else method)


class _Checkpoint:
    """What has to be known of a file before the library reads it, and checks it."""

    def __init__(self, path):
        with open(path, encoding="ascii", errors="replace") as file:
            lines = iter(file.read().splitlines())
        self.t = self.t_end = 0.0
        self.y = np.empty(0)
        self.has_nodes = False
        for line in lines:
            words = line.split()
            if line.startswith("t real =") and not self.y.size:
                self.t = _number(words[-1])
            elif words[:2] == ["y", "real"] and len(words) == 3 and words[2].isdigit() and not self.y.size:
                self.y = _vector(lines, int(words[2]))
            elif line.startswith("t_end real ="):
                self.t_end = _number(words[-1])
            elif line.startswith("keeps_nodes logical ="):
                self.has_nodes = words[-1] == "true"
                return


def _vector(lines, n):
    values = []
    for line in lines:
        values += map(_number, line.split())
        if len(values) >= n:
            break
    return np.array(values[:n])


def _number(word):
    try:
        return float(word)
    except ValueError:
        return np.nan                    # one that is not finite, or a file that the library will refuse
