# SPDX-License-Identifier: BSD-3-Clause
"""Matrices as the library stores them: identity, diagonal, banded, dense.

Symmetry and bandwidth are facts about the entries: they are looked up exactly, never guessed.
"""

import numpy as np

from ._arguments import array, integer

ZERO, IDENTITY, DIAGONAL, BANDED, DENSE = -1, 0, 1, 2, 3       # enum dynstep_kind
NOTHING = np.empty(0)


class Banded:
    """A square band matrix; made by :func:`banded` or :meth:`from_dense`.

    Attributes
    ----------
    ab : ndarray, shape (kl + ku + 1, n)
        ``A[i, j]`` is ``ab[ku + i - j, j]``.
    kl, ku : int
        Diagonals below and above the main one.
    n : int
        Number of rows.
    """

    def __init__(self, ab, kl, ku):
        self.ab = ab
        self.kl = kl
        self.ku = ku
        self.n = ab.shape[1]

    @property
    def shape(self):
        """(n, n)"""
        return self.n, self.n

    @classmethod
    def from_dense(cls, a):
        """The band of a square 2-D array, as wide as its entries ask for."""
        a = array("a", a, 2)
        if a.shape[0] != a.shape[1]:
            raise ValueError(f"a has the shape {a.shape}, expected a square matrix")
        i, j = np.nonzero(a)
        return cls.from_entries(a.shape[0], i, j, a[i, j])

    @classmethod
    def from_entries(cls, n, i, j, values):
        """The band that holds the entries A[i, j], of which none comes twice."""
        kl = int(np.max(i - j, initial=0))
        ku = int(np.max(j - i, initial=0))
        ab = np.zeros((kl + ku + 1, n), order="F")
        ab[ku + i - j, j] = values
        return cls(ab, kl, ku)

    def diagonal(self, offset=0):
        """Entries A[i, i + offset], a view."""
        row = self.ab[self.ku - offset]
        return row[offset:] if offset >= 0 else row[:self.n + offset]

    def toarray(self):
        """The dense matrix."""
        a = np.zeros(self.shape)
        for offset in range(-self.kl, self.ku + 1):
            np.fill_diagonal(a[max(0, -offset):, max(0, offset):], self.diagonal(offset))
        return a

    def __repr__(self):
        return f"<banded {self.n} by {self.n} matrix, kl={self.kl}, ku={self.ku}>"


def banded(ab, kl, ku):
    """A band matrix in LAPACK's storage (that of ``scipy.linalg.solve_banded``).

    Parameters
    ----------
    ab : array_like, shape (kl + ku + 1, n)
        ``A[i, j]`` is ``ab[ku + i - j, j]``; places outside the matrix are not read.  A symmetric matrix is given
        whole, both triangles.
    kl, ku : int
        Diagonals below and above the main one, 0 <= kl, ku < n.

    See Also
    --------
    Banded.from_dense : the band of a dense array

    Examples
    --------
    A chain of springs, fixed at both ends:

    >>> K = dynstep.banded([[-1.0]*n, [2.0]*n, [-1.0]*n], 1, 1)
    """
    ab = np.asarray(ab)
    if ab.ndim != 2:
        raise ValueError(f"ab has the shape {ab.shape}, expected (kl + ku + 1, n)")
    n = ab.shape[1]
    kl, ku = integer("kl", kl, 0, max(n - 1, 0)), integer("ku", ku, 0, max(n - 1, 0))
    if ab.shape[0] != kl + ku + 1 or n < 1:
        raise ValueError(f"ab has the shape {ab.shape}, expected (kl + ku + 1, n) = ({kl + ku + 1}, n)")
    if ab.dtype.kind not in "biuf":
        raise TypeError(f"ab has the type {ab.dtype}, expected real numbers")
    ab = np.array(ab, np.float64, order="F")
    for k in range(1, max(kl, ku) + 1):           # not entries of the matrix: they may be NaN
        if k <= ku:
            ab[ku - k, :k] = 0.0
        if k <= kl:
            ab[ku + k, n - k:] = 0.0
    array("ab", ab)
    return Banded(ab, kl, ku)


class Matrix:
    """A matrix in one of the library's kinds."""

    def __init__(self, kind, n, data=NOTHING, kl=0, ku=0):
        self.kind = kind
        self.n = n
        self.data = data              # [n], [kl + ku + 1, n] or [n, n], by columns
        self.kl = kl
        self.ku = ku
        self.symmetric = _is_symmetric(self)

    def stored(self):
        """(kind, kl, ku) of the library."""
        return self.kind, self.kl, self.ku

    def entries(self):
        """By columns, a vector."""
        return self.data.T.reshape(-1)

    def __repr__(self):
        symmetric = "symmetric" if self.symmetric else "not symmetric"
        return {ZERO: "zero", IDENTITY: "identity", DIAGONAL: "diagonal",
                BANDED: f"banded (kl={self.kl}, ku={self.ku}), {symmetric}", DENSE: f"dense, {symmetric}"}[self.kind]

    def dot(self, x):
        """A x for x [n] or [n, columns]."""
        if self.kind == ZERO:
            return np.zeros_like(x)
        if self.kind == IDENTITY:
            return x
        if self.kind == DIAGONAL:
            return (x.T*self.data).T
        if self.kind == DENSE:
            return self.data @ x
        y = np.zeros(x.shape)
        for offset in range(-self.kl, self.ku + 1):
            rows = slice(max(0, -offset), self.n - max(0, offset))
            columns = slice(max(0, offset), self.n + min(0, offset))
            y[rows] += (x[columns].T*self.data[self.ku - offset, columns]).T
        return y


def _is_symmetric(m):
    if m.kind == DENSE:
        # in blocks: the transposed of a large matrix is slow to read, and ends at the first difference
        return all(np.array_equal(m.data[i:i + 256], m.data[:, i:i + 256].T) for i in range(0, m.n, 256))
    if m.kind == BANDED:
        return m.kl == m.ku and all(np.array_equal(m.data[m.ku - k, k:], m.data[m.ku + k, :m.n - k])
                                    for k in range(1, m.ku + 1))
    return True


def is_sparse(a):
    """True for a matrix or array of scipy.sparse, without an import of scipy."""
    return type(a).__module__.startswith("scipy.sparse") and hasattr(a, "tocoo")


def order_of(name, a):
    """Number of rows that a matrix asks for, or None for a number or nothing."""
    if a is None:
        return None
    shape = np.shape(a) if not (isinstance(a, Banded) or is_sparse(a)) else a.shape
    if len(shape) == 0:
        return None
    if len(shape) > 2 or len(shape) == 2 and shape[0] != shape[1]:
        raise ValueError(f"{name} has the shape {shape}, expected (n, n) or, for a diagonal matrix, (n,)")
    if shape[0] < 1:
        raise ValueError(f"{name} has no rows")
    return shape[0]


def as_matrix(name, a, n):
    """`Matrix` of order n of what a user may give, but for sparse matrices: see `_ordering`."""
    if a is None:
        return Matrix(IDENTITY if name == "M" else ZERO, n)
    if isinstance(a, Banded):
        return Matrix(BANDED, n, a.ab, a.kl, a.ku)
    a = array(name, a)
    if a.ndim == 0:
        return Matrix(DIAGONAL, n, np.full(n, float(a)))
    if a.ndim == 1:
        return Matrix(DIAGONAL, n, a.copy())
    return Matrix(DENSE, n, a.copy(order="F"))


def declared_kind(name, kind, n):
    """(kind, kl, ku) of the library, of what a user declares: "dense", "diagonal" or (kl, ku)."""
    if isinstance(kind, str) and kind in ("dense", "diagonal"):
        return (DENSE if kind == "dense" else DIAGONAL), 0, 0
    if isinstance(kind, tuple) and len(kind) == 2:
        return BANDED, integer(f"kl of {name}", kind[0], 0, n - 1), integer(f"ku of {name}", kind[1], 0, n - 1)
    raise ValueError(f"{name} must be 'dense', 'diagonal' or a tuple (kl, ku), not {kind!r}")


def rows_of(n, kind, kl, ku):
    """Rows of the arrays that a Python function returns; 0: a vector."""
    return {DIAGONAL: 0, DENSE: n}.get(kind, kl + ku + 1)
