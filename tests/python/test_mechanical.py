# SPDX-License-Identifier: BSD-3-Clause
"""General systems: all kinds of functions, structure, tangents."""
import ctypes

import numpy as np
import pytest
from problems import chain, duffing_force, pendulum_energy, pendulum_force, same_bits

import dynstep
from dynstep import LinearSystem, MechanicalSystem, solve

METHODS = ["newmark", "central-difference", "midpoint", "newmark-extrapolation",
           dynstep.MidpointExtrapolation(3, "romberg")]
N = 3
START = np.linspace(0.5, 1.5, N), np.linspace(-0.2, 0.3, N)


def run(force, method="newmark-extrapolation", **options):
    return solve(MechanicalSystem(N, force, **options), (0, 3), *START, method, h=0.1)


@pytest.fixture(scope="module")
def numba_force():
    numba = pytest.importorskip("numba")

    @numba.cfunc(dynstep.signature("force"))
    def force(n, t, q, v, f, ctx):
        for i in range(n):
            f[i] = -q[i]*(1.0 + q[i]*q[i]) - 0.1*v[i] + 0.3*t
        return 0
    return force


@pytest.fixture(scope="module")
def force_with_data():
    numba = pytest.importorskip("numba")

    @numba.cfunc(dynstep.signature("force"))
    def force(n, t, q, v, f, ctx):
        data = numba.carray(ctx, 2, numba.float64)
        for i in range(n):
            f[i] = -q[i]*(data[0] + q[i]*q[i]) - data[1]*v[i] + 0.3*t
        return 0
    return force


def capsule(address, context=0):
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
    made = new(address, None, None)
    if context:
        put = ctypes.pythonapi.PyCapsule_SetContext
        put.argtypes = ctypes.py_object, ctypes.c_void_p
        put(made, context)
    return made


# ---- The same bits from all kinds of functions ----

@pytest.mark.parametrize("method", METHODS, ids=str)
def test_compiled_and_python_forces_give_the_same_bits(method, numba_force):
    python = run(duffing_force, method)
    assert python.success and same_bits(python, run(numba_force, method))


def test_all_kinds_of_compiled_functions_give_the_same_bits(numba_force):
    expected = run(duffing_force)
    address = numba_force.address
    prototype = dynstep.signature("force", "ctypes")
    kinds = {
        "ctypes of numba": numba_force.ctypes, "ctypes": prototype(address), "PyCapsule": capsule(address),
        "address": dynstep.compiled(address), "compiled": dynstep.compiled(numba_force),
    }
    try:
        import cffi
    except ImportError:
        pass
    else:
        ffi = cffi.FFI()
        kinds["cffi"] = ffi.cast("int(*)(int, double, const double *, const double *, double *, void *)", address)
        kinds["cffi void"] = ffi.cast("void *", address)
    try:
        from scipy import LowLevelCallable
    except ImportError:
        pass
    else:
        kinds["LowLevelCallable"] = LowLevelCallable(prototype(address))
        kinds["LowLevelCallable of a capsule"] = LowLevelCallable(capsule(address), signature="int (int)")
    for name, force in kinds.items():
        assert same_bits(expected, run(force)), name


def test_python_functions_through_ctypes(numba_force):
    @dynstep.signature("force", "ctypes")
    def force(n, t, q, v, f, ctx):
        q, v, f = ((ctypes.c_double*n).from_address(x) for x in (q, v, f))
        for i in range(n):
            f[i] = -q[i]*(1.0 + q[i]*q[i]) - 0.1*v[i] + 0.3*t
        return 0
    assert same_bits(run(duffing_force), run(force))


def test_functions_from_a_c_library(tmp_path):
    import shutil
    import subprocess
    compiler = shutil.which("cc") or shutil.which("gcc")
    if not compiler:
        pytest.skip("no C compiler")
    source = tmp_path / "force.c"
    source.write_text(f"""
        {dynstep.signature("force", "c")} {{
            for (int i = 0; i < n; i++) f[i] = -q[i]*(1.0 + q[i]*q[i]) - 0.1*v[i] + 0.3*t;
            return 0;
        }}""")
    library = tmp_path / "force.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-O2", "-ffp-contract=off", source, "-o", library], check=True)
    loaded = ctypes.CDLL(str(library))
    assert same_bits(run(duffing_force), run(loaded.force))


class Data(ctypes.Structure):
    _fields_ = [("stiffness", ctypes.c_double), ("damping", ctypes.c_double)]


def test_all_kinds_of_user_data(force_with_data):
    expected = run(duffing_force)
    array = np.array([1.0, 0.1])
    structure = Data(1.0, 0.1)
    kinds = {
        "numpy": array, "int": array.ctypes.data, "Structure": structure, "pointer": ctypes.pointer(structure),
        "byref": ctypes.byref(structure), "c_void_p": ctypes.c_void_p(array.ctypes.data),
        "ctypes array": (ctypes.c_double*2)(1.0, 0.1), "PyCapsule": capsule(array.ctypes.data),
    }
    try:
        import cffi
    except ImportError:
        pass
    else:
        ffi = cffi.FFI()
        kinds["cffi"] = ffi.new("double[2]", [1.0, 0.1])
    for name, data in kinds.items():
        assert same_bits(expected, run(force_with_data, user_data=data)), name
        assert same_bits(expected, run(dynstep.compiled(force_with_data, data))), name
    assert same_bits(expected, run(capsule(force_with_data.address, array.ctypes.data)))
    try:
        from scipy import LowLevelCallable
    except ImportError:
        return
    pointer = ctypes.cast(array.ctypes.data, ctypes.c_void_p)
    assert same_bits(expected, run(LowLevelCallable(force_with_data.ctypes, pointer)))
    array[0] = 2.0                                         # the data are read at each call
    assert not same_bits(expected, run(force_with_data, user_data=array))


def test_user_data_live_as_long_as_the_system(force_with_data):
    system = MechanicalSystem(N, force_with_data, user_data=np.array([1.0, 0.1]))
    import gc
    gc.collect()
    assert same_bits(run(duffing_force), solve(system, (0, 3), *START, h=0.1))


def test_args_reach_all_python_functions():
    seen = set()

    def force(t, q, v, k, name):
        seen.add("force")
        assert name == "spring"
        return -k*q

    def mass(t, q, v, k, name):
        seen.add("mass")
        return np.ones(1)

    def tangent(t, q, v, a, k, name):
        seen.add("tangent")
        return np.array([k]), np.zeros(1)

    def energy(t, q, v, k, name):
        return 0.5*v[0]**2 + 0.5*k*q[0]**2

    system = MechanicalSystem(1, force, mass, tangent, energy, mass_kind="diagonal", tangent_kind="diagonal",
                              args=(4.0, "spring"))
    s = solve(system, (0, 3), 1, 0, h=0.1)
    assert np.abs(s.q[0] - np.cos(2*s.t)).max() < 1e-9 and seen == {"force", "mass", "tangent"}
    assert np.abs(s.energy() - 2).max() < 1e-8
    assert solve(MechanicalSystem(1, lambda t, q, v, k: -k*q, args=4.0), (0, 3), 1, 0, h=0.1).success


def test_signatures_that_do_not_fit_are_refused(numba_force):
    numba = pytest.importorskip("numba")

    @numba.cfunc("float64(float64)")
    def other(x):
        return x

    with pytest.raises(TypeError, match="force is compiled as.*expected int force"):
        MechanicalSystem(1, other)
    with pytest.raises(TypeError, match="energy is compiled as"):
        MechanicalSystem(1, numba_force, energy=dynstep.signature("load", "ctypes")())
    with pytest.raises(TypeError, match="force is compiled as"):
        MechanicalSystem(1, ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(lambda x: x))
    with pytest.raises(TypeError, match="GIL"):
        MechanicalSystem(1, ctypes.PYFUNCTYPE(ctypes.c_int)(lambda: 0))
    cffi = pytest.importorskip("cffi")
    with pytest.raises(TypeError, match="force is compiled as"):
        MechanicalSystem(1, cffi.FFI().cast("int(*)(int, double)", numba_force.address))
    with pytest.raises(TypeError, match="not a function pointer"):
        MechanicalSystem(1, cffi.FFI().new("double[2]"))


def test_signature_texts():
    assert dynstep.signature("load", "c") == "int load(int n, double t, double *p, void *ctx)"
    for function in ("force", "mass", "tangent", "energy", "load", "observer"):
        count = dynstep.signature(function, "c").count(",") + 1
        assert len(dynstep.signature(function, "ctypes")._argtypes_) == count
    with pytest.raises(ValueError, match="function must be one of 'force'"):
        dynstep.signature("farce")
    with pytest.raises(ValueError, match="form must be one of"):
        dynstep.signature("force", "fortran")


# ---- Accuracy and structure ----

def test_order_on_a_nonlinear_problem():
    system = MechanicalSystem(1, pendulum_force, energy=pendulum_energy, velocity_free=True)
    times = np.linspace(0, 4, 11)
    fine = solve(system, (0, 4), 2.0, 0.0, dynstep.NewmarkExtrapolation(6), h=0.1, t_eval=times)
    for method, order in (("newmark", 2), (dynstep.NewmarkExtrapolation(2), 4), (dynstep.NewmarkExtrapolation(3), 6)):
        e = [np.abs(solve(system, (0, 4), 2.0, 0.0, method, h=h, t_eval=times).q - fine.q).max() for h in (0.2, 0.1)]
        assert np.log2(e[0]/e[1]) == pytest.approx(order, abs=0.4)
    assert np.ptp(fine.energy()) < 1e-11


def test_force_with_matrices_and_a_linear_system_agree():
    n = 8
    ab = chain(n)
    k = dynstep.banded(ab, 1, 1)
    dense = k.toarray()
    m = np.linspace(1, 2, n)
    q0 = np.sin(np.arange(n))
    expected = solve(LinearSystem(m, 0.1, k), (0, 5), q0, 0*q0, h=0.1)

    def force(t, q, v):
        return -dense @ q - 0.1*v

    def tangent(t, q, v, a):
        return ab, np.array([[0], [1], [0]])*np.full(n, 0.1)

    options = {
        "differences": {},
        "banded differences": {"tangent_kind": (1, 1), "tangent_symmetric": True},
        "tangent": {"tangent": tangent, "tangent_kind": (1, 1), "tangent_constant": True, "tangent_symmetric": True,
                    "linear": True},
        "dense tangent": {"tangent": lambda t, q, v, a: (dense, 0.1*np.eye(n))},
        "transposed layout": {"tangent": lambda t, q, v, a: (np.asfortranarray(dense), 0.1*np.eye(n)[::-1, ::-1])},
        "integers": {"tangent": lambda t, q, v, a: (dense.astype(int), np.eye(n)*0.1)},
    }
    masses = {"vector": m, "matrix": np.diag(m), "band": dynstep.Banded.from_dense(np.diag(m))}
    for name, given in options.items():
        for mass in masses.values():
            s = solve(MechanicalSystem(n, force, mass, **given), (0, 5), q0, 0*q0, h=0.1)
            assert s.success and np.abs(s.q - expected.q).max() < 1e-11, name


@pytest.mark.parametrize("kind", ["dense", "diagonal", (1, 0)])
def test_mass_functions(kind):
    n = 3
    diagonal = np.array([1.0, 2.0, 3.0])
    full = np.diag(diagonal)
    if kind == (1, 0):
        full[1, 0] = 0.25
    shapes = {"dense": full, "diagonal": diagonal, (1, 0): np.array([diagonal, [0.25, 0, 99]])}
    calls = []

    def mass(t, q, v):
        calls.append(t)
        return shapes[kind]

    q0 = np.ones(n)
    expected = solve(LinearSystem(full, K=4.0), (0, 2), q0, 0*q0, h=0.1)
    for constant in (False, True):
        calls.clear()
        system = MechanicalSystem(n, lambda t, q, v: -4*q, mass, mass_kind=kind, mass_constant=constant,
                                  velocity_free=True)
        s = solve(system, (0, 2), q0, 0*q0, h=0.1)
        assert np.abs(s.q - expected.q).max() < 1e-11 and (len(calls) < 30) == constant


def test_sparse_constant_mass():
    sparse = pytest.importorskip("scipy.sparse")
    m = np.array([[2.0, 1, 0], [1, 3, 0], [0, 0, 1]])
    q0 = np.ones(3)
    a, b = (solve(MechanicalSystem(3, lambda t, q, v: -q, mass), (0, 1), q0, 0*q0, h=0.1)
            for mass in (m, sparse.csr_array(m)))
    assert np.abs(a.q - b.q).max() < 1e-13


def test_declared_structure_saves_work():
    def force(t, q, v):
        return -q**3 + np.roll(q, 1)*0

    counts = {}
    for name, given in {"dense": {}, "diagonal": {"tangent_kind": "diagonal"},
                        "velocity-free": {"velocity_free": True, "tangent_kind": "diagonal"}}.items():
        counts[name] = solve(MechanicalSystem(10, force, **given), (0, 1), np.ones(10), np.zeros(10), "newmark",
                             h=0.1).counts["forces"]
    assert counts["dense"] > counts["diagonal"] > counts["velocity-free"]


def test_tangent_of_a_velocity_free_system_returns_k_alone():
    system = MechanicalSystem(1, pendulum_force, tangent=lambda t, q, v, a: np.cos(q), tangent_kind="diagonal",
                              velocity_free=True)
    plain = solve(MechanicalSystem(1, pendulum_force), (0, 2), 1, 0, h=0.1)
    assert np.abs(solve(system, (0, 2), 1, 0, h=0.1).q - plain.q).max() < 1e-12


def test_compiled_mass_tangent_and_energy():
    numba = pytest.importorskip("numba")

    @numba.cfunc(dynstep.signature("force"))
    def force(n, t, q, v, f, ctx):
        f[0] = -4*q[0]
        return 0

    @numba.cfunc(dynstep.signature("mass"))
    def mass(n, t, q, v, m, ctx):
        m[0] = 2.0
        return 0

    @numba.cfunc(dynstep.signature("tangent"))
    def tangent(n, t, q, v, a, k, c, ctx):
        k[0] = 4.0
        return 0

    @numba.cfunc(dynstep.signature("energy"))
    def energy(n, t, q, v, e, ctx):
        e[0] = v[0]**2 + 2*q[0]**2
        return 0

    system = MechanicalSystem(1, force, mass, tangent, energy, tangent_kind="diagonal", velocity_free=True)
    s = solve(system, (0, 2), 1, 0, h=0.1)
    assert np.abs(s.q[0] - np.cos(np.sqrt(2)*s.t)).max() < 1e-10
    assert np.abs(s.energy() - 2).max() < 1e-9
    assert system.energy(0.0, [1.0], [0.0]) == 2.0 and "energy" in repr(system)


def test_numba_functions_that_are_not_cfuncs_are_python_functions():
    numba = pytest.importorskip("numba")

    @numba.njit
    def force(t, q, v):
        return -q
    assert same_bits(run(force), run(lambda t, q, v: -q))


# ---- Refusals of the model ----

def test_out_of_domain_asks_newton_for_less():
    calls = []

    def force(t, q, v):                          # a wall that the first correction runs into
        if q[0] > 1.05:
            calls.append(t)
            raise dynstep.OutOfDomain("beyond the wall")
        return 1.0/(1.1 - q) - 10*np.ones(1)

    s = solve(MechanicalSystem(1, force, velocity_free=True), (0, 0.5), 1.0, 3.0, "newmark", h=0.05)
    assert s.status in (0, -2, -3) and s.t.size >= 1
    if not s.success:
        assert "force" in s.message or "Newton" in s.message

    def never(t, q, v):
        if t > 0:
            raise dynstep.OutOfDomain
        return -q
    s = solve(MechanicalSystem(1, never), (0, 1), 1.0, 0.0, "newmark", h=0.1)
    assert not s.success and s.status == -2 and "force" in s.message and s.t.tolist() == [0.0]


def test_compiled_refusal_is_an_unsuccessful_solution():
    numba = pytest.importorskip("numba")

    @numba.cfunc(dynstep.signature("force"))
    def force(n, t, q, v, f, ctx):
        f[0] = -q[0]
        return -1 if t > 0.55 else 0

    s = solve(MechanicalSystem(1, force), (0, 1), 1, 0, "newmark", h=0.1)
    assert not s.success and s.status == -2 and "force" in s.message
    assert s.t[-1] == pytest.approx(0.5) and np.abs(s.q[0] - np.cos(s.t)).max() < 0.01


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_not_finite_forces_end_the_run_with_the_trajectory(bad):
    def force(t, q, v):
        return -q if t < 0.55 else np.array([bad])

    for method in ("newmark", "central-difference", "newmark-extrapolation", "midpoint"):
        s = solve(MechanicalSystem(1, force), (0, 1), 1, 0, method, h=0.1)
        assert not s.success and s.status == -10
        assert "force returned" in s.message and "component 1 at t = 0." in s.message
        assert s.t[-1] == pytest.approx(0.5)
    s = solve(MechanicalSystem(1, lambda t, q, v: q*bad), (0, 1), 1, 0, h=0.1)
    assert not s.success and s.t.size == 0


def test_newton_that_does_not_converge():
    def force(t, q, v):
        return -1e6*np.sign(q)*np.sqrt(np.abs(q))

    s = solve(MechanicalSystem(1, force, velocity_free=True), (0, 10), 1.0, 0.0, dynstep.Newmark(
        newton=dynstep.Newton(limit=2, halvings=0)), h=1.0)
    assert not s.success and s.status == -3 and "Newton" in s.message and "t = " in s.message
