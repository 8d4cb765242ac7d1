# SPDX-License-Identifier: BSD-3-Clause
"""Methods and their options.

The objects are values: they compare, hash, copy and pickle, and cannot be changed.  Ranges are
the library's own: each new object is shown to it once.
"""

from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np

from . import _core
from ._arguments import integer, number
from ._handle import Handle

_SEQUENCES = {"romberg": 1, "bulirsch": 2, "harmonic": 3, "double-harmonic": 4, "automatic": 6}
_CUSTOM = 5
_EVEN_LEVELS = 4                         # of runs with h, where levels is None
_MOST_LEVELS = 12
_NO_NUMBERS = np.empty(0, np.int32)


class MethodProperties(NamedTuple):
    """Facts about a method, the same that the library's own drivers read."""
    name: str
    source: str                  #: paper and equation
    order: int                   #: of q and v
    acceleration_order: int      #: of a
    multiplier_order: int        #: of multipliers; 0: takes no constraints
    error_order: int             #: of the error estimate; 0: none
    stages: int                  #: implicit solves (or force evaluations) a step
    symmetric: bool              #: may be the base of an extrapolation
    mechanical: bool             #: needs a mechanical system
    stability_limit: float       #: largest omega*h at which an undamped oscillator does not grow: inf if there
                                 #: is none, 0 if it grows at every step, None if not known


@dataclass(frozen=True)
class Newton:
    """Options of Newton's iteration (Austin 1991, section 7.3); linear systems have none.

    Parameters
    ----------
    limit : int
        Most corrections in a step, >= 1.
    halvings : int
        Most halvings of a correction after which the residual is larger, >= 0.
    tolerance : float
        Of the correction of q and v, relative to their largest component, 0 <= tolerance < 1.  0, the
        default, goes on to round-off, as extrapolation wants it.
    """
    limit: int = 25
    halvings: int = 20
    tolerance: float = 0.0

    def __post_init__(self):
        set_fields(self, limit=integer("limit", self.limit, 1), halvings=integer("halvings", self.halvings, 0),
             tolerance=number("tolerance", self.tolerance))
        if not 0.0 <= self.tolerance < 1.0:
            raise ValueError(f"tolerance = {self.tolerance:g} must be 0 or more and less than 1")


class Method:
    """What all methods have: `order`, `properties`, equality by what they do."""

    _levels_of_steps = 1                 # rows of the table of a step of Integrator

    @property
    def properties(self):
        """`MethodProperties`."""
        handle = Handle(1)
        self._install(handle)
        _, name, source, facts, limit = handle.call(_core.dynstep_properties)
        order, of_a, multipliers, error, stages, symmetric, mechanical = map(int, facts)
        return MethodProperties(name.decode(), source.decode(), order, of_a, multipliers, error, stages,
                                bool(symmetric), bool(mechanical), limit if limit >= 0 else None)

    @property
    def order(self):
        """Order of q and v."""
        return self.properties.order

    def stability_limit(self, damping_ratio=0.0):
        """Largest omega*h at which an oscillator grows by less than 1e-12 a step.

        Parameters
        ----------
        damping_ratio : float
            Of the oscillator, >= 0.

        Returns
        -------
        float
            inf where there is none.  Methods over Newmark's with gamma = 1/2 and over the midpoint rule.

        Raises
        ------
        ValueError
            For a negative damping ratio, or Newmark's method with another gamma.

        Notes
        -----
        From the amplification matrix, Austin 1991, eq. (37); docs/theory/newmark-extrapolation.md.
        """
        handle = Handle(1)
        self._install(handle)
        ratio = number("damping_ratio", damping_ratio, 0.0)
        return float(handle.call(_core.dynstep_stability_limit, ratio)[1])

    def _check_newton(self):
        if self.newton is None:
            set_fields(self, newton=Newton())
        if not isinstance(self.newton, Newton):
            raise TypeError(f"newton must be a dynstep.Newton(...), not {self.newton!r}")

    def _install(self, handle):
        for setter, *arguments in self._settings():
            handle.call(setter, *arguments)

    def _newton_setting(self):
        return _core.dynstep_set_newton, self.newton.limit, self.newton.halvings, self.newton.tolerance

    def _key(self):
        return tuple((setter.__name__, *(tuple(a) if isinstance(a, np.ndarray) else a for a in arguments))
                     for setter, *arguments in self._settings())

    def __eq__(self, other):
        return self._key() == other._key() if isinstance(other, Method) else NotImplemented

    def __hash__(self):
        return hash(self._key())

    def __repr__(self):
        # what has to be given by its name is shown where it is not the default
        shown = [f"{f.name}={getattr(self, f.name)!r}" for f in fields(self)
                 if (getattr(self, f.name) not in (f.default, Newton()) if f.kw_only else
                     getattr(self, f.name) is not None)]
        return f"{type(self).__name__}({', '.join(shown)})"


def set_fields(self, **values):
    """Set fields of a frozen object while it is made."""
    for name, value in values.items():
        object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False, repr=False)
class Newmark(Method):
    """Newmark's method.

    Parameters
    ----------
    beta : float
        >= 0.  1/4: constant (average) acceleration, unconditionally stable; 1/6: linear acceleration; 1/12: Fox
        and Goodwin, fourth order for linear systems; 0: central differences, which solve nothing where
        M is constant and the force has no v.
    gamma : float
        >= 0.  1/2: second order, no damping by the method.  More damps, and is of first order.
    newton : Newton, optional
        Keyword only.

    Notes
    -----
    Austin 1991, eqs. (20)-(25).
    """
    beta: float = 0.25
    gamma: float = 0.5
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        self._check_newton()
        set_fields(self, beta=number("beta", self.beta), gamma=number("gamma", self.gamma))
        self.properties

    def _settings(self):
        return ((_core.dynstep_set_newmark, self.beta, self.gamma), self._newton_setting())


@dataclass(frozen=True, eq=False, repr=False)
class Midpoint(Method):
    """The implicit midpoint rule, of second order and unconditionally stable.

    Parameters
    ----------
    newton : Newton, optional
        Keyword only.
    """
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        self._check_newton()

    def _settings(self):
        return ((_core.dynstep_set_midpoint,), self._newton_setting())


class Extrapolation(Method):
    """What the extrapolations have in common: base, levels, sequence."""

    def _check_levels(self):
        if self.levels is not None:
            set_fields(self, levels=integer("levels", self.levels, 1))
        set_fields(self, max_levels=integer("max_levels", self.max_levels, 2, _MOST_LEVELS))
        if isinstance(self.sequence, str):
            if self.sequence not in _SEQUENCES:
                raise ValueError(f"sequence must be one of {', '.join(map(repr, _SEQUENCES))} or integers, "
                                 f"not {self.sequence!r}")
            return
        try:
            set_fields(self, sequence=tuple(integer("a number of the sequence", i, 1) for i in self.sequence))
        except TypeError as error:
            raise TypeError(f"sequence must be a name or a list of integers ({error})") from None
        least = 2 if self.levels is None else self.levels
        if len(self.sequence) < least:
            raise ValueError(f"sequence has {len(self.sequence)} numbers, too few for levels = {self.levels}")

    @property
    def _levels_of_steps(self):
        there = _MOST_LEVELS if isinstance(self.sequence, str) else len(self.sequence)
        return min(_EVEN_LEVELS, there) if self.levels is None else self.levels

    def _settings(self):
        custom = not isinstance(self.sequence, str)
        there = min(len(self.sequence), _MOST_LEVELS) if custom else _MOST_LEVELS
        vary = self.levels is None
        levels = self._levels_of_steps
        most = min(self.max_levels, there) if vary else 0
        numbers = np.array(self.sequence[:max(levels, most)], np.int32) if custom else _NO_NUMBERS
        return (*self._base()._settings(),
                (_core.dynstep_set_extrapolation, levels, _CUSTOM if custom else _SEQUENCES[self.sequence], numbers),
                (_core.dynstep_set_order_control, int(vary), most))


@dataclass(frozen=True, eq=False, repr=False)
class NewmarkExtrapolation(Extrapolation):
    """Newmark's method, extrapolated to order 2*levels.

    Each step is made `levels` times, in more and more substeps, and the results are combined so that the
    error's leading terms in h^2, h^4, ... vanish.

    Parameters
    ----------
    levels : int, optional
        1 to 12.  Default: 4 in runs with `h` and single steps; in runs by tolerances the error chooses them, step by step,
        together with the step length.
    sequence : str or sequence of int
        Numbers of substeps: "harmonic" 1, 2, 3, 4, ... (the least work for an order), "romberg"
        1, 2, 4, 8, ..., "bulirsch" 1, 2, 4, 6, 8, 12, ..., "double-harmonic" 2, 4, 6, 8, ..., or your own
        increasing integers.  "automatic": "harmonic", under relative tolerances below 1e-13 "double-harmonic".
    beta : float
        Of the base, Newmark's method with gamma = 1/2; 1/4 by default.  ``NewmarkExtrapolation(beta=0)`` solves nothing where
        M is constant and the force has no v (`velocity_free`): the least work for forces that are not stiff.
    base : Newmark or Midpoint, optional
        Another base in place of Newmark(beta), a symmetric one: Newmark with gamma = 1/2, or Midpoint.
    max_levels : int
        Keyword only.  With ``levels=None``: most levels that the error may choose, 2 to 12; all of them need memory.
    newton : Newton, optional
        Keyword only.

    Notes
    -----
    Austin 1991, section 4.  No extrapolation is unconditionally stable: see
    :meth:`stability_limit`.
    """
    levels: int = None
    sequence: object = "automatic"
    beta: float = None
    base: Method = None
    max_levels: int = field(default=9, kw_only=True)
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        self._check_levels()
        if self.base is None:
            self._check_newton()
            set_fields(self, beta=0.25 if self.beta is None else number("beta", self.beta))
        elif not isinstance(self.base, (Newmark, Midpoint)):
            raise TypeError(f"base must be Newmark(...) or Midpoint(), not {self.base!r}")
        elif self.beta is not None or self.newton is not None:
            raise ValueError("beta and newton are options of the base; give them to it")
        elif not self.base.properties.symmetric:
            raise ValueError(f"base = {self.base!r} is not symmetric: its error has odd powers of h; use gamma = 0.5")
        else:
            set_fields(self, newton=self.base.newton)
        self.properties

    def _base(self):
        return self.base or Newmark(self.beta, newton=self.newton)


@dataclass(frozen=True, eq=False, repr=False)
class MidpointExtrapolation(Extrapolation):
    """The implicit midpoint rule, extrapolated to order 2*levels; see :class:`NewmarkExtrapolation`.

    Parameters
    ----------
    levels : int, optional
        1 to 12; None: chosen by the error in runs by tolerances, else 4.
    sequence : str or sequence of int
        As for :class:`NewmarkExtrapolation`.
    max_levels, newton
        Keyword only, as for :class:`NewmarkExtrapolation`.
    """
    levels: int = None
    sequence: object = "automatic"
    max_levels: int = field(default=9, kw_only=True)
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        self._check_levels()
        self._check_newton()
        self.properties

    def _base(self):
        return Midpoint(newton=self.newton)
