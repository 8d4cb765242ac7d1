# SPDX-License-Identifier: BSD-3-Clause
"""Runs that are left and taken up again: the same bits in the same program and from a checkpoint."""
import copy
import pickle

import numpy as np
import pytest
from problems import ROD_START, rod

import dynstep
from dynstep import resume, solve, solve_ode

ORBIT = (0, 5), [0.5, 0.0], [0.0, 1.75]
TIMES = np.linspace(0, 5, 41)
MECHANICS = "t", "q", "v", "a", "lam", "psi"


def orbit():
    return dynstep.MechanicalSystem(2, lambda t, q, v: -q/np.hypot(*q)**3, velocity_free=True)


def joined(parts, names):
    return [np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names]


def agree(whole, parts, names):
    """The points of the whole run are those of its parts, bit by bit."""
    return all(np.array_equal(x, getattr(whole, name)) for x, name in zip(joined(parts, names), names))


def left(call, again, path, names, remade=()):
    """Leave a run after 7 steps and go on in both ways; `remade` are counters of work that a checkpoint does not save."""
    whole = call()
    first = call(max_steps=7)
    assert not first.success and "max_steps = 7" in first.message and whole.success
    first.checkpoint(path)
    there, here = again(path), first.resume()
    assert agree(whole, (first, there), names) and agree(whole, (first, here), names)
    assert {k: v for k, v in here.counts.items() if k not in remade} == \
        {k: v for k, v in whole.counts.items() if k not in remade}
    assert {k: v for k, v in there.counts.items() if k not in remade} == \
        {k: v for k, v in whole.counts.items() if k not in remade}
    assert there.success and there.message == whole.message
    return whole, there, here


@pytest.mark.parametrize("method", ["newmark", "midpoint", "newmark-extrapolation", "midpoint-extrapolation",
                                    "generalized-alpha", "soi2", "bi", "bi-extrapolation"])
@pytest.mark.parametrize("options", [{"h": 0.07}, {"rtol": 1e-6}, {"rtol": 1e-6, "t_eval": TIMES}, {"h": 0.07, "every": 3},
                                     {"tol": 1e-5, "controller": "pi"}, {"rtol": 1e-6, "dense_output": True}],
                         ids=lambda options: "-".join(options))
def test_each_family_goes_on_with_the_same_bits(method, options, tmp_path):
    if method in ("newmark", "midpoint") and "h" not in options:
        pytest.skip("without an error estimate")
    path = tmp_path / "run.checkpoint"
    # the factors of a first matrix at the time of the checkpoint are made again, with the same bits; the acceleration behind a
    # step that is not recorded is computed where a call of the library ends there
    remade = ("factorizations",) if "h" not in options and method in ("soi2", "generalized-alpha") else \
        ("forces",) if "every" in options else ()
    whole, there, here = left(lambda **more: solve(orbit(), *ORBIT, method, **options, **more),
                              lambda path: resume(orbit(), path, method), path, MECHANICS, remade)
    if "dense_output" in options:
        t = np.linspace(there.sol.t_min, 5, 30)
        assert there.sol.t_min < there.t[0]
        for piece in there, here:
            assert all(map(np.array_equal, piece.sol(t), whole.sol(t)))


def test_linear_constrained_and_first_order_systems(tmp_path):
    path = tmp_path / "run.checkpoint"
    chain = dynstep.LinearSystem(np.ones(3), K=dynstep.banded([[-1, -1, 0], [2, 2, 2], [0, -1, -1]], 1, 1))
    for method, steps in ("pade", {"h": 0.1}), ("pade", {"rtol": 1e-7}), ("newmark-extrapolation", {"h": 0.1}):
        left(lambda **more: solve(chain, (0, 4), [1, 0, 0], np.zeros(3), method, **steps, **more),
             lambda path: resume(chain, path, method), path, MECHANICS, ("factorizations",))
    for steps in {"h": 0.05}, {"rtol": 1e-4}:
        left(lambda **more: solve(rod(), (0, 1), *ROD_START, **steps, **more),
             lambda path: resume(rod(), path), path, MECHANICS, ("factorizations", "solves"))
    stiff = lambda t, y: [-50*(y[0] - np.cos(t)), y[0] - y[1]]
    for method in "bi", "bi45", "bi-extrapolation":
        for steps in {"h": 0.02}, {"rtol": 1e-6}, {"rtol": 1e-6, "dense_output": True}:
            left(lambda **more: solve_ode(stiff, (0, 2), [0.0, 1.0], method, **steps, **more),
                 lambda path: resume(stiff, path, method), path, ("t", "y", "yp"), ("factorizations",))


def test_sparse_systems_have_their_own_order(tmp_path):
    sparse = pytest.importorskip("scipy.sparse")
    n, path = 40, tmp_path / "run.checkpoint"
    order = np.random.default_rng(1).permutation(n)
    K = sparse.diags([-1.0, 2.1, -1.0], [-1, 0, 1], (n, n)).tocsr()[order][:, order]
    system = dynstep.LinearSystem(np.ones(n), K=K)
    assert system.ordering is not None
    left(lambda **more: solve(system, (0, 2), np.arange(n)/n, np.zeros(n), "pade", h=0.1, dense_output=True, **more),
         lambda path: resume(system, path, "pade"), path, MECHANICS, ("factorizations",))


def test_events_actions_and_observers(tmp_path):
    path = tmp_path / "ball.checkpoint"
    ball = dynstep.MechanicalSystem(1, lambda t, q, v: [-9.81])

    def floor(terminal):
        return dynstep.Event(lambda t, q, v: q[0], -1, terminal, lambda t, q, v: (q, -0.8*v))

    whole = solve(ball, (0, 3), 1.0, 0.0, events=floor(False), rtol=1e-9)
    parts = [solve(ball, (0, 3), 1.0, 0.0, events=floor(2), rtol=1e-9)]
    assert parts[0].status == 3
    parts[0].checkpoint(path)
    parts.append(resume(ball, path, events=floor(3)))
    assert parts[1].status == 3 and parts[1].t_events[0].size == 3
    parts.append(parts[1].resume(2))
    assert not parts[2].success and "max_steps = 2" in parts[2].message
    parts.append(parts[2].resume())
    met = [t for part in parts for t in part.t_events[0]]
    assert np.array_equal(met, whole.t_events[0]) and agree(whole, parts, MECHANICS)
    stopped = solve(ball, (0, 3), 1.0, 0.0, "newmark", h=0.01, observer=lambda t, q, v, a: t > 1)
    assert stopped.status == 1
    stopped.checkpoint(path)
    assert agree(solve(ball, (0, 3), 1.0, 0.0, "newmark", h=0.01), (stopped, resume(ball, path, "newmark")), MECHANICS)
    with pytest.raises(ValueError, match="event"):                      # none were watched
        resume(ball, path, "newmark", events=floor(1))
    parts[-1].checkpoint(path)
    with pytest.raises(ValueError, match="no error estimate"):
        resume(ball, path, "newmark", events=floor(1))


def test_the_end_is_the_end(tmp_path):
    path = tmp_path / "end.checkpoint"
    s = solve(orbit(), *ORBIT, h=0.1)
    s.checkpoint(path)
    for again in resume(orbit(), path), s.resume():
        assert again.success and again.t.size == 0 and again.q.shape == (2, 0) and "end" in again.message


def test_dense_pieces_take_times(tmp_path):
    path = tmp_path / "run.checkpoint"
    whole = solve(orbit(), *ORBIT, rtol=1e-8, dense_output=True, t_eval=TIMES)
    first = solve(orbit(), *ORBIT, rtol=1e-8, dense_output=True, t_eval=TIMES, max_steps=4)
    first.checkpoint(path)
    there = resume(orbit(), path, t_eval=TIMES[TIMES > first.sol.t_max])
    assert agree(whole, (first, there), "tqva") and agree(whole, (first, first.resume()), "tqva")
    solve(orbit(), *ORBIT, rtol=1e-8, max_steps=4).checkpoint(path)
    with pytest.raises(ValueError, match="t_eval"):
        resume(orbit(), path, t_eval=[5.0])


def test_what_is_refused(tmp_path):
    path = tmp_path / "run.checkpoint"
    s = solve(orbit(), *ORBIT, h=0.1, max_steps=5)
    s.checkpoint(path)
    with pytest.raises(OSError, match="no/folder"):
        s.checkpoint(tmp_path / "no/folder/file")
    with pytest.raises(FileNotFoundError):
        resume(orbit(), tmp_path / "none")
    with pytest.raises(ValueError, match="run.checkpoint"):
        resume(orbit(), path, "newmark")
    with pytest.raises(ValueError, match="4 numbers"):
        resume(dynstep.MechanicalSystem(3, lambda t, q, v: -q), path)
    for copied in copy.copy(s), copy.deepcopy(solve(dynstep.LinearSystem(1.0, K=1.0), (0, 1), 1.0, 0.0, h=0.5)):
        with pytest.raises(ValueError, match="copied"):
            copied.resume()
    linear = solve(dynstep.LinearSystem(1.0, K=1.0), (0, 1), 1.0, 0.0, h=0.5)
    assert np.array_equal(pickle.loads(pickle.dumps(linear.t)), linear.t)
    s.resume()
    with pytest.raises(ValueError, match="went on"):
        s.checkpoint(path)
    text = path.read_text()
    path.write_text(text[:len(text)//2])
    with pytest.raises(ValueError, match="run.checkpoint"):
        resume(orbit(), path)
    path.write_text("nonsense\n")
    with pytest.raises(ValueError, match="run.checkpoint"):
        resume(orbit(), path)


def test_a_mended_failure_goes_on():
    broken = [True]

    def force(t, q, v):
        if t > 1 and broken[0]:
            raise dynstep.OutOfDomain
        return -q

    s = solve(dynstep.MechanicalSystem(1, force), (0, 2), 1.0, 0.0, "newmark", h=0.1)
    assert not s.success and s.t[-1] < 1.2
    broken[0] = False
    rest = s.resume()
    assert rest.success and agree(solve(dynstep.MechanicalSystem(1, force), (0, 2), 1.0, 0.0, "newmark", h=0.1), (s, rest), "tqva")
