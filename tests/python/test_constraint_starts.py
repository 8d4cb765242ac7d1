# SPDX-License-Identifier: BSD-3-Clause
"""Constrained systems: starts off the constraints, redundant ones, and what is declared."""
import warnings

import numpy as np
import pytest
from problems import GRAVITY, ROD_START, driven_pendulum, knife_edge, rod, rod_constraint

import dynstep
from dynstep import SOI2, Integrator, MechanicalSystem, check_system, solve


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


def falling(t, q, v):
    return [0.0, -GRAVITY]


# ---- The start ----

OFF = np.array([1.1, 0.0]), np.array([0.3, 1.0])


def test_a_start_off_the_constraints_is_moved():
    with pytest.warns(dynstep.StartCorrected, match=r"off its constraints.*moved q by .* and v by") as caught:
        s = solve(rod(), (0, 1), *OFF, h=0.01)
    assert caught[0].filename == __file__
    c = s.start_correction
    assert c.g == pytest.approx(0.21) and c.moved_q == pytest.approx(0.1) and c.moved_v == pytest.approx(0.3)
    assert np.abs(s.q[:, 0] - [1, 0]).max() < 1e-14 and np.abs(s.v[:, 0] - [0, 1]).max() < 1e-14
    assert s.success and s.constraint_drift.g.max() < 1e-14


def test_a_start_off_the_constraints_is_refused():
    s = solve(rod(), (0, 1), *OFF, SOI2(start="refuse"), h=0.01)
    assert not s.success and s.status == -7 and s.t.size == 0 and s.lam.shape == (1, 0)
    assert "constraint" in s.message and s.start_correction.g == pytest.approx(0.21)
    with pytest.raises(dynstep.IntegrationError, match="constraint") as caught:
        Integrator(rod(), SOI2(start="refuse")).start(0, *OFF)
    assert caught.value.status == -7


def test_a_start_off_the_constraints_is_kept():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        s = solve(rod(), (0, 1), *OFF, SOI2(start="keep"), h=0.01)
    assert np.array_equal(s.q[:, 0], OFF[0]) and s.start_correction.moved_q == 0.0
    assert s.constraint_drift.g[0] == pytest.approx(0.21) and s.constraint_drift.g[1:].max() < 1e-13


def test_small_corrections_do_not_warn():
    q0, v0 = ROD_START
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        s = solve(rod(), (0, 0.1), q0*(1 + 1e-10), v0, h=0.01)
        assert 1e-11 < s.start_correction.moved_q < 1e-9 and np.hypot(*s.q[:, 0]) == pytest.approx(1, abs=1e-15)
        solve(rod(), (0, 0.1), [1, 0], [0, 0], h=0.01)
    integrator = Integrator(rod())
    with pytest.warns(dynstep.StartCorrected) as caught:
        integrator.start(0.0, *OFF)
    assert caught[0].filename == __file__ and integrator.start_correction.g == pytest.approx(0.21)


# ---- Redundant, conflicting and too many ----

def test_redundant_constraints():
    plain = solve(rod(), (0, 2), *ROD_START, h=0.01)
    twice = solve(rod(constraint=lambda t, q: [rod_constraint(t, q)]*2), (0, 2), *ROD_START, h=0.01)
    assert twice.success and twice.lam.shape == (2, 201)
    assert np.abs(twice.q - plain.q).max() < 1e-11
    assert np.abs(twice.lam.sum(axis=0) - plain.lam[0]).max() < 1e-7
    assert "constraint 2 of g" in twice.start_correction.redundant and plain.start_correction.redundant == ""


def test_conflicting_constraints_fail_with_a_sentence():
    conflict = rod(constraint=lambda t, q: [rod_constraint(t, q), rod_constraint(t, q) + 0.1])
    s = solve(conflict, (0, 1), *ROD_START, h=0.01)
    assert not s.success and "constraint" in s.message


@pytest.mark.parametrize("k, start", [(lambda t, q, v: q @ v - 1.0, ROD_START),
                                      (lambda t, q, v: q @ v - 1e-3, ([1.0, 0.0], [0.0, 0.0])),
                                      (lambda t, q, v: [q @ v + 1.0, q @ v - 1.0], ([1.0, 0.0], [0.0, 0.0]))])
def test_conflicting_velocities_fail_with_a_sentence(k, start):
    """g' = 2 q v and k: also where the best compromise is the start itself."""
    system = MechanicalSystem(3, lambda t, q, v: [0.0, -GRAVITY, 0.0], velocity_constraint=lambda t, q, v: k(t, q[:2], v[:2]),
                              constraint=None if np.size(k(0.0, *np.zeros((2, 2)))) > 1 else lambda t, q: q[:2] @ q[:2] - 1)
    s = solve(system, (0, 1), *(np.append(x, 0.0) for x in start), h=0.01)
    assert not s.success and s.t.size == 0 and "constraints" in s.message and "contradict" in s.message
    assert "t = 0" in s.message


def test_more_constraints_than_coordinates():
    with pytest.raises(ValueError, match="3.*(constraint|coordinate)"):
        solve(rod(constraint=lambda t, q: np.array([q[0], q[1], q[0] + q[1]])), (0, 1), [0, 0], [0, 0], h=0.01)


# ---- What is declared ----

POINT = 0.3, np.array([0.7, -0.6]), np.array([0.2, 0.5])


def test_check_system_looks_at_constraints():
    assert check_system(rod(constraint_jacobian=rod_jacobian, constraint_curvature=rod_curvature), *POINT)
    for name, wrong in {"constraint_jacobian": lambda t, q: -2*q,
                        "constraint_curvature": lambda t, q, v: 3*(v @ v)}.items():
        report = check_system(rod(**{name: wrong}), *POINT)
        assert not report and name in str(report)
    q, v = np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.4, 0.7])
    assert check_system(knife_edge(velocity_jacobian=knife_jacobian, velocity_curvature=knife_curvature), 0.0, q, v)
    for name, wrong in {"velocity_jacobian": lambda t, q, v: [[np.sin(q[2]), np.cos(q[2]), 0]],
                        "velocity_curvature": lambda t, q, v: v[0]}.items():
        report = check_system(knife_edge(**{name: wrong}), 0.0, q, v)
        assert not report and name in str(report)
    assert check_system(driven_pendulum(constraint_jacobian=driven_jacobian), *POINT)
    report = check_system(driven_pendulum(constraint_jacobian=lambda t, q: driven_jacobian(t, q)[0]), *POINT)
    assert not report and "constraint_jacobian" in str(report)           # dg/dt is missing


@pytest.mark.parametrize("options, words", [
    ({"constraint_jacobian": rod_jacobian}, "constraint_jacobian goes with constraint, which is not given"),
    ({"velocity_curvature": rod_curvature}, "velocity_curvature goes with velocity_constraint"),
    ({"reaction": lambda *_: 0}, "reaction goes with constraint or velocity_constraint"),
    ({"constraint": rod_constraint, "reaction_jacobian": lambda *_: 0}, "reaction_jacobian goes with reaction"),
    ({"constraints": 2}, "constraints = 2, but there is no constraint"),
    ({"velocity_constraints": 1, "constraint": rod_constraint}, "there is no velocity_constraint"),
    ({"constraint": rod_constraint, "constraints": -1}, "constraints = -1 must be 0 or more"),
    ({"constraint": rod_constraint, "constraints": 1.0}, "constraints must be an integer"),
    ({"constraint": 7}, "constraint must be a function"),
    ({"constraint": dynstep.compiled(4096)}, "constraints is missing: a compiled constraint"),
    ({"constraint": rod_constraint, "constraint_pattern": [[1, 1]]},
     "constraint_pattern goes with constraint_jacobian"),
    ({"constraint_pattern": [[1, 1, 1]]}, r"constraint_pattern has 3 columns, expected n = 2"),
    ({"constraint_pattern": ([0, 2], [0, 2])}, "indices of constraint_pattern must lie between 0 and n - 1 = 1"),
    ({"constraint_pattern": ([0, 2], [1, 0])}, "indices of constraint_pattern must increase in each row"),
    ({"constraint_pattern": ([0, 3], [0, 1])}, "indptr of constraint_pattern must rise from 0"),
    ({"constraint_pattern": ([0, 2, 1], [0, 1])}, "indptr of constraint_pattern must rise from 0"),
    ({"constraint_pattern": ([0, 1.5], [0])}, "indptr of constraint_pattern"),
    ({"constraint_pattern": ([0, 2], [0, 1]), "constraints": 2}, "pattern of the Jacobian has 1 rows"),
    ({"constraint": rod_constraint, "equation_order": [0, 0, 1]}, "equation_order must be a permutation"),
])
def test_options_that_do_not_fit(options, words):
    if "constraint_pattern" in options and "goes with" not in words:
        options = {"constraint": rod_constraint, "constraint_jacobian": rod_jacobian, **options}
    with pytest.raises((ValueError, TypeError), match=words):
        MechanicalSystem(2, falling, **options)


def test_the_number_of_constraints_is_asked_for():
    asked = []

    def constraint(t, q, radius):
        asked.append((t, q.copy()))
        q[:] = 7.0                                   # one's own copy
        t0, (x, y) = asked[-1]
        return x*x + y*y - radius**2

    system = MechanicalSystem(2, lambda t, q, v, radius: [0.0, -GRAVITY], constraint=constraint, args=(1.0,))
    assert not asked
    s = solve(system, (0, 0.1), *ROD_START, h=0.01)
    assert s.success and s.lam.shape == (1, 11) and np.array_equal(asked[0][1], ROD_START[0])
    assert "constraint" in repr(system) and system.is_constrained and not dynstep.LinearSystem(1.0).is_constrained
    with pytest.raises(ValueError, match=r"constraint returned an array of shape \(1,\), expected \(2,\)"):
        solve(rod(constraint=lambda t, q: [rod_constraint(t, q)], constraints=2), (0, 1), *ROD_START, h=0.01)
    none = solve(rod(constraint=lambda t, q: []), (0, 0.1), *ROD_START, h=0.01)
    assert none.success and none.lam.shape == (0, 11)
