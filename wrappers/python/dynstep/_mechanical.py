# SPDX-License-Identifier: BSD-3-Clause
"""M(t,q,v) q'' = f(t,q,v) + r with functions of the user's, free or constrained."""

import numpy as np

from . import _core
from ._arguments import LARGEST_INTEGER, flag, integer
from ._compiled import recognise, signature
from ._constraints import NAMES as CONSTRAINT_NAMES
from ._constraints import Constraints
from ._functions import functions
from ._matrices import declared_kind, order_of, rows_of
from ._ordering import store_as_given
from ._switches import Switches

_MASS = 1                                       # enum dynstep_matrix


class MechanicalSystem:
    """M(t,q,v) q'' = f(t,q,v), or with constraints g(t,q) = 0, k(t,q,v) = 0 and the reactions that hold them.

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
    constraint : callable or compiled function, optional
        ``constraint(t, q, *args)`` returns g, m numbers that the motion keeps at zero.  Needs one of the methods
        :class:`SOI2`, :class:`HHT`.
    constraint_jacobian : callable or compiled function, optional
        ``constraint_jacobian(t, q, *args)`` returns G = dg/dq, shape (m, n), or, where g depends on t, a tuple
        ``(G, g_t)`` with g_t = dg/dt, shape (m,).  G is an array or a scipy.sparse matrix; for m = 1 also a vector.
        Default: differences, of g_t too.
    constraint_curvature : callable or compiled function, optional
        ``constraint_curvature(t, q, v, *args)`` returns g'' - G q'', m numbers.  Default: differences.
    velocity_constraint, velocity_jacobian, velocity_curvature : callable or compiled function, optional
        The same for nonholonomic constraints: ``(t, q, v, *args)`` to k, p numbers; to K = dk/dv, shape (p, n); and to
        k' - K q'', p numbers.
    reaction : callable or compiled function, optional
        ``reaction(t, q, v, lam, psi, *args)`` returns r, n numbers.  Default: -G^T lam - K^T psi.
    reaction_jacobian : callable or compiled function, optional
        ``reaction_jacobian(t, q, v, lam, psi, *args)`` returns ``(dr/dlam, dr/dpsi)``, shapes (n, m) and (n, p), or one
        of them where the other has no columns.  Default: differences.
    reaction_tangent : callable or compiled function, optional
        ``reaction_tangent(t, q, v, lam, psi, *args)`` returns ``(K, C)``, -dr/dq and -dr/dv, as `tangent` does.
        Only the number of Newton's corrections depends on it.  Default: left out.
    constraints, velocity_constraints : int, optional
        m and p.  Default: the number of rows of the patterns, or how many numbers the Python functions return at the
        start of a run.  Compiled functions need them.
    constraint_pattern, velocity_pattern : scipy.sparse matrix, (indptr, indices) or array, optional
        Places of G, and of K, that may differ from zero: those that a sparse matrix stores, or its two arrays of the
        CSR format, or the nonzero entries of an array.  It must not change during a run; so it is declared, not
        taken from the first Jacobian.  The library then looks for an order of coordinates and constraints with a
        narrow band: for chains and trees a step takes a time linear in n.  With a pattern the Jacobian may also
        return the values alone, a vector in the order of the pattern.
    equation_order : sequence of int, optional
        The order of the band, in place of the library's own search: a permutation of 0, ..., n + m + p - 1, where
        0 ... n - 1 are coordinates, then come `constraint` and `velocity_constraint`.

    switches : callable or compiled function, optional
        ``switches(t, q, v, *args)`` returns `n_switches` numbers that change their signs at the surfaces where `force` is not
        smooth: contacts, dead zones, dry friction.  :func:`solve` ends a step at each crossing, for real, and starts anew
        behind it, so that the accuracy is that of a smooth system.
    n_switches : int, optional
        Default: 1, or the size of `side`.
    side : ndarray of int32, shape (n_switches,), optional
        Where the library writes +1 or -1, the side of each surface; default: an array of the system's own, the attribute
        `side`.  A force that asks ``side[i]`` in place of the sign of switch i is smooth inside each step, and it must ask it
        where it jumps at the surface.  Give an array where compiled functions are to read it, through `user_data`.

    Attributes
    ----------
    side : ndarray of int32, shape (n_switches,), or None
        The present sides.  Runs of one system with switches exclude each other: a second one at the same time, in another thread
        or inside a function of the first, is a RuntimeError.

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

    The same pendulum, a mass on a rod of length 1:

    >>> pendulum = dynstep.MechanicalSystem(2, lambda t, q, v: [0.0, -9.81], constraint=lambda t, q: q @ q - 1,
    ...                                     velocity_free=True)
    >>> solution = dynstep.solve(pendulum, (0, 10), [1.0, 0.0], [0.0, 0.0], h=0.01)
    >>> tension = 2*solution.lam[0]
    """

    ordering = None
    first_order = False

    def __init__(self, n, force, mass=None, tangent=None, energy=None, *, mass_kind="dense", mass_symmetric=False,
                 mass_constant=False, tangent_kind="dense", tangent_symmetric=False, tangent_constant=False,
                 linear=False, velocity_free=False, user_data=None, args=(), constraint=None,
                 constraint_jacobian=None, constraint_curvature=None, velocity_constraint=None,
                 velocity_jacobian=None, velocity_curvature=None, reaction=None, reaction_jacobian=None,
                 reaction_tangent=None, constraints=None, velocity_constraints=None, constraint_pattern=None,
                 velocity_pattern=None, equation_order=None, switches=None, n_switches=None, side=None):
        of_constraints = {name: function for name, function in locals().items() if name in CONSTRAINT_NAMES}
        self.n = integer("n", n, 1, LARGEST_INTEGER//2)
        if force is None:
            raise TypeError("force is None, expected a function")
        mass_is_function = mass is not None and (callable(mass) or recognise("mass", mass, "mass") is not None)
        self._functions = functions({"force": force, "mass": mass if mass_is_function else None, "tangent": tangent,
                                     "energy": energy, "switches": switches, **of_constraints}, user_data, args)
        self._switches = Switches(self._functions["switches"], n_switches, side)
        self.side = self._switches.side
        self._constraints = Constraints(self.n, self._functions, constraints, velocity_constraints,
                                        constraint_pattern, velocity_pattern, equation_order)
        self._mass_structure = (*declared_kind("mass_kind", mass_kind, self.n), _symmetric("mass", mass_symmetric, mass_kind),
                                int(flag("mass_constant", mass_constant)))
        self._tangent_structure = (
            *declared_kind("tangent_kind", tangent_kind, self.n), _symmetric("tangent", tangent_symmetric, tangent_kind),
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

    @property
    def is_constrained(self):
        """True where constraints were given."""
        return bool(self._constraints)

    def _install(self, handle):
        f = self._functions
        handle.bind(_core.dynstep_set_force, f["force"])
        if f["mass"] is not None:
            handle.bind(_core.dynstep_set_mass, f["mass"], *self._mass_structure,
                        rows=rows_of(self.n, *self._mass_structure[:3]))
        elif self._mass is not None:
            mass = self._mass
            handle.call(_core.dynstep_set_matrix, _MASS, *mass.stored(), int(mass.symmetric), mass.entries())
        handle.call(_core.dynstep_set_structure, *self._tangent_structure)
        if f["tangent"] is not None:
            handle.bind(_core.dynstep_set_tangent, f["tangent"], rows=rows_of(self.n, *self._tangent_structure[:3]))
        if f["energy"] is not None:
            handle.bind(_core.dynstep_set_energy, f["energy"])
        self._switches.install(handle)

    def _install_constraints(self, handle, t, q, v):
        """At the first start of a handle: only then there is a point where functions can be asked for m and p."""
        if self._constraints and not handle.m + handle.p:
            self._constraints.install(handle, self.n, t, q, v, rows_of(self.n, *self._tangent_structure[:3]))


def _symmetric(name, symmetric, kind):
    if flag(f"{name}_symmetric", symmetric) and isinstance(kind, tuple) and kind[0] != kind[1]:
        raise ValueError(f"{name}_symmetric: kl and ku of {name}_kind = {kind} differ")
    return int(symmetric)
