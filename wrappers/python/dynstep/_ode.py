# SPDX-License-Identifier: BSD-3-Clause
"""First-order systems: y' = f(t,y), and y' = A y + b(t) with a constant matrix."""

from . import _core
from ._arguments import LARGEST_INTEGER, integer
from ._functions import functions
from ._linear import common_order
from ._loads import LoadTable
from ._matrices import declared_kind, rows_of
from ._ordering import store
from ._switches import Switches


class OdeSystem:
    """y' = f(t,y).

    Parameters
    ----------
    n : int
        Number of unknowns, >= 1.
    rhs : callable or compiled function
        ``rhs(t, y, *args)`` returns f, n numbers.
    jacobian : callable or compiled function, optional
        ``jacobian(t, y, *args)`` returns df/dy in the storage of `jacobian_kind`.  Default: differences.
    jacobian_kind : "dense", "diagonal" or (kl, ku)
        Structure of df/dy, also for differences, which cost kl + ku + 2 evaluations of f in a band; a tuple means a
        band.  With entries outside of it the iteration of a step converges slowly, or not at all.  Shapes that a Python function returns: (n, n), (n,), or (kl + ku + 1, n) as for :func:`banded`.
    user_data : optional
        What compiled functions get as their context; see :func:`compiled`.
    args : tuple
        Further arguments of the Python functions; what is no tuple or list counts as one argument.

    switches, n_switches, side : optional
        As for :class:`MechanicalSystem`, with ``switches(t, y, *args)``; a compiled function gets y in q, and NULL in v.

    Notes
    -----
    Functions are Python functions or compiled ones, as for :class:`MechanicalSystem`; ``dynstep.signature("rhs")`` and
    ``dynstep.signature("jacobian")`` are the C signatures.  A Python function that raises :class:`OutOfDomain`, or
    returns NaN, asks for a smaller correction.  The Jacobian decides how fast the iteration of a step
    converges, nothing else.

    Raises
    ------
    ValueError, TypeError
        Something that does not fit, named.

    Examples
    --------
    >>> system = dynstep.OdeSystem(2, lambda t, y: [y[1], -np.sin(y[0])])
    >>> solution = dynstep.solve_ode(system, (0, 10), [1.0, 0.0], h=0.05)
    """

    ordering = None
    first_order = True

    def __init__(self, n, rhs, jacobian=None, *, jacobian_kind="dense", user_data=None, args=(), switches=None,
                 n_switches=None, side=None):
        self.n = integer("n", n, 1, LARGEST_INTEGER)
        if rhs is None:
            raise TypeError("rhs is None, expected a function")
        self._functions = functions({"rhs": rhs, "jacobian": jacobian, "switches": switches}, user_data, args)
        self._switches = Switches(self._functions["switches"], n_switches, side)
        self.side = self._switches.side
        self._jacobian = declared_kind("jacobian_kind", jacobian_kind, self.n)

    def __repr__(self):
        given = " and ".join(name for name, f in self._functions.items() if f is not None)
        return f"<first-order system of {self.n} unknown(s) with {given}>"

    def _install(self, handle):
        handle.bind(_core.dynstep_set_rhs, self._functions["rhs"])
        handle.bind(_core.dynstep_set_jacobian, self._functions["jacobian"], *self._jacobian,
                    rows=rows_of(self.n, *self._jacobian))
        self._switches.install(handle)


class LinearOde:
    """y' = A y + b(t), with a constant matrix.

    Parameters
    ----------
    A : matrix
        A number, a vector (a diagonal matrix), a 2-D array, ``dynstep.banded(...)``, or any matrix of scipy.sparse, as for
        :class:`LinearSystem`.
    source : callable, compiled function or LoadTable, optional
        b(t).  A Python function ``source(t, *args)`` returns n numbers; a compiled one has the signature
        ``dynstep.signature("source")``.
    user_data : optional
        What a compiled source gets as its context; see :func:`compiled`.
    args : tuple
        Further arguments of a Python source.

    Attributes
    ----------
    n : int
        Number of unknowns.
    ordering : ndarray of int or None
        Where a new order pays for a sparse matrix: unknown ``ordering[i]`` has place i inside the library.

    Notes
    -----
    The library steps such a system without Python, and factorizes once for each step length.

    Raises
    ------
    ValueError, TypeError
        Shapes that do not fit, entries that are not finite or not real.

    Examples
    --------
    >>> system = dynstep.LinearOde([[0.0, 1.0], [-4.0, 0.0]])
    >>> dynstep.solve_ode(system, (0, 10), [1.0, 0.0], h=0.1).y[0, -1]      # cos(2*10)
    """

    first_order = True

    def __init__(self, A, source=None, *, user_data=None, args=()):
        if A is None:
            raise TypeError("A is None, expected a matrix")
        self._table = source if isinstance(source, LoadTable) else None
        self.n = common_order({"A": A}, source=self._table)
        matrices, self.ordering = store(self.n, A=A)
        self._matrix = matrices["A"]
        self.source = source
        self._source = functions({"source": None if self._table else source}, user_data, args)["source"]

    @property
    def storage(self):
        """How A is stored."""
        return repr(self._matrix)

    def __repr__(self):
        reordered = "" if self.ordering is None else ", reordered"
        return f"<linear first-order system of {self.n} unknown(s): A {self.storage}{reordered}>"

    def _install(self, handle):
        handle.call(_core.dynstep_set_system_matrix, *self._matrix.stored(), self._matrix.entries())
        if self._table is not None:
            self._table._install(handle, self.ordering)
        elif self._source is not None:
            handle.bind(_core.dynstep_set_source, self._source, order=self.ordering)
