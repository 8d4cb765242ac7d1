# SPDX-License-Identifier: BSD-3-Clause
"""How the steps of a run are chosen: by their length, by rtol and atol, or by Xie's `tol`."""

import numpy as np

from . import _core
from ._arguments import array, choice, number, vector
from ._run import expected_steps

_CONTROLLERS = {"standard": 1, "pi": 2}
_IN_FRONT = 1                            # place of the 0.8 of "pi"
_RTOL, _ATOL = 1e-6, 1e-8


class EvenSteps:
    """Steps of one length."""

    def __init__(self, h):
        self._h = number("h", h)

    def expected(self, t0, t1):
        """Number of steps, for room and progress."""
        return expected_steps(t0, t1, self._h)

    def begin(self, handle, t1, every, t_eval):
        """Code of the library."""
        return handle.call(_core.dynstep_begin, t1, self._h, every, t_eval)


class ControlledSteps:
    """Steps that follow the error estimate of the method, in the norm of Xie's thesis."""

    def __init__(self, tol, controller, h_first, h_max):
        tol = number("tol", tol)
        if not tol > 0.0:
            raise ValueError(f"tol = {tol:g} must be positive")
        self._control = tol, choice("controller", controller, _CONTROLLERS), _IN_FRONT, h_first, h_max

    def expected(self, t0, t1):
        """None: not known."""
        return None

    def begin(self, handle, t1, every, t_eval):
        """Code of the library."""
        return handle.call(_core.dynstep_begin_controlled, t1, *self._control, t_eval)


class StepsWithin:
    """Steps that follow the error estimate of the method, within rtol and atol."""

    def __init__(self, rtol, atol, h_first, h_max, h_min):
        self._control = rtol, *atol, h_first, h_max, h_min

    def expected(self, t0, t1):
        """None: not known."""
        return None

    def begin(self, handle, t1, every, t_eval):
        """Code of the library."""
        return handle.call(_core.dynstep_begin_within, t1, *self._control, t_eval)


def choose_steps(system, h, rtol, atol, tol, controller, h_first, h_max, h_min, every):
    """What the arguments ask for."""
    if h is not None and tol is not None:
        raise ValueError("h and tol exclude each other: h for steps of one length, tol for steps that follow the error "
                         "estimate of the method")
    for name, value in (("rtol", rtol), ("atol", atol), ("h_min", h_min)):
        if value is not None and (h is not None or tol is not None):
            raise ValueError(f"{name} goes without {'tol' if h is None else 'h'}: "
                             + ("tol has a norm of its own" if h is None else "steps of one length follow no tolerance"))
    if h is not None:
        if h_first is not None or h_max is not None or choice("controller", controller, _CONTROLLERS) != 1:
            raise ValueError("controller, h_first and h_max do not go with h, for steps of one length")
        return EvenSteps(h)
    if every != 1:
        raise ValueError(f"every = {every!r} goes with h; without it choose points by t_eval")
    h_first, h_max, h_min = (0.0 if x is None else number(name, x)
                             for name, x in (("h_first", h_first), ("h_max", h_max), ("h_min", h_min)))
    if tol is not None:
        return ControlledSteps(tol, controller, h_first, h_max)
    if choice("controller", controller, _CONTROLLERS) != 1:
        raise ValueError("controller goes with tol")
    return StepsWithin(_RTOL if rtol is None else number("rtol", rtol, 0.0), tolerances(system, atol), h_first, h_max, h_min)


def tolerances(system, atol):
    """(atol, atol of lambda, atol of psi) for the library: an array of one or of all components in its order."""
    n, order = system.n, system.ordering
    kinds = ("y",) if system.first_order else ("q", "v")
    given = _by_kind(kinds, atol)
    multipliers = [number(f"atol of {name}", given.pop(name, 0.0), 0.0) for name in ("lam", "psi")]
    if any(multipliers) and not getattr(system, "is_constrained", False):
        raise ValueError("atol has lam or psi, but the system has no constraints")
    unknown = [name for name in given if name not in kinds]
    if unknown:
        raise ValueError(f"atol has the key {unknown[0]!r}; expected {', '.join(map(repr, kinds))}"
                         + ("" if system.first_order else ", 'lam', 'psi'"))
    parts = [_part(name, given.get(name, _ATOL), n, order) for name in kinds]
    if all(np.ndim(part) == 0 and part == parts[0] for part in parts):
        return np.array([parts[0]]), *multipliers
    return np.concatenate([np.broadcast_to(part, (n,)) for part in parts]), *multipliers


def _by_kind(kinds, atol):
    """{kind: what is given for it}."""
    if atol is None:
        return {}
    if isinstance(atol, dict):
        return dict(atol)
    if len(kinds) == 1:
        return {kinds[0]: atol}
    if isinstance(atol, tuple) and len(atol) == 2:
        return dict(zip(kinds, atol))
    values = array("atol", atol)
    if values.ndim == 0:
        return dict.fromkeys(kinds, values)
    if values.ndim != 1 or values.size % 2:
        raise ValueError(f"atol has the shape {values.shape}, expected a number, (2*n,) for [q, v], or a value for each kind, "
                         "such as dict(q=1e-9, v=1e-6)")
    return dict(zip(kinds, np.split(values, 2)))


def _part(name, value, n, order):
    """A number, or a vector in the order of the library."""
    name = f"atol of {name}"
    if np.ndim(value) == 0:
        return number(name, value, 0.0)
    values = vector(name, value, n)
    negative = np.flatnonzero(values < 0.0)
    if negative.size:
        raise ValueError(f"{name}[{negative[0]}] = {values[negative[0]]:g} must be 0 or more")
    return values if order is None else values[order]
