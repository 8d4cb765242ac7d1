# SPDX-License-Identifier: BSD-3-Clause
"""Checks of what a user passes in: each error names the argument."""

import operator

import numpy as np

LARGEST_INTEGER = 2**31 - 1          # of a C int


def array(name, value, ndim=None):
    """`value` as an array of finite doubles, a new one or the user's own."""
    if value is None:
        raise TypeError(f"{name} is None, expected an array of numbers")
    try:
        a = np.asarray(value)
    except ValueError as error:                    # a ragged list
        raise ValueError(f"{name} is not a rectangular array: {error}") from None
    if a.dtype.kind not in "biuf":
        raise TypeError(f"{name} has the type {a.dtype}, expected real numbers")
    if ndim is not None and a.ndim not in ((ndim,) if isinstance(ndim, int) else ndim):
        raise ValueError(f"{name} has the shape {a.shape}, expected {ndim} dimension(s)")
    a = a.astype(np.float64, copy=False)
    if not np.isfinite(a).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(a))[0])
        place = f"[{', '.join(map(str, where))}]" if where else ""
        raise ValueError(f"{name}{place} = {a[where]} is not finite")
    return a


def vector(name, value, n=None):
    """`value` as a contiguous vector of n finite doubles; a number counts as a vector of one."""
    a = array(name, value)
    if a.ndim == 0 and n in (None, 1):
        a = a.reshape(1)
    if a.ndim != 1 or n is not None and a.size != n:
        raise ValueError(f"{name} has the shape {a.shape}, expected ({'n' if n is None else n},)")
    return np.ascontiguousarray(a)


def number(name, value, lowest=-np.inf, highest=np.inf):
    """`value` as a finite float in a closed range."""
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{name} must be a number, not {value!r}")
    try:
        x = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number, not {value!r}") from None
    if not np.isfinite(x):
        raise ValueError(f"{name} = {x} must be finite")
    if not lowest <= x <= highest:
        raise ValueError(f"{name} = {x:g} must be {_range(lowest, highest)}")
    return x


def integer(name, value, lowest, highest=LARGEST_INTEGER):
    """`value` as an int in a closed range; floats are refused."""
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be an integer, not {value!r}")
    try:
        i = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be an integer, not {value!r}") from None
    if not lowest <= i <= highest:
        raise ValueError(f"{name} = {i} must be {_range(lowest, highest)}")
    return i


def flag(name, value):
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be True or False, not {value!r}")
    return bool(value)


def choice(name, value, choices):
    """Value of a dictionary for a key that the user gives."""
    if not isinstance(value, str) or value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}, not {value!r}")
    return choices[value]


def _range(lowest, highest):
    if highest in (np.inf, LARGEST_INTEGER):
        return f"{lowest:g} or more"
    return f"{lowest} to {highest}"
