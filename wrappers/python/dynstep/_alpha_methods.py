# SPDX-License-Identifier: BSD-3-Clause
"""Generalized-alpha and its extension to constraints (Jay and Negrut 2008), as values like all methods."""

import math
from dataclasses import dataclass, field

from . import _core
from ._arguments import choice, flag, number
from ._methods import Method, Newton, set_fields

_COEFFICIENTS = ("alpha_m", "alpha_f", "beta", "gamma")
_VARIANTS = {"soi2": 1, "reduced": 2, "index-3": 3}
_MASS_AT = {"stored": 1, "recomputed": 2}
_ESTIMATES = {"larger": 1, "projected": 2, "raw": 3}
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
            set_fields(self, rho_inf=rho)
            return
        for name in ("alpha_m", "alpha_f"):
            if name not in given:
                raise ValueError(f"{name} is missing: give rho_inf, or alpha_m and alpha_f (and beta, gamma)")
        m, f = number("alpha_m", self.alpha_m), number("alpha_f", self.alpha_f)
        set_fields(self, alpha_m=m, alpha_f=f,
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
                (_core.dynstep_set_start, _STARTS[self.start]),
                (_core.dynstep_set_estimate, _ESTIMATES[self.estimate]), *self._options())

    def _check_constrained(self):
        choice("variant", self.variant, _VARIANTS)
        choice("start", self.start, _STARTS)
        choice("estimate", self.estimate, _ESTIMATES)
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
    estimate : "larger", "projected" or "raw"
        Which error runs by tolerances look at: that along the constraints ("projected"); as it comes, with a part that the
        constraints take away ("raw"); or the projected one, but at least a part of the raw one ("larger"), which is safe near
        configurations where constraints begin to depend on each other.
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
    estimate: str = field(default="larger", kw_only=True)
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
    variant, start, estimate, mass_at, adjust_acceleration, adjust_momentum, second_order_start, newton
        Keyword only, as for :class:`SOI2`.  ``HHT(variant="index-3")`` is HHT-I3.

    Notes
    -----
    Jay and Negrut 2008, eq. (17); alpha_m = 0, alpha_f = -alpha, beta = (1 - alpha)^2/4, gamma = 1/2 - alpha.
    """
    alpha: float = -0.1
    variant: str = field(default="soi2", kw_only=True)
    start: str = field(default="project", kw_only=True)
    estimate: str = field(default="larger", kw_only=True)
    mass_at: str = field(default="stored", kw_only=True)
    adjust_acceleration: bool = field(default=True, kw_only=True)
    adjust_momentum: bool = field(default=True, kw_only=True)
    second_order_start: bool = field(default=True, kw_only=True)
    newton: Newton = field(default=None, kw_only=True)

    def __post_init__(self):
        set_fields(self, alpha=number("alpha", self.alpha, -1/3, 0.0))
        self._check_constrained()

    @property
    def coefficients(self):
        """(alpha_m, alpha_f, beta, gamma)."""
        return 0.0, abs(self.alpha), 0.25*(1.0 - self.alpha)**2, 0.5 - self.alpha
