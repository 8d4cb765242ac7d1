# SPDX-License-Identifier: BSD-3-Clause
"""Constraints of a mechanical system: which functions go together, how many numbers they give, where their Jacobians
have entries."""

import numpy as np

from . import _core
from ._arguments import LARGEST_INTEGER, array, integer
from ._functions import OutOfDomain

_G, _K = 1, 2                                   # `which` of dynstep_set_pattern

#: what each function goes with
_NEEDS = {
    "constraint_jacobian": ("constraint",), "constraint_curvature": ("constraint",),
    "velocity_jacobian": ("velocity_constraint",), "velocity_curvature": ("velocity_constraint",),
    "reaction": ("constraint", "velocity_constraint"), "reaction_jacobian": ("reaction",),
    "reaction_tangent": ("constraint", "velocity_constraint"),
}
NAMES = ("constraint", "velocity_constraint", *_NEEDS)


class Constraints:
    """The constraints of a system of n coordinates; `f` are its user functions by name."""

    def __init__(self, n, f, constraints, velocity_constraints, constraint_pattern, velocity_pattern, equation_order):
        self._f = f
        for name, others in _NEEDS.items():
            if f[name] is not None and all(f[other] is None for other in others):
                raise ValueError(f"{name} goes with {' or '.join(others)}, which is not given")
        self._patterns = (_pattern("constraint_pattern", constraint_pattern, f["constraint_jacobian"], n),
                          _pattern("velocity_pattern", velocity_pattern, f["velocity_jacobian"], n))
        self._numbers = (_number("constraints", constraints, f["constraint"], self._patterns[0]),
                         _number("velocity_constraints", velocity_constraints, f["velocity_constraint"],
                                 self._patterns[1]))
        self._order = None
        if equation_order is not None:
            self._order = array("equation_order", equation_order, 1)
            if sorted(self._order) != list(range(self._order.size)):
                raise ValueError("equation_order must be a permutation of 0, 1, ..., n + m + p - 1: coordinates, "
                                 "constraints, velocity_constraints")

    def __bool__(self):
        """There are constraints."""
        return self._f["constraint"] is not None or self._f["velocity_constraint"] is not None

    def install(self, handle, n, t, q, v, rows):
        """Give all to the library; where the numbers m and p are not known, the functions are asked at t, q, v.

        rows     of the matrices that reaction_tangent returns
        """
        f = self._f
        points = {"constraint": (t, q), "velocity_constraint": (t, q, v)}
        # no generator: it would spoil a StopIteration of the user's
        m, p = [0 if f[name] is None else number if number is not None else _ask(f[name], points[name])
                for name, number in zip(points, self._numbers)]
        if m:
            handle.bind(_core.dynstep_set_constraint, f["constraint"], before=(m,))
            handle.bind(_core.dynstep_set_constraint_jacobian, f["constraint_jacobian"],
                        pattern=self._patterns[0], read=_Reader("constraint_jacobian", self._patterns[0]))
            handle.bind(_core.dynstep_set_constraint_curvature, f["constraint_curvature"])
        if p:
            handle.bind(_core.dynstep_set_velocity_constraint, f["velocity_constraint"], before=(p,))
            handle.bind(_core.dynstep_set_velocity_jacobian, f["velocity_jacobian"],
                        pattern=self._patterns[1], read=_Reader("velocity_jacobian", self._patterns[1]))
            handle.bind(_core.dynstep_set_velocity_curvature, f["velocity_curvature"])
        if m or p:
            handle.bind(_core.dynstep_set_reaction, f["reaction"])
            handle.bind(_core.dynstep_set_reaction_jacobian, f["reaction_jacobian"])
            handle.bind(_core.dynstep_set_reaction_tangent, f["reaction_tangent"], rows=rows)
        for which, rows, pattern in (_G, m, self._patterns[0]), (_K, p, self._patterns[1]):
            if rows and pattern is not None:
                handle.call(_core.dynstep_set_pattern, which, rows, *pattern)
        if self._order is not None:
            handle.call(_core.dynstep_set_constraint_order, self._order.astype(np.int32))
        handle.m, handle.p = m, p


def _ask(function, point):
    """How many numbers a Python function returns."""
    try:
        result = function.fun(*(np.copy(x) if isinstance(x, np.ndarray) else x for x in point), *function.args)
    except OutOfDomain as error:
        raise ValueError(f"{function.name} is not defined at the start, t = {point[0]:g}: {error}") from error
    try:
        shape = np.shape(result)
    except ValueError as error:                      # a ragged list
        raise ValueError(f"{function.name} did not return an array: {error}") from None
    if result is None or len(shape) > 1:
        returned = "None" if result is None else f"an array of shape {shape}"
        raise (TypeError if result is None else ValueError)(
            f"{function.name} returned {returned}, expected one number for each constraint")
    return int(np.prod(shape, dtype=int))


def _number(name, number, function, pattern):
    """How many constraints there are, None where that is to be asked."""
    if function is None:
        if number not in (None, 0):
            raise ValueError(f"{name} = {number!r}, but there is no {name[:-1]}")
        return 0
    rows = None if pattern is None else pattern[0].size - 1
    if number is None:
        if rows is None and not function.is_python:
            raise ValueError(f"{name} is missing: a compiled {function.name} cannot tell how many numbers it gives")
        return rows
    number = integer(name, number, 0, LARGEST_INTEGER)
    if rows not in (None, number):
        raise ValueError(f"{name} = {number}, but the pattern of the Jacobian has {rows} rows")
    return number


def _pattern(name, pattern, function, n):
    """(first, column) of a Jacobian, arrays of int32 counted from 0."""
    if pattern is None:
        return None
    if function is None:
        raise ValueError(f"{name} goes with {name.replace('pattern', 'jacobian')}, which is not given")
    if hasattr(pattern, "tocsr"):
        columns = pattern.shape[1]
        pattern = pattern.tocsr(copy=True)
        pattern.sum_duplicates()
        first, column = pattern.indptr, pattern.indices
    elif isinstance(pattern, tuple) and len(pattern) == 2:
        first, column = (_integers(f"{part} of {name}", x) for part, x in zip(("indptr", "indices"), pattern))
        columns = n
    else:
        entries = array(name, pattern, 2)
        columns = entries.shape[1]
        column = np.nonzero(entries)[1]
        first = np.concatenate([[0], np.cumsum(np.count_nonzero(entries, axis=1))])
    if columns != n:
        raise ValueError(f"{name} has {columns} columns, expected n = {n}")
    first, column = (np.ascontiguousarray(x, np.int32) for x in (first, column))
    if first.size < 1 or first[0] != 0 or first[-1] != column.size or np.any(np.diff(first) < 0):
        raise ValueError(f"indptr of {name} must rise from 0 to the size of indices, {column.size}")
    if np.any((column < 0) | (column >= n)):
        raise ValueError(f"indices of {name} must lie between 0 and n - 1 = {n - 1}")
    falls = np.flatnonzero(np.diff(column) <= 0) + 1
    if np.setdiff1d(falls, first).size:
        raise ValueError(f"indices of {name} must increase in each row")
    return first, column


def _integers(name, value):
    x = array(name, value, 1)
    if np.any(x != np.round(x)) or np.any(np.abs(x) > LARGEST_INTEGER):
        raise ValueError(f"{name} must be integers")
    return x


class _Reader:
    """Array of a scipy.sparse Jacobian: the values of the pattern, or a dense one without."""

    def __init__(self, name, pattern):
        self._name = name
        self._pattern = pattern

    def __call__(self, sparse, rows, columns):
        if self._pattern is None or sparse.shape != (rows, columns):
            return sparse.toarray()                  # a wrong shape is refused there
        first, column = self._pattern
        sparse = sparse.tocsr()
        if np.array_equal(sparse.indices, column) and np.array_equal(sparse.indptr, first):
            return sparse.data
        if not sparse.has_canonical_format:
            sparse = sparse.copy()
            sparse.sum_duplicates()
        rows = np.arange(rows)
        expected = np.repeat(rows, np.diff(first))*columns + column
        given = np.repeat(rows, np.diff(sparse.indptr))*columns + sparse.indices
        known = np.isin(given, expected)
        outside = np.flatnonzero(~known & (sparse.data != 0))
        if outside.size:
            i, j = divmod(int(given[outside[0]]), columns)
            raise ValueError(f"{self._name} returned an entry [{i}, {j}] that its pattern does not have")
        values = np.zeros(column.size, sparse.dtype)
        values[np.searchsorted(expected, given[known])] = sparse.data[known]
        return values
