# SPDX-License-Identifier: BSD-3-Clause
"""Steps by rtol and atol."""
import numpy as np
import pytest
from problems import ROD_START, rod

from dynstep import LinearSystem, MechanicalSystem, OdeSystem, solve, solve_ode


def orbit(**options):
    """Two bodies, e = 0.6; period 2 pi."""
    return MechanicalSystem(2, lambda t, q, v: -q/np.hypot(*q)**3, velocity_free=True, **options)


ORBIT = (0, 2*np.pi), [0.4, 0.0], [0.0, 2.0]


def error(s):
    return np.hypot(*(s.q[:, -1] - ORBIT[1]))


def test_errors_follow_the_tolerance():
    runs = [solve(orbit(), *ORBIT, rtol=10.0**-k, atol=10.0**-k) for k in (5, 7, 9)]
    errors, steps = [error(s) for s in runs], [s.counts["steps"] for s in runs]
    assert all(s.success for s in runs) and errors[0] > 30*errors[1] > 900*errors[2] and errors[2] < 1e-6
    assert steps == sorted(steps) and all(np.abs(np.diff(s.t)).min() > 0 for s in runs)
    assert solve(orbit(), *ORBIT).counts == solve(orbit(), *ORBIT, rtol=1e-6, atol=1e-8).counts
    s = solve_ode(lambda t, y: [y[1], -y[0]], (0, 10), [1.0, 0.0], rtol=1e-9, atol=1e-9)
    assert np.abs(s.y[0] - np.cos(s.t)).max() < 1e-7


def test_forms_of_atol():
    n = 2
    def counts(atol):
        return solve(orbit(), *ORBIT, rtol=0, atol=atol).counts
    assert counts(1e-7) == counts([1e-7]*4) == counts((1e-7, 1e-7)) == counts(dict(q=1e-7, v=1e-7)) == counts(
        dict(q=[1e-7]*n, v=1e-7)) == counts(np.full(2*n, 1e-7))
    assert counts(dict(q=1e-7)) == counts((1e-7, 1e-8)) == counts([1e-7, 1e-7, 1e-8, 1e-8]) != counts(1e-7)
    assert counts((1.0, [1e-6, 1.0])) == counts([1.0, 1.0, 1e-6, 1.0]) != counts([1.0, 1.0, 1.0, 1e-6])
    assert counts(None) == counts(1e-8) == counts({})
    system = OdeSystem(2, lambda t, y: [y[1], -y[0]])
    both = [solve_ode(system, (0, 5), [1.0, 0.0], rtol=0, atol=atol).counts for atol in (1e-6, [1e-6, 1e-6], dict(y=1e-6))]
    assert both[0] == both[1] == both[2]


@pytest.mark.parametrize("options, error, words", [
    (dict(atol=-1), ValueError, "atol of q = -1 must be 0 or more"), (dict(atol=[1, 2, 3]), ValueError, r"atol has the shape \(3,\)"),
    (dict(atol=[1]*6), ValueError, r"atol of q has the shape \(3,\)"), (dict(atol=dict(w=1)), ValueError, "key 'w'"),
    (dict(atol=dict(lam=1.0)), ValueError, "no constraints"), (dict(atol=dict(q=[1, -1])), ValueError, r"atol of q\[1\] = -1"),
    (dict(atol=np.nan), ValueError, "atol"), (dict(atol="small"), TypeError, "atol"), (dict(atol=np.eye(2)), ValueError, "atol"),
    (dict(rtol=-1e-6), ValueError, "rtol"), (dict(rtol=[1, 2]), TypeError, "rtol"), (dict(rtol=0, atol=0), ValueError, "rtol = 0 and atol"),
    (dict(h_first=-0.1), ValueError, "h_first"), (dict(h_max=-0.1), ValueError, "h_max"), (dict(h_min=-0.1), ValueError, "h_min"),
    (dict(tol=1e-3, h_min=0.1), ValueError, "h_min goes without tol"), (dict(every=2), ValueError, "every = 2 goes with h"),
    (dict(method="newmark"), ValueError, "no error estimate"),
])
def test_wrong_tolerances_are_named(options, error, words):
    with pytest.raises(error, match=words):
        solve(orbit(), *ORBIT, **options)


def test_tolerances_below_rounding():
    s = solve(orbit(), *ORBIT, rtol=1e-17, atol=0)
    assert s.status == -14 and "rounding" in s.message
    assert s.t.size == 1 and np.array_equal(s.q[:, 0], ORBIT[1]) and np.array_equal(s.v[:, 0], ORBIT[2])
    assert np.abs(s.a[:, 0] - [-6.25, 0.0]).max() < 1e-14
    assert solve(orbit(), *ORBIT, rtol=1e-17, atol=0, t_eval=[1.0]).t.size == 0
    assert solve(orbit(), *ORBIT, rtol=1e-17, atol=0, t_eval=[0.0, 1.0], dense_output=True).t.size == 1
    s = solve_ode(lambda t, y: -y, (0, 1), [1.0, 2.0], rtol=1e-17, atol=0)
    assert s.status == -14 and np.array_equal(s.y, [[1.0], [2.0]]) and np.array_equal(s.yp, -s.y)
    # on the way: the state grows beside its atol
    s = solve(MechanicalSystem(1, lambda t, q, v: q), (0, 40), 1.0, 1.0, rtol=0, atol=1e-9)
    assert s.status == -14 and s.t.size > 3 and 0 < s.t[-1] < 40


def test_limits_of_steps():
    longest = np.diff(solve(orbit(), *ORBIT, h_max=0.05).t).max()
    assert longest <= 0.05*(1 + 1e-12)
    assert solve(orbit(), *ORBIT, h_first=1e-3).t[1] == 1e-3
    s = solve(orbit(), *ORBIT, rtol=1e-10, atol=1e-10, h_min=0.5)
    assert s.status == -5 and "h_min" in s.message and s.t[-1] < 6.0
    s = solve(LinearSystem(1.0, K=1.0), (0, -3), 1.0, 0.0, rtol=1e-8, atol=1e-8)
    assert s.success and s.t[-1] == -3.0 and abs(s.q[0, -1] - np.cos(3.0)) < 1e-6


def test_multipliers_of_a_system_with_constraints():
    """Their tolerances are taken, or the method says that it has no estimate."""
    try:
        s = solve(rod(), (0, 0.2), *ROD_START, atol=dict(lam=1e-4))
    except ValueError as refusal:
        assert "no error estimate" in str(refusal)
    else:
        assert s.success and s.lam.shape[0] == 1
    with pytest.raises(ValueError, match="atol of lam = -1"):
        solve(rod(), (0, 0.2), *ROD_START, atol=dict(lam=-1.0))


def test_dense_output_and_times():
    times = np.linspace(0, 6, 40)
    asked = solve(orbit(), *ORBIT, rtol=1e-9, t_eval=times)
    dense = solve(orbit(), *ORBIT, rtol=1e-9, t_eval=times, dense_output=True)
    assert np.array_equal(asked.t, times) and np.abs(asked.q - dense.q).max() < 1e-6      # of interpolants
    assert asked.counts["steps"] == dense.counts["steps"]
