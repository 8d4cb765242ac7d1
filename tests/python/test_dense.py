# SPDX-License-Identifier: BSD-3-Clause
"""Dense output of the order of the method, levels by the error, the stability warning."""
import warnings

import numpy as np
import pytest

import dynstep
from dynstep import BIExtrapolation, MidpointExtrapolation, NewmarkExtrapolation, StabilityWarning, solve, solve_ode

ORBIT = (0, 2*np.pi), [0.5, 0.0], [0.0, np.sqrt(3.0)]                    # e = 1/2


def orbit():
    return dynstep.MechanicalSystem(2, lambda t, q, v: -q/np.hypot(*q)**3, velocity_free=True)


@pytest.mark.parametrize("method, order", [("newmark", 2), (NewmarkExtrapolation(3), 6), (NewmarkExtrapolation(4), 8), ("bi", 4)])
def test_sol_has_the_order_of_the_method(method, order):
    spring = dynstep.MechanicalSystem(1, lambda t, q, v: -q, velocity_free=True)
    t = np.linspace(0, 4, 333)
    errors = []
    for h in 0.8, 0.4:
        q, v, a = solve(spring, (0, 4), 1.0, 0.0, method, h=h, dense_output=True).sol(t)
        errors.append([np.abs(x + y).max() for x, y in ((q, -np.cos(t)), (v, np.sin(t)), (a, np.cos(t)))])
    assert (np.log2(np.divide(*errors)) > order - 0.5).all()


def test_nodes_are_in_sol_alone():
    for method in "newmark-extrapolation", "bi":
        plain, dense = (solve(orbit(), *ORBIT, method, rtol=1e-9, dense_output=d) for d in (False, True))
        assert all(np.array_equal(getattr(plain, x), getattr(dense, x)) for x in "tqva")
        for x, name in zip(dense.sol(plain.t), "qva"):                  # the last point is the right end of a step
            given = getattr(plain, name)
            assert np.array_equal(x[:, :-1], given[:, :-1]) and np.allclose(x[:, -1], given[:, -1], rtol=1e-12, atol=1e-12)
        assert plain.counts["steps"] == dense.counts["steps"] and plain.counts["forces"] < dense.counts["forces"]
        t = np.linspace(*ORBIT[0], 200)
        by_library = solve(orbit(), *ORBIT, method, rtol=1e-9, t_eval=t)
        by_sol = solve(orbit(), *ORBIT, method, rtol=1e-9, t_eval=t, dense_output=True)
        assert np.abs(by_sol.q - by_library.q).max() < 1e-14 and np.abs(by_sol.a - by_library.a).max() < 1e-12
    s = solve_ode(lambda t, y: [y[1], -y[0]], (0, 5), [1.0, 0.0], "bi-extrapolation", rtol=1e-11, atol=1e-11,
                  dense_output=True)
    t = np.linspace(0, 5, 300)
    assert np.abs(s.sol(t)[0] - np.cos(t)).max() < 1e-9 and np.abs(s.sol.derivative(t)[0] + np.sin(t)).max() < 1e-8


def test_backwards_every_and_many_points():
    s = solve(orbit(), (1.0, -1.0), *ORBIT[1:], h=-0.01, every=50, dense_output=True)
    assert np.allclose(s.t, [1, 0.5, 0, -0.5, -1]) and np.array_equal(s.sol(s.t)[0], s.q)
    n = 300000                                                          # blocks of seven points: nodes cross them
    system = dynstep.LinearSystem(np.ones(n), K=np.ones(n))
    s = solve(system, (0, 2), np.ones(n), np.zeros(n), h=0.25, dense_output=True)
    t = np.linspace(0, 2, 9)[1:] - 0.1
    assert s.t.size == 9 and np.abs(s.sol(t)[0][-1] - np.cos(t)).max() < 1e-9


def test_impacts_are_corners_of_sol():
    floor = dynstep.Event(lambda t, q, v: q[0], -1, False, lambda t, q, v: (q, -0.5*v))
    ball = dynstep.MechanicalSystem(1, lambda t, q, v: [-9.81])
    s = solve(ball, (0, 1), 1.0, 0.0, rtol=1e-10, events=floor, dense_output=True)
    hit = s.t_events[0][0]
    assert (s.t == hit).sum() == 2
    before, behind = s.sol(hit - 1e-9)[1][0], s.sol(hit + 1e-9)[1][0]
    assert before < 0 < behind and abs(behind + 0.5*before) < 1e-6
    t = np.linspace(0, hit, 50)[:-1]
    assert np.abs(s.sol(t)[0][0] - (1 - 0.5*9.81*t**2)).max() < 1e-12
    ends = solve(ball, (0, 3), 1.0, 0.0, rtol=1e-10, dense_output=True,
                 events=dynstep.Event(lambda t, q, v: q[0], -1, True, lambda t, q, v: (q, -0.5*v)))
    hit = ends.t_events[0][0]
    assert ends.status == 3 and (ends.t == hit).sum() == 2 and ends.sol(hit)[1][0] < 0


def test_the_error_chooses_levels():
    def forces(method, k=10):
        s = solve(orbit(), *ORBIT, method, rtol=10.0**-k, atol=10.0**-k)
        assert s.success and np.hypot(*(s.q[:, -1] - ORBIT[1])) < 300*10.0**-k
        return s.counts["forces"]

    explicit = forces(NewmarkExtrapolation(beta=0))
    assert explicit < 0.9*forces(NewmarkExtrapolation(4, beta=0)) and explicit < 0.5*forces(None)
    assert forces(NewmarkExtrapolation(beta=0, max_levels=3)) > 1.3*explicit
    assert forces("midpoint-extrapolation", 8) < forces(MidpointExtrapolation(2), 8)
    assert solve(orbit(), *ORBIT, rtol=1e-7).counts != solve(orbit(), *ORBIT, NewmarkExtrapolation(4), rtol=1e-7).counts
    # with h there are four
    for one, four in ((NewmarkExtrapolation(), NewmarkExtrapolation(4, "harmonic")), (BIExtrapolation(), BIExtrapolation(4, 4, "harmonic")),
                      (NewmarkExtrapolation(sequence=(1, 2, 4)), NewmarkExtrapolation(3, (1, 2, 4)))):
        assert np.array_equal(*(solve(orbit(), *ORBIT, m, h=0.3).q for m in (one, four))) and one.order == four.order


def test_options_of_levels():
    assert NewmarkExtrapolation(max_levels=5) != NewmarkExtrapolation() == NewmarkExtrapolation(None, "automatic")
    assert NewmarkExtrapolation(4, max_levels=5) == NewmarkExtrapolation(4)
    assert repr(NewmarkExtrapolation(max_levels=5)) == "NewmarkExtrapolation(sequence='automatic', beta=0.25, max_levels=5)"
    assert repr(BIExtrapolation(max_levels=5)) == "BIExtrapolation(order=4, sequence='automatic', max_levels=5)"
    for make in NewmarkExtrapolation, MidpointExtrapolation, BIExtrapolation:
        for wrong in dict(max_levels=1), dict(max_levels=13), dict(sequence=(1,)), dict(levels=0), dict(sequence="auto"):
            with pytest.raises(ValueError):
                make(**wrong)
    with pytest.raises(TypeError):
        NewmarkExtrapolation(max_levels="9")
    assert solve(orbit(), *ORBIT, NewmarkExtrapolation(sequence=(1, 2, 3, 5)), rtol=1e-8).success


def test_estimates_of_soi2():
    from problems import ROD_START, rod
    steps = [solve(rod(), (0, 1), *ROD_START, dynstep.SOI2(estimate=e), rtol=1e-5).counts["steps"]
             for e in ("larger", "projected", "raw")]
    assert steps[1] <= steps[0] <= steps[2] and steps[1] < steps[2]
    with pytest.raises(ValueError, match="estimate"):
        dynstep.SOI2(estimate="largest")
    assert dynstep.HHT(estimate="raw") != dynstep.HHT()


def test_steps_beyond_the_limit_are_told():
    system = dynstep.LinearSystem(np.ones(2), K=np.array([1.0, 1e4]))
    for call in (lambda **k: solve(system, (0, 2), [1.0, 0.0], [0.0, 0.0], NewmarkExtrapolation(4), h=0.1, **k),):
        with pytest.warns(StabilityWarning, match="omega h = 10") as seen:
            s = call()
        assert len(seen) == 1 and seen[0].filename == __file__ and s.warning == str(seen[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert solve(system, (0, 2), [1.0, 0.0], [0.0, 0.0], "newmark", h=0.1).warning is None
        assert solve(system, (0, 2), [1.0, 0.0], [0.0, 0.0], "pade", h=0.1).warning is None
        assert solve_ode(lambda t, y: -y, (0, 1), 1.0, h=0.1).warning is None
