# SPDX-License-Identifier: BSD-3-Clause
"""User functions of constraints: compiled ones, what they may return, what they raise."""
import gc
import os
import signal
import subprocess
import sys
import time
import weakref

import numpy as np
import pytest
from problems import GRAVITY, same_bits
from test_exceptions import Mine, frames
from test_threads import resident

import dynstep
from dynstep import Integrator, MechanicalSystem, solve

# A knife edge (x, y, phi) on a string around the origin that gets longer, under a load: both kinds of constraints, all
# functions.  Each operation rounds once, in this order, in any language.
START = 0.0, np.array([1.0, 0.0, 0.5]), None
RATE = 0.1


def force(t, q, v):
    return np.array([0.3, 0.2, -0.1])


def constraint(t, q):
    return np.array([(q[0]*q[0] + q[1]*q[1]) - (1.0 + RATE*t)])


def constraint_jacobian(t, q):
    return np.array([[2.0*q[0], 2.0*q[1], 0.0]]), np.array([-RATE])


def constraint_curvature(t, q, v):
    return np.array([2.0*(v[0]*v[0] + v[1]*v[1])])


def velocity_constraint(t, q, v):
    return np.array([v[0]*q[2] - v[1]])


def velocity_jacobian(t, q, v):
    return np.array([[q[2], -1.0, 0.0]])


def velocity_curvature(t, q, v):
    return np.array([v[0]*v[2]])


def reaction(t, q, v, lam, psi):
    return np.array([-(2.0*q[0])*lam[0] - q[2]*psi[0], -(2.0*q[1])*lam[0] + psi[0], 0.0])


def reaction_jacobian(t, q, v, lam, psi):
    return np.array([[-(2.0*q[0])], [-(2.0*q[1])], [0.0]]), np.array([[-q[2]], [1.0], [0.0]])


def reaction_tangent(t, q, v, lam, psi):
    return np.array([[2.0*lam[0], 0.0, psi[0]], [0.0, 2.0*lam[0], 0.0], [0.0, 0.0, 0.0]]), np.zeros((3, 3))


FUNCTIONS = {f.__name__: f for f in (
    constraint, constraint_jacobian, constraint_curvature, velocity_constraint, velocity_jacobian, velocity_curvature,
    reaction, reaction_jacobian, reaction_tangent)}
NOT_ALWAYS = "constraint_curvature", "velocity_curvature", "reaction_tangent"     # not asked for in each step
# 2 x x' = RATE and y' = phi x'
POINT = np.array([1.0, 0.0, 0.5]), np.array([0.5*RATE, 0.25*RATE, 0.4])
C_SOURCE = """
static double lengthening = 0.1;
force { f[0] = 0.3; f[1] = 0.2; f[2] = -0.1; return 0; }
constraint { g[0] = (q[0]*q[0] + q[1]*q[1]) - (1.0 + lengthening*t); return 0; }
constraint_jacobian { gq[0] = 2.0*q[0]; gq[1] = 2.0*q[1]; gt[0] = -lengthening; return 0; }
constraint_curvature { c[0] = 2.0*(v[0]*v[0] + v[1]*v[1]); return 0; }
velocity_constraint { k[0] = v[0]*q[2] - v[1]; return 0; }
velocity_jacobian { kv[0] = q[2]; kv[1] = -1.0; return 0; }
velocity_curvature { c[0] = v[0]*v[2]; return 0; }
reaction { r[0] = -(2.0*q[0])*lambda[0] - q[2]*psi[0]; r[1] = -(2.0*q[1])*lambda[0] + psi[0]; r[2] = 0.0; return 0; }
reaction_jacobian { rl[0] = -(2.0*q[0]); rl[1] = -(2.0*q[1]); rp[0] = -q[2]; rp[1] = 1.0; return 0; }
reaction_tangent { k[0] = k[4] = 2.0*lambda[0]; k[6] = psi[0]; return 0; }
"""


def run(given=FUNCTIONS, force=force, **options):
    return solve(MechanicalSystem(3, force, **given, **options), (0, 1), *POINT, h=0.05)


def same(first, second):
    return same_bits(first, second) and np.array_equal(first.lam, second.lam) and np.array_equal(first.psi, second.psi)


def with_numba():
    """All functions as numba.cfunc, from the C source."""
    numba = pytest.importorskip("numba")
    made = {}
    for line in C_SOURCE.strip().splitlines()[1:]:
        name, _, body = line.partition(" { ")
        arguments = [p.rpartition(" ")[2].lstrip("*").replace("lambda", "lam") for p in
                     dynstep.signature(name, "c").partition("(")[2][:-1].split(", ")]
        body = body.removesuffix(" }").replace("lambda", "lam").replace("lengthening", "0.1")
        code = f"def {name}({', '.join(arguments)}):\n" + "".join(f"    {x}\n" for x in body.rstrip(";").split("; "))
        names = {}
        exec(code, names)
        made[name] = numba.cfunc(dynstep.signature(name))(names[name])
    return made


def with_c(folder):
    """All functions as ctypes function pointers."""
    import ctypes
    import shutil
    compiler = shutil.which("cc") or shutil.which("gcc")
    if not compiler:
        pytest.skip("no C compiler")
    lines = C_SOURCE.strip().splitlines()
    source = folder/"functions.c"
    functions = [dynstep.signature(line.split()[0], "c") + line.removeprefix(line.split()[0]) for line in lines[1:]]
    source.write_text("\n".join(lines[:1] + functions))
    library = folder/"functions.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-O2", "-ffp-contract=off", source, "-o", library], check=True)
    loaded = ctypes.CDLL(str(library))
    return {name: dynstep.signature(name, "ctypes")((name, loaded)) for name in ["force", *FUNCTIONS]}


# ---- The same bits from all kinds of functions ----

@pytest.mark.parametrize("kind", ["numba", "C"])
def test_compiled_and_python_functions_give_the_same_bits(kind, tmp_path):
    compiled = with_numba() if kind == "numba" else with_c(tmp_path)
    expected = run()
    assert expected.success, expected.message
    load = compiled.pop("force")
    counts = {"constraints": 1, "velocity_constraints": 1}
    assert same(expected, run(compiled, load, **counts))
    for name, function in compiled.items():                      # one compiled among Python functions
        number = {f"{name}s": 1} if f"{name}s" in counts else {}
        assert same(expected, run({**FUNCTIONS, name: function}, **number)), name
    assert expected.constraint_drift.g.max() < 1e-14 and expected.constraint_drift.k.max() < 1e-14


def test_functions_given_and_left_out():
    expected = run()
    for left_out in [["reaction_tangent"], ["reaction_jacobian"], ["reaction", "reaction_jacobian"],
                     ["constraint_curvature", "velocity_curvature"], ["constraint_jacobian", "velocity_jacobian"]]:
        s = run({name: f for name, f in FUNCTIONS.items() if name not in left_out})
        assert s.success, s.message
        for x in ("q", "v", "a", "lam", "psi"):
            assert np.abs(getattr(s, x) - getattr(expected, x)).max() < 1e-7, (left_out, x)


def test_signatures():
    for name in FUNCTIONS:
        assert dynstep.signature(name, "c").startswith(f"int {name}(int n, int ")
        count = dynstep.signature(name, "c").count(",") + 1
        assert len(dynstep.signature(name, "ctypes")._argtypes_) == count
    assert dynstep.signature("constraint", "c") == \
        "int constraint(int n, int m, double t, const double *q, double *g, void *ctx)"
    numba = pytest.importorskip("numba")

    @numba.cfunc(dynstep.signature("force"))
    def other(n, t, q, v, f, ctx):
        return 0

    with pytest.raises(TypeError, match="constraint is compiled as.*expected int constraint"):
        MechanicalSystem(3, force, constraint=other, constraints=1)


def test_data_of_compiled_functions():
    numba = pytest.importorskip("numba")

    @numba.cfunc(dynstep.signature("constraint"))
    def sphere(n, m, t, q, g, ctx):
        g[0] = q[0]*q[0] + q[1]*q[1] - numba.carray(ctx, 1, numba.float64)[0]
        return 0

    data = np.array([4.0])
    system = MechanicalSystem(2, lambda t, q, v: [0.0, -GRAVITY], constraint=sphere, constraints=1, user_data=data)
    s = solve(system, (0, 1), [2.0, 0.0], [0.0, 0.0], h=0.01)
    assert s.success and np.abs(np.hypot(*s.q) - 2).max() < 1e-14


def test_a_thread_for_each_with_compiled_functions():
    import threading
    system = MechanicalSystem(3, **with_numba(), constraints=1, velocity_constraints=1)
    results = {}

    def job(i):
        results[i] = solve(system, (0, 1), *POINT, h=0.05)

    threads = [threading.Thread(target=job, args=(i,)) for i in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert all(same(results[0], results[i]) for i in range(4))


# ---- What they raise ----

def failing(kind, action, after):
    """All functions; `kind` does `action` once t > after."""
    def function_of_the_user(t, *rest):
        return action() if t > after else FUNCTIONS[kind](t, *rest)
    return {**FUNCTIONS, kind: function_of_the_user}


@pytest.mark.parametrize("kind", FUNCTIONS)
@pytest.mark.parametrize("after", [-1.0, 0.52])
def test_exceptions_come_out_unchanged(kind, after):
    for error in (Mine("an object of its own"), KeyboardInterrupt(), StopIteration(7)):
        def action():
            raise error

        if kind in NOT_ALWAYS:
            after = -1.0
        with pytest.raises(type(error)) as caught:
            run(failing(kind, action, after))
        assert caught.value is error
        assert frames(error)[-2:] == ["function_of_the_user", "action"] and "solve" in frames(error)


def test_exceptions_in_check_and_drift():
    calls = []

    def late(t, q):
        calls.append(t)
        if broken:
            raise Mine
        return constraint(t, q)

    broken = False
    s = run({**FUNCTIONS, "constraint": late})
    broken = True
    with pytest.raises(Mine):
        s.constraint_drift
    with pytest.raises(Mine):
        dynstep.check_system(s.system, 0.0, *POINT)
    broken = False
    assert s.constraint_drift.g.max() < 1e-14 and s.constraint_drift is s.constraint_drift


def test_an_integrator_goes_on_after_an_exception():
    raised = []

    def late(t, q):
        if t > 0.47 and not raised:
            raised.append(t)
            raise Mine
        return constraint(t, q)

    integrator = Integrator(MechanicalSystem(3, force, **{**FUNCTIONS, "constraint": late}))
    integrator.start(0.0, *POINT)
    with pytest.raises(Mine):
        integrator.run(1.0, 0.05)
    assert integrator.t == pytest.approx(0.45)
    integrator.run(1.0, 0.05)
    assert integrator.q == pytest.approx(run().q[:, -1], abs=1e-6)


# ---- What is wrong with them ----

CHECKED_AT = 0.3, [0.9, 0.2, 0.4], [0.3, 0.2, 0.5]


@pytest.mark.parametrize("kind", FUNCTIONS)
def test_check_system_finds_one_per_cent(kind):
    def wrong(*x):
        good = FUNCTIONS[kind](*x)
        return tuple(1.01*y for y in good) if isinstance(good, tuple) else 1.01*good

    report = dynstep.check_system(MechanicalSystem(3, force, **{**FUNCTIONS, kind: wrong}), *CHECKED_AT)
    derivative = {"constraint": "constraint_jacobian", "velocity_constraint": "velocity_jacobian",
                  "reaction": "reaction_jacobian"}.get(kind, kind)
    assert not report and derivative in str(report) and "t = 0.3" in str(report)
    assert dynstep.check_system(MechanicalSystem(3, force, **FUNCTIONS), *CHECKED_AT)


def test_check_system_finds_a_pattern_that_is_too_small():
    g = {**FUNCTIONS, "constraint_jacobian": lambda t, q: ([2*q[0]], [-RATE])}
    report = dynstep.check_system(MechanicalSystem(3, force, constraint_pattern=([0, 1], [0]), **g), *CHECKED_AT)
    assert not report and "constraint 1 of g changes with q(2)" in str(report)


# ---- What they return ----

SHAPES = {"constraint": "(1,)", "constraint_jacobian": "(1, 3)", "constraint_curvature": "(1,)",
          "velocity_constraint": "(1,)", "velocity_jacobian": "(1, 3)", "velocity_curvature": "(1,)",
          "reaction": "(3,)", "reaction_jacobian": "(3, 1)", "reaction_tangent": "(3, 3)"}


@pytest.mark.parametrize("kind", FUNCTIONS)
def test_wrong_shapes_and_types(kind):
    pair = kind in ("reaction_jacobian", "reaction_tangent")
    for wrong in (np.zeros((2, 5)), np.zeros(7), np.zeros((1, 1, 1))):
        with pytest.raises(ValueError) as caught:
            run(failing(kind, lambda: (wrong, wrong) if pair else wrong, -1.0), constraints=1, velocity_constraints=1)
        text = str(caught.value)
        assert text.startswith(f"{kind} returned ") and f"an array of shape {wrong.shape}, expected " in text
        assert SHAPES[kind] in text or wrong.ndim == 1 and "(3,)" in text
    for wrong, word in ((None, "None"), (np.zeros(3, complex), "complex128"), ("a", "real numbers")):
        with pytest.raises(TypeError, match=f"{kind} returned.*{word}"):
            run(failing(kind, lambda: (wrong, wrong) if pair else wrong, -1.0), constraints=1, velocity_constraints=1)


@pytest.mark.parametrize("kind, value, error, words", [
    ("constraint_jacobian", (np.zeros((1, 3)), np.zeros(2)), ValueError, r"g_t, an array of shape \(2,\), expected"),
    ("constraint_jacobian", (np.zeros((1, 3)),), TypeError, r"a tuple of 1, expected G, an array, or \(G, g_t\)"),
    ("reaction_jacobian", (np.zeros((3, 1)), np.zeros((1, 3))), ValueError, r"dr/dpsi, an array of shape \(1, 3\)"),
    ("reaction_jacobian", (np.zeros((1, 3)), np.zeros((3, 1))), ValueError, r"dr/dlambda, an array of shape"),
    ("reaction_jacobian", np.zeros((3, 1)), TypeError, r"expected a tuple \(dr/dlambda, dr/dpsi\)"),
    ("reaction_tangent", np.zeros((3, 3)), TypeError, r"expected a tuple \(K, C\)"),
])
def test_wrong_tuples(kind, value, error, words):
    with pytest.raises(error, match=f"{kind} returned.*{words}"):
        run(failing(kind, lambda: value, -1.0))


@pytest.mark.parametrize("kind", ["constraint", "velocity_constraint"])
def test_numbers_of_constraints_that_cannot_be_told(kind):
    for value, error, words in ((None, TypeError, "None"), (np.zeros((2, 2)), ValueError, r"\(2, 2\)"),
                                ([[1, 2], [3]], ValueError, "did not return an array")):
        with pytest.raises(error, match=f"{kind} .*{words}"):
            run(failing(kind, lambda: value, -1.0))

    def out_of_domain():
        raise dynstep.OutOfDomain("below zero")
    with pytest.raises(ValueError, match=f"{kind} is not defined at the start, t = 0: below zero"):
        run(failing(kind, out_of_domain, -1.0))


def test_results_that_numpy_can_read():
    expected = run()
    for make in (list, lambda x: x.tolist(), np.asfortranarray, lambda x: x.astype(">f8"),
                 lambda x: x.astype(np.longdouble)):
        given = {"constraint": lambda t, q: make(constraint(t, q)),
                 "constraint_jacobian": lambda t, q: tuple(map(make, constraint_jacobian(t, q))),
                 "velocity_jacobian": lambda t, q, v: make(velocity_jacobian(t, q, v)),
                 "reaction_jacobian": lambda t, q, v, x, y: tuple(map(make, reaction_jacobian(t, q, v, x, y)))}
        assert same(expected, run({**FUNCTIONS, **given}))
    flat = {"constraint": lambda t, q: constraint(t, q)[0],
            "constraint_jacobian": lambda t, q: tuple(x[0] for x in constraint_jacobian(t, q)),
            "velocity_jacobian": lambda t, q, v: velocity_jacobian(t, q, v)[0],
            "reaction_jacobian": lambda t, q, v, x, y: tuple(z.ravel() for z in reaction_jacobian(t, q, v, x, y))}
    assert same(expected, run({**FUNCTIONS, **flat}))


def test_sparse_jacobians_must_fit_their_pattern():
    sparse = pytest.importorskip("scipy.sparse")
    pattern = {"constraint_pattern": sparse.csr_array([[1, 1, 0]])}
    expected = run(**pattern)
    assert expected.success and np.abs(expected.q - run().q).max() < 1e-12
    good = {"csr": sparse.csr_array, "coo": sparse.coo_matrix, "values": lambda g: g[0, :2], "dense": np.array}
    for name, kind in good.items():
        def jacobian(t, q):
            g, gt = constraint_jacobian(t, q)
            return kind(g), gt
        assert same(expected, run({**FUNCTIONS, "constraint_jacobian": jacobian}, **pattern)), name
    wrong = np.array([[1.0, 2.0, 3.0]])
    for kind in (sparse.csr_array, np.array):
        with pytest.raises(ValueError, match=r"constraint_jacobian returned an entry \[0, 2\] that its pattern"):
            run({**FUNCTIONS, "constraint_jacobian": lambda t, q: kind(wrong)}, **pattern)
    for shape in ((1, 2), (2, 3)):
        with pytest.raises(ValueError, match=r"expected \(1, 3\)"):
            run({**FUNCTIONS, "constraint_jacobian": lambda t, q: sparse.csr_array(np.ones(shape))}, **pattern)


def test_arrays_may_be_kept_and_changed():
    kept = []

    def keeping(function):
        def user(t, *arrays):
            kept.append(arrays)
            result = function(t, *(x.copy() for x in arrays))
            for x in arrays:
                x[:] = 99.0
            return result
        return user

    assert same(run(), run({name: keeping(f) for name, f in FUNCTIONS.items()}))
    gc.collect()
    assert all(np.all(x == 99.0) and x.flags.owndata and x.flags.writeable for arrays in kept for x in arrays)


# ---- Refusals of the model ----

@pytest.mark.parametrize("kind", [name for name in FUNCTIONS if name != "reaction_tangent"])
@pytest.mark.parametrize("after", [-1.0, 0.52])
def test_values_that_are_not_finite_end_the_run_with_the_trajectory(kind, after):
    def nan(t, *rest):
        good = FUNCTIONS[kind](t, *rest)
        if t <= after:
            return good
        return tuple(np.full_like(x, np.nan) for x in good) if isinstance(good, tuple) else np.full_like(good, np.nan)

    if kind in NOT_ALWAYS and after > 0:
        return
    s = run({**FUNCTIONS, kind: nan})
    assert not s.success and s.status in (-10, -3) and kind in s.message, s.message
    if after > 0:
        assert 0.2 < s.t[-1] < 0.55 and np.isfinite(s.lam).all() and s.lam.shape == (1, s.t.size)
        assert np.array_equal(s.q, run().q[:, :s.t.size])


@pytest.mark.parametrize("kind", ["constraint", "constraint_jacobian", "velocity_constraint", "reaction"])
def test_out_of_domain(kind):
    def out(*_):
        raise dynstep.OutOfDomain
    s = run(failing(kind, out, 0.52))
    assert not s.success and s.status == -2 and kind in s.message and 0.2 < s.t[-1] < 0.55


# ---- Memory, Ctrl-C ----

def test_references_are_given_back():
    functions = {name: (lambda f: lambda *x: f(*x))(f) for name, f in FUNCTIONS.items()}
    run(functions)
    gc.collect()
    counts = [sys.getrefcount(f) for f in functions.values()]
    for _ in range(50):
        run(functions)
    gc.collect()
    assert [sys.getrefcount(f) for f in functions.values()] == counts


@pytest.mark.parametrize("kind", FUNCTIONS)
def test_frames_of_exceptions_are_released(kind):
    class Big:
        pass

    alive = []

    def action():
        big = Big()
        alive.append(weakref.ref(big))
        raise Mine

    for _ in range(3):
        try:
            run(failing(kind, action, -1.0), constraints=1, velocity_constraints=1)
        except Mine:
            pass
    gc.collect()
    assert len(alive) == 3 and all(ref() is None for ref in alive)


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="needs /proc")
@pytest.mark.parametrize("kind", ["raise", "wrong shape", "sparse", "fine"])
def test_memory_does_not_grow(kind):
    sparse = pytest.importorskip("scipy.sparse") if kind == "sparse" else None

    def jacobian(t, q):
        ballast = np.ones(100_000)                   # 800 kB in the frame that raises
        if kind == "sparse":
            return sparse.csr_array([[2*q[0], 2*q[1], 0.0]]), [-RATE*ballast[0]]
        if t < 0.02 or kind == "fine":
            return constraint_jacobian(t, q)
        if kind == "raise":
            raise ValueError("no")
        return np.ones(7)

    system = MechanicalSystem(3, force, **{**FUNCTIONS, "constraint_jacobian": jacobian})

    def once():
        try:
            solve(system, (0, 0.1), *POINT, h=0.05)
        except ValueError:
            pass

    for _ in range(100):
        once()
    before = resident()
    for _ in range(400):
        once()
    assert resident() - before < 8*2**20             # a leak of one frame each would be 320 MB


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_ctrl_c_within_a_second():
    pytest.importorskip("numba")
    code = """
import signal, sys, time
import dynstep
sys.path.insert(0, sys.argv[1])
from test_constraint_functions import POINT, with_numba
signal.signal(signal.SIGINT, signal.default_int_handler)
system = dynstep.MechanicalSystem(3, **with_numba(), constraints=1, velocity_constraints=1)
print("ready", flush=True)
try:
    while True:
        dynstep.solve(system, (0, 1e4), *POINT, h=1e-4, every=0)
except KeyboardInterrupt:
    print("interrupted", time.time(), flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", code, os.path.dirname(__file__)], stdout=subprocess.PIPE,
                          text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            time.sleep(0.7)
            sent = time.time()
            process.send_signal(signal.SIGINT)
            words = process.stdout.readline().split()
            process.wait(20)
        finally:
            process.kill()
    assert words[0] == "interrupted" and process.returncode == 0
    assert float(words[1]) - sent < 1.0
