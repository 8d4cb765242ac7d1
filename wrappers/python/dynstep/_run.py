# SPDX-License-Identifier: BSD-3-Clause
"""Runs in pieces: between two calls of the library Python sees Ctrl-C and shows progress."""

import math
import time
import warnings

from . import _core
from ._arguments import LARGEST_INTEGER
from ._handle import COUNT_NAMES, EVENT, MORE, TOO_MANY_STEPS

# Seconds in the library between two looks at Ctrl-C.  The time of a step is not known before: steps may get 20 times
# slower, and the promised second is kept.  The first piece is one step.  More of short ones would cost too much: on a
# chain of 1000 masses a call costs 15 us, and 16 steps take the time of 50 in a longer run
_PIECE = 0.05
_STEPS = COUNT_NAMES.index("steps")

# More steps than a run has
MANY = 10**15


def expected_steps(t0, t1, h):
    """Number of steps of a run, for room and progress; the library counts by itself."""
    return math.ceil(min(abs((t1 - t0)/h), MANY)) if h else 0


def drive(handle, record, max_steps=None, progress=None, events=None):
    """Go on with the run that was begun, to its end or for `max_steps` steps; returns the code."""
    with handle:
        return _drive(handle, record, max_steps, progress, events)


def _drive(handle, record, max_steps, progress, events):
    before = _steps(handle)
    made, piece = 0, 1
    while True:
        if max_steps is not None:
            piece = min(piece, max_steps - made)
        begun = time.perf_counter()
        code, count = handle.call(_core.dynstep_proceed, piece, *record.room())
        elapsed = time.perf_counter() - begun
        record.add(count, lambda *sizes: handle.call(_core.dynstep_record_multipliers, *sizes)[1:],
                   lambda count: handle.call(_core.dynstep_point_kinds, count)[1])
        last, made = made, _steps(handle) - before
        if progress is not None:
            progress.show(made)
        if code == EVENT and events is not None and events.go_on(handle):
            code = MORE
        if code != MORE:
            return code
        if max_steps is not None and made >= max_steps:
            return TOO_MANY_STEPS
        if made > last:
            affordable = _PIECE*(made - last)/max(elapsed, 1e-9)
            piece = int(max(1, min(affordable, LARGEST_INTEGER)))


class StabilityWarning(UserWarning):
    """The steps of a run are longer than its method bears: motions of high frequency grow, though nobody pushes them."""


def warn_of_steps(handle, stacklevel):
    """The library's warning about the steps of the last run, which is shown; None: there is none."""
    sentence = handle.call(_core.dynstep_get_warning)[1].decode(errors="replace").strip()
    if not sentence:
        return None
    warnings.warn(sentence, StabilityWarning, stacklevel=stacklevel + 1)
    return sentence


def _steps(handle):
    return int(handle.call(_core.dynstep_counts)[1][_STEPS])
