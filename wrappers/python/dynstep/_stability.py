# SPDX-License-Identifier: BSD-3-Clause
"""Where methods are stable, how accurate they are, how they damp and turn.

A method that makes y <- R(h lambda) y of y' = lambda y, with a rational R, is looked into by the signs of
polynomials: no part of its domain can be missed.  The others are sampled.
"""

from dataclasses import dataclass, field

import numpy as np

from . import _core
from ._arguments import array, choice, integer, number, vector
from ._handle import Handle
from ._method_table import as_method
from ._methods import Midpoint, Newmark
from ._plot import plot_accuracy, plot_damping, plot_domain
from ._rational_methods import BI, Pade

_TAYLOR, _FEHLBERG, _PADE = 1, 2, 3
_PROPERTIES = {"i-stable": 1, "a-stable": 2, "f-stable": 3, "l-stable": 4}
_SAMPLED_RADII = np.logspace(-2, 3, 201)
_SAMPLED_GROWTH = 1e-9               # a spectral radius is the root of a discriminant: half of the digits


@dataclass(frozen=True, eq=False, repr=False)
class StabilityDomain:
    """Where |R(z)| <= 1, z = h*lambda: the step does not make a motion e^(lambda t) larger.

    z has no unit.  The rays are those of the upper half-plane; the lower one is its mirror image.

    Attributes
    ----------
    method : Method, str or (num, den)
        What was asked for.
    is_certified : bool
        Found by the signs of polynomials; False: sampled on the rays alone.
    angles : ndarray, shape (rays,)
        Of rays from z = 0, in degrees from the positive real axis, 0 to 180.
    crossings : list of ndarray
        For each ray |z| where it goes into the domain or out, ascending; their number differs from ray to ray.
    begins : ndarray of int, shape (rays,)
        For each ray 1: stable near z = 0, -1: not, 0: |R| = 1 all along.
    a_angle : float
        |R| <= 1 for |arg(-z)| <= a_angle, in degrees, 0 to 90.
    is_a_stable, is_i_stable, is_f_stable, is_l_stable : bool
        |R| <= 1 for Re z <= 0; on the imaginary axis; for Re z <= 0 and for no other z; for Re z <= 0, and R(infinity) = 0.
    r_infinity : float
        |R(infinity)|, inf where it is not bounded.
    imaginary_intervals : ndarray, shape (number, 2)
        |R(iy)| <= 1 for y from [k, 0] to [k, 1], y >= 0, ascending; the last end may be inf.
    growth : float
        Largest |R(iy)| - 1; not above 0 where no undamped motion grows.
    growth_at : float
        A y where it is.
    real_limit : float
        |R(x)| <= 1 for -real_limit <= x <= 0; inf where that holds for all x <= 0.
    poles, zeros : ndarray of complex, shape (q,) and (p,)
        Of R, in both half-planes; none where the domain is sampled.
    boundary : list of ndarray of complex
        Closed curves |R| = 1, each an array of its points z; none where |R| = 1 on the whole imaginary axis (what there is
        around poles on the left then shows in `crossings` alone), and where the domain is sampled.
    """
    method: object
    is_certified: bool
    angles: np.ndarray
    crossings: list
    begins: np.ndarray
    a_angle: float
    is_a_stable: bool
    is_i_stable: bool
    is_f_stable: bool
    is_l_stable: bool
    r_infinity: float
    imaginary_intervals: np.ndarray
    growth: float
    growth_at: float
    real_limit: float
    poles: np.ndarray = field(default_factory=lambda: np.empty(0, complex))
    zeros: np.ndarray = field(default_factory=lambda: np.empty(0, complex))
    boundary: list = field(default_factory=list)

    def __repr__(self):
        is_so = [name for name, so in (("A", self.is_a_stable), ("I", self.is_i_stable), ("F", self.is_f_stable),
                                       ("L", self.is_l_stable)) if so]
        how = "certified" if self.is_certified else "sampled"
        return (f"<stability domain of {_name(self.method)}, {how}: {', '.join(is_so) + '-stable, ' if is_so else ''}"
                f"A({self.a_angle:.6g} degrees), |R(infinity)| = {self.r_infinity:.6g}, real limit {self.real_limit:.6g}>")

    def contains(self, z):
        """True where |R(z)| <= 1 (spectral radius, where there is no R); `z` is a number or an array."""
        allowed = 1.0 + (1e-14 if self.is_certified else _SAMPLED_GROWTH)
        return spectral_radius(self.method, z) <= allowed

    def plot(self, ax=None, *, extent=None):
        """Draw the domain, its poles and zeros.

        Parameters
        ----------
        ax : matplotlib axes, optional
        extent : (float, float, float, float), optional
            Least and largest real and imaginary part to be shown.

        Returns
        -------
        matplotlib axes
        """
        return plot_domain(self, ax, extent)


@dataclass(frozen=True, eq=False, repr=False)
class AccuracyDomain:
    """Smallest |h*lambda| at which the error passes a tolerance, for eigenvalues with |lambda| = 1.

    Attributes
    ----------
    method : Method, str or (num, den)
        What was asked for.
    tol : float
        Largest Euclidean norm of the error on [0, t_end] that is allowed, in the unit of `x0`.
    x0 : ndarray, shape (2,)
        Start.
    t_end : float
        End of the interval, in units of 1/|lambda|.
    angles : ndarray, shape (k,)
        Of the eigenvalue lambda, in degrees from the positive real axis.
    h : ndarray, shape (k,)
        For each angle the smallest step length at which the error is larger than `tol`, in units of 1/|lambda|.
    """
    method: object
    tol: float
    x0: np.ndarray
    t_end: float
    angles: np.ndarray
    h: np.ndarray

    def __repr__(self):
        steps = f", h = {self.h.min():.4g} to {self.h.max():.4g}" if self.h.size else ""
        return (f"<accuracy domain of {_name(self.method)}: tol = {self.tol:g} on [0, {self.t_end:g}], "
                f"{self.angles.size} angle(s){steps}>")

    def plot(self, ax=None, **style):
        """Draw the boundary in the plane of h*lambda; `style` goes to matplotlib's plot."""
        return plot_accuracy(self, ax, style)


@dataclass(frozen=True, eq=False, repr=False)
class DampingFrequency:
    """What a step makes of h*lambda = r (-cos(angle) + i sin(angle)): -damping + i frequency, with the true one.

    All are per step: divided by h they are those per unit of time.

    Attributes
    ----------
    method : Method, str or (num, den)
        What was asked for.
    angle : float
        Of h*lambda, in degrees from the negative real axis: 0 is pure damping, 90 an undamped oscillation.
    r : ndarray, shape (k,)
        |h*lambda|.
    damping : ndarray, shape (k,)
        -log |R|: inf at a zero of R, -inf at a pole.
    frequency : ndarray, shape (k,)
        arg R, radians per step, -pi to pi.
    exact_damping : ndarray, shape (k,)
        r cos(angle).
    exact_frequency : ndarray, shape (k,)
        r sin(angle), radians per step, modulo 2 pi: brought to -pi to pi as `frequency` is, since a step cannot show
        whole turns.  So it jumps where r sin(angle) passes pi, 3 pi, ...
    """
    method: object
    angle: float
    r: np.ndarray
    damping: np.ndarray
    frequency: np.ndarray
    exact_damping: np.ndarray
    exact_frequency: np.ndarray

    def __repr__(self):
        lengths = f", r = {self.r.min():g} to {self.r.max():g}" if self.r.size else ""
        return (f"<damping and frequency of {_name(self.method)} at {self.angle:g} degrees: "
                f"{self.r.size} point(s){lengths}>")

    def plot(self, axes=None, **style):
        """Draw damping and frequency over r in two axes; `style` goes to matplotlib's plot."""
        return plot_damping(self, axes, style)


def stability_domain(method, *, rays=37):
    """Where a method is stable, for y' = lambda*y.

    Parameters
    ----------
    method : method, str, or (num, den)
        A method object or shorthand, or the coefficients of R(z) = N(z)/D(z) in ascending powers, with
        num[0] = den[0] = 1, up to degree 16.
    rays : int
        Rays from 0 to 180 degrees on which crossings are told.  Rays through the poles and zeros of R come in
        addition: by the maximum principle each unstable region has a pole and each bounded stable one a zero, so none
        is missed.

    Returns
    -------
    StabilityDomain
        ``is_certified`` is True for methods with a rational R.  The others (Newmark, extrapolations, generalized-alpha,
        ...) are stepped on q'' + 2 zeta w q' + w^2 q = 0, whose eigenvalues are lambda and its conjugate, at 201 lengths
        |z| from 0.01 to 1000 on each ray; what lies between is not seen.

    Examples
    --------
    >>> domain = dynstep.stability_domain(dynstep.Pade(3, 4))
    >>> domain.is_l_stable, domain.a_angle
    (True, 90.0)
    """
    rays = integer("rays", rays, 2)
    rational = _rational(method)
    if rational is None:
        return _sampled_domain(as_method(method), rays)
    handle = Handle(1)
    num, den = rational
    _, flags, numbers, intervals, poles, zeros = handle.call(_core.dynstep_stability_facts_of, num, den)
    p, q, _, count, is_i, is_a, is_f, is_l = map(int, flags)
    angle, at_infinity, growth, growth_at, real_limit, _ = map(float, numbers)
    none = np.empty(0), np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0)
    _, (nangles, ncrossings) = handle.call(_core.dynstep_stability_rays, num, den, rays, *none)
    angles, begins, first = np.empty(nangles), np.empty(nangles, np.int32), np.empty(nangles + 1, np.int32)
    crossings = np.empty(ncrossings)
    handle.call(_core.dynstep_stability_rays, num, den, rays, angles, begins, first, crossings)
    _, (curves, points, _) = handle.call(_core.dynstep_stability_boundary, num, den, none[1], none[0])
    cuts, line = np.empty(curves + 1, np.int32), np.empty(points, complex)
    handle.call(_core.dynstep_stability_boundary, num, den, cuts, line.view(float))
    return StabilityDomain(
        method, True, np.degrees(angles), np.split(crossings, first[1:-1]), begins, angle, bool(is_a), bool(is_i), bool(is_f),
        bool(is_l), at_infinity, intervals[:2*count].reshape(count, 2).copy(), growth, growth_at, real_limit,
        poles[:2*q].view(complex), zeros[:2*p].view(complex), np.split(line, cuts[1:-1]) if curves else [])


def stability_function(method, z):
    """R(z): what one step makes of y' = lambda*y, z = h*lambda.

    Parameters
    ----------
    method : method, str, or (num, den)
        As for :func:`stability_domain`; one with a rational R.
    z : complex, or array of them

    Returns
    -------
    complex, or array of the shape of `z`
        inf at a pole.

    Raises
    ------
    TypeError
        For a method without R(z): see :func:`spectral_radius`.
    """
    num, den = _needs_rational(method)
    points, shape = _points(z)
    values = Handle(1).call(_core.dynstep_rational_values, num, den, points)[1].view(complex).reshape(shape)
    return complex(values) if shape == () else values


def spectral_radius(method, z):
    """Factor by which a step makes the slowest of the motions with h*lambda = z and its conjugate larger: |R(z)|, or the
    spectral radius of a step on q'' + 2 zeta w q' + w^2 q = 0.

    Parameters
    ----------
    method : method, str, or (num, den)
        Any.
    z : complex, or array of them

    Returns
    -------
    float, or array of the shape of `z`
        inf where the method refuses the step (growing motions, long steps).  Eigenvalues that fall together, as on the real axis, are known to half of the digits (a third with
        generalized-alpha).
    """
    if _rational(method) is not None:
        return np.abs(stability_function(method, z))
    points, shape = _points(z)
    handle = Handle(1)
    as_method(method)._install(handle)
    code, radii = handle.call(_core.dynstep_spectral_radii, points)
    if code < 0:
        raise ValueError(handle.sentence)
    return float(radii[0]) if shape == () else radii.reshape(shape)


def accuracy_domain(method, tol=1e-4, x0=(1.0, 0.0), *, angles=None, t_end=10.0):
    """Smallest step lengths at which the error on [0, t_end] passes a tolerance, for x' = A x with eigenvalues on the unit
    circle, A = [[0, 1], [-1, 2 cos(theta)]].

    Parameters
    ----------
    method : method, str, or (num, den)
        One with a rational R.
    tol : float
        Of the largest Euclidean norm of the error, > 0.
    x0 : two floats
        Start.
    angles : array of float, optional
        theta in degrees from the positive real axis; default 0, 5, ..., 180.
    t_end : float

    Returns
    -------
    AccuracyDomain

    Notes
    -----
    Xie 1995, section 3.2.
    """
    num, den = _needs_rational(method)
    angles = np.arange(0.0, 181.0, 5.0) if angles is None else vector("angles", angles)
    tol, t_end, x0 = number("tol", tol), number("t_end", t_end), vector("x0", x0, 2)
    if not tol > 0.0:
        raise ValueError(f"tol = {tol:g} must be positive: the error that is allowed")
    if not t_end > 0.0:
        raise ValueError(f"t_end = {t_end:g} must be positive")
    handle = Handle(1)
    code, h = handle.call(_core.dynstep_accuracy_limits, num, den, np.radians(angles), x0, tol, t_end)
    if code < 0:
        raise ValueError(handle.sentence)
    return AccuracyDomain(method, tol, x0, t_end, angles, h)


def damping_frequency(method, angle=0.0, r=None):
    """Damping and frequency of a method along a ray, h*lambda = r (-cos(angle) + i sin(angle)).

    Parameters
    ----------
    method : method, str, or (num, den)
        One with a rational R.
    angle : float
        Degrees from the negative real axis.
    r : array of float, optional
        Default: 0 to 20.

    Returns
    -------
    DampingFrequency

    Notes
    -----
    Xie 1995, section 3.3, eqs. (3.12), (3.13).
    """
    angle = number("angle", angle)
    r = np.linspace(0.0, 20.0, 401) if r is None else vector("r", r)
    exact = -r*np.exp(-1j*np.radians(angle))
    if angle == 0.0:
        exact = -r + 0j
    value = np.atleast_1d(stability_function(method, exact))
    with np.errstate(divide="ignore"):
        damping = -np.log(np.abs(value))
    turned = np.angle(np.exp(1j*exact.imag))
    return DampingFrequency(method, angle, r, damping, np.angle(value), -exact.real, turned)


def alpha_windows(order, property="i-stable"):
    """For which alpha backinterpolation has a property.

    Parameters
    ----------
    order : (int, int) or "fehlberg"
        Degrees p and q, 0 to 6, of R(z) = P_p(alpha z)/P_q(-(1 - alpha) z).
    property : "i-stable", "a-stable", "f-stable" or "l-stable"
        |R| <= 1 on the imaginary axis; in the left half-plane; there and nowhere else; there, and R(infinity) = 0.

    Returns
    -------
    array (number, 2)
        Intervals of alpha; an isolated one has its ends equal.

    Examples
    --------
    >>> dynstep.alpha_windows((4, 5)).round(6)
    array([[0.43622 , 0.448615]])
    """
    which = choice("property", property, _PROPERTIES)
    family, p, q = _FEHLBERG, 0, 0
    if not isinstance(order, str) or order != "fehlberg":
        try:
            p, q = order
        except (TypeError, ValueError):
            raise TypeError(f"order must be (p, q) or 'fehlberg', not {order!r}") from None
        family, p, q = _TAYLOR, integer("order[0]", p, 0, 6), integer("order[1]", q, 0, 6)
    windows = np.empty((256, 2))
    _, (count,) = Handle(1).call(_core.dynstep_alpha_windows, family, p, q, which, windows.reshape(-1))
    return windows[:count].copy()


def _name(method):
    """Of a method in a sentence."""
    if isinstance(method, tuple):
        return f"R(z) of degrees {np.size(method[0]) - 1} and {np.size(method[1]) - 1}"
    return repr(method)


def _rational(method):
    """Coefficients (num, den) of R(z), or None where the method has none."""
    if isinstance(method, tuple) and len(method) == 2:
        return vector("num", method[0]), vector("den", method[1])
    family = _family(as_method(method))
    if family is None:
        return None
    _, num, den = Handle(1).call(_core.dynstep_rational_coefficients, *family)
    return np.trim_zeros(num, "b"), np.trim_zeros(den, "b")


def _family(method):
    """(family, p, q, alpha) of a method object that has R(z)."""
    if isinstance(method, Midpoint) or isinstance(method, Newmark) and (method.beta, method.gamma) == (0.25, 0.5):
        return _PADE, 1, 1, 0.0
    if isinstance(method, Pade):
        return _PADE, method.p, method.q, 0.0
    if isinstance(method, BI):
        family, orders = (_FEHLBERG, (0, 0)) if method.orders is None else (_TAYLOR, method.orders)
        return family, *orders, method.alpha
    return None


def _needs_rational(method):
    rational = _rational(method)
    if rational is None:
        raise TypeError(f"{method!r} has no stability function R(z); ask for its spectral_radius")
    return rational


def _points(z):
    """Real and imaginary parts by turns, and the shape."""
    z = np.asarray(z)
    if z.dtype.kind not in "biufc":
        raise TypeError(f"z has the type {z.dtype}, expected numbers")
    points = np.ascontiguousarray(z, complex).reshape(-1)
    return array("z", points.view(float)), z.shape


def _sampled_domain(method, rays):
    angles = np.linspace(0.0, 180.0, rays)
    z = _SAMPLED_RADII*np.exp(1j*np.radians(angles))[:, None]
    stable = spectral_radius(method, z) <= 1.0 + _SAMPLED_GROWTH
    crossings = []
    for i, row in enumerate(stable):
        flips = np.nonzero(row[1:] != row[:-1])[0]
        low, high, inside = _SAMPLED_RADII[flips], _SAMPLED_RADII[flips + 1], row[flips]
        direction = np.exp(1j*np.radians(angles[i]))
        for _ in range(40 if flips.size else 0):
            middle = 0.5*(low + high)
            same = (spectral_radius(method, middle*direction) <= 1.0 + _SAMPLED_GROWTH) == inside
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        crossings.append(low)
    whole = stable.all(axis=1)
    left = angles >= 90.0
    unstable = angles[left & ~whole]
    a_angle = 0.0 if not whole[-1] else 90.0 if not unstable.size else 180.0 - angles[angles > unstable.max()].min()
    axis = spectral_radius(method, 1j*_SAMPLED_RADII)
    is_i = bool((axis <= 1.0 + _SAMPLED_GROWTH).all())
    at = int(axis.argmax())
    padded = np.concatenate(([False], axis <= 1.0 + _SAMPLED_GROWTH, [False]))
    begin, end = np.nonzero(~padded[:-1] & padded[1:])[0], np.nonzero(padded[:-1] & ~padded[1:])[0] - 1
    intervals = np.column_stack((np.where(begin == 0, 0.0, _SAMPLED_RADII[begin]),
                                 np.where(end == axis.size - 1, np.inf, _SAMPLED_RADII[end])))
    far = float(spectral_radius(method, -1e9))
    row = whole[-1]
    return StabilityDomain(
        method, False, angles, crossings, np.where(stable[:, 0], 1, -1), float(a_angle), a_angle == 90.0, is_i, False,
        bool(a_angle == 90.0 and far < 1e-3), far, intervals, float(max(0.0, axis[at] - 1.0)), float(_SAMPLED_RADII[at]),
        np.inf if row else float(crossings[-1][0]) if crossings[-1].size else 0.0)
