# SPDX-License-Identifier: BSD-3-Clause
"""dynstep.scipy: what scipy's own tests ask of its solvers, and agreement with its Radau."""
import subprocess
import sys
import warnings

import numpy as np
import pytest

import dynstep

pytest.importorskip("scipy")
from scipy import sparse                                        # noqa: E402
from scipy.integrate import solve_ivp                           # noqa: E402

from dynstep.scipy import BI, BI44, BI45, BI55, BIExtrapolation  # noqa: E402

SOLVERS = BI, BI44, BI45, BI55, BIExtrapolation
SPANS = (5, 9), (5, 1)
Y0 = 1/3, 2/9
RTOL, ATOL = 1e-3, 1e-6

each = pytest.mark.parametrize("solver", SOLVERS)
each_span = pytest.mark.parametrize("span", SPANS)


def rational(t, y):
    """y1' = y2/t, y2' = y2 (y1 + 2 y2 - 1)/(t (y1 - 1)): the solution is rational; columns of states, too."""
    return np.array([y[1]/t, y[1]*(y[0] + 2*y[1] - 1)/(t*(y[0] - 1))])


def rational_jacobian(t, y):
    return np.array([[0, 1/t], [-2*y[1]**2/(t*(y[0] - 1)**2), (y[0] + 4*y[1] - 1)/(t*(y[0] - 1))]])


def rational_solution(t):
    return np.array([t/(t + 10), 10*t/(t + 10)**2])


def weighted(y, exact, rtol=RTOL, atol=ATOL):
    """Error in units of the tolerance, the largest of the root mean squares over the components."""
    return np.sqrt(np.mean(((y - exact)/(atol + rtol*np.abs(exact)))**2, axis=0)).max()


def check_rational(result, span):
    assert result.success and result.status == 0
    assert result.t[0] == span[0] and result.t[-1] == span[1]
    assert weighted(result.y, rational_solution(result.t)) < 5
    times = np.linspace(*span)
    assert weighted(result.sol(times), rational_solution(times)) < 5
    assert weighted(result.sol(times[7])[:, np.newaxis], rational_solution(times[7:8])) < 5
    np.testing.assert_allclose(result.sol(result.t), result.y, rtol=1e-15, atol=1e-15)


# ---- What solve_ivp offers ----

@each
@each_span
@pytest.mark.parametrize("vectorized", (False, True))
@pytest.mark.parametrize("jac", (None, rational_jacobian, lambda t, y: sparse.csc_matrix(rational_jacobian(t, y))))
def test_integration(solver, span, vectorized, jac):
    calls = []

    def fun(t, y):
        calls.append(y.ndim)
        return rational(t, y)
    result = solve_ivp(fun, span, Y0, method=solver, rtol=RTOL, atol=ATOL, dense_output=True, jac=jac, vectorized=vectorized)
    check_rational(result, span)
    assert result.t_events is None and result.y_events is None
    # differences are no evaluations of f: a column at once of each of them, or f and two of its columns
    per_jacobian = 0 if jac is not None else 2 if vectorized else 3
    assert result.nfev == len(calls) - per_jacobian*result.njev
    assert 0 < result.njev <= result.nfev and 0 < result.nlu
    assert set(calls) == ({2} if vectorized else {1})
    assert result.t.size - 1 <= 8


@each
def test_jacobian_is_a_matrix(solver):
    matrix = np.array([[-1.0, -5.0], [1.0, 1.0]])
    for jac in (matrix, matrix.tolist(), sparse.csc_matrix(matrix)):
        result = solve_ivp(lambda t, y: matrix @ y, (0, 2), [0, 2], method=solver, rtol=1e-5, atol=1e-8, jac=jac, dense_output=True)
        exact = np.vstack((-5*np.sin(2*result.t), 2*np.cos(2*result.t) + np.sin(2*result.t)))
        assert result.success and result.njev == 0 and result.nlu > 0
        assert weighted(result.y, exact, 1e-5, 1e-8) < 100
    with pytest.raises(ValueError, match=r"jac has the shape \(2, 3\), expected \(2, 2\)"):
        solver(lambda t, y: -y, 0, [1.0, 2.0], 1, jac=np.zeros((2, 3)))


@pytest.mark.parametrize("given", (False, True))
@pytest.mark.parametrize("vectorized", (False, True))
def test_band(given, vectorized):
    """Heat in a rod: f and bands of a Jacobian with other numbers of diagonals below and above, both ways."""
    n = 12
    lower, upper = np.full(n - 2, 4.0), np.full(n - 1, 9.0)
    matrix = np.diag(np.full(n, -30.0)) + np.diag(lower, -2) + np.diag(upper, 1)
    packed = np.zeros((4, n))
    packed[0, 1:], packed[1], packed[3, :-2] = upper, -30.0, lower
    calls = []

    def fun(t, y):
        calls.append(t)
        return matrix @ y
    options = dict(method=BI45, rtol=1e-6, atol=1e-9, vectorized=vectorized)
    banded = solve_ivp(fun, (0, 1), np.ones(n), lband=2, uband=1, jac=packed if given else None, **options)
    of_band = len(calls)
    full = solve_ivp(fun, (0, 1), np.ones(n), **options)
    np.testing.assert_allclose(banded.y[:, -1], full.y[:, -1], rtol=1e-6)
    if not given and not vectorized:
        assert of_band - banded.nfev == 5*banded.njev and len(calls) - of_band - full.nfev == 13*full.njev


@each
def test_difference_at_the_edge(solver):
    """A root that does not bear a step forward of its argument: differences go the other way."""
    result = solve_ivp(lambda t, y: np.where(y > 1.0, np.nan, -np.sqrt(np.abs(2.0 - y))), (0, 1), [1.0], method=solver)
    assert result.success
    np.testing.assert_allclose(result.y[0, -1], 2.0 - 1.5**2, rtol=1e-3)


@each
@each_span
def test_limits_of_steps(solver, span):
    result = solve_ivp(rational, span, Y0, method=solver, max_step=0.5, first_step=0.1, dense_output=True)
    check_rational(result, span)
    assert np.abs(np.diff(result.t)).max() <= 0.5 + 1e-15
    np.testing.assert_allclose(abs(result.t[1] - 5), 0.1)
    for name, value in (("max_step", -1), ("max_step", 0), ("max_step", np.nan), ("first_step", -1), ("first_step", 0),
                        ("first_step", 5), ("min_step", -1)):
        with pytest.raises(ValueError, match=name):
            solver(rational, span[0], Y0, span[1], **{name: value})
    late = solver(rational, span[0], Y0, span[1], max_step=1e-20)
    assert "step size is less" in late.step()
    assert late.status == "failed"
    with pytest.raises(RuntimeError):
        late.step()


@each
@each_span
def test_t_eval(solver, span):
    times = np.array([span[0], *np.linspace(*span, 9)[1:6] + 0.01])
    result = solve_ivp(rational, span, Y0, method=solver, t_eval=times)
    assert np.array_equal(result.t, times) and result.y.shape == (2, 6)
    assert weighted(result.y, rational_solution(times)) < 5
    both = solve_ivp(rational, span, Y0, method=solver, t_eval=times, dense_output=True)
    assert np.array_equal(both.t, times) and np.array_equal(both.y, result.y)
    many = np.linspace(*span)
    assert weighted(both.sol(many), rational_solution(many)) < 5
    assert solve_ivp(rational, span, Y0, method=solver, t_eval=[]).y == []


@each
@each_span
def test_events(solver, span):
    def first(t, y):
        return y[0] - y[1]**0.7

    def second(t, y):
        return y[1]**0.6 - y[0]

    def at_half(t, y):
        return t - (span[0] + span[1])/2

    reference = solve_ivp(rational, span, Y0, method="DOP853", rtol=1e-11, atol=1e-12, events=(first, second, at_half))
    result = solve_ivp(rational, span, Y0, method=solver, rtol=RTOL, atol=ATOL, events=(first, second, at_half))
    assert result.status == 0
    for found, known, at, exact in zip(result.t_events, reference.t_events, result.y_events, reference.y_events):
        assert len(found) == len(known)
        np.testing.assert_allclose(found, known, rtol=2e-3)
        np.testing.assert_allclose(at, exact, rtol=2e-3)
    at_half.direction = np.sign(span[0] - span[1])
    assert solve_ivp(rational, span, Y0, method=solver, events=at_half).t_events[0].size == 0
    at_half.direction = -at_half.direction
    at_half.terminal = True
    ended = solve_ivp(rational, span, Y0, method=solver, events=at_half, dense_output=True)
    assert ended.status == 1 and ended.success
    np.testing.assert_allclose(ended.t[-1], (span[0] + span[1])/2, rtol=1e-14)
    np.testing.assert_allclose(ended.sol(ended.t[-1]), ended.y[:, -1], rtol=1e-14)
    assert weighted(ended.y[:, -1:], rational_solution(ended.t[-1:])) < 5


@each
def test_event_that_ends_the_second_time(solver):
    def crossing(t, y):
        return y[0]
    crossing.terminal = 2
    result = solve_ivp(lambda t, y: [y[1], -y[0]], (0, 20), [1.0, 0.0], method=solver, rtol=1e-6, atol=1e-8, events=crossing)
    np.testing.assert_allclose(result.t_events[0], [np.pi/2, 3*np.pi/2], rtol=1e-5)
    assert result.status == 1 and result.t[-1] == result.t_events[0][1]


@each
def test_arguments(solver):
    """args go to f, the Jacobian and events."""
    def event(t, y, a, b):
        return y[0] - 0.5*b
    given = dict(method=solver, args=(-2.0, 1.0), jac=lambda t, y, a, b: [[a]], events=event, rtol=1e-6)
    result = solve_ivp(lambda t, y, a, b: a*y, (0, 1), [1.0], **given)
    np.testing.assert_allclose(result.t_events[0], np.log(2)/2, rtol=1e-5)
    np.testing.assert_allclose(result.y[0, -1], np.exp(-2), rtol=1e-5)


# ---- Ends and corners ----

@each
def test_no_interval(solver):
    result = solve_ivp(lambda t, y: -y, (4, 4), [2, 3], method=solver, dense_output=True)
    assert result.success and np.array_equal(result.sol([4, 5, 6]), [[2, 2, 2], [3, 3, 3]])
    made = solver(lambda t, y: -y, 0.0, [10.0, 0.0], 0.0)
    assert made.step() is None and made.status == "finished"
    assert np.array_equal(made.dense_output()(0.0), [10.0, 0.0])


@each
def test_no_unknowns(solver):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for end in (10, np.inf):
            result = solve_ivp(lambda t, y: np.zeros(0), (0, end), np.zeros(0), method=solver, dense_output=True)
            assert np.array_equal(result.sol([1, 2, 3]), np.zeros((0, 3)))
        made = solver(lambda t, y: -y, 0.0, [], np.inf)
        made.step()
        assert made.status == "finished"


@each
@pytest.mark.parametrize("end", (np.inf, -np.inf))
def test_states_of_a_solver(solver, end):
    start = np.array(Y0)
    made = solver(rational, 5, start, end)
    assert (made.n, made.status, made.t_bound, made.direction, made.t) == (2, "running", end, np.sign(end), 5)
    assert np.array_equal(made.y, Y0) and made.step_size is None and made.nfev > 0 and made.njev >= 0 and made.nlu == 0
    with pytest.raises(RuntimeError):
        made.dense_output()
    assert made.step() is None
    assert made.status == "running" and made.step_size > 0 and (made.t - 5)*end > 0 and made.nfev > 1 and made.nlu > 0
    np.testing.assert_allclose(made.dense_output()(5), Y0, rtol=1e-15)
    np.testing.assert_array_equal(made.dense_output()(made.t), made.y)
    assert made.dense_output()([5, made.t]).shape == (2, 2)
    with pytest.raises(ValueError):
        made.dense_output()(np.zeros((2, 2)))
    assert np.array_equal(start, Y0)


@each
def test_step_behind_the_end(solver):
    made = solver(lambda t, y: -y, 0.0, [1.0], 0.1)
    while made.status == "running":
        made.step()
    assert made.status == "finished" and made.t == 0.1
    with pytest.raises(RuntimeError, match="failed or finished"):
        made.step()


@each
def test_no_motion(solver):
    result = solve_ivp(lambda t, y: np.zeros_like(y), (0, 10), np.ones(3), method=solver)
    assert result.success
    np.testing.assert_allclose(result.y, 1.0, rtol=1e-15)


@each
@pytest.mark.parametrize("end", (1e-4, 2.0, 205.0))
def test_end_is_kept(solver, end):
    """f is not asked for behind the end; it depends on t alone, where the classical formula's own error sees nothing."""
    def fun(t, y):
        assert 0.0 <= t <= end
        return [0.1*np.cos(t)]
    result = solve_ivp(fun, (0, end), [1.0], method=solver, dense_output=True)
    assert result.success and result.t[-1] == end
    np.testing.assert_allclose(result.y[0, -1], 1 + 0.1*np.sin(end), rtol=1e-3)


# ---- Bad input and faults ----

@each
def test_bad_input(solver):
    for name, value in (("rtol", [1e-3, 1e-3]), ("rtol", -1.0), ("rtol", np.nan), ("atol", -1.0), ("atol", [1, 2, 3]),
                        ("atol", np.nan), ("lband", -1), ("uband", 2)):
        with pytest.raises(ValueError, match=name):
            solver(rational, 5, Y0, 9, **{name: value})
    with pytest.raises(ValueError, match="complex"):
        solve_ivp(lambda t, y: -y, (0, 1), [1 + 1j], method=solver)
    with pytest.raises(ValueError, match="finite"):
        solve_ivp(lambda t, y: -y, (0, 1), [np.nan], method=solver)
    with pytest.raises(ValueError, match="1-dimensional"):
        solver(lambda t, y: -y, 0, [[1.0]], 1)
    with pytest.raises(ValueError, match="rhs"):
        solve_ivp(lambda t, y: [1.0, 2.0, 3.0], (0, 1), [1.0, 2.0], method=solver)
    with pytest.warns(UserWarning, match="nothing_known"):
        assert solve_ivp(lambda t, y: -y, (0, 1), [1.0], method=solver, nothing_known=3).success
    with pytest.warns(UserWarning, match="rtol = 1e-17 is too small"):
        solver(lambda t, y: -y, 0, [1.0], 1, rtol=1e-17)


@each
def test_exceptions_come_out(solver):
    class Refusal(Exception):
        pass

    def fun(t, y):
        if t > limit:
            raise Refusal(t)
        return -y

    def jac(t, y):
        raise Refusal("jac")
    for limit in (-1.0, 0.5):
        with pytest.raises(Refusal):
            solve_ivp(fun, (0, 1), [1.0], method=solver)
    limit = 2.0
    with pytest.raises(Refusal, match="jac"):
        solve_ivp(lambda t, y: -y**2, (0, 1), [1.0], method=solver, jac=jac)


@each
def test_failure_is_told(solver):
    result = solve_ivp(lambda t, y: y**2, (0, 2), [1.0], method=solver, rtol=1e-6, atol=1e-8)
    assert not result.success and result.status == -1
    assert 0.99 < result.t[-1] <= 1.0 + 1e-6 and "t = " in result.message and np.isfinite(result.y).all()
    never = solve_ivp(lambda t, y: np.full(1, np.nan), (0, 1), [1.0], method=solver)
    assert not never.success and never.t.size == 1 and "t = 0" in never.message
    behind = solve_ivp(lambda t, y: np.full(1, np.nan if t > 0 else 1.0), (0, 1), [1.0], method=solver)
    assert not behind.success and behind.t.size == 1 and "t = 0" in behind.message and "begin" not in behind.message
    short = solve_ivp(lambda t, y: -50*np.sin(50*t)*y, (0, 1), [1.0], method=solver, min_step=0.5, rtol=1e-8)
    assert not short.success and short.message


@each
def test_nodes_that_fail(solver):
    """Dense output asks f inside the step; where it refuses, the polynomial goes through what there is."""
    asked = []

    def fun(t, y):
        asked.append(t)
        return np.array([np.nan]) if refuse and t > 0 else -y
    refuse = False
    made = solver(fun, 0.0, [1.0], 1.0)
    made.step()
    refuse = True
    before = len(asked)
    output = made.dense_output()
    assert (len(asked) > before) == (solver in (BI55, BIExtrapolation))
    np.testing.assert_allclose(output(made.t/2)[0], np.exp(-made.t/2), rtol=2e-3)


# ---- Options, order, agreement ----

def test_options():
    def run(solver, **options):
        return solve_ivp(rational, (5, 9), Y0, method=solver, **options)
    assert np.array_equal(run(BI44).y, run(BI).y)
    assert np.array_equal(run(BI45).y, run(BI, order=(4, 5), alpha=0.44).y)
    assert np.array_equal(run(BI44, alpha=0.4).y, run(BI, alpha=0.4).y)
    assert np.array_equal(run(BI55).y, run(BI, order=5).y)
    assert run(BI, halves="fehlberg").success
    assert run(BIExtrapolation, levels=3, order=2, sequence="double-harmonic").success
    for options in (dict(alpha=2.0), dict(order=7)):
        with pytest.raises(ValueError, match=next(iter(options))):
            run(BI, **options)
    with pytest.raises(ValueError, match="levels"):
        run(BIExtrapolation, levels=0)


@pytest.mark.parametrize("solver, options, order", ((BI44, {}, 4), (BI45, {}, 4), (BI55, {}, 6),
                                                    (BIExtrapolation, {"levels": 2}, 6)))
def test_order_of_dense_output(solver, options, order):
    """Steps of one length, loose tolerances: the largest error between the steps falls like h^order."""
    def error(h):
        result = solve_ivp(lambda t, y: [y[1], -np.sin(y[0])], (0, 4), [1.0, 0.5], method=solver, rtol=1.0, atol=1.0, first_step=h,
                           max_step=h, dense_output=True, **options)
        assert result.t.size == round(4/h) + 1
        times = np.linspace(0, 4, 333)
        return np.abs(result.sol(times) - exact.sol(times)).max()
    exact = solve_ivp(lambda t, y: [y[1], -np.sin(y[0])], (0, 4), [1.0, 0.5], method="DOP853", rtol=1e-13, atol=1e-14,
                      max_step=0.02, dense_output=True)
    errors = [error(h) for h in (0.5, 0.25, 0.125)]
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert slopes[-1] > order - 0.3, slopes


def kinetics(t, y):
    """A chain of reactions with rates that are a factor of 500 apart (Robertson's form, milder)."""
    slow, fast, square = 0.04*y[0], 20.0*y[1]*y[2], 50.0*y[1]**2
    return np.array([-slow + fast, slow - fast - square, square])


def van_der_pol(t, y):
    return np.array([y[1], 10*(1 - y[0]**2)*y[1] - y[0]])


def lotka_volterra(t, y):
    return np.array([1.5*y[0] - y[0]*y[1], -3*y[1] + y[0]*y[1]])


@each
@pytest.mark.parametrize("fun, y0, end, level", ((kinetics, [1.0, 0.0, 0.0], 40.0, 0.9), (van_der_pol, [2.0, 0.0], 20.0, 0.0),
                                                 (lotka_volterra, [10.0, 5.0], 10.0, 3.0)))
def test_agreement_with_radau(solver, fun, y0, end, level):
    """Ends, dense output and events within ten times what Radau misses at the same tolerance, or a hundred tolerances."""
    def crossing(t, y):
        return y[0] - level
    given = dict(t_span=(0, end), y0=y0, events=crossing, dense_output=True)
    rtol, atol = 1e-6, 1e-8
    exact = solve_ivp(fun, method="DOP853", rtol=1e-12, atol=1e-14, **given)
    radau = solve_ivp(fun, method="Radau", rtol=rtol, atol=atol, **given)
    result = solve_ivp(fun, method=solver, rtol=rtol, atol=atol, **given)
    assert result.success
    times = np.linspace(0, end, 777)

    def miss(run):
        slopes = np.array([fun(t, y) for t, y in zip(times, exact.sol(times).T)]).T
        # a solution of relaxation has its error along the path, in time
        scale = atol + rtol*(np.abs(exact.sol(times)) + np.abs(slopes))
        return (np.abs(run.sol(times) - exact.sol(times))/scale).max()
    assert miss(result) < max(10*miss(radau), 100)
    found, known = result.t_events[0], exact.t_events[0]
    assert found.size == known.size == radau.t_events[0].size > 0
    assert np.abs(found - known).max() < max(10*np.abs(radau.t_events[0] - known).max(), 100*rtol)


def test_scipy_is_optional():
    """The package is imported without scipy; dynstep.scipy asks for it."""
    code = ("import sys; import dynstep; assert not any(m.startswith('scipy') for m in sys.modules)\n"
            "dynstep.scipy.BI45\nimport scipy\nassert dynstep.scipy is not scipy\n"
            "try: dynstep.nothing\nexcept AttributeError: pass\nelse: raise SystemExit(1)")
    subprocess.run([sys.executable, "-c", code], check=True)
    assert dynstep.scipy.BI45 is BI45
