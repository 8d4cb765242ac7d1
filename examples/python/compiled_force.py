# SPDX-License-Identifier: BSD-3-Clause
"""One force, compiled by numba or by a C compiler, handed over in every way that there is.

Duffing's oscillator q'' = -q - k q^3; k comes through the context pointer.  All ways give the same bits, and
none holds the interpreter's lock.
"""
import ctypes
import importlib.util
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np

import dynstep

C_SOURCE = """
int force(int n, double t, const double *q, const double *v, double *f, void *ctx)
{
    const double k = *(const double *)ctx;
    for (int i = 0; i < n; i++)
        f[i] = -q[i] - k*((q[i]*q[i])*q[i]);
    return 0;                                /* > 0: outside the domain, < 0: give up */
}
"""
DATA = np.array([0.5])
ways = {}

if importlib.util.find_spec("numba"):
    import numba

    @numba.cfunc(dynstep.signature("force"))
    def by_numba(n, t, q, v, f, ctx):
        k = numba.carray(ctx, 1, numba.float64)[0]
        for i in range(n):
            f[i] = -q[i] - k*((q[i]*q[i])*q[i])
        return 0

    ways["numba"] = by_numba, DATA

if compiler := shutil.which("cc") or shutil.which("gcc"):
    folder = tempfile.TemporaryDirectory()
    source, library = pathlib.Path(folder.name, "force.c"), pathlib.Path(folder.name, "force.so")
    source.write_text(C_SOURCE)
    subprocess.run([compiler, "-O2", "-ffp-contract=off", "-shared", "-fPIC", source, "-o", library], check=True)
    by_ctypes = dynstep.signature("force", "ctypes")(("force", ctypes.CDLL(str(library))))
    ways["ctypes"] = by_ctypes, DATA
    ways["an address"] = dynstep.compiled(ctypes.cast(by_ctypes, ctypes.c_void_p).value, DATA), None
    if importlib.util.find_spec("cffi"):
        import cffi
        ffi = cffi.FFI()
        ffi.cdef(dynstep.signature("force", "c") + ";")
        by_cffi = ffi.addressof(ffi.dlopen(str(library)), "force")
        ways["cffi"] = by_cffi, ffi.new("double *", DATA[0])
    if importlib.util.find_spec("scipy"):
        from scipy import LowLevelCallable
        data = ctypes.cast(DATA.ctypes.data, ctypes.c_void_p)
        ways["LowLevelCallable"] = LowLevelCallable(by_ctypes, data), None

results = {}
for name, (force, user_data) in ways.items():
    system = dynstep.MechanicalSystem(2, force, velocity_free=True, user_data=user_data)
    results[name] = dynstep.solve(system, (0, 20), [1.0, -2.0], [0.0, 0.0], h=0.1).q
    print(f"{name:18} q(20) = {results[name][:, -1]}")
assert all(np.array_equal(q, next(iter(results.values()))) for q in results.values())
