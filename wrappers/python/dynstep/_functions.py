# SPDX-License-Identifier: BSD-3-Clause
"""User functions of a system or a run, as the library takes them: an address and a context.

A compiled function is passed as it is.  A Python function gets a thunk of `thunk.c`: it never
lets an exception cross a Fortran frame, but keeps it until the library has returned.
"""

import numpy as np

from . import _core
from ._compiled import PARAMETERS, recognise

_THUNKS = {kind: _core.python_function(i) for i, kind in enumerate(PARAMETERS)}
_REORDERED = {"load": _core.python_function(100), "source": _core.python_function(100),
              "observer": _core.python_function(101), "event": _core.python_function(102),
              "action": _core.python_function(103)}
_VECTORS = {"load": 1, "source": 1, "observer": 3, "event": 2, "action": 2}    # vectors of workspace that reordering takes
_ANSWERS = "observer", "action"                              # whose results are more than a failure
_MOST_ARGS = 32


class OutOfDomain(ArithmeticError):
    """Raised by a user's Python function: the model is not defined here, a smaller step may help.

    Newton's iteration answers with smaller corrections; where that does not help, the run ends
    as an unsuccessful :class:`Solution`.  (A compiled function returns 1 instead.)
    """


class UserFunction:
    """A function of the user's, compiled or Python."""

    def __init__(self, name, fun, kind, user_data=None, args=()):
        self.name = name
        self.kind = kind
        self.fun = fun
        self.args = args
        self.compiled = recognise(name, fun, kind, user_data)
        if self.compiled is None and not callable(fun):
            raise TypeError(f"{name} must be a function or a compiled function, not {fun!r}")

    @property
    def is_python(self):
        return self.compiled is None

    def bind(self, failure, rows=0, order=None, pattern=None, read=None):
        """(address, context, what must be kept) for one handle.

        failure   list of one place, for an exception
        rows      of the matrices that it returns: 0 diagonal, else a 2-D array [rows, n]
        order     None, or place i of the library is place order[i] of the user
        pattern   None, or (first, column) of the Jacobian that it returns, arrays of int32
        read      None, or read(sparse, rows, columns) makes an array of a sparse Jacobian
        """
        if self.compiled is None:
            retry = () if self.kind in _ANSWERS else OutOfDomain
            context = [self.fun, self.args, self.name.encode(), rows, pattern, read, order, retry, failure]
            return _THUNKS[self.kind], id(context), context
        address, context = self.compiled.address, self.compiled.context
        if order is None:
            return address, context, self.compiled
        work = np.empty(_VECTORS[self.kind]*order.size)
        block = np.concatenate([[address, context, work.ctypes.data], order]).astype(np.intp)
        return _REORDERED[self.kind], block.ctypes.data, (self.compiled, work, block)


def further_arguments(args):
    """Further arguments as a tuple."""
    args = tuple(args) if isinstance(args, (tuple, list)) else (args,)
    if len(args) > _MOST_ARGS:
        raise ValueError(f"args has {len(args)} entries, at most {_MOST_ARGS} can be passed")
    return args


def functions(named, user_data, args):
    """{name: UserFunction or None} of {name: function or None}, which share `user_data` and `args`."""
    args = further_arguments(args)
    found = {name: None if fun is None else UserFunction(name, fun, name, user_data, args)
             for name, fun in named.items()}
    given = [f for f in found.values() if f is not None]
    if args and not any(f.is_python for f in given):
        raise ValueError("args are passed to Python functions, and there is none; compiled functions take user_data")
    if user_data is not None and all(f.is_python for f in given):
        raise ValueError("user_data is passed to compiled functions, and there is none; Python functions take args")
    return found
