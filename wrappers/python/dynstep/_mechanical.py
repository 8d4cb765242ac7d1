# SPDX-License-Identifier: BSD-3-Clause
"""M(t,q,v) q'' = f(t,q,v) with functions of the user's."""

import numpy as np

from . import _core
from ._arguments import LARGEST_INTEGER, flag, integer
from ._compiled import recognise, signature
from ._functions import functions
from ._matrices import BANDED, DENSE, DIAGONAL, order_of
from ._ordering import store_as_given

_MASS = 1                                       # enum dynstep_matrix


class MechanicalSystem:
    """M(t,q,v) q'' = f(t,q,v).

    Parameters
    ----------
    n : int
        Number of coordinates, >= 1.
    force : callable or compiled function
        ``force(t, q, v, *args)`` returns f, n numbers: all forces on the right-hand side.
    mass : matrix, callable or compiled function, optional
        A constant matrix (as for :class:`LinearSystem`), or ``mass(t, q, v, *args)``, which returns M in the
        storage of `mass_kind`.  Default: the identity.
    tangent : callable or compiled function, optional
        ``tangent(t, q, v, a, *args)`` returns ``(K, C)`` in the storage of `tangent_kind`, K = -d(f - M a)/dq
        and C = -d(f - M a)/dv at fixed a; only K where the system is `velocity_free`.  Default: differences.
    energy : callable or compiled function, optional
        ``energy(t, q, v, *args)`` returns a number.
    mass_kind, tangent_kind : "dense", "diagonal" or (kl, ku)
        Structure of M, and of K and C: a tuple means a band.  Shapes that Python functions return: (n, n), (n,), or
        (kl + ku + 1, n) as for :func:`banded`.  `mass_kind` is read where `mass` is a function.
    mass_symmetric, mass_constant, tangent_symmetric, tangent_constant : bool
        M is symmetric, depends on nothing; K and C are, do.
    linear : bool
        f is linear in q and v, and M depends on t at most: one correction of Newton's iteration is exact.
        (Believed where there is a `tangent`; differences are too rough for that.)
    velocity_free : bool
        f and M do not depend on v.  Halves the evaluations of f for differences.
    user_data : optional
        What compiled functions get as their context; see :func:`compiled`.
    args : tuple
        Further arguments of the Python functions.

    Notes
    -----
    Functions are Python functions, or compiled ones: ``numba.cfunc``, a ctypes or cffi function pointer, a PyCapsule,
    ``scipy.LowLevelCallable``; see :func:`signature` for the C signatures.  Compiled functions run without the
    interpreter's lock, about a hundred times faster.

    Arrays that a Python function gets are its own and may be kept.  What it raises comes out of :func:`solve`
    unchanged.  To say that the model is not defined at a point, so that a smaller correction is tried, raise
    :class:`OutOfDomain`, or return NaN.

    What is declared is believed; :func:`check_system` compares it with what the functions do.

    Raises
    ------
    ValueError, TypeError
        Something that does not fit, named.

    Examples
    --------
    A pendulum:

    >>> pendulum = dynstep.MechanicalSystem(1, lambda t, q, v: -9.81*np.sin(q), velocity_free=True)
    >>> solution = dynstep.solve(pendulum, (0, 10), 2.0, 0.0, h=0.05)
    """

    ordering = None

    def __init__(self, n, force, mass=None, tangent=None, energy=None, *, mass_kind="dense", mass_symmetric=False,
                 mass_constant=False, tangent_kind="dense", tangent_symmetric=False, tangent_constant=False,
                 linear=False, velocity_free=False, user_data=None, args=()):
        self.n = integer("n", n, 1, LARGEST_INTEGER//2)
        if force is None:
            raise TypeError("force is None, expected a function")
        mass_is_function = mass is not None and (callable(mass) or recognise("mass", mass, "mass") is not None)
        self._functions = functions({"force": force, "mass": mass if mass_is_function else None, "tangent": tangent,
                                     "energy": energy}, user_data, args)
        self._mass_structure = (*_kind("mass_kind", mass_kind, self.n), _symmetric("mass", mass_symmetric, mass_kind),
                                int(flag("mass_constant", mass_constant)))
        self._tangent_structure = (
            *_kind("tangent_kind", tangent_kind, self.n), _symmetric("tangent", tangent_symmetric, tangent_kind),
            int(flag("tangent_constant", tangent_constant)), int(flag("linear", linear)),
            int(flag("velocity_free", velocity_free)))
        self._mass = None
        if not mass_is_function:
            if (mass_kind, mass_symmetric, mass_constant) != ("dense", False, False):
                raise ValueError("mass_kind, mass_symmetric and mass_constant are read where mass is a function; a "
                                 "matrix tells them itself")
            if mass is not None:
                if order_of("mass", mass) not in (None, self.n):
                    raise ValueError(f"mass has {order_of('mass', mass)} rows, expected n = {self.n}")
                self._mass = store_as_given("mass", mass, self.n)
        self.has_energy = energy is not None

    def energy(self, t, q, v):
        """Energy by the function given.

        Parameters
        ----------
        t : float or array_like, shape (nt,)
        q, v : array_like, shape (n,) or (n, nt)

        Returns
        -------
        float or ndarray, shape (nt,)

        Raises
        ------
        ValueError
            The system has no energy function.
        """
        q, v = np.asarray(q, float), np.asarray(v, float)
        if q.ndim < 2:
            return float(self._energies([t], q.reshape(self.n, 1), v.reshape(self.n, 1))[0])
        return self._energies(t, q, v)

    def _energies(self, t, q, v):
        energy = self._functions["energy"]
        if energy is None:
            raise ValueError("the system has no energy function")
        points = [(float(x), q[:, i].copy(), v[:, i].copy()) for i, x in enumerate(t)]
        if energy.is_python:
            return np.array([energy.fun(*point, *energy.args) for point in points], float)
        function = signature("energy", "ctypes")(energy.compiled.address)
        result = np.empty(1)
        values = np.empty(len(points))
        for i, (x, q1, v1) in enumerate(points):
            code = function(self.n, x, q1.ctypes.data, v1.ctypes.data, result.ctypes.data, energy.compiled.context)
            values[i] = result[0] if code == 0 else np.nan
        return values

    def __repr__(self):
        given = ", ".join(name for name, f in self._functions.items() if f is not None)
        return f"<mechanical system of {self.n} coordinate(s) with {given}>"

    def _install(self, handle):
        f = self._functions
        handle.bind(_core.dynstep_set_force, f["force"])
        if f["mass"] is not None:
            handle.bind(_core.dynstep_set_mass, f["mass"], *self._mass_structure,
                        rows=_rows(self.n, *self._mass_structure[:3]))
        elif self._mass is not None:
            self._mass.install(handle, _core.dynstep_set_matrix, _MASS)
        handle.call(_core.dynstep_set_structure, *self._tangent_structure)
        if f["tangent"] is not None:
            handle.bind(_core.dynstep_set_tangent, f["tangent"], rows=_rows(self.n, *self._tangent_structure[:3]))
        if f["energy"] is not None:
            handle.bind(_core.dynstep_set_energy, f["energy"])


def _kind(name, kind, n):
    """(kind, kl, ku) of the library."""
    if isinstance(kind, str) and kind in ("dense", "diagonal"):
        return (DENSE if kind == "dense" else DIAGONAL), 0, 0
    if isinstance(kind, tuple) and len(kind) == 2:
        return BANDED, integer(f"kl of {name}", kind[0], 0, n - 1), integer(f"ku of {name}", kind[1], 0, n - 1)
    raise ValueError(f"{name} must be 'dense', 'diagonal' or a tuple (kl, ku), not {kind!r}")


def _symmetric(name, symmetric, kind):
    if flag(f"{name}_symmetric", symmetric) and isinstance(kind, tuple) and kind[0] != kind[1]:
        raise ValueError(f"{name}_symmetric: kl and ku of {name}_kind = {kind} differ")
    return int(symmetric)


def _rows(n, kind, kl, ku):
    """Rows of the arrays that a Python function returns; 0: a vector."""
    return {DIAGONAL: 0, DENSE: n}.get(kind, kl + ku + 1)
