# SPDX-License-Identifier: BSD-3-Clause
"""Jacobians by differences of a Python function that takes many columns at once."""

import numpy as np

_STEP = np.sqrt(np.finfo(float).eps)


def difference_jacobian(columns, t, y, band=None):
    """df/dy at (t, y), as src/system/dynstep_differences.f90 has it.

    columns   columns(t, Y) = F, the function at each column of Y, an array [n, k]
    band      (kl, ku), or None for a full matrix
    Returns an array [n, n], or [kl + ku + 1, n] where df_i/dy_j has the place [i - j + ku, j].
    """
    n = y.size
    groups = n if band is None else min(n, sum(band) + 1)
    group = np.arange(n) % groups
    f0 = columns(t, y[:, np.newaxis])[:, 0]
    moves = _STEP*_sizes(y, f0)
    f1, by = _moved(columns, t, y, moves, group, groups)
    outside = ~np.isfinite(f1).all(axis=0)
    if outside.any():                                            # the other way
        moves = np.where(outside[group], -moves, moves)
        f1, by = _moved(columns, t, y, moves, group, groups)
    full = (f1[:, group] - f0[:, np.newaxis])/by
    if band is None:
        return full
    kl, ku = band
    packed = np.zeros((kl + ku + 1, n))
    for row in range(kl + ku + 1):
        j = np.arange(max(0, ku - row), min(n, n + ku - row))
        packed[row, j] = full[j + row - ku, j]
    return packed


def _moved(columns, t, y, moves, group, groups):
    """The function where the components of each group are moved [n, groups], and by how much they are [n]."""
    moved = y + moves
    points = np.repeat(y[:, np.newaxis], groups, axis=1)
    points[np.arange(y.size), group] = moved
    return columns(t, points), moved - y


def _sizes(y, f):
    """Of each component itself, raised where it is much smaller than what it changes by while the largest one changes."""
    sizes = np.abs(y)
    largest, fastest = sizes.max(), np.abs(f).max()
    if 0.0 < largest and 0.0 < fastest < np.inf:
        change = np.clip(largest/fastest, 1e-60, 1e60)*np.abs(f)
        sizes = np.where(sizes < 1e-4*change, np.maximum(sizes, 0.01*change), sizes)
    sizes = np.where(sizes > 0.0, sizes, 0.01*sizes.max())
    return np.where(sizes > 0.0, sizes, 1.0)
