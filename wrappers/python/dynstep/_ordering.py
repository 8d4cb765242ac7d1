# SPDX-License-Identifier: BSD-3-Clause
"""Matrices of scipy.sparse: in which order of the coordinates, and whether banded or dense.

The matrix of a grid or a mesh is a band, whose width depends on how the points are counted.  One order is chosen
for M, C and K together: as given, or by the algorithm of Cuthill and McKee, reversed, where that pays.
"""

import numpy as np

from ._matrices import BANDED, DENSE, DIAGONAL, Banded, Matrix, as_matrix, is_sparse

# Share of the present cost below which a new order is taken: it also costs a pass over what is recorded,
# and errors count equations in it
_WORTH_IT = 0.75


def _cost(half_width):
    """Work of a step, about in ns per unknown: measured for n = 200 and 1000, symmetric, with half widths 1: 4,
    2: 8, 3: 37, 8: 44, 20: 75, 45: 150, 100: 300, 200: 680.  The first two have kernels of their own."""
    return 4*half_width if half_width <= 2 else 35 + 2.5*half_width


def store(n, **given):
    """({name: Matrix}, order) of what the user gives; `order` is None, or place i of the
    library is place order[i] of the user."""
    sparse = {name: _entries(name, a) for name, a in given.items() if is_sparse(a)}
    plain = {name: as_matrix(name, a, n) for name, a in given.items() if name not in sparse}
    if not sparse:
        return plain, None
    bands = {name: _entries_of_band(m) for name, m in plain.items() if m.kind == BANDED}
    has_dense = any(m.kind == DENSE for m in plain.values())
    order = None if has_dense else _better_order(n, {**sparse, **bands})
    if order is not None:
        place = np.argsort(order)
        sparse = {name: (place[i], place[j], x) for name, (i, j, x) in {**sparse, **bands}.items()}
        plain = {name: Matrix(m.kind, n, m.data[order] if m.kind == DIAGONAL else m.data)
                 for name, m in plain.items() if name not in sparse}
    return {**plain, **{name: _stored(n, *entries) for name, entries in sparse.items()}}, order


def store_as_given(name, a, n):
    """`Matrix` of one matrix, in the order given."""
    return _stored(n, *_entries(name, a)) if is_sparse(a) else as_matrix(name, a, n)


def _entries(name, a):
    """(i, j, values) of a sparse matrix, without zeros and duplicates."""
    if a.dtype.kind not in "biuf":
        raise TypeError(f"{name} has the type {a.dtype}, expected real numbers")
    a = a.tocsr().astype(np.float64)         # also adds up duplicates
    a.sum_duplicates()
    a = a.tocoo()
    bad = np.flatnonzero(~np.isfinite(a.data))
    if bad.size:
        raise ValueError(f"{name}[{a.row[bad[0]]}, {a.col[bad[0]]}] = {a.data[bad[0]]} is not finite")
    there = a.data != 0.0
    return a.row[there].astype(np.intp), a.col[there].astype(np.intp), a.data[there]


def _entries_of_band(m):
    row, j = np.nonzero(m.data)
    return row - m.ku + j, j, m.data[row, j]


def _stored(n, i, j, values):
    """Diagonal, banded or dense.  A band that takes no less room than the dense matrix is hardly faster (measured
    for n = 50, 200, 1000: dense 0.9 to 1.3 of it) and takes as long to factorize."""
    band = Banded.from_entries(n, i, j, values)
    if band.kl == 0 and band.ku == 0:
        return Matrix(DIAGONAL, n, band.ab[0].copy())
    if band.kl + band.ku + 1 < n:
        return Matrix(BANDED, n, band.ab, band.kl, band.ku)
    a = np.zeros((n, n), order="F")
    a[i, j] = values
    return Matrix(DENSE, n, a)


def _half_width(i, j):
    return int(np.max(np.abs(i - j), initial=0))


def _better_order(n, entries):
    """The reverse Cuthill-McKee order of the union of some matrices, or None where it is not worth it."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    i = np.concatenate([i for i, _, _ in entries.values()])
    j = np.concatenate([j for _, j, _ in entries.values()])
    present = _half_width(i, j)
    if present <= 2:
        return None
    both = np.concatenate([i, j]), np.concatenate([j, i])
    pattern = csr_array((np.ones(2*i.size, np.int8), both), shape=(n, n))
    order = reverse_cuthill_mckee(pattern, symmetric_mode=True).astype(np.intp)
    place = np.argsort(order)
    return order if _cost(_half_width(place[i], place[j])) < _WORTH_IT*_cost(present) else None
