# SPDX-License-Identifier: BSD-3-Clause
"""M q'' + C q' + K q = p(t) with constant matrices."""

import numpy as np

from . import _core
from ._arguments import vector
from ._functions import functions
from ._loads import LoadTable
from ._matrices import order_of
from ._ordering import store

_WHICH = {"M": 1, "C": 2, "K": 3}               # enum dynstep_matrix


class LinearSystem:
    """M q'' + C q' + K q = p(t), with constant matrices (Austin 1991, eq. (27)).

    Parameters
    ----------
    M : matrix or None
        Mass, not zero; None is the identity.
    C, K : matrix, optional
        Damping and stiffness; None is zero.
    load : callable, compiled function or LoadTable, optional
        p(t).  A Python function ``load(t, *args)`` returns n numbers; a compiled one has the signature
        ``dynstep.signature("load")``; for samples see :class:`LoadTable` and :func:`ground_motion`.
    user_data : optional
        What a compiled load gets as its context; see :func:`compiled`.
    args : tuple
        Further arguments of a Python load.
    feedback : tuple (b, k, c), optional
        Keyword only, as the two above.  A force -b (k.q + c.q') on the right-hand side: along b, by gains k and c of
        any coordinates; vectors of n numbers, None for k or c that is zero.  It does not fill the band of C and K.  Takes
        one of the methods :class:`Pade` (the default), :class:`BI`.

    Attributes
    ----------
    n : int
        Number of coordinates.
    ordering : ndarray of int or None
        Where a new order pays for sparse matrices: coordinate ``ordering[i]`` has place i inside the library.
        All you pass and get is in your own order; only equation numbers in error messages are not.

    Notes
    -----
    A matrix is a number (times the identity), a vector (a diagonal matrix), a 2-D array (dense),
    ``dynstep.banded(...)``, or any matrix of scipy.sparse; that one is stored as a band, in the order given or,
    where it pays, in the reverse Cuthill-McKee order.  Entries are copied.  Symmetric matrices are found by comparison of all
    entries, exactly: one that is symmetric but for rounding is treated as unsymmetric, which is slower.

    The library steps such a system without Python, and factorizes once for each step length.

    Raises
    ------
    ValueError, TypeError
        Shapes that do not fit, entries that are not finite or not real.

    Examples
    --------
    A mass of 2 on a spring of stiffness 8:

    >>> system = dynstep.LinearSystem(2.0, K=8.0)
    >>> dynstep.solve(system, (0, 10), 1.0, 0.0, h=0.1).q[0, -1]      # cos(2*10)
    """

    is_constrained = False
    first_order = False

    def __init__(self, M=None, C=None, K=None, load=None, *, user_data=None, args=(), feedback=None):
        self._table = load if isinstance(load, LoadTable) else None
        self.feedback = None if feedback is None else _feedback(feedback)
        self.n = common_order({"M": M, "C": C, "K": K}, load=self._table, feedback=self.feedback)
        self._matrices, self.ordering = store(self.n, M=M, C=C, K=K)
        self.load = load
        self._load = functions({"load": None if self._table else load}, user_data, args)["load"]
        self.has_energy = self._matrices["M"].symmetric and self._matrices["K"].symmetric

    @property
    def storage(self):
        """{name: how the matrix is stored}."""
        return {name: repr(self._matrices[name]) for name in _WHICH}

    def energy(self, t, q, v):
        """Kinetic and strain energy, (v'Mv + q'Kq)/2.

        Parameters
        ----------
        t : float or array_like
            Not read; other systems' energy may depend on it.
        q, v : array_like, shape (n,) or (n, nt)

        Returns
        -------
        float or ndarray, shape (nt,)

        Raises
        ------
        ValueError
            M or K is not symmetric.
        """
        if not self.has_energy:
            raise ValueError("the system has no energy: M or K is not symmetric")
        q, v = np.atleast_1d(np.asarray(q, float)), np.atleast_1d(np.asarray(v, float))
        for name, x in (("q", q), ("v", v)):
            if x.shape[:1] != (self.n,) or x.ndim > 2:
                raise ValueError(f"{name} has the shape {x.shape}, expected ({self.n},) or ({self.n}, nt)")
        if self.ordering is not None:
            q, v = q[self.ordering], v[self.ordering]
        return 0.5*(np.sum(v*self._matrices["M"].dot(v), axis=0) + np.sum(q*self._matrices["K"].dot(q), axis=0))

    def __repr__(self):
        storage = ", ".join(f"{name} {how}" for name, how in self.storage.items())
        reordered = "" if self.ordering is None else ", reordered"
        fed_back = "" if self.feedback is None else ", feedback"
        return f"<linear system of {self.n} coordinate(s): {storage}{fed_back}{reordered}>"

    def _install_constraints(self, handle, t, q, v):
        """There are none."""

    def _install(self, handle):
        for name, which in _WHICH.items():
            matrix = self._matrices[name]
            handle.call(_core.dynstep_set_matrix, which, *matrix.stored(), int(matrix.symmetric), matrix.entries())
        if self.feedback is not None:
            order = slice(None) if self.ordering is None else self.ordering
            handle.call(_core.dynstep_set_coupling, *(x[order] for x in self.feedback))
        if self._table is not None:
            self._table._install(handle, self.ordering)
        elif self._load is not None:
            handle.bind(_core.dynstep_set_load, self._load, order=self.ordering)

    _energies = energy


class _Feedback(tuple):
    """b, k, c."""

    @property
    def n(self):
        return self[0].size


def _feedback(given):
    if not isinstance(given, (tuple, list)) or len(given) != 3:
        raise ValueError(f"feedback must be a tuple (b, k, c) of vectors, not {given!r}")
    b = vector("b of feedback", given[0]).copy()
    return _Feedback([b, *(np.zeros(b.size) if x is None else vector(f"{name} of feedback", x, b.size).copy()
                           for name, x in zip("kc", given[1:]))])


def common_order(matrices, **others):
    """The n that matrices and what else has an n agree on; 1 where all are numbers."""
    orders = {name: n for name, a in matrices.items() if (n := order_of(name, a)) is not None}
    orders.update({name: x.n for name, x in others.items() if x is not None})
    if len(set(orders.values())) > 1:
        raise ValueError("the sizes do not fit: " + ", ".join(f"{name} has {n} rows" for name, n in orders.items()))
    return next(iter(orders.values()), 1)
