# SPDX-License-Identifier: BSD-3-Clause
"""Interpolants through the nodes of a run, on motions that are known: orders, ends, backward runs, unequal steps."""

import numpy as np
import pytest

from dynstep._interpolant import Interpolant, OdeInterpolant


def motion(t):
    """q, v, a of two coordinates [2, nt]."""
    return (np.array([np.sin(1.5*t), np.exp(-t)]), np.array([1.5*np.cos(1.5*t), -np.exp(-t)]),
            np.array([-2.25*np.sin(1.5*t), np.exp(-t)]))


def nodes(t_ends, inner):
    """Times with inner[i] nodes inside step i, and the numbers of the ends."""
    parts = [np.linspace(left, right, m + 2)[:-1] for left, right, m in zip(t_ends, t_ends[1:], inner)]
    return np.concatenate([*parts, t_ends[-1:]]), np.concatenate([[0], np.cumsum(np.asarray(inner) + 1)])


def mechanical(t_ends, inner):
    t, ends = nodes(t_ends, inner)
    none = np.zeros((0, t.size))
    return Interpolant(t, *motion(t), none, none, ends)


def first_order(t_ends, inner):
    t, ends = nodes(t_ends, inner)
    return OdeInterpolant(t, *motion(t)[:2], ends)


def errors(sol, times):
    if isinstance(sol, OdeInterpolant):
        found = sol(times), sol.derivative(times)
    else:
        found = sol(times)
    return np.array([np.abs(x - exact).max() for x, exact in zip(found, motion(times))])


@pytest.mark.parametrize("m", range(4))
@pytest.mark.parametrize("sign", [1, -1])
def test_orders(m, sign):
    """h^(2m+4) in q, v, y, h^(2m+3) in a, y'; through the ends alone h^6, h^5, h^3"""
    times = sign*np.linspace(0, 4, 401)
    steps = [8, 4, 2, 1][m]
    for make, stated in (mechanical, [2*m + 4, 2*m + 4, 2*m + 3] if m else [6, 5, 3]), (first_order, [2*m + 4, 2*m + 3]):
        both = [errors(make(sign*np.linspace(0, 4, k*steps + 1), [m]*k*steps), times) for k in (4, 8)]
        assert np.abs(np.log2(both[0]/both[1]) - stated).max() < 0.35


def test_rounding():
    """Errors are those of the data, where the order does not show: 50 units of q, of a in units of eps/h"""
    sol = mechanical(np.linspace(0, 4, 41), [5]*40)
    q, v, a = errors(sol, np.linspace(0, 4, 1001))
    assert max(q, v) < 50*np.finfo(float).eps and a < 500*np.finfo(float).eps/0.1


def test_large_times():
    """t = 1e6 rounds the places of the nodes; their steps have equal parts all the same"""
    t, ends = nodes(np.linspace(0, 1, 9), [3]*8)
    none = np.zeros((0, t.size))
    late = Interpolant(t + 1e6, *motion(t), none, none, ends)
    s = np.arange(64)/64 + 2.0**-8                          # these are exact at 1e6
    for found, exact in zip(late(1e6 + s), motion(s)):
        assert np.abs(found - exact).max() < 1e-10


def test_mixed_steps():
    """Steps of unequal lengths with 0 to 5 nodes inside; each is what it would be alone"""
    t_ends = np.array([0, 0.1, 0.15, 0.4, 0.5, 0.55, 0.8, 1.0])
    inner = [0, 3, 1, 0, 5, 2, 1]
    times = np.random.default_rng(1).permutation(np.linspace(0, 1, 301))
    for make in mechanical, first_order:
        sol = make(t_ends, inner)
        values = sol(times) if make is mechanical else (sol(times), sol.derivative(times))
        for left, right, m in zip(t_ends, t_ends[1:], inner):
            at = (times >= left) & (times < right)
            alone = make(np.array([left, right]), [m])
            one = alone(times[at]) if make is mechanical else (alone(times[at]), alone.derivative(times[at]))
            for x, y in zip(values, one):
                assert np.abs(x[:, at] - y).max() < 1e-13
    at_ends = mechanical(t_ends, inner)(t_ends[:-1])
    assert all(np.array_equal(x, y) for x, y in zip(at_ends, motion(t_ends[:-1])))


def test_no_ends_given():
    """Every point is an end: the bits of ends = 0, 1, 2, ..., but for a, whose error is h^4, and h^3 with ends"""
    t = np.linspace(0, 2, 11)
    none = np.zeros((0, t.size))
    times = np.linspace(0, 2, 77)
    plain, told = (Interpolant(t, *motion(t), none, none, *more) for more in ((), (np.arange(11),)))
    assert all(np.array_equal(x, y) for x, y in zip(plain(times)[:2], told(times)[:2]))
    assert errors(plain, times)[2] < 0.3*errors(told, times)[2]
    assert plain(0.3)[0].shape == (2,) and plain([])[0].shape == (2, 0)
    y, told = OdeInterpolant(t, *motion(t)[:2]), OdeInterpolant(t, *motion(t)[:2], np.arange(11))
    assert np.array_equal(y(times), told(times)) and np.array_equal(y.derivative(times), told.derivative(times))


def test_acceleration_of_a_low_order():
    """An error h^3 of a step in q, as the trapezoid leaves, is none in a where ends are given, and one of h without them"""
    none = np.zeros((0, 2))
    sizes = []
    for h in 0.02, 0.01:
        t = np.array([0, h])
        q, v, a = motion(t)
        q[:, 1] += h**3
        sizes.append([np.abs(Interpolant(t, q, v, a, none, none, ends)(0.3*h)[2] - motion(np.array(0.3*h))[2]).max()
                      for ends in ([0, 1], None)])
    assert np.abs(np.log2(np.divide(*sizes)) - [3, 1]).max() < 0.1


def test_multipliers():
    """Linear between ends; columns of inner nodes are not read"""
    t, ends = nodes(np.array([0.0, 0.5, 1.0]), [2, 1])
    lam = np.full((1, t.size), np.nan)
    lam[0, ends] = 2*t[ends]
    lam, psi = Interpolant(t, *motion(t), lam, np.zeros((0, t.size)), ends).multipliers([0.1, 0.7, 1.0])
    assert np.allclose(lam, [[0.2, 1.4, 2.0]], rtol=1e-15) and psi.shape == (0, 3)


@pytest.mark.parametrize("ends", [[0, 2], [1, 4], [0, 2, 2, 4], [0, 3, 2, 4]])
def test_wrong_ends(ends):
    t = np.linspace(0, 1, 5)
    with pytest.raises(ValueError, match="ends must increase from 0 to 4"):
        OdeInterpolant(t, *motion(t)[:2], ends)
