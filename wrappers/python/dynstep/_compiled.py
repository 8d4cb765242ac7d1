# SPDX-License-Identifier: BSD-3-Clause
"""Compiled user functions: their C signatures, and the addresses behind the objects of
numba, ctypes, cffi, PyCapsule and scipy.LowLevelCallable."""

import ctypes
import sys

import numpy as np

from ._arguments import choice

_POINT = "int n, double t, const double *q, const double *v"
_REACTION = ("int n, int m, int p, double t, const double *q, const double *v, const double *lambda, "
             "const double *psi")

#: parameters of the user functions of dynstep.h; all return int
PARAMETERS = {
    "force": _POINT + ", double *f, void *ctx",
    "mass": _POINT + ", double *m, void *ctx",
    "tangent": _POINT + ", const double *a, double *k, double *c, void *ctx",
    "energy": _POINT + ", double *energy, void *ctx",
    "load": "int n, double t, double *p, void *ctx",
    "observer": _POINT + ", const double *a, void *ctx",
    "constraint": "int n, int m, double t, const double *q, double *g, void *ctx",
    "constraint_jacobian": "int n, int m, double t, const double *q, double *gq, double *gt, void *ctx",
    "constraint_curvature": _POINT.replace("int n", "int n, int m") + ", double *c, void *ctx",
    "velocity_constraint": _POINT.replace("int n", "int n, int p") + ", double *k, void *ctx",
    "velocity_jacobian": _POINT.replace("int n", "int n, int p") + ", double *kv, void *ctx",
    "velocity_curvature": _POINT.replace("int n", "int n, int p") + ", double *c, void *ctx",
    "reaction": _REACTION + ", double *r, void *ctx",
    "reaction_jacobian": _REACTION + ", double *rl, double *rp, void *ctx",
    "reaction_tangent": _REACTION + ", double *k, double *c, void *ctx",
    "rhs": "int n, double t, const double *y, double *f, void *ctx",
    "jacobian": "int n, double t, const double *y, double *jac, void *ctx",
    "source": "int n, double t, double *b, void *ctx",
    "event": _POINT.replace("int n", "int n, int count") + ", double *s, void *ctx",
    "action": "int n, int which, double t, double *q, double *v, void *ctx",
    "switches": _POINT.replace("int n", "int n, int count") + ", double *s, void *ctx",
}

_FunctionPointer = ctypes.CFUNCTYPE(None).__bases__[0]
_PYTHON_API = 0x4             # FUNCFLAG_PYTHONAPI of ctypes: such a function wants the GIL


class Compiled:
    """A compiled function with its data; made by :func:`compiled`."""

    __slots__ = ("address", "context", "keep")

    def __init__(self, address, context=0, keep=None):
        self.address = address
        self.context = context
        self.keep = keep              # what must stay alive behind the two addresses

    def __repr__(self):
        return f"<compiled function at {self.address:#x}>"


def signature(function="force", form="numba"):
    """Signature of a compiled user function.

    Parameters
    ----------
    function : {"force", "mass", "tangent", "energy", "load", "observer", "constraint", ...}
        Or another function of :class:`MechanicalSystem`, :class:`OdeSystem` or :class:`LinearOde`, by the name of its
        argument.  Arrays are those of
        `dynstep.h`: vectors have n entries, matrices are stored by columns (LAPACK band storage where they are
        declared banded), zero on entry.  Jacobians of constraints are stored by rows: G[i, j] is ``gq[j + i*n]``, or
        the values in the order of the pattern where one is declared; dr/dlambda[i, j] is ``rl[i + j*n]``.  All return
        0, or > 0 for "outside the domain, a smaller step may help", or < 0 for "give up"; an
        observer returns 1 to stop, and gets y in q, y' in a and NULL in v where the system is of first order.  So do events,
        actions and switches: y in q, NULL in v.  An event writes one number, s[0] (count is 1); an action returns 1 where it
        has written q or v or changed parameters, else 0.
    form : {"numba", "ctypes", "c"}
        For ``numba.cfunc(...)``, a ctypes function type, or the declaration as text.

    Examples
    --------
    >>> @numba.cfunc(dynstep.signature("force"))
    ... def force(n, t, q, v, f, ctx):
    ...     for i in range(n):
    ...         f[i] = -q[i]
    ...     return 0
    """
    parameters = choice("function", function, PARAMETERS).split(", ")
    kinds = [p.rpartition(" ")[0] + "*"*p.count("*") for p in parameters]
    if choice("form", form, {"numba": 1, "ctypes": 2, "c": 3}) == 3:
        return f"int {function}({', '.join(parameters)})"
    if form == "ctypes":
        # addresses, not ctypes.POINTER: a POINTER object for each argument costs a microsecond
        types = {"int": ctypes.c_int, "double": ctypes.c_double}
        return ctypes.CFUNCTYPE(ctypes.c_int, *(types.get(k, ctypes.c_void_p) for k in kinds))
    from numba import types as numba
    doubles = numba.CPointer(numba.float64)
    types = {"int": numba.int32, "double": numba.float64, "void*": numba.voidptr}
    return numba.int32(*(types.get(k, doubles) for k in kinds))


def compiled(function, user_data=None):
    """A compiled function with data of its own.

    Parameters
    ----------
    function : numba cfunc, ctypes or cffi function pointer, PyCapsule, scipy.LowLevelCallable, or int
        Its C signature is that of :func:`signature`; an int is an address.
    user_data : numpy array, ctypes object, cffi pointer, PyCapsule or int, optional
        What the function gets as `ctx`: the address of the data, or the int itself.

    Notes
    -----
    Function and data are kept alive.  Where all functions of a system share their data,
    ``MechanicalSystem(..., user_data=...)`` does the same.
    """
    if isinstance(function, (int, np.integer)) and not isinstance(function, bool):
        if function <= 0:
            raise ValueError(f"function = {function} is no address")
        return Compiled(int(function), _address_of_data(user_data), user_data)
    found = recognise("function", function, None, user_data)
    if found is None:
        raise TypeError(f"function must be a compiled function, not {function!r}")
    return found


def recognise(name, fun, kind=None, user_data=None):
    """`Compiled` of an object that is a compiled function, else None.

    Where the object knows its own signature, it is compared with that of `kind`.
    """
    if isinstance(fun, Compiled):
        return fun if user_data is None or fun.context else Compiled(
            fun.address, _address_of_data(user_data), (fun.keep, user_data))
    keep = fun, user_data
    if isinstance(fun, tuple) and type(fun).__name__ == "LowLevelCallable":
        user_data = fun.user_data if user_data is None else user_data
        fun = fun.function
    if hasattr(fun, "address") and hasattr(fun, "native_name"):            # numba.cfunc
        _check_numba(name, fun, kind)
        return Compiled(fun.address, _address_of_data(user_data), keep)
    if isinstance(fun, _FunctionPointer):
        _check_ctypes(name, fun, kind)
        return Compiled(_value(fun), _address_of_data(user_data), keep)
    if _is_cffi(fun):
        _check_cffi(name, fun, kind)
        return Compiled(_cffi_address(fun), _address_of_data(user_data), keep)
    if type(fun).__name__ == "PyCapsule":
        context = _capsule("Context", fun) if user_data is None else _address_of_data(user_data)
        return Compiled(_capsule("Pointer", fun), context or 0, keep)
    if type(fun).__module__ == "_cffi_backend":
        raise TypeError(f"{name} is a function of a cffi library; pass its address, ffi.addressof(lib, 'name')")
    return None


def _address_of_data(data):
    if data is None:
        return 0
    if isinstance(data, np.ndarray):
        if not data.flags.forc:
            raise ValueError("user_data must be a contiguous array, not a slice with gaps")
        return data.ctypes.data
    if isinstance(data, (int, np.integer)):
        return int(data)
    if isinstance(data, (ctypes.c_void_p, ctypes._Pointer)):
        return _value(data)
    if isinstance(data, (ctypes.Structure, ctypes.Union, ctypes.Array, ctypes._SimpleCData)):
        return ctypes.addressof(data)
    if type(data).__name__ == "CArgObject":                                # ctypes.byref(...)
        return ctypes.addressof(data._obj)
    if _is_cffi(data):
        return _cffi_address(data)
    if type(data).__name__ == "PyCapsule":
        return _capsule("Pointer", data)
    raise TypeError("user_data must be a numpy array, a ctypes object, a cffi pointer, a PyCapsule or an int, "
                    f"not {type(data).__name__}")


def _value(pointer):
    return ctypes.cast(pointer, ctypes.c_void_p).value or 0


def _is_cffi(x):
    backend = sys.modules.get("_cffi_backend")
    return backend is not None and isinstance(x, backend.FFI.CData)


def _cffi_address(x):
    return int(sys.modules["_cffi_backend"].FFI().cast("intptr_t", x))


def _capsule(what, capsule):
    name = ctypes.pythonapi.PyCapsule_GetName
    name.restype, name.argtypes = ctypes.c_char_p, (ctypes.py_object,)
    if what == "Context":
        get = ctypes.pythonapi.PyCapsule_GetContext
        get.restype, get.argtypes = ctypes.c_void_p, (ctypes.py_object,)
        return get(capsule)
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)
    return get(capsule, name(capsule))


def _refuse(name, kind, found):
    raise TypeError(f"{name} is compiled as {found}, expected {signature(kind, 'c')}; see dynstep.signature({kind!r})")


def _check_numba(name, fun, kind):
    own = getattr(fun, "_sig", None)
    if kind is None or own is None:
        return
    from numba import types
    expected = signature(kind)

    def fits(given, wanted):
        pointers = types.CPointer, types.RawPointer
        return given == wanted or isinstance(given, pointers) and isinstance(wanted, pointers)

    if len(own.args) != len(expected.args) or not fits(own.return_type, expected.return_type) \
            or not all(map(fits, own.args, expected.args)):
        _refuse(name, kind, own)


def _check_ctypes(name, fun, kind):
    if fun._flags_ & _PYTHON_API:
        raise TypeError(f"{name} is a function of ctypes.PyDLL or PYFUNCTYPE, which runs with the GIL held; "
                        "use CDLL or CFUNCTYPE")
    if kind is None or fun.argtypes is None:
        return
    expected = signature(kind, "ctypes")

    def code(ctype):              # ctypes' own letter: i, d; P for all pointers
        letter = getattr(ctype, "_type_", None)
        return letter if isinstance(letter, str) and letter in "id" else "P"

    if [code(c) for c in fun.argtypes] != [code(c) for c in expected._argtypes_] or code(fun.restype) != "i":
        _refuse(name, kind, f"{fun.restype} from {fun.argtypes}")


def _check_cffi(name, fun, kind):
    own = sys.modules["_cffi_backend"].FFI().typeof(fun)
    if own.kind == "function":
        pass
    elif own.kind == "pointer" and own.item.kind in ("void", "primitive"):
        return                                             # a bare address
    else:
        raise TypeError(f"{name} is a cffi object of type {own.cname}, not a function pointer")
    if kind is None:
        return

    def code(ctype):
        return {"int": "i", "int32_t": "i", "double": "d"}.get(ctype.cname, "P" if ctype.kind == "pointer" else "?")

    expected = ["P" if "*" in p else p[0] for p in PARAMETERS[kind].split(", ")]
    if [code(c) for c in own.args] != expected or code(own.result) != "i":
        _refuse(name, kind, own.cname)
