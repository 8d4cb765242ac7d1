# SPDX-License-Identifier: BSD-3-Clause
"""First-order systems: what they take, what they refuse, what comes out."""
import ctypes
import pickle

import numpy as np
import pytest

import dynstep
from dynstep import (BI, BIExtrapolation, Integrator, LinearOde, LinearSystem, LoadTable, MechanicalSystem, Newton, OdeSystem,
                     OutOfDomain, Pade, solve, solve_ode)


def decay(t, y):
    return -y


@pytest.mark.parametrize("make, error, match", [
    (lambda: OdeSystem(0, decay), ValueError, "n = 0"),
    (lambda: OdeSystem(1.5, decay), TypeError, "n must be an integer"),
    (lambda: OdeSystem(2, None), TypeError, "rhs is None"),
    (lambda: OdeSystem(2, 3), TypeError, "rhs must be a function"),
    (lambda: OdeSystem(2, decay, "no"), TypeError, "jacobian must be a function"),
    (lambda: OdeSystem(2, decay, jacobian_kind="banded"), ValueError, "jacobian_kind must be"),
    (lambda: OdeSystem(2, decay, jacobian_kind=(2, 0)), ValueError, "kl of jacobian_kind = 2"),
    (lambda: OdeSystem(2, decay, user_data=np.ones(1)), ValueError, "user_data is passed to compiled functions"),
    (lambda: LinearOde(None), TypeError, "A is None"),
    (lambda: LinearOde(np.ones((2, 3))), ValueError, "A has the shape"),
    (lambda: LinearOde([[1.0, np.nan], [0.0, 1.0]]), ValueError, r"A\[0, 1\] = nan"),
    (lambda: LinearOde(np.eye(2), 3.0), TypeError, "source must be a function"),
    (lambda: LinearOde(np.eye(2), LoadTable((0, 1), np.ones((3, 4)))), ValueError, "the sizes do not fit"),
    (lambda: LinearSystem(1.0, feedback=(1.0, 2.0)), ValueError, r"feedback must be a tuple \(b, k, c\)"),
    (lambda: LinearSystem(1.0, feedback=([1.0, 2.0], [1.0], None)), ValueError, "k of feedback has the shape"),
    (lambda: LinearSystem(1.0, feedback=([1.0, np.inf], None, None)), ValueError, r"b of feedback\[1\] = inf"),
    (lambda: LinearSystem(np.ones(3), feedback=([1.0, 2.0], None, None)), ValueError, "feedback has 2 rows"),
])
def test_wrong_systems_are_named(make, error, match):
    with pytest.raises(error, match=match):
        make()


@pytest.mark.parametrize("changed, error, match", [
    ({"system": LinearSystem(1.0)}, TypeError, "goes with solve"),
    ({"system": 7.0}, TypeError, "system must be"),
    ({"system": OdeSystem(2, decay)}, ValueError, r"y0 has the shape \(1,\), expected \(2,\)"),
    ({"system": OdeSystem(1, decay), "args": (1,)}, ValueError, "args go with a function"),
    ({"y0": [[1.0]]}, ValueError, "y0 has the shape"),
    ({"y0": None}, TypeError, "y0 is None"),
    ({"y0": np.nan}, ValueError, "y0"),
    ({"t_span": (0, 1, 2)}, ValueError, "t_span"),
    ({"h": 0.0}, ValueError, "h must not be zero"),
    ({"h": -0.1}, ValueError, "points away"),
    ({"tol": 1e-6}, ValueError, "h and tol exclude each other"),
    ({"h_first": 0.1}, ValueError, "do not go with h"),
    ({"h_max": 0.1}, ValueError, "do not go with h"),
    ({"controller": "pi"}, ValueError, "do not go with h"),
    ({"rtol": 1e-6}, ValueError, "rtol goes without h"),
    ({"h": None, "tol": 1e-6, "atol": 1e-6}, ValueError, "atol goes without tol"),
    ({"h": None, "controller": "pi"}, ValueError, "controller goes with tol"),
    ({"h": None, "rtol": -1.0}, ValueError, "rtol = -1"),
    ({"h": None, "atol": {"q": 1e-6}}, ValueError, "atol has the key 'q'; expected 'y'"),
    ({"h": None, "atol": [1e-6, 1e-6]}, ValueError, r"atol of y has the shape \(2,\), expected \(1,\)"),
    ({"h": None, "tol": 0.0}, ValueError, "tol = 0 must be positive"),
    ({"h": None, "tol": "fine"}, TypeError, "tol must be a number"),
    ({"h": None, "tol": 1e-6, "controller": "pid"}, ValueError, "controller must be one of 'standard', 'pi'"),
    ({"h": None, "tol": 1e-6, "h_first": -0.1}, ValueError, "h_first = -0.1.* points away"),
    ({"h": None, "tol": 1e-6, "h_max": -0.1}, ValueError, "h_max = -0.1"),
    ({"h": None, "tol": 1e-6, "every": 2}, ValueError, "every = 2 goes with h"),
    ({"h": None, "tol": 1e-6, "method": BIExtrapolation(1)}, ValueError, "no error estimate"),
    ({"t_eval": [2.0]}, ValueError, r"t_eval\[0\]"),
    ({"every": -1}, ValueError, "every"),
    ({"max_steps": 0}, ValueError, "max_steps"),
    ({"dense_output": 1}, TypeError, "dense_output"),
    ({"observer": 1}, TypeError, "observer"),
    ({"method": "runge"}, ValueError, "method must be"),
    ({"method": "newmark"}, ValueError, "first order"),
])
def test_wrong_runs_are_named(changed, error, match):
    with pytest.raises(error, match=match):
        solve_ode(**{"system": decay, "t_span": (0, 1), "y0": 1.0, "h": 0.1, **changed})


def test_each_system_has_its_own_solve():
    for act in (lambda s: solve(s, (0, 1), 1, 0, h=0.1), Integrator, lambda s: dynstep.check_system(s, 0, [1], [0])):
        for system in (OdeSystem(1, decay), LinearOde(1.0)):
            with pytest.raises(TypeError, match="goes with solve_ode"):
                act(system)
    with pytest.raises(TypeError, match="goes with solve;"):
        solve_ode(MechanicalSystem(1, lambda t, q, v: -q), (0, 1), 1.0, "newmark", h=0.1)


def test_feedback_wants_a_method_that_takes_it():
    system = LinearSystem(np.ones(2), feedback=([1.0, 0.0], [0.0, 1.0], None))
    assert "feedback" in repr(system) and system.n == 2
    with pytest.raises(ValueError, match="coupling"):
        solve(system, (0, 1), [1, 2], [0, 0], "newmark-extrapolation", h=0.1)


def test_systems_show_what_they_are():
    sparse = pytest.importorskip("scipy.sparse")
    assert repr(OdeSystem(3, decay, lambda t, y: 1)) == "<first-order system of 3 unknown(s) with rhs and jacobian>"
    assert "A dense" in repr(LinearOde(np.ones((2, 2)))) and LinearOde(3.0).n == 1
    n = 40
    ring = np.roll(np.eye(n), 1, axis=1) + np.roll(np.eye(n), -1, axis=1)
    system = LinearOde(sparse.csr_array(ring))
    assert system.ordering is not None and "reordered" in repr(system) and "kl=2, ku=2" in system.storage


# ---- Solutions ----

VOLTERRA = [2.0, 3.0]


def volterra(t, y, k=1.0):
    return np.array([k*y[0]*(1 - y[1]), -y[1]*(1 - y[0])])


def circle(t, y):
    return (y @ y)**2*np.array([-y[1], y[0]])            # from (1, 0): cos t, sin t


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("method, order", [("bi", 4), ("bi45", 4), (BI(1), 2), (BI(3), 4), (BI((4, 5), 0.4), 4),
                                           (BI(halves="fehlberg", alpha=0.4), 5), (BIExtrapolation(3, 2), 6)])
def test_order_forward_and_backward(method, order, direction):
    end = [np.cos(2.0), direction*np.sin(2.0)]
    errors = [np.abs(solve_ode(circle, (0, 2*direction), [1, 0], method, h=direction/steps).y[:, -1] - end).max()
              for steps in (16, 32)]
    assert np.log2(errors[0]/errors[1]) > order - 0.35, errors


def test_solution_has_what_it_promises():
    s = solve_ode(volterra, (0, 1), VOLTERRA, h=0.1, args=(1.0,))
    assert s.success and s.status == 0 and s.t.shape == (11,) and s.y.shape == s.yp.shape == (2, 11) and s.sol is None
    assert np.array_equal(s.yp.T, [volterra(t, y) for t, y in zip(s.t, s.y.T)])
    assert isinstance(s.system, OdeSystem) and s.method == BI() and s.counts["steps"] == 10 and s.counts["forces"] > 100
    assert "2 unknown(s)" in repr(s) and "BI(order=(4, 4), alpha=0.5)" in repr(s)
    assert not hasattr(s, "q")


def test_what_is_recorded():
    full = solve_ode(volterra, (0, 1), VOLTERRA, h=0.05)
    dense = solve_ode(volterra, (0, 1), VOLTERRA, h=0.05, dense_output=True)
    times = np.array([0.0, 0.01, 0.33, 0.33, 1.0])
    there = solve_ode(volterra, (0, 1), VOLTERRA, h=0.05, t_eval=times)
    both = solve_ode(volterra, (0, 1), VOLTERRA, h=0.05, t_eval=times, dense_output=True)
    assert np.array_equal(there.t, times) and np.abs(there.y - dense.sol(times)).max() < 1e-14
    assert np.abs(there.yp - dense.sol.derivative(times)).max() < 1e-13 and np.array_equal(both.y, dense.sol(times))
    assert dense.sol(0.33).shape == (2,) and np.abs(dense.sol(full.t) - full.y).max() < 1e-15
    fine = solve_ode(volterra, (0, 1), VOLTERRA, h=0.01)
    assert 1e-8 < np.abs(dense.sol(fine.t) - fine.y).max() < 1e-5           # h^4
    with pytest.raises(ValueError, match="outside the run"):
        dense.sol(1.5)
    every = solve_ode(volterra, (0, 1), VOLTERRA, h=0.05, every=8)
    assert np.array_equal(every.y, full.y[:, [0, 8, 16, 20]])
    assert solve_ode(volterra, (0, 1), VOLTERRA, h=0.05, t_eval=[]).y.shape == (2, 0)
    stopped = solve_ode(volterra, (0, 1), VOLTERRA, h=0.05, observer=lambda t, y, yp: y[0] < 1.5 and yp[0] < 0)
    assert stopped.status == 1 and stopped.y[0, -2] >= 1.5 > stopped.y[0, -1]
    short = solve_ode(volterra, (0, 1), VOLTERRA, h=0.05, max_steps=7)
    assert not short.success and short.t.size == 8 and "max_steps = 7 steps were made, up to t = 0.35" in short.message


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("controller", ["standard", "pi"])
@pytest.mark.parametrize("method", ["bi", "bi45", BI(3), BI(halves="fehlberg", alpha=0.4), BIExtrapolation(3, 2)])
def test_errors_follow_the_tolerance(method, controller, direction):
    # measured: errors of 0.001 to 1.5 tolerances, and 700 to 10000 times smaller by a tolerance 1000 times smaller
    errors = []
    for tol in (1e-5, 1e-8):
        s = solve_ode(circle, (0, 2*direction), [1, 0], method, tol=tol, controller=controller, h_max=2)
        assert s.success and s.t[-1] == 2*direction and s.counts["steps"] == s.t.size - 1 < 1200
        assert np.all(np.diff(s.t)*direction > 0)
        errors.append(np.abs(s.y - [np.cos(s.t), np.sin(s.t)]).max())
        assert errors[-1] < 2*tol
    assert errors[1] < errors[0]/500, errors


def test_steps_that_are_controlled():
    long = {"tol": 1e-7, "h_first": 1.0, "h_max": 1.0}
    s = solve_ode(volterra, (0, 4), VOLTERRA, **long)
    assert s.success and s.counts["rejections"] > 0 and s.counts["steps"] == s.t.size - 1
    assert np.array_equal(s.yp.T, [volterra(t, y) for t, y in zip(s.t, s.y.T)])
    first = solve_ode(volterra, (0, 4), VOLTERRA, tol=1e-7)
    assert first.t[1] == 4/128 and np.diff(first.t).max() <= 0.25 and first.counts["rejections"] == 0
    assert np.diff(solve_ode(volterra, (0, 4), VOLTERRA, tol=1e-3, h_max=0.0625).t).max() <= 0.0625
    times = np.array([0.0, 0.01, 0.33, 0.33, 4.0])
    dense = solve_ode(volterra, (0, 4), VOLTERRA, **long, dense_output=True)
    there = solve_ode(volterra, (0, 4), VOLTERRA, **long, t_eval=times)
    assert np.array_equal(dense.y, s.y) and np.array_equal(there.t, times) and there.counts == s.counts
    assert np.abs(there.y - dense.sol(times)).max() < 1e-13 and np.array_equal(there.y[:, -1], s.y[:, -1])
    assert solve_ode(volterra, (0, 4), VOLTERRA, **long, t_eval=[]).y.shape == (2, 0)
    short = solve_ode(volterra, (0, 4), VOLTERRA, **long, max_steps=7)
    assert not short.success and np.array_equal(short.y, s.y[:, :8]) and "max_steps = 7" in short.message
    stopped = solve_ode(volterra, (0, 4), VOLTERRA, **long, observer=lambda t, y, yp: t > 1)
    assert stopped.status == 1 and np.array_equal(stopped.t, s.t[:stopped.t.size]) and stopped.t[-2] <= 1 < stopped.t[-1]
    pi = solve_ode(volterra, (0, 4), VOLTERRA, **long, controller="pi")
    assert pi.success and pi.counts["steps"] != s.counts["steps"]


def test_a_failing_step_is_made_shorter():
    def root(t, y):                                      # y = 1 - t^2/4 ends at t = 2
        if y[0] < 0:
            raise OutOfDomain
        return -np.sqrt(y)
    s = solve_ode(root, (0, 3), 1.0, tol=1e-6)
    assert not s.success and s.t[-1] == pytest.approx(2, abs=1e-2) and "step length fell" in s.message
    assert s.counts["rejections"] > 10


def test_mechanical_systems_are_controlled(capsys):
    system = LinearSystem(2.0, K=8.0)
    for method in (None, "bi", "midpoint-extrapolation"):
        coarse, fine = (solve(system, (0, 5), 1.0, 0.0, method, tol=tol, h_max=1.0) for tol in (1e-5, 1e-9))
        errors = [np.abs(s.q[0] - np.cos(2*s.t)).max() for s in (coarse, fine)]
        assert coarse.success and fine.success and coarse.t.size < fine.t.size, method
        assert errors[0] < 1e-5*coarse.t.size and errors[1] < 1e-9*fine.t.size, errors
    solve(system, (0, 5), 1.0, 0.0, tol=1e-6, progress=True)
    assert "step" in capsys.readouterr().err
    with pytest.raises(ValueError, match="no error estimate"):
        solve(system, (0, 5), 1.0, 0.0, "newmark", tol=1e-6)
    assert abs(solve(system, (0, 5), 1.0, 0.0).q[0, -1] - np.cos(10.0)) < 1e-4


@pytest.mark.parametrize("kind", ["dense", "diagonal", (1, 1), (0, 2)])
def test_jacobians_of_all_kinds(kind):
    # the Jacobian is banded; a kind that leaves entries out makes the iteration slower, not the result another one
    n = 6

    def rhs(t, y):
        f = -(2 + y*y)*y + np.sin(t)
        f[1:] += y[:-1]
        f[:-1] += y[1:]
        return f

    def jacobian(t, y):
        a = np.diag(-2 - 3*y*y) + np.eye(n, k=1) + np.eye(n, k=-1)
        if kind == "diagonal":
            return np.diag(a)
        if kind == "dense":
            return a
        ab = np.zeros((kind[0] + kind[1] + 1, n))
        for offset in range(-kind[0], kind[1] + 1):
            diagonal = np.diag(a, offset)
            ab[kind[1] - offset, max(0, offset):max(0, offset) + diagonal.size] = diagonal
        return ab

    y0 = np.linspace(-1, 1, n)
    expected = solve_ode(rhs, (0, 2), y0, h=0.1)
    for given in (jacobian, None) if kind in ("dense", (1, 1)) else (jacobian,):
        s = solve_ode(OdeSystem(n, rhs, given, jacobian_kind=kind), (0, 2), y0, h=0.1)
        assert s.success and np.abs(s.y - expected.y).max() < 1e-13


# ---- Linear systems ----

A = np.array([[-1.0, 2.0, 0.0], [-2.0, -1.0, 0.5], [0.0, 0.3, -40.0]])


def test_linear_ode_by_all_methods():
    linalg = pytest.importorskip("scipy.linalg")
    y0 = np.array([1.0, 0.0, 2.0])
    exact = linalg.expm(2*A) @ y0
    for method, error in ((Pade(5, 6), 1e-12), (Pade(4, 4), 1e-8), ("pade", 1e-8), ("bi", 1e-4), (BIExtrapolation(4, 2), 1e-3)):
        s = solve_ode(LinearOde(A), (0, 2), y0, method, h=0.1)
        assert np.abs(s.y[:, -1] - exact).max() < error, method
    assert np.abs(solve_ode(OdeSystem(3, lambda t, y: A @ y), (0, 2), y0, h=0.1).y
                  - solve_ode(LinearOde(A), (0, 2), y0, h=0.1).y).max() < 1e-11


def test_sources_and_orders_of_unknowns_agree():
    sparse = pytest.importorskip("scipy.sparse")
    n = 40
    ring = np.roll(np.eye(n), 1, axis=1) + np.roll(np.eye(n), -1, axis=1) - 2.5*np.eye(n)
    pattern, y0 = np.linspace(0, 1, n), np.cos(np.arange(n))
    table = LoadTable((0.0, 4.0), [0.0, 4.0], pattern)
    kept = []
    native = dynstep.signature("source", "ctypes")(
        lambda n, t, b, ctx: np.copyto(np.ctypeslib.as_array((ctypes.c_double*n).from_address(b)), t*pattern) or 0)
    runs = [solve_ode(system, (0, 2), y0, "pade", h=0.1, observer=observer) for system, observer in (
        (LinearOde(ring, lambda t: t*pattern), None), (LinearOde(sparse.csr_array(ring), table), None),
        (LinearOde(sparse.csr_array(ring), lambda t: t*pattern), lambda t, y, yp: kept.append((y, yp))),
        (LinearOde(sparse.csr_array(ring), native), None))]
    for s in runs[1:]:
        assert np.abs(s.y - runs[0].y).max() < 1e-13 and np.abs(s.yp - runs[0].yp).max() < 1e-12
    assert np.array_equal(np.array(kept)[:, 0].T, runs[2].y[:, 1:]) and np.array_equal(kept[-1][1], runs[2].yp[:, -1])


def test_a_compiled_observer_of_reordered_unknowns():
    sparse = pytest.importorskip("scipy.sparse")
    numba = pytest.importorskip("numba")
    n = 40
    ring = np.roll(np.eye(n), 1, axis=1) + np.roll(np.eye(n), -1, axis=1) - 2.5*np.eye(n)
    last = np.zeros(2*n)

    @numba.cfunc(dynstep.signature("observer"))
    def observer(n, t, q, v, a, ctx):
        last = numba.carray(ctx, 2*n, numba.float64)
        for i in range(n):
            last[i] = q[i]
            last[n + i] = a[i]
        return 0

    s = solve_ode(LinearOde(sparse.csr_array(ring)), (0, 1), np.arange(n), "pade", h=0.1,
                  observer=dynstep.compiled(observer, last))
    assert np.array_equal(last, np.concatenate([s.y[:, -1], s.yp[:, -1]]))


@pytest.mark.parametrize("method", ["pade", "bi", Pade(3, 4)])
def test_feedback_is_the_dense_closed_loop(method):
    sparse = pytest.importorskip("scipy.sparse")
    n = 40
    ring = 2.2*np.eye(n) - 0.5*np.roll(np.eye(n), 1, axis=1) - 0.5*np.roll(np.eye(n), -1, axis=1)
    rng = np.random.default_rng(3)
    b, k, c = rng.uniform(0, 0.3, (3, n))
    q0, v0 = rng.standard_normal((2, n))
    dense = LinearSystem(1.0, 0.1*ring + np.outer(b, c), ring + np.outer(b, k))
    banded = LinearSystem(1.0, sparse.csr_array(0.1*ring), sparse.csr_array(ring), feedback=(b, k, c))
    assert banded.ordering is not None and banded.has_energy
    first, second = (solve(system, (0, 3), q0, v0, method, h=0.1) for system in (dense, banded))
    assert first.success and second.success
    assert np.abs(first.q - second.q).max() < 1e-12 and np.abs(first.a - second.a).max() < 1e-11
    assert np.abs(solve(LinearSystem(np.ones(n), feedback=(b, None, None)), (0, 1), q0, v0, method, h=0.1).v
                  - v0[:, np.newaxis]).max() < 1e-13


def test_mechanical_systems_take_the_new_methods():
    system = LinearSystem(2.0, K=8.0)
    for method, error in (("pade", 1e-11), ("bi", 1e-5), (Pade(8, 8), 1e-12)):
        s = solve(system, (0, 5), 1.0, 0.0, method, h=0.05)
        assert np.abs(s.q[0] - np.cos(2*s.t)).max() < error
        assert np.ptp(s.energy()) < 1e-12
    with pytest.raises(ValueError, match="linear"):
        solve(MechanicalSystem(1, lambda t, q, v: -q), (0, 1), 1.0, 0.0, "pade", h=0.1)
    s = solve(MechanicalSystem(1, lambda t, q, v: -4*q), (0, 5), 1.0, 0.0, "bi", h=0.05)
    assert np.abs(s.q[0] - np.cos(2*s.t)).max() < 1e-5


# ---- Functions of the user ----

@pytest.mark.parametrize("which", ["rhs", "jacobian", "source", "observer"])
@pytest.mark.parametrize("error", [KeyError("an object of its own"), KeyboardInterrupt()])
def test_exceptions_come_out_unchanged(which, error):
    def late(result):
        def function(t, *rest):
            if t > (-1 if which == "jacobian" else 0.35):
                raise error
            return result
        return function

    if which == "source":
        run = {"system": LinearOde(-1.0, late([0.0]))}
    else:
        run = {"system": OdeSystem(1, late([0.0]) if which == "rhs" else decay, late([[1.0]]) if which == "jacobian" else None)}
    for steps in ({"h": 0.1}, {"tol": 1e-4}):
        with pytest.raises(type(error)) as caught:
            solve_ode(**run, t_span=(0, 1), y0=1.0, **steps, observer=late(False) if which == "observer" else None)
        assert caught.value is error


@pytest.mark.parametrize("value, error, match", [
    (None, TypeError, "rhs returned None"), ([1.0, 2.0, 3.0], ValueError, r"rhs returned an array of shape \(3,\)"),
    ([1j, 0], TypeError, "rhs returned an array of complex")])
def test_results_that_cannot_be(value, error, match):
    with pytest.raises(error, match=match):
        solve_ode(lambda t, y: value, (0, 1), [1.0, 2.0], h=0.1)
    jacobian = match.replace("rhs", "jacobian").replace(r"\(3,\)", r"\(3,\), expected \(2, 2\)")
    with pytest.raises(error, match=jacobian):
        solve_ode(OdeSystem(2, decay, lambda t, y: value), (0, 1), [1.0, 2.0], h=0.1)


def test_failures_are_solutions():
    def root(t, y):
        if y[0] < 0:
            raise OutOfDomain
        return [-1.0]
    for rhs in (root, lambda t, y: [-1.0 if y[0] >= 0 else np.nan]):
        s = solve_ode(rhs, (0, 2), 1.0, h=0.25)
        assert not s.success and s.t[-1] == pytest.approx(1.0) and s.message and s.y[0, -1] == pytest.approx(0.0, abs=1e-12)
    assert "rhs" in solve_ode(lambda t, y: [np.nan], (0, 1), 1.0, h=0.1).message


def test_compiled_functions_give_the_same_bits():
    numba = pytest.importorskip("numba")

    @numba.cfunc(dynstep.signature("rhs"))
    def compiled(n, t, y, f, ctx):
        k = numba.carray(ctx, 1, numba.float64)[0]
        f[0] = k*y[0]*(1 - y[1])
        f[1] = -y[1]*(1 - y[0])
        return 0

    @numba.cfunc(dynstep.signature("jacobian"))
    def jacobian(n, t, y, jac, ctx):
        k = numba.carray(ctx, 1, numba.float64)[0]
        jac[0] = k*(1 - y[1])
        jac[1] = y[1]
        jac[2] = -k*y[0]
        jac[3] = y[0] - 1
        return 0

    def matrix(t, y, k):
        return [[k*(1 - y[1]), -k*y[0]], [y[1], y[0] - 1]]

    @dynstep.signature("rhs", "ctypes")
    def native(n, t, y, f, ctx):
        y, f = ((ctypes.c_double*2).from_address(x) for x in (y, f))
        k = ctypes.c_double.from_address(ctx).value
        f[:] = k*y[0]*(1 - y[1]), -y[1]*(1 - y[0])
        return 0

    k = np.array([1.25])
    run = {"t_span": (0, 2), "y0": VOLTERRA, "h": 0.1}
    plain = solve_ode(OdeSystem(2, volterra, matrix, args=(1.25,)), **run)
    for system in (OdeSystem(2, compiled, jacobian, user_data=k),
                   OdeSystem(2, dynstep.compiled(native, k), dynstep.compiled(jacobian, k))):
        s = solve_ode(system, **run)
        assert np.array_equal(s.y, plain.y) and np.array_equal(s.yp, plain.yp) and s.counts == plain.counts
    assert np.array_equal(solve_ode(dynstep.compiled(compiled, k), **run).y, solve_ode(volterra, **run, args=1.25).y)
    with pytest.raises(TypeError, match="rhs is compiled as"):
        OdeSystem(2, numba.cfunc("float64(float64)")(lambda x: x))
    assert dynstep.signature("rhs", "c") == "int rhs(int n, double t, const double *y, double *f, void *ctx)"


# ---- Methods ----

def test_methods_are_values():
    assert BI() == BI(4) == BI((4, 4), 0.5) == BI.f_stable(4) != BI(3) and BI.f_stable(2) == BI(1)
    assert [m.order for m in (BI(1), BI(2), BI(3), BI(4), BI(5), BI((4, 5), 0.44))] == [2, 2, 4, 4, 6, 4]
    assert BI((4, 5), 0.44).orders == (4, 5) and BI(halves="fehlberg").orders is None
    assert repr(BI((4, 5), 0.44)) == "BI(order=(4, 5), alpha=0.44)" and repr(Pade(3, 4)) == "Pade(p=3, q=4)"
    assert repr(BI(halves="fehlberg", newton=Newton(9))) == (
        "BI(alpha=0.5, halves='fehlberg', newton=Newton(limit=9, halvings=20, tolerance=0.0))")
    for m in (BI((4, 5), 0.44), BI(halves="fehlberg"), Pade(2, 3), BIExtrapolation(3, 2), BIExtrapolation(2, 4, (1, 3))):
        assert pickle.loads(pickle.dumps(m)) == m == eval(repr(m)) and hash(m) == hash(pickle.loads(pickle.dumps(m)))
    assert Pade().order == 8 and Pade(2, 3).order == 5 and BIExtrapolation(3, 2).base == BI(1)
    assert [BIExtrapolation(k, p).order for k, p in ((1, 2), (3, 2), (1, 4), (3, 4))] == [2, 6, 4, 8]
    assert BI().stability_limit() == Pade(2, 4).stability_limit(0.1) == BI((4, 5), 0.44).stability_limit() == np.inf
    assert BI(4, 1.0).stability_limit() == pytest.approx(np.sqrt(8)) and BI(1, 1.0).stability_limit() == 0
    assert dynstep.stability_domain("bi").is_f_stable and dynstep.stability_domain(BI(5)).a_angle == pytest.approx(77.712, abs=1e-3)
    assert dynstep.stability_function("pade", 1.0) == pytest.approx(np.e) and dynstep.stability_domain(Pade(3, 4)).is_l_stable
    assert {"pade", "bi", "bi45", "bi-extrapolation"} <= set(dynstep.methods()) and "bi45" in str(dynstep.methods())


@pytest.mark.parametrize("make, error, match", [
    (lambda: BI.f_stable(6), ValueError, r"BI\(5, 5\), has poles in the left half-plane"),
    (lambda: BI(0), ValueError, "order = 0"), (lambda: BI((4, 6)), ValueError, r"order\[1\] = 6"),
    (lambda: BI((4,)), ValueError, "order must be"), (lambda: BI(4.0), TypeError, "order"),
    (lambda: BI(4, 1.5), ValueError, "alpha = 1.5"), (lambda: BI(4, "x"), TypeError, "alpha"),
    (lambda: BI(halves="euler"), ValueError, "halves must be one of"), (lambda: BI(4, halves="fehlberg"), ValueError, "order = 4"),
    (lambda: BI(newton=3), TypeError, "newton"), (lambda: Pade(-1), ValueError, "p = -1"), (lambda: Pade(4, 9), ValueError, "q = 9"),
    (lambda: Pade(0, 0), ValueError, "both be 0"), (lambda: Pade(2.0), TypeError, "p must be an integer"),
    (lambda: BIExtrapolation(0), ValueError, "levels"), (lambda: BIExtrapolation(3, 3), ValueError, "order = 3 must be 2 or 4"),
    (lambda: BIExtrapolation(3, 2, "none"), ValueError, "sequence"), (lambda: BI(5).stability_limit(0.1), ValueError, "not A-stable")])
def test_options_out_of_range_are_named(make, error, match):
    with pytest.raises(error, match=match):
        make()


def test_plot_of_unknowns():
    plt = pytest.importorskip("matplotlib.pyplot")
    s = solve_ode(volterra, (0, 1), VOLTERRA, h=0.1)
    figure, axes = plt.subplots(2)
    assert len(s.plot(ax=axes[0]).lines) == 2 and s.plot(0, of="yp", ax=axes[1]).get_ylabel() == "y'"
    with pytest.raises(ValueError, match="of must be one of 'y', 'yp'"):
        s.plot(of="q", ax=axes[0])
    plt.close(figure)


@pytest.mark.parametrize("options, points", [
    ({}, 1), ({"dense_output": True}, 1), ({"t_eval": [0.0, 0.5]}, 1), ({"t_eval": [0.5]}, 0)])
def test_a_start_that_fails_is_kept(options, points):
    s = solve_ode(lambda t, y: y*np.nan, (0, 1), [1.0, 2.0], h=0.1, **options)
    assert not s.success and s.t.size == points and s.y.shape == s.yp.shape == (2, points) and s.sol is None
    if points:
        assert s.t[0] == 0.0 and s.y[:, 0].tolist() == [1.0, 2.0] and np.isnan(s.yp).all()


def test_what_takes_no_first_order_system_says_so():
    system = dynstep.OdeSystem(1, lambda t, y: -y)
    for refuse in (lambda: dynstep.check_system(system, 0.0, [1.0], [0.0]), lambda: dynstep.Integrator(system)):
        with pytest.raises(TypeError, match="OdeSystem, which goes with solve_ode"):
            refuse()


def test_orders_in_a_list():
    assert dynstep.BI([4, 5], 0.44) == dynstep.BI((4, 5), 0.44)
