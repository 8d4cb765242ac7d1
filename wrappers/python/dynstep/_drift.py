# SPDX-License-Identifier: BSD-3-Clause
"""How well constraints are kept: at the start, and along a trajectory."""

import warnings
from typing import NamedTuple

import numpy as np

from . import _core
from ._handle import Handle

# A start that was moved by less than that, relative to its size, is one that was typed in with eight digits, or is the
# last point of another run
_WORTH_A_WARNING = 1e-8


class ConstraintDrift(NamedTuple):
    """How far each point of a trajectory is from its constraints; zeros where there are none."""
    g: np.ndarray                #: largest abs(g), shape (nt,)
    gv: np.ndarray               #: largest abs(g'), with g' = G v + g_t, shape (nt,)
    k: np.ndarray                #: largest abs(k), shape (nt,)


class StartCorrection(NamedTuple):
    """What a start found, and what it moved to fulfil the constraints."""
    g: float                     #: largest abs(g) found
    gv: float                    #: largest abs(g') found, with g' = G v + g_t, at the moved q
    k: float                     #: largest abs(k) found, at the moved q
    moved_q: float               #: largest change of a coordinate
    moved_v: float               #: largest change of a velocity
    redundant: str               #: which constraints depend on each other, in words; empty where none do


class StartCorrected(UserWarning):
    """The start was not consistent with the constraints, and was moved."""


def start_correction(handle):
    """`StartCorrection` of the start that was made or refused, None without constraints."""
    if not handle.m + handle.p:
        return None
    _, found = handle.call(_core.dynstep_start_report)
    redundant = handle.call(_core.dynstep_redundant_constraints)[1].decode(errors="replace").strip()
    return StartCorrection(*map(float, found), redundant)


def warn_of_correction(correction, q, v, stacklevel):
    """Warn where the start has moved q or v by more than their rounding."""
    if correction is None:
        return
    moved = [f"{name} by {by:.2g}" for name, by, x in (("q", correction.moved_q, q), ("v", correction.moved_v, v))
             if by > _WORTH_A_WARNING*(np.abs(x).max() or 1.0)]
    if moved:
        found = ", ".join(f"{name} = {x:.2g}" for name, x in zip(("|g|", "|g'|", "|k|"), correction[:3]) if x > 0.0)
        warnings.warn(f"the start is off its constraints ({found}); it moved {' and '.join(moved)}.  "
                      "start='refuse' or 'keep' of the method does otherwise", StartCorrected, stacklevel + 1)


def constraint_drift(system, t, q, v):
    """`ConstraintDrift` of a trajectory."""
    drift = np.zeros((3, t.size))
    if system.is_constrained and t.size:
        handle = Handle(system.n)
        system._install(handle)
        system._install_constraints(handle, float(t[0]), q[:, 0], v[:, 0])
        for i, time in enumerate(t):
            code, *found = handle.call(_core.dynstep_residuals, time, q[:, i], v[:, i], handle.m, handle.p)
            drift[:, i] = [np.abs(x).max(initial=0.0) for x in found] if code >= 0 else np.nan
    return ConstraintDrift(*drift)
