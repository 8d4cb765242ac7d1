# SPDX-License-Identifier: BSD-3-Clause
"""The methods for y' = f(t,y) as solvers of scipy.integrate.

    >>> import dynstep
    >>> from scipy.integrate import solve_ivp
    >>> solve_ivp(f, (0, 10), y0, method=dynstep.scipy.BI45, rtol=1e-6, atol=1e-9)

`BI` is backinterpolation with any orders; `BI44`, `BI45` and `BI55` name three of them; `BIExtrapolation` extrapolates it.  They
take what scipy's own implicit solvers take; scipy is needed for this module alone.
"""

import warnings
from inspect import signature

import numpy as np
from scipy.integrate import DenseOutput, OdeSolver

from . import _core
from ._arguments import LARGEST_INTEGER, integer, number
from ._differences import difference_jacobian
from ._handle import MORE, SUCCESS
from ._hermite import HermiteSteps
from ._matrices import NOTHING, is_sparse
from ._ode import OdeSystem
from ._rational_methods import BI as _BI
from ._rational_methods import BIExtrapolation as _BIExtrapolation
from ._request import make_handle, message

__all__ = ["BI", "BI44", "BI45", "BI55", "BIExtrapolation"]

# The end of a run that has none
_FAR = 1e300

# Below that scipy's solvers raise rtol, too
_LEAST_RTOL = 100*np.finfo(float).eps


class _Solver(OdeSolver):
    """Steps of the library, one for each call of `step`.

    Parameters
    ----------
    fun : callable
        ``fun(t, y)`` returns y', shape (n,).
    t0 : float
    y0 : array_like, shape (n,)
        Real.
    t_bound : float
        End of the run, before or behind t0, or infinite.
    max_step, first_step, min_step : float, optional
        Lengths > 0 (min_step: >= 0) of steps; the last one may be shorter.  Default: none, chosen, 0.
    rtol, atol : float, optional
        The error of a step, its root mean square over the components, may be atol + rtol*abs(y); `atol` may be an array
        of shape (n,).  Default: 1e-3 and 1e-6.
    jac : callable, array_like, sparse matrix or None, optional
        df/dy: ``jac(t, y)``, or a constant matrix; dense or of scipy.sparse, which is stored as a dense one.  Default: differences,
        which are not counted in `nfev`.  It decides how fast the iteration of a step converges, nothing else.
    lband, uband : int, optional
        Diagonals of a banded df/dy below and above the main one; `jac` then gives an array of shape (lband + uband + 1, n)
        with df[i]/dy[j] in place [i - j + uband, j].
    vectorized : bool, optional
        ``fun(t, y)`` takes y of shape (n, k), too, which makes differences fast.
    **options
        Of the method.

    Attributes
    ----------
    nfev, njev, nlu : int
        Evaluations of `fun` and of the Jacobian, factorizations.  `nfev` has those for dense output.

    Notes
    -----
    A step that fails ends the run with the library's sentence as `message`.  An exception of `fun` or `jac` comes out unchanged.
    Dense output has the order of the method: where the cubic through the ends of a step does not do, the motion inside a step is
    computed once more, when it is asked for.

    Raises
    ------
    ValueError, TypeError
        An argument that cannot be; complex y0.
    """

    _options = ()

    def __init__(self, fun, t0, y0, t_bound, max_step=np.inf, rtol=1e-3, atol=1e-6, jac=None, lband=None, uband=None,
                 vectorized=False, first_step=None, min_step=0.0, **options):
        for name in [name for name in options if name not in self._options]:
            warnings.warn(f"{type(self).__name__} has no option `{name}`; it has no effect", stacklevel=2)
            del options[name]
        super().__init__(fun, t0, y0, t_bound, vectorized)
        self._method = self._make(**options)
        self._control = _control(self, rtol, atol, max_step, first_step, min_step)
        self._band = _band(self.n, lband, uband)
        self._begin_error = self._inner = None
        self._inner_nlu = 0
        self.y = self.y.copy()
        if self.n == 0 or t0 == t_bound:
            _checked_jacobian(self, jac)
            return                                               # `step` of scipy knows what to do
        self._system = OdeSystem(self.n, _inside(self, self.fun), _inside(self, _checked_jacobian(self, jac)),
                                 jacobian_kind="dense" if self._band is None else self._band)
        self._handle = make_handle(self._system, self._method)
        code = self._handle.call(_core.dynstep_start_ode, float(t0), self.y)
        if code == SUCCESS:
            end = t_bound if np.isfinite(t_bound) else self.direction*_FAR
            code = self._handle.call(_core.dynstep_begin_within, float(end), *self._control, NOTHING)
        if code != SUCCESS:
            self._begin_error = message(self._handle, self._system, code)
            return
        self._yp = self._handle.call(_core.dynstep_get_ode, self.n)[3]

    def _step_impl(self):
        if self._begin_error is not None:
            return False, self._begin_error
        handle = self._handle
        if 0.0 < self._control[5] < abs(np.nextafter(self.t, self.direction*np.inf) - self.t):
            return False, self.TOO_SMALL_STEP
        code, _ = handle.call(_core.dynstep_proceed, 1, *(NOTHING,)*4, refuse=False)
        self._count()
        if code not in (MORE, SUCCESS):
            return False, message(handle, self._system, code)
        self._before = self.y, self._yp
        _, self.t, self.y, self._yp = handle.call(_core.dynstep_get_ode, self.n)
        return True, None

    def _count(self):
        self.nlu = self._handle.counts()["factorizations"] + self._inner_nlu

    def _dense_output_impl(self):
        points = [(self.t_old, *self._before), *self._nodes(), (self.t, self.y, self._yp)]
        return _Dense(*(np.array(x) for x in zip(*points)))

    def _nodes(self):
        """Points (t, y, y') inside the step, so many that the polynomial through all has the order of the method; fewer where
        the motion cannot be computed."""
        count = max(0, (self._order() - 3)//2)                   # 2 count + 4 >= order
        points = []
        if not count:
            return points
        if self._inner is None:
            self._inner = make_handle(self._system, self._method)
        handle = self._inner
        h = (self.t - self.t_old)/(count + 1)
        code = handle.call(_core.dynstep_start_ode, self.t_old, self._before[0])
        for i in range(1, count + 1):
            if code != SUCCESS:
                break
            handle.call(_core.dynstep_begin_within, self.t_old + i*h, *self._control[:4], h, 0.0, 0.0, NOTHING)
            code, _ = handle.call(_core.dynstep_proceed, LARGEST_INTEGER, *(NOTHING,)*4, refuse=False)
            if code == SUCCESS:
                points.append(handle.call(_core.dynstep_get_ode, self.n)[1:])
        self._inner_nlu += handle.counts()["factorizations"]
        self._count()
        return points

    def _order(self):
        """Of a step, about; where the error chooses it, as src/steppers/dynstep_order_control.f90 guesses it."""
        method = self._method
        if getattr(method, "levels", 1) is not None:
            return method.properties.order
        levels = min(max(2, int(1.5 - 0.6*np.log10(self._control[0]))), method.max_levels)
        return method.base.properties.order + 2*(levels - 1)


_PARAMETERS = _Solver.__doc__.partition("one for each call of `step`.\n")[2]


class BI(_Solver):
    __doc__ = f"""Backinterpolation; **options are `order`, `alpha`, `halves` and `newton` of :class:`dynstep.BI`.

    Its steps are those of an explicit method twice, and |h J| of some tens is the most that their iteration bears where f is not
    linear: for stiffer problems with a nonlinear f take scipy's Radau.
{_PARAMETERS}"""

    _options = tuple(signature(_BI).parameters)

    def _make(self, **options):
        return _BI(**options)


class BI44(BI):
    """:class:`BI` of the orders (4, 4) with alpha = 1/2, symmetric, of order 4: undamped modes keep their amplitude.
    **options are `alpha` and `newton`."""

    _options = ("alpha", "newton")
    _orders, _alpha = (4, 4), 0.5

    def _make(self, alpha=None, newton=None):
        return _BI(self._orders, self._alpha if alpha is None else alpha, newton=newton)


class BI45(BI44):
    """:class:`BI` of the orders (4, 5) with alpha = 0.44, of order 4: stiff modes are damped.  **options are `alpha` and
    `newton`."""

    _orders, _alpha = (4, 5), 0.44


class BI55(BI44):
    """:class:`BI` of the orders (5, 5) with alpha = 1/2, symmetric, of order 6, for problems that are not stiff: it is not
    A-stable.  **options are `alpha` and `newton`."""

    _orders = (5, 5)


class BIExtrapolation(_Solver):
    __doc__ = f"""Extrapolation of :class:`BI44`; **options are those of :class:`dynstep.BIExtrapolation`.
{_PARAMETERS}"""

    _options = tuple(signature(_BIExtrapolation).parameters)

    def _make(self, **options):
        return _BIExtrapolation(**options)


class _Dense(DenseOutput):
    """The polynomial through y and y' at the ends of a step and at nodes inside."""

    def __init__(self, t, y, yp):
        super().__init__(t[0], t[-1])
        self._end = y[-1].copy()
        self._curve = HermiteSteps(t, y, yp, np.array([0]), len(t))

    def _call_impl(self, t):
        times = np.atleast_1d(t)
        y, _ = self._curve(np.zeros(times.size, int), (times - self.t_old)/(self.t - self.t_old))
        y[times == self.t] = self._end                           # to the last bit
        return y[0] if t.ndim == 0 else y.T


def _control(solver, rtol, atol, max_step, first_step, min_step):
    """rtol, atol, two of multipliers, h_first, h_max, h_min for the library."""
    if np.ndim(rtol):
        raise ValueError(f"rtol must be a number, not an array of shape {np.shape(rtol)}; atol may be an array")
    rtol = number("rtol", rtol, 0.0)
    if rtol < _LEAST_RTOL:
        warnings.warn(f"rtol = {rtol:g} is too small, {_LEAST_RTOL:.3g} is taken", stacklevel=3)
        rtol = _LEAST_RTOL
    atol = np.array(atol, float, ndmin=1)
    if atol.shape not in ((1,), (solver.n,)) or not (atol >= 0.0).all() or np.isinf(atol).any():
        raise ValueError(f"atol = {atol} must be a number, or of shape ({solver.n},), of values that are 0 or more")
    if not max_step > 0.0:
        raise ValueError(f"max_step = {max_step} must be positive")
    if first_step is None:
        first_step = 0.0
    elif not 0.0 < first_step <= abs(solver.t_bound - solver.t):
        raise ValueError(f"first_step = {first_step} must be positive, and not longer than the interval")
    return (rtol, atol, 0.0, 0.0, float(solver.direction*first_step), float(max_step) if np.isfinite(max_step) else 0.0,
            number("min_step", min_step, 0.0))


def _inside(solver, fun):
    """The same function of t and y, not asked behind the end, where the sum of substeps may lie by a rounding error."""
    nearer = min if solver.direction > 0 else max
    return lambda t, y: fun(nearer(t, solver.t_bound), y)


def _band(n, lband, uband):
    """(kl, ku), or None for a full matrix; one that is not given is 0."""
    if lband is None and uband is None or n == 0:
        return None
    return tuple(0 if x is None else integer(name, x, 0, n - 1) for name, x in (("lband", lband), ("uband", uband)))


def _checked_jacobian(solver, jac):
    """A function of t, y that counts itself in solver.njev and returns a dense or packed array."""
    band, n = solver._band, solver.n
    shape = (n, n) if band is None else (sum(band) + 1, n)
    if jac is None:
        def jacobian(t, y):
            solver.njev += 1
            return difference_jacobian(solver.fun_vectorized, t, y, band)
        return jacobian
    if callable(jac):
        def jacobian(t, y):
            solver.njev += 1
            return _array(jac(t, y), shape)
        return jacobian
    matrix = _array(jac, shape)
    return lambda t, y: matrix


def _array(matrix, shape):
    matrix = np.asarray(matrix.toarray() if is_sparse(matrix) else matrix, float)
    if matrix.shape != shape:
        raise ValueError(f"jac has the shape {matrix.shape}, expected {shape}")
    return matrix
