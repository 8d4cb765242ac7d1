# SPDX-License-Identifier: BSD-3-Clause
"""Backinterpolation and Pade's approximations (Xie 1995), as values like all methods."""

import math
from dataclasses import dataclass, field

from . import _core
from ._arguments import choice, integer, number
from ._methods import Extrapolation, Method, Newton, set_fields

_FORMS = {"automatic": 0, "parallel": 1, "product": 2, "refined": 3}
_HALVES = {"taylor": 1, "fehlberg": 2}
_F_STABLE = {2: (1, 1), 4: (4, 4)}


class _Rational(Method):
    """What methods have whose steps on linear systems are R(h A)."""

    def stability_limit(self, damping_ratio=0.0):
        """Largest omega*h at which an oscillator does not grow.

        Parameters
        ----------
        damping_ratio : float
            Of the oscillator, >= 0.

        Returns
        -------
        float
            inf where there is none.

        Raises
        ------
        ValueError
            For a negative damping ratio; for a positive one where the method is not A-stable: see
            :func:`stability_domain`.
        """
        number("damping_ratio", damping_ratio, 0.0)
        from ._stability import stability_domain
        domain = stability_domain(self, rays=2)
        if domain.is_a_stable:
            return math.inf
        if damping_ratio > 0.0:
            raise ValueError(f"{self!r} is not A-stable; stability_domain tells where it is stable with damping")
        intervals = domain.imaginary_intervals
        return float(intervals[0, 1]) if len(intervals) and intervals[0, 0] == 0.0 else 0.0


@dataclass(frozen=True, eq=False, repr=False)
class Pade(_Rational):
    """Pade's approximation of the exponential, of order p + q, for linear systems: :class:`LinearSystem` and
    :class:`LinearOde`.

    Parameters
    ----------
    p, q : int
        Degrees of numerator and denominator, 0 to 8.  p = q: undamped modes keep their amplitude, whatever h is; q = p + 1
        or p + 2: stiff modes are damped at once.
    form : "automatic", "parallel", "product" or "refined"
        Keyword only.  How a step is put together from the poles of the approximation; it changes rounding errors and cost
        alone.  "parallel": a sum of partial fractions, the fastest; not where p > q.  "product": one pair of poles after the
        other.  "refined": and each solution corrected by its residual, so that the energy of undamped systems does not
        drift in millions of steps.  "automatic": the sum where it loses less than a factor of 100 of rounding.

    Notes
    -----
    Xie 1995, section 2.3.  Loads and sources are taken to the full order, also where the system is stiff.
    """
    p: int = 4
    q: int = 4
    form: str = field(default="automatic", kw_only=True)

    def __post_init__(self):
        set_fields(self, p=integer("p", self.p, 0), q=integer("q", self.q, 0))
        choice("form", self.form, _FORMS)
        self.properties

    def _settings(self):
        return ((_core.dynstep_set_pade, self.p, self.q, choice("form", self.form, _FORMS)),)


@dataclass(frozen=True, eq=False, repr=False, init=False)
class BI(_Rational):
    """Backinterpolation: a Runge-Kutta half-step forward over alpha*h, and one that runs backward over (1 - alpha)*h from
    the unknown end of the step to the same point.

    For first-order systems, and for mechanical ones without constraints.

    Parameters
    ----------
    order : int or (int, int)
        Orders p of the half forward and q of the half backward, 1 to 5; a number means both.  Default: (4, 4).
    alpha : float
        0 to 1.  With p = q and 1/2 the method is symmetric, of an even order, and with p <= 4 undamped modes keep their
        amplitude.  Orders (4, 5) want 0.4363 to 0.4486: elsewhere some undamped modes grow.
    halves : "taylor" or "fehlberg"
        Keyword only.  "fehlberg": both halves by the fifth-order formula of RKF45, without `order`.
    newton : Newton, optional
        Keyword only.  Of the iteration for the end of the step, which is Broyden's.

    Attributes
    ----------
    orders : (int, int) or None
        p and q; `order` is that of the method.

    Notes
    -----
    Xie 1995, sections 2.4 and 2.5.  On y' = l y a step is R(h l) with R(z) = P_p(alpha z)/P_q(-(1 - alpha) z), P_p
    the Taylor polynomial of degree p of the exponential.  Where q = 5 (or "fehlberg"), R has poles in the left half-plane
    at z = (-0.24 +- 3.13i)/(1 - alpha): no such method is A-stable, though (4, 5) in its window of alpha does well.
    """
    orders: tuple
    alpha: float
    halves: str = field(kw_only=True)
    newton: Newton = field(kw_only=True)

    def __init__(self, order=None, alpha=0.5, *, halves="taylor", newton=None):
        choice("halves", halves, _HALVES)
        if halves == "fehlberg" and order is not None:
            raise ValueError(f"order = {order!r}, but halves = 'fehlberg' has its own")
        orders = None if halves == "fehlberg" else _orders((4, 4) if order is None else order)
        set_fields(self, orders=orders, alpha=number("alpha", alpha, 0.0, 1.0), halves=halves, newton=newton)
        self._check_newton()
        self.properties

    @classmethod
    def f_stable(cls, order=4, *, newton=None):
        """The method of this order, 2 or 4, that keeps the amplitude of undamped modes for all h.

        Raises
        ------
        ValueError
            Another order: there is none.
        """
        return cls(_f_stable(order), 0.5, newton=newton)

    def _settings(self):
        p, q = self.orders or (5, 5)
        return ((_core.dynstep_set_backinterpolation, p, q, self.alpha, _HALVES[self.halves]), self._newton_setting())

    def __repr__(self):
        what = [] if self.orders is None else [f"order={self.orders}"]
        what.append(f"alpha={self.alpha!r}")
        if self.halves != "taylor":
            what.append(f"halves={self.halves!r}")
        if self.newton != Newton():
            what.append(f"newton={self.newton!r}")
        return f"BI({', '.join(what)})"


@dataclass(frozen=True, eq=False, repr=False, init=False)
class BIExtrapolation(Extrapolation):
    """Backinterpolation, extrapolated; see :class:`NewmarkExtrapolation`.

    Parameters
    ----------
    levels : int, optional
        1 to 12; None: chosen by the error in runs by tolerances, else 4.
    order : int
        Of the base, 2 or 4: :meth:`BI.f_stable`.  Each level but the first adds 2 to it.
    sequence : str or sequence of int
        As for :class:`NewmarkExtrapolation`.
    max_levels, newton
        Keyword only, as for :class:`NewmarkExtrapolation`.

    Attributes
    ----------
    base : BI
        The method that is extrapolated; `order` is that of the extrapolation, base.order + 2*(levels - 1).
    """
    levels: int
    base: BI
    sequence: object
    max_levels: int = field(kw_only=True)
    newton: Newton = field(kw_only=True)

    def __init__(self, levels=None, order=4, sequence="automatic", *, max_levels=9, newton=None):
        set_fields(self, levels=levels, base=BI.f_stable(order, newton=newton), sequence=sequence, max_levels=max_levels)
        set_fields(self, newton=self.base.newton)
        self._check_levels()
        self.properties

    def _base(self):
        return self.base

    def __repr__(self):
        levels = "" if self.levels is None else f"levels={self.levels}, "
        most = "" if self.max_levels == 9 else f", max_levels={self.max_levels}"
        newton = "" if self.newton == Newton() else f", newton={self.newton!r}"
        return f"BIExtrapolation({levels}order={self.base.order}, sequence={self.sequence!r}{most}{newton})"


def _orders(order):
    if isinstance(order, (tuple, list)):
        if len(order) != 2:
            raise ValueError(f"order must be a number or (p, q), not {order!r}")
        return tuple(integer(f"order[{i}]", x, 1, 5) for i, x in enumerate(order))
    return (integer("order", order, 1, 5),)*2


def _f_stable(order):
    order = integer("order", order, 1)
    if order not in _F_STABLE:
        raise ValueError(f"order = {order} must be 2 or 4: the next one, BI(5, 5), has poles in the left half-plane; use "
                         "Pade(s, s) of order 2 s for linear systems, or BIExtrapolation")
    return _F_STABLE[order]
