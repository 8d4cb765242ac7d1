# SPDX-License-Identifier: BSD-3-Clause
"""Methods and their options.

The objects are values: they compare, hash, copy and pickle, and cannot be changed.  Ranges are
the library's own: each new object is shown to it once.
"""

import math
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np

from . import _core
from ._arguments import choice, flag, integer, number
from ._handle import Handle

_SEQUENCES = {"romberg": 1, "bulirsch": 2, "harmonic": 3, "double-harmonic": 4}
_CUSTOM = 5
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
        _set(self, limit=integer("limit", self.limit, 1), halvings=integer("halvings", self.halvings, 0),
             tolerance=number("tolerance", self.tolerance))
        if not 0.0 <= self.tolerance < 1.0:
            raise ValueError(f"tolerance = {self.tolerance:g} must be 0 or more and less than 1")


class Method:
    """What all methods have: `order`, `properties`, equality by what they do."""

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
            _set(self, newton=Newton())
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


def _set(self, **values):
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
        _set(self, beta=number("beta", self.beta), gamma=number("gamma", self.gamma))
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


class _Extrapolation(Method):
    """What the two extrapolations have in common: base, levels, sequence."""

    def _check_levels(self):
        _set(self, levels=integer("levels", self.levels, 1))
        if isinstance(self.sequence, str):
            if self.sequence not in _SEQUENCES:
                raise ValueError(f"sequence must be one of {', '.join(map(repr, _SEQUENCES))} or integers, "
                                 f"not {self.sequence!r}")
            return
        try:
            _set(self, sequence=tuple(integer("a number of the sequence", i, 1) for i in self.sequence))
        except TypeError as error:
            raise TypeError(f"sequence must be a name or a list of integers ({error})") from None
        if len(self.sequence) < self.levels:
            raise ValueError(f"sequence has {len(self.sequence)} numbers, too few for levels = {self.levels}")

    def _settings(self):
        custom = not isinstance(self.sequence, str)
        numbers = np.array(self.sequence[:self.levels], np.int32) if custom else _NO_NUMBERS
        return (*self._base()._settings(),
                (_core.dynstep_set_extrapolation, self.levels, _CUSTOM if custom else _SEQUENCES[self.sequence],
                 numbers))


@dataclass(frozen=True, eq=False, repr=False)
class NewmarkExtrapolation(_Extrapolation):
    """Newmark's method, extrapolated to order 2*levels.

    Each step is made `levels` times, in more and more substeps, and the results are combined so that the
    error's leading terms in h^2, h^4, ... vanish.

    Parameters
    ----------
    levels : int
        1 to 12.
    sequence : str or sequence of int
        Numbers of substeps: "harmonic" 1, 2, 3, 4, ... (the least work for an order), "romberg"
        1, 2, 4, 8, ..., "bulirsch" 1, 2, 4, 6, 8, 12, ..., "double-harmonic" 2, 4, 6, 8, ..., or your own
        increasing integers.
    beta : float
        Of the base, Newmark's method with gamma = 1/2.
    base : Newmark or Midpoint, optional
        Another base in place of Newmark(beta), a symmetric one: Newmark with gamma = 1/2, or Midpoint.
    newton : Newton, optional
        Keyword only.

    Notes
    -----
    Austin 1991, section 4.  No extrapolation is unconditionally stable: see
    :meth:`stability_limit`.
    """
    levels: int = 4
    sequence: object = "harmonic"
    beta: float = None
    base: Method = None
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        self._check_levels()
        if self.base is None:
            self._check_newton()
            _set(self, beta=0.25 if self.beta is None else number("beta", self.beta))
        elif not isinstance(self.base, (Newmark, Midpoint)):
            raise TypeError(f"base must be Newmark(...) or Midpoint(), not {self.base!r}")
        elif self.beta is not None or self.newton is not None:
            raise ValueError("beta and newton are options of the base; give them to it")
        elif not self.base.properties.symmetric:
            raise ValueError(f"base = {self.base!r} is not symmetric: its error has odd powers of h; use gamma = 0.5")
        else:
            _set(self, newton=self.base.newton)
        self.properties

    def _base(self):
        return self.base or Newmark(self.beta, newton=self.newton)


@dataclass(frozen=True, eq=False, repr=False)
class MidpointExtrapolation(_Extrapolation):
    """The implicit midpoint rule, extrapolated to order 2*levels; see :class:`NewmarkExtrapolation`.

    Parameters
    ----------
    levels : int
        1 to 12.
    sequence : str or sequence of int
        As for :class:`NewmarkExtrapolation`.
    newton : Newton, optional
        Keyword only.
    """
    levels: int = 4
    sequence: object = "harmonic"
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        self._check_levels()
        self._check_newton()
        self.properties

    def _base(self):
        return Midpoint(newton=self.newton)


_COEFFICIENTS = ("alpha_m", "alpha_f", "beta", "gamma")
_VARIANTS = {"soi2": 1, "reduced": 2, "index-3": 3}
_MASS_AT = {"stored": 1, "recomputed": 2}
_STARTS = {"project": 1, "refuse": 2, "keep": 3}


class _Alpha(Method):
    """What the methods with an acceleration at t + alpha h have in common."""

    def _check_options(self):
        self._check_newton()
        choice("mass_at", self.mass_at, _MASS_AT)
        for name in ("adjust_acceleration", "adjust_momentum", "second_order_start"):
            flag(name, getattr(self, name))

    def _check_rho(self):
        given = {name: getattr(self, name) for name in _COEFFICIENTS if getattr(self, name) is not None}
        if self.rho_inf is not None and given:
            raise ValueError(f"rho_inf tells all coefficients; leave out {', '.join(given)}")
        if not given:
            rho = number("rho_inf", 0.8 if self.rho_inf is None else self.rho_inf, 0.0, 1.0)
            _set(self, rho_inf=rho)
            return
        for name in ("alpha_m", "alpha_f"):
            if name not in given:
                raise ValueError(f"{name} is missing: give rho_inf, or alpha_m and alpha_f (and beta, gamma)")
        m, f = number("alpha_m", self.alpha_m), number("alpha_f", self.alpha_f)
        _set(self, alpha_m=m, alpha_f=f,
             gamma=number("gamma", 0.5 - m + f if self.gamma is None else self.gamma),
             beta=number("beta", 0.25*(1.0 - m + f)**2 if self.beta is None else self.beta))

    @property
    def coefficients(self):
        """(alpha_m, alpha_f, beta, gamma)."""
        if self.rho_inf is None:
            return self.alpha_m, self.alpha_f, self.beta, self.gamma
        return tuple(map(float, _core.dynstep_alpha_coefficients(self.rho_inf)[1]))

    def stability_limit(self, damping_ratio=0.0):
        """Largest omega*h at which an oscillator does not grow.

        Parameters
        ----------
        damping_ratio : float
            Of the oscillator, >= 0.

        Returns
        -------
        float
            inf where there is none: with any `rho_inf`, and with HHT.

        Raises
        ------
        ValueError
            For a negative damping ratio, and for coefficients of which it is not known.
        """
        number("damping_ratio", damping_ratio, 0.0)
        limit = self.properties.stability_limit
        if limit is None or limit < math.inf and damping_ratio > 0.0:
            raise ValueError(f"the stability limit of {self!r} is not known")
        return limit

    def _options(self):
        return ((_core.dynstep_set_alpha_options, _MASS_AT[self.mass_at], int(self.adjust_acceleration),
                 int(self.adjust_momentum), int(self.second_order_start)), self._newton_setting())


@dataclass(frozen=True, eq=False, repr=False)
class GeneralizedAlpha(_Alpha):
    """The generalized-alpha method, for systems without constraints: of second order, with a damping of high
    frequencies that you choose.

    Parameters
    ----------
    rho_inf : float
        What is left of an infinitely fast oscillation after a step, 0 (all is damped) to 1 (nothing).  Default: 0.8.
    alpha_m, alpha_f, beta, gamma : float, optional
        The coefficients themselves, in place of `rho_inf`; by default beta = (1 - alpha_m + alpha_f)^2/4 and
        gamma = 1/2 - alpha_m + alpha_f, which second order needs.
    mass_at : "stored" or "recomputed"
        Keyword only, as all that follow.  M between two steps: that of the step before, or computed again.
    adjust_acceleration, adjust_momentum : bool
        Correct what is kept from the step before where the step length changes.  Without this the order drops to one
        with variable steps.
    second_order_start : bool
        The acceleration that the first step begins with is of second order; False: it is the one at the start.
    newton : Newton, optional

    Notes
    -----
    Jay and Negrut 2008, eqs. (2), (14).
    """
    rho_inf: float = None
    alpha_m: float = None
    alpha_f: float = None
    beta: float = None
    gamma: float = None
    mass_at: str = field(default="stored", kw_only=True)
    adjust_acceleration: bool = field(default=True, kw_only=True)
    adjust_momentum: bool = field(default=True, kw_only=True)
    second_order_start: bool = field(default=True, kw_only=True)
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        self._check_rho()
        self._check_options()
        self.properties

    def _settings(self):
        return ((_core.dynstep_set_generalized_alpha, *self.coefficients), *self._options())


class _Constrained(_Alpha):
    """What the methods for constraints have in common."""

    def _settings(self):
        return ((_core.dynstep_set_soi2, *self.coefficients, _VARIANTS[self.variant]),
                (_core.dynstep_set_start, _STARTS[self.start]), *self._options())

    def _check_constrained(self):
        choice("variant", self.variant, _VARIANTS)
        choice("start", self.start, _STARTS)
        self._check_options()
        self.properties


@dataclass(frozen=True, eq=False, repr=False)
class SOI2(_Constrained):
    """Generalized-alpha-SOI2, for constraints on coordinates and velocities: of second order in coordinates,
    velocities, accelerations and multipliers, also with variable steps, and all constraints and their derivatives
    are kept to round-off.

    Parameters
    ----------
    rho_inf : float
        What is left of an infinitely fast oscillation after a step, 0 (all is damped) to 1 (nothing).  Default: 0.8.
        With 1, errors of accelerations and multipliers never die out.
    alpha_m, alpha_f, beta, gamma : float, optional
        The coefficients themselves, as for :class:`GeneralizedAlpha`.
    variant : "soi2", "reduced" or "index-3"
        Keyword only, as all that follow.  "reduced": one set of nonholonomic multipliers less (section 6 of the
        paper); "index-3": without the constraints on velocities, to compare with: g' drifts.
    start : "project", "refuse" or "keep"
        Where q0, v0 do not fulfil the constraints: move them, as little as the mass allows (with a warning,
        :class:`StartCorrected`); fail; or begin there.
    mass_at, adjust_acceleration, adjust_momentum, second_order_start, newton
        As for :class:`GeneralizedAlpha`.

    Notes
    -----
    Jay and Negrut 2008, eqs. (13), (14).
    """
    rho_inf: float = None
    alpha_m: float = None
    alpha_f: float = None
    beta: float = None
    gamma: float = None
    variant: str = field(default="soi2", kw_only=True)
    start: str = field(default="project", kw_only=True)
    mass_at: str = field(default="stored", kw_only=True)
    adjust_acceleration: bool = field(default=True, kw_only=True)
    adjust_momentum: bool = field(default=True, kw_only=True)
    second_order_start: bool = field(default=True, kw_only=True)
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        self._check_rho()
        self._check_constrained()


@dataclass(frozen=True, eq=False, repr=False)
class HHT(_Constrained):
    """The method of Hilber, Hughes and Taylor; with constraints HHT-SOI2.

    Parameters
    ----------
    alpha : float
        -1/3 (most damping) to 0 (none: the trapezoidal rule).
    variant, start, mass_at, adjust_acceleration, adjust_momentum, second_order_start, newton
        Keyword only, as for :class:`SOI2`.  ``HHT(variant="index-3")`` is HHT-I3.

    Notes
    -----
    Jay and Negrut 2008, eq. (17); alpha_m = 0, alpha_f = -alpha, beta = (1 - alpha)^2/4, gamma = 1/2 - alpha.
    """
    alpha: float = -0.1
    variant: str = field(default="soi2", kw_only=True)
    start: str = field(default="project", kw_only=True)
    mass_at: str = field(default="stored", kw_only=True)
    adjust_acceleration: bool = field(default=True, kw_only=True)
    adjust_momentum: bool = field(default=True, kw_only=True)
    second_order_start: bool = field(default=True, kw_only=True)
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        _set(self, alpha=number("alpha", self.alpha, -1/3, 0.0))
        self._check_constrained()

    @property
    def coefficients(self):
        """(alpha_m, alpha_f, beta, gamma)."""
        return 0.0, abs(self.alpha), 0.25*(1.0 - self.alpha)**2, 0.5 - self.alpha


_NAMED = {
    "newmark": Newmark(),
    "linear-acceleration": Newmark(1/6),
    "fox-goodwin": Newmark(1/12),
    "central-difference": Newmark(0.0),
    "midpoint": Midpoint(),
    "newmark-extrapolation": NewmarkExtrapolation(),
    "midpoint-extrapolation": MidpointExtrapolation(),
    "generalized-alpha": GeneralizedAlpha(),
    "hht": HHT(),
    "soi2": SOI2(),
    "hht-soi2": HHT(),
    "hht-i3": HHT(variant="index-3"),
}


def as_method(method):
    """The method that an object or a shorthand means."""
    if isinstance(method, Method):
        return method
    if isinstance(method, str) and method in _NAMED:
        return _NAMED[method]
    raise (ValueError if isinstance(method, str) else TypeError)(
        f"method must be a method object such as dynstep.Newmark(), or one of {', '.join(map(repr, _NAMED))}; "
        f"not {method!r}")


def method_for(system, method):
    """The same, with a default that suits the system."""
    if method is None:
        method = "soi2" if system.is_constrained else "newmark-extrapolation"
    return as_method(method)


class MethodTable(dict):
    """{shorthand: MethodProperties}; prints as a table."""

    def __str__(self):
        rows = [("method", "order", "of a", "of lam", "stages", "symmetric", "stable for omega*h", "source")]
        for name, p in self.items():
            x = p.stability_limit if p.stability_limit is not None else _NAMED[name].stability_limit()
            limit = "any" if x == math.inf else "none" if x == 0.0 else f"<= {x:.4g}"
            rows.append((name, str(p.order), str(p.acceleration_order), str(p.multiplier_order or "-"), str(p.stages), "yes" if p.symmetric else "no",
                         limit, p.source))
        widths = [max(map(len, column)) for column in zip(*rows)]
        return "\n".join("  ".join(x.ljust(w) for x, w in zip(row, widths)).rstrip() for row in rows)


def methods():
    """Table of the methods that have a shorthand, with their facts.

    Returns
    -------
    MethodTable
        A dictionary {shorthand: MethodProperties}; ``print(dynstep.methods())`` shows it as a table, where "-" in the
        column "of lam" stands for a method that takes no constraints.
    """
    return MethodTable({name: method.properties for name, method in _NAMED.items()})
