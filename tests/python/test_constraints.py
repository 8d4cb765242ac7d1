# SPDX-License-Identifier: BSD-3-Clause
"""Constrained systems: known motions, multipliers, drift, starts, patterns."""
import pickle

import numpy as np
import pytest
from problems import (
    DRIVEN_START, GRAVITY, KNIFE_START, ROD_START, driven_pendulum, driven_solution, knife_edge, knife_solution, rod,
    rod_constraint, rod_solution, rods, rods_pattern, rods_start, same_bits)

import dynstep
from dynstep import HHT, SOI2, Integrator, MechanicalSystem, solve


def rod_jacobian(t, q):
    return 2*q


def rod_curvature(t, q, v):
    return 2*(v @ v)


def knife_jacobian(t, q, v):
    return [[np.sin(q[2]), -np.cos(q[2]), 0.0]]


def knife_curvature(t, q, v):
    return v[2]*(v[0]*np.cos(q[2]) + v[1]*np.sin(q[2]))


def driven_jacobian(t, q):
    d = q[0] - 0.3*np.sin(3*t)
    return [[2*d, 2*q[1]]], [-1.8*d*np.cos(3*t)]


GIVEN = {
    "rod": (rod, {"constraint_jacobian": rod_jacobian, "constraint_curvature": rod_curvature}, ROD_START),
    "knife": (knife_edge, {"velocity_jacobian": knife_jacobian, "velocity_curvature": knife_curvature}, KNIFE_START),
    "driven": (driven_pendulum, {"constraint_jacobian": driven_jacobian}, DRIVEN_START),
}


def errors(system, start, exact, h, method=None, t_end=2.0):
    """Largest errors of q, v, a, multipliers."""
    s = solve(system, (0, t_end), *start, method, h=h)
    assert s.success, s.message
    found = s.q, s.v, s.a, *(x for x in (s.lam, s.psi) if x.size)
    return np.array([np.abs(x - y).max() for x, y in zip(found, exact(s.t))])


# ---- Known motions ----

def test_a_pendulum_in_six_lines():
    pendulum = MechanicalSystem(2, lambda t, q, v: [0.0, -9.81], constraint=lambda t, q: q @ q - 1, velocity_free=True)
    solution = solve(pendulum, (0, 10), q0=[1, 0], v0=[0, 0], h=0.01)
    tension = 2*solution.lam[0]
    assert solution.success and solution.method == SOI2() and solution.lam.shape == (1, 1001)
    assert np.abs(tension - 3*9.81*-solution.q[1]).max() < 0.03          # 3 m g cos(angle)
    # g' by differences of g, which are good to 1e-12
    assert solution.constraint_drift.g.max() < 1e-14 and solution.constraint_drift.gv.max() < 1e-11


@pytest.mark.parametrize("problem, exact", [("rod", rod_solution), ("knife", knife_solution),
                                            ("driven", driven_solution)])
@pytest.mark.parametrize("method", [SOI2(), SOI2(0.2), SOI2(0.0), HHT(-0.2), SOI2(variant="reduced")], ids=repr)
@pytest.mark.parametrize("given", [True, False])
def test_order_two_in_all_components(problem, exact, method, given):
    make, functions, start = GIVEN[problem]
    system = make(**functions) if given else make()
    e = [errors(system, start, exact, h, method) for h in (0.01, 0.005)]
    small = 1e-10                                     # the angle of the knife edge is exact
    orders = [np.log2(x/y) for x, y in zip(*e) if x > small]
    assert len(orders) >= 2 and min(orders) > 1.85, (e, orders)


def test_double_pendulum_against_its_angles():
    integrate = pytest.importorskip("scipy.integrate")

    def angles(t, y):
        (a, b), (u, w) = y[:2], y[2:]
        c, s = np.cos(a - b), np.sin(a - b)
        m = [[2, c], [c, 1]]
        return [u, w, *np.linalg.solve(m, [-s*w*w - 2*GRAVITY*np.sin(a), s*u*u - GRAVITY*np.sin(b)])]

    q0, v0 = rods_start(2)
    exact = integrate.solve_ivp(angles, (0, 1.5), [np.pi/4, np.pi/4, 0, 0], method="DOP853", rtol=1e-12, atol=1e-13).y
    (a, b), (u, w) = exact[:2, -1], exact[2:, -1]
    q = np.array([np.sin(a), -np.cos(a), np.sin(a) + np.sin(b), -np.cos(a) - np.cos(b)])
    v = np.array([u*np.cos(a), u*np.sin(a), u*np.cos(a) + w*np.cos(b), u*np.sin(a) + w*np.sin(b)])
    e = []
    for h in (0.01, 0.005):
        s = solve(rods(2), (0, 1.5), q0, v0, h=h)
        e.append([np.abs(s.q[:, -1] - q).max(), np.abs(s.v[:, -1] - v).max()])
    assert np.log2(np.divide(*e)) == pytest.approx(2, abs=0.1) and max(e[1]) < 1e-2


def test_general_reaction():
    """r = -G^T (lam + lam^3/100): the same motion, and other multipliers."""
    def reaction(t, q, v, lam, psi):
        assert lam.shape == (1,) and psi.shape == (0,)
        return -2*q*(lam + lam**3/100)

    plain = solve(rod(), (0, 2), *ROD_START, h=0.005)
    more = {"derivatives": {"reaction_jacobian": lambda t, q, v, lam, psi: -2*q*(1 + 0.03*lam**2)},
            "tuple": {"reaction_jacobian": lambda t, q, v, lam, psi: (-2*q*(1 + 0.03*lam**2), np.zeros((2, 0)))},
            "differences": {},
            "tangent": {"reaction_tangent": lambda t, q, v, lam, psi: 2*(lam + lam**3/100)*np.ones(2),
                        "tangent_kind": "diagonal"}}
    for name, given in more.items():
        s = solve(rod(reaction=reaction, **given), (0, 2), *ROD_START, h=0.005)
        assert s.success and np.abs(s.q - plain.q).max() < 1e-4, name
        assert np.abs(s.lam + s.lam**3/100 - plain.lam).max() < 2e-3, name
        assert s.constraint_drift.g.max() < 1e-14


def test_both_kinds_of_constraints():
    """The knife edge, turned by a motor against a moment of 0.7: the same motion, and lam is that moment."""
    def reaction(t, q, v, lam, psi):
        return np.array([-np.sin(q[2])*psi[0], np.cos(q[2])*psi[0], -lam[0]])

    def jacobians(t, q, v, lam, psi):
        return [[0], [0], [-1]], [-np.sin(q[2]), np.cos(q[2]), 0]

    for given in ({}, {"reaction": reaction}, {"reaction": reaction, "reaction_jacobian": jacobians}):
        system = MechanicalSystem(3, lambda t, q, v: [2.0, 0.0, 0.7], constraint=lambda t, q: q[2] - 1.5*t,
                                  velocity_constraint=lambda t, q, v: v[0]*np.sin(q[2]) - v[1]*np.cos(q[2]), **given)
        e = []
        for h in (0.01, 0.005):
            s = solve(system, (0, 3), *KNIFE_START, h=h)
            assert s.success and s.lam.shape == s.psi.shape == (1, s.t.size)
            assert np.abs(s.lam - 0.7).max() < 1e-9
            e.append([np.abs(x - y).max() for x, y in zip((s.q, s.v, s.a, s.psi), knife_solution(s.t))])
            assert max(x.max() for x in s.constraint_drift) < 1e-13
        assert np.log2(np.divide(*e)).min() > 1.9


# ---- The same by other ways ----

@pytest.mark.parametrize("problem", GIVEN)
def test_derivatives_given_or_by_differences(problem):
    make, functions, start = GIVEN[problem]
    plain = solve(make(), (0, 1), *start, h=0.01)
    for names in [[name] for name in functions] + [list(functions)]:
        s = solve(make(**{name: functions[name] for name in names}), (0, 1), *start, h=0.01)
        for x in ("q", "v", "a", "lam", "psi"):
            assert np.abs(getattr(s, x) - getattr(plain, x)).max(initial=0) < 1e-7, (names, x)


@pytest.mark.parametrize("given", ["dense", "indptr", "sparse", "values", "full array", "order"])
def test_patterns_do_not_change_the_motion(given):
    count = 7
    first, column = rods_pattern(count)
    rows = np.repeat(np.arange(count), np.diff(first))
    places = np.zeros((count, 2*count))
    places[rows, column] = 1
    dense = rods(count)
    jacobian = dense._functions["constraint_jacobian"].fun
    options = {
        "dense": {}, "indptr": {"constraint_pattern": (first, column)},
        "values": {"constraint_pattern": (first, column),
                   "constraint_jacobian": lambda t, q: jacobian(t, q)[rows, column]},
        "full array": {"constraint_pattern": places},
        "order": {"constraint_pattern": (first, column), "equation_order": np.concatenate(
            [[2*count + i, 2*i, 2*i + 1] for i in range(count)])},
    }
    if given == "sparse":
        sparse = pytest.importorskip("scipy.sparse")
        for kind in (sparse.csr_array, sparse.csc_matrix, sparse.coo_matrix):
            options["sparse"] = {"constraint_pattern": kind(places), "constraint_jacobian":
                                 lambda t, q, kind=kind: kind(jacobian(t, q))}
            check(rods(count, **options["sparse"]), dense)
        options["sparse"].pop("constraint_pattern")                # then it is made dense
    check(rods(count, **options[given]), dense)


def check(system, other):
    """Both move alike, up to rounding."""
    s, t = (solve(x, (0, 1), *rods_start(x.n//2), h=0.01) for x in (system, other))
    assert s.success and np.abs(s.q - t.q).max() < 1e-11 and np.abs(s.lam - t.lam).max() < 1e-8
    assert s.counts["steps"] == 100 and s.constraint_drift.g.max() < 1e-13


def test_patterns_of_velocity_constraints():
    pattern = ([0, 2], [0, 1])
    plain = solve(knife_edge(velocity_jacobian=knife_jacobian), (0, 1), *KNIFE_START, h=0.01)
    for jacobian in (knife_jacobian, lambda t, q, v: [np.sin(q[2]), -np.cos(q[2])]):
        system = knife_edge(velocity_jacobian=jacobian, velocity_pattern=pattern)
        s = solve(system, (0, 1), *KNIFE_START, h=0.01)
        assert s.success and np.abs(s.q - plain.q).max() < 1e-12 and np.abs(s.psi - plain.psi).max() < 1e-9
    with pytest.raises(ValueError, match="velocity_jacobian returned an array of shape .3,., expected .2,."):
        solve(knife_edge(velocity_jacobian=lambda t, q, v: knife_jacobian(t, q, v)[0], velocity_pattern=pattern),
              (0, 1), *KNIFE_START, h=0.01)


def test_systems_are_pickled_with_their_constraints():
    first, column = rods_pattern(1)
    system = MechanicalSystem(2, falling, constraint=rod_constraint, constraint_jacobian=rod_jacobian,
                              constraint_pattern=(first, column), constraints=1)
    again = pickle.loads(pickle.dumps(system))
    a, b = (solve(x, (0, 1), *ROD_START, h=0.01) for x in (system, again))
    assert same_bits(a, b) and np.array_equal(a.lam, b.lam)


def falling(t, q, v):
    return [0.0, -GRAVITY]


# ---- What is recorded ----

def test_multipliers_at_all_kinds_of_points():
    every = solve(rod(), (0, 1), *ROD_START, h=0.01)
    third = solve(rod(), (0, 1), *ROD_START, h=0.01, every=3)
    last = solve(rod(), (0, 1), *ROD_START, h=0.01, every=0)
    dense = solve(rod(), (0, 1), *ROD_START, h=0.01, dense_output=True)
    assert np.array_equal(third.lam[:, :-1], every.lam[:, ::3][:, :third.t.size - 1])
    assert np.array_equal(last.lam, every.lam[:, -1:]) and np.array_equal(dense.lam, every.lam)
    assert every.psi.shape == (0, 101) and last.psi.shape == (0, 1)
    times = np.array([0.0, 0.01, 0.013, 0.5, 0.507, 1.0])
    some = solve(rod(), (0, 1), *ROD_START, h=0.01, t_eval=times)
    chosen = solve(rod(), (0, 1), *ROD_START, h=0.01, t_eval=times, dense_output=True)
    expected = np.interp(times, every.t, every.lam[0])
    for s in (some, chosen):
        assert np.array_equal(s.t, times) and s.lam.shape == (1, 6)
        assert np.abs(s.lam[0] - expected).max() < 1e-11*np.abs(expected).max()
    lam, psi = chosen.sol.multipliers(0.013)
    assert lam.shape == (1,) and psi.shape == (0,) and lam == pytest.approx(expected[2])
    assert chosen.sol.multipliers([])[0].shape == (1, 0)
    with pytest.raises(ValueError, match="outside the run"):
        chosen.sol.multipliers(1.5)
    nothing = solve(rod(), (0, 1), *ROD_START, h=0.01, t_eval=[])
    assert nothing.lam.shape == (1, 0) and nothing.success and nothing.constraint_drift.g.shape == (0,)
    free = solve(dynstep.LinearSystem(1.0, K=1.0), (0, 1), 1, 0, h=0.1)
    assert free.lam.shape == free.psi.shape == (0, 11) and free.start_correction is None
    assert not np.any(free.constraint_drift) and free.constraint_drift.g.shape == (11,)


def test_backwards():
    forward = solve(rod(), (0, 1), *ROD_START, SOI2(1.0), h=0.01)
    back = solve(rod(), (1, 0), forward.q[:, -1], forward.v[:, -1], SOI2(1.0), h=-0.01, dense_output=True)
    assert np.abs(back.q[:, -1] - ROD_START[0]).max() < 1e-3 and back.constraint_drift.g.max() < 1e-14
    assert back.sol.multipliers(0.5)[0] == pytest.approx(back.lam[:, 50])


def test_pieces_of_a_run_lose_no_multipliers():
    from unittest import mock
    whole = solve(rod(), (0, 1), *ROD_START, h=0.01)
    with mock.patch("dynstep._run._PIECE", 1e-9), mock.patch("dynstep._record._FIRST_BLOCK", 8):
        pieces = solve(rod(), (0, 1), *ROD_START, h=0.01)
    assert same_bits(whole, pieces) and np.array_equal(whole.lam, pieces.lam)


def test_observers_and_counts():
    seen = []
    s = solve(rod(), (0, 1), *ROD_START, h=0.01, observer=lambda t, q, v, a: seen.append(t) or t > 0.495)
    assert s.status == 1 and s.t[-1] == pytest.approx(0.5) and s.lam.shape == (1, len(seen) + 1)
    assert "1 + 0 multiplier(s)" in repr(s)
    assert s.counts["constraints"] > 50


# ---- Drift ----

def test_drift_of_soi2_and_of_index_3():
    system = rod(constraint_jacobian=rod_jacobian)
    kept = solve(system, (0, 5), *ROD_START, "soi2", h=0.01).constraint_drift
    baseline = solve(system, (0, 5), *ROD_START, "hht-i3", h=0.01).constraint_drift
    assert kept.g.max() < 1e-14 and kept.gv.max() < 1e-12 and not kept.k.any()
    assert baseline.g.max() < 1e-13 and baseline.gv.max() > 1e-5
    nonholonomic = solve(knife_edge(), (0, 5), *KNIFE_START, h=0.01).constraint_drift
    assert nonholonomic.k.max() < 1e-14 and not nonholonomic.g.any() and nonholonomic.k.shape == (501,)


def test_drift_is_that_of_the_functions():
    s = solve(driven_pendulum(), *[(0, 2), *DRIVEN_START], "hht-i3", h=0.05)
    d = s.q[0] - 0.3*np.sin(3*s.t)
    assert np.abs(s.constraint_drift.g - np.abs(d**2 + s.q[1]**2 - 1)).max() < 1e-15
    gv = 2*d*(s.v[0] - 0.9*np.cos(3*s.t)) + 2*s.q[1]*s.v[1]
    assert np.abs(s.constraint_drift.gv - np.abs(gv)).max() < 1e-11 and np.abs(gv).max() > 1e-6


def test_plots_of_the_drift():
    plt = pytest.importorskip("matplotlib.pyplot")
    s = solve(rod(), (0, 1), *ROD_START, h=0.01)
    axes = s.plot_drift(plt.figure().add_subplot())
    assert [line.get_label() for line in axes.lines] == ["|g|", "|g'|"] and axes.get_yscale() == "log"
    both = solve(knife_edge(), (0, 1), *KNIFE_START, h=0.01)
    assert [line.get_label() for line in both.plot_drift(plt.figure().add_subplot()).lines] == ["|k|"]
    assert len(s.plot(ax=plt.figure().add_subplot()).lines) == 2
    with pytest.raises(ValueError, match="no constraints"):
        solve(dynstep.LinearSystem(1.0), (0, 1), 1, 0, h=0.1).plot_drift()
    plt.close("all")


# ---- Methods ----

def test_methods_that_take_no_constraints():
    for method in ("newmark", "newmark-extrapolation", "midpoint", "generalized-alpha"):
        with pytest.raises(ValueError, match="constraint"):
            solve(rod(), (0, 1), *ROD_START, method, h=0.01)
    assert Integrator(rod()).method == SOI2()
    free = MechanicalSystem(1, lambda t, q, v: -q)
    assert Integrator(free).method == dynstep.NewmarkExtrapolation()


def test_methods_for_constraints_without_any():
    system = dynstep.LinearSystem(2.0, 0.1, 8.0)
    expected = solve(system, (0, 5), 1, 0, "generalized-alpha", h=0.01)
    for method in ("soi2", SOI2(variant="index-3")):
        s = solve(system, (0, 5), 1, 0, method, h=0.01)
        assert s.success and np.abs(s.q - expected.q).max() < 1e-12
    sparse = pytest.importorskip("scipy.sparse")          # in an order of the wrapper's own
    places = np.random.default_rng(1).permutation(40)
    k = (3*np.eye(40) - np.eye(40, k=1) - np.eye(40, k=-1))[np.ix_(places, places)]
    shuffled, dense = dynstep.LinearSystem(1.0, K=sparse.csr_array(k)), dynstep.LinearSystem(1.0, K=k)
    q0 = np.linspace(-1, 1, 40)
    a, b = (solve(x, (0, 1), q0, 0*q0, "soi2", h=0.05) for x in (shuffled, dense))
    assert shuffled.ordering is not None and np.abs(a.q - b.q).max() < 1e-13
    w = np.sqrt(4 - 0.025**2)
    exact = np.exp(-0.025*expected.t)*(np.cos(w*expected.t) + 0.025/w*np.sin(w*expected.t))
    assert np.abs(expected.q - exact).max() < 3e-3


# ---- One step at a time ----

def test_integrator_with_steps_of_any_length():
    """Order two needs the corrections (14a), (14b): random steps between 0.5 and 1.5 h."""
    ratios = np.random.default_rng(3).uniform(0.5, 1.5, 100)
    e = []
    for split in (1, 2, 4):
        integrator = Integrator(rod(constraint_jacobian=rod_jacobian))
        integrator.start(0.0, *ROD_START)
        assert integrator.lam.shape == (1,) and integrator.psi.shape == (0,)
        for h in np.tile(ratios, split)*0.02/split:
            integrator.step(h)
        q, v, a, lam = rod_solution(np.array([0.0, integrator.t]))
        e.append([np.abs(x - y[:, -1]).max() for x, y in zip(
            (integrator.q, integrator.v, integrator.a, integrator.lam), (q, v, a, lam))])
    e = np.array(e)
    assert np.abs(np.log2(e[:-1]/e[1:]) - 2).max() < 0.4, e


def test_integrator_starts_again():
    integrator = Integrator(rod(), HHT(-0.05))
    results = []
    for _ in range(2):
        integrator.start(0.0, *ROD_START)
        integrator.run(1.0, 0.01)
        results.append([integrator.q, integrator.v, integrator.lam])
    assert np.array_equal(results[0][0], results[1][0]) and np.array_equal(results[0][2], results[1][2])
    s = solve(rod(), (0, 1), *ROD_START, HHT(-0.05), h=0.01, every=0)
    assert np.array_equal(s.q[:, 0], results[0][0]) and np.array_equal(s.lam[:, 0], results[0][2])


def test_integrator_turns_back():
    """The middles of a step and of its way back coincide."""
    integrator = Integrator(rod(constraint_jacobian=rod_jacobian))
    integrator.start(0.0, *ROD_START)
    for h in (0.01, -0.01, 0.01, 0.01, -0.01, -0.01):
        integrator.step(h)
    assert np.abs(integrator.q - ROD_START[0]).max() < 1e-7 and np.abs(integrator.v - ROD_START[1]).max() < 1e-5
