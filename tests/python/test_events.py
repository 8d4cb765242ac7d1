# SPDX-License-Identifier: BSD-3-Clause
"""Events of a run, their actions, and switches of the right side."""
import copy
import ctypes
import pickle
import threading

import numpy as np
import pytest
from problems import chain

import dynstep
from dynstep import Event, Integrator, LinearOde, LinearSystem, MechanicalSystem, OdeSystem, compiled, signature, solve, solve_ode

numba = pytest.importorskip("numba")
G = 9.81
RESTITUTION = 0.8


def ball():
    return MechanicalSystem(1, lambda t, q, v: [-G], velocity_free=True)


def bounces(count, restitution=RESTITUTION):
    """Times at which a ball that starts at rest from 1 meets the floor."""
    first = np.sqrt(2/G)
    return first + 2*first*np.concatenate([[0], np.cumsum(restitution**np.arange(1, count))])


def height(t, q, v):
    return q[0]


def rebound(t, q, v):
    return q, -RESTITUTION*v


def floor(**options):
    return Event(height, **{"direction": -1, "action": rebound, **options})


def scipys(function, **attributes):
    """A function with attributes, as scipy has them."""
    for name, value in attributes.items():
        setattr(function, name, value)
    return function


@pytest.mark.parametrize("steps", [{}, {"h": 0.1}, {"h": 0.03, "method": "newmark"}, {"tol": 1e-8}, {"method": "bi"}])
def test_a_ball_bounces(steps):
    s = solve(ball(), (0, 3), 1.0, 0.0, events=[floor(), lambda t, q, v: v[0]], **steps)
    assert s.success and s.status == 0 and s.t[-1] == 3.0
    # all methods solve a parabola exactly
    assert np.abs(s.t_events[0] - bounces(6)).max() < 1e-12
    tops = s.t_events[1]
    assert tops.size == 6 and np.abs(tops - bounces(7)[:-1] - np.diff(bounces(7))/2).max() < 1e-12
    assert np.abs(s.q_events[0]).max() < 1e-13 and s.q_events[0].shape == s.v_events[0].shape == (6, 1)
    assert np.abs(s.v_events[0][:, 0] + G*bounces(1)*RESTITUTION**np.arange(6)).max() < 1e-11
    pairs = np.flatnonzero(np.diff(s.t) == 0.0)
    assert np.array_equal(s.t[pairs], s.t_events[0])
    assert np.array_equal(s.v[0, pairs + 1], -RESTITUTION*s.v[0, pairs])
    assert np.array_equal(s.q[0, pairs + 1], s.q[0, pairs])
    assert "events: 6, 6" in repr(s)


def test_without_events_there_are_none():
    s = solve(ball(), (0, 1), 1.0, 0.0)
    assert s.t_events is None and s.q_events is None and s.v_events is None
    assert solve(ball(), (0, 1), 1.0, 0.0, events=[]).t_events == []
    s = solve(ball(), (0, 0.1), 1.0, 0.0, events=[floor(), height])
    assert [x.shape for x in s.t_events] == [(0,), (0,)] and [x.shape for x in s.q_events] == [(0, 1), (0, 1)]
    assert solve_ode(lambda t, y: -y, (0, 1), 1.0).y_events is None


def test_attributes_of_scipy():
    s = solve(ball(), (0, 3), 1.0, 0.0, events=scipys(lambda t, q, v: q[0], direction=-1.0, action=rebound))
    assert len(s.t_events) == 1 and s.t_events[0].size == 6
    s = solve(ball(), (0, 3), 1.0, 0.0, events=scipys(lambda t, q, v: q[0], terminal=True))
    assert s.success and s.status == 3 and s.t[-1] == s.t_events[0][0] and "events[0] ended the run at t = 0.4515" in s.message
    never = scipys(lambda t, q, v: q[0], terminal=True, direction=1)
    assert solve(ball(), (0, 3), 1.0, 0.0, events=never).status == 0


@pytest.mark.parametrize("terminal, met, status", [(False, 6, 0), (True, 1, 3), (1, 1, 3), (2, 2, 3), (6, 6, 3), (7, 6, 0)])
def test_terminal_counts(terminal, met, status):
    s = solve(ball(), (0, 3), 1.0, 0.0, h=0.1, events=[lambda t, q, v: v[0], floor(terminal=terminal)], dense_output=True)
    assert s.status == status and s.t_events[1].size == met
    assert s.t[-1] == (s.t_events[1][-1] if status else 3.0)
    assert np.isfinite(s.sol(s.t)).all()


def test_a_run_backward():
    s = solve(ball(), (0, -1), 1.0, 2.0, h=-0.1, events=scipys(lambda t, q, v: q[0], direction=-1, terminal=True))
    assert s.status == 3 and abs(s.t[-1] - (2 - np.sqrt(4 + 2*G))/G) < 1e-13


def test_dense_output_and_times():
    times = np.linspace(0, 3, 50)
    recorded = solve(ball(), (0, 3), 1.0, 0.0, events=floor())
    dense = solve(ball(), (0, 3), 1.0, 0.0, events=floor(), dense_output=True, t_eval=times)
    asked = solve(ball(), (0, 3), 1.0, 0.0, events=floor(), t_eval=times)
    assert recorded.t.size > 14 and np.array_equal(dense.t, times) and np.array_equal(asked.t, times)
    assert np.abs(asked.q - dense.q).max() < 1e-12
    assert np.abs(dense.sol(recorded.t)[0] - recorded.q).max() < 1e-12
    for every in (0, 1, 3):
        seen, chosen = (solve(ball(), (0, 3), 1.0, 0.0, h=0.05, every=every, events=floor(), dense_output=dense)
                        for dense in (False, True))
        assert np.array_equal(seen.t, chosen.t) and np.array_equal(seen.v, chosen.v)


def test_events_change_parameters():
    stiffness = [1.0]

    def stiffer(t, q, v):
        stiffness[0] = 4.0
        return True

    system = MechanicalSystem(1, lambda t, q, v: -stiffness[0]*q)
    s = solve(system, (0, 3), 1.0, 0.0, rtol=1e-10, atol=1e-12, events=Event(height, action=stiffer))
    assert abs(s.q[0, -1] + 0.5*np.sin(2*(3 - np.pi/2))) < 1e-9


@pytest.mark.parametrize("answer, error, words", [
    (3.0, TypeError, r"action of events\[0\] returned float"), ("ab", TypeError, "returned str"),
    ((1.0,), ValueError, "returned 1 arrays"), (([1.0], [1.0, 2.0]), ValueError, r"shape \(2,\), expected \(1,\)"),
    ((1.0, None), TypeError, "returned None"),
])
def test_wrong_answers_of_actions(answer, error, words):
    with pytest.raises(error, match=words):
        solve(ball(), (0, 3), 1.0, 0.0, events=floor(action=lambda t, q, v: answer))


@pytest.mark.parametrize("answer", [None, False, True, np.True_])
def test_answers_that_change_no_state(answer):
    s = solve(ball(), (0, 3), 1.0, 0.0, h=0.5, events=floor(action=lambda t, q, v: answer))
    assert s.success and abs(s.q[0, -1] - (1 - G*4.5)) < 1e-12


def test_a_change_in_place_is_refused_and_arrays_may_be_kept():
    kept = []

    def in_place(t, q, v):
        v *= -1
        return True

    with pytest.raises(ValueError, match="read-only"):
        solve(ball(), (0, 3), 1.0, 0.0, events=floor(action=in_place))
    s = solve(ball(), (0, 3), 1.0, 0.0, events=floor(action=lambda t, q, v: (kept.append(v), rebound(t, q, v))[1]))
    assert np.array_equal(np.concatenate(kept), s.v_events[0][:, 0])


class Mine(Exception):
    pass


@pytest.mark.parametrize("error", [Mine("an object of its own"), KeyboardInterrupt(), dynstep.OutOfDomain("in an action")])
def test_exceptions_come_out_unchanged(error):
    def fails(t, *rest):
        if t > 0.3:
            raise error
        return 1.0

    places = [lambda: solve(ball(), (0, 3), 1.0, 0.0, events=floor(action=fails))]
    if not isinstance(error, dynstep.OutOfDomain):
        places += [lambda: solve(ball(), (0, 3), 1.0, 0.0, events=[height, fails]),
                   lambda: solve(MechanicalSystem(1, lambda t, q, v: -q, switches=fails), (0, 3), 1.0, 0.0),
                   lambda: solve_ode(OdeSystem(1, lambda t, y: -y, switches=fails), (0, 3), 1.0)]
    for place in places:
        with pytest.raises(type(error)) as caught:
            place()
        assert caught.value is error and error.__context__ is None


def test_failures_are_solutions():
    for events, words in ((lambda t, q, v: np.nan if t > 0.3 else 1.0, r"events[0] is NaN"),
                          ([height, lambda t, q, v: np.inf if t > 0.3 else 1.0], "events[1] is Infinity"),
                          (floor(action=lambda t, q, v: (q, [np.nan])), "behind events[0]")):
        s = solve(ball(), (0, 3), 1.0, 0.0, h=0.1, events=events)
        assert not s.success and words in s.message and s.t[-1] > 0.19, s.message
    s = solve(ball(), (0, 9), 1.0, 0.0, events=floor())
    assert s.status == -13 and "bounces to an end" in s.message and abs(s.t[-1] - bounces(200)[-1]) < 1e-6

    def out_of_domain(t, q, v):
        raise dynstep.OutOfDomain("never defined")

    s = solve(ball(), (0, 3), 1.0, 0.0, events=out_of_domain)
    assert s.status == -2 and s.t.size == 1
    s = solve(MechanicalSystem(1, lambda t, q, v: -q, switches=lambda t, q, v: np.nan if t > 0.5 else 1.0), (0, 3), 1.0, 0.0)
    assert s.status == -10 and "switches[0] is NaN" in s.message and 0 < s.t[-1] < 0.5
    s = solve(MechanicalSystem(1, lambda t, q, v: -q, switches=lambda t, q, v: np.nan), (0, 3), 1.0, 0.0)
    assert not s.success


@pytest.mark.parametrize("events, error, words", [
    (5, TypeError, "events must be a function"), ([height, 5], TypeError, r"events\[1\] must be a function"),
    (Event(height, direction="up"), TypeError, r"direction of events\[0\]"),
    ([Event(height, direction=np.nan)], ValueError, r"direction of events\[0\]"),
    (Event(height, terminal=-1), ValueError, r"terminal of events\[0\]"),
    (Event(height, terminal=1.5), TypeError, r"terminal of events\[0\]"),
    (Event(height, action=3), TypeError, r"action of events\[0\] must be a function"),
    (lambda t, q, v: [1.0, 2.0], ValueError, r"events\[0\] returned an array of shape \(2,\)"),
    (lambda t, q, v: None, TypeError, r"events\[0\] returned None"),
    (lambda t, q: 1.0, TypeError, "positional"),
])
def test_wrong_events_are_named(events, error, words):
    with pytest.raises(error, match=words):
        solve(ball(), (0, 1), 1.0, 0.0, events=events)


def test_first_order():
    fall = lambda t, y, g: [y[1], -g]              # noqa: E731
    event = scipys(lambda t, y, g: y[0], direction=-1, action=lambda t, y, g: [y[0], -RESTITUTION*y[1]])
    s = solve_ode(fall, (0, 3), [1.0, 0.0], events=event, args=(G,))
    assert s.success and np.abs(s.t_events[0] - bounces(6)).max() < 1e-12 and s.y_events[0].shape == (6, 2)
    assert np.array_equal(s.y[1, 1:][np.diff(s.t) == 0], -RESTITUTION*s.y_events[0][:, 1])
    with pytest.raises(ValueError, match=r"shape \(1,\), expected \(2,\)"):
        solve_ode(fall, (0, 3), [1.0, 0.0], events=Event(lambda t, y, g: y[0], action=lambda t, y, g: [1.0]), args=(G,))
    s = solve_ode(fall, (0, 3), [1.0, 0.0], events=Event(lambda t, y, g: y[0], terminal=True), args=(G,))
    assert s.status == 3 and s.t_events[0][0] == s.t[-1]


# ---- Compiled functions ----

def of_numba():
    @numba.cfunc(signature("event"))
    def event(n, count, t, q, v, s, ctx):
        s[0] = q[0]
        return 0

    @numba.cfunc(signature("action"))
    def action(n, which, t, q, v, ctx):
        v[0] = -0.8*v[0]
        return 1
    return event, action


def of_ctypes():
    at = ctypes.c_double.from_address

    def event(n, count, t, q, v, s, ctx):
        at(s).value = at(q).value
        return 0

    def action(n, which, t, q, v, ctx):
        at(v).value = -0.8*at(v).value
        return 1
    return signature("event", "ctypes")(event), signature("action", "ctypes")(action)


@pytest.mark.parametrize("kind", [of_numba, of_ctypes])
def test_compiled_functions_give_the_same_bits(kind):
    event, action = kind()
    python = solve(ball(), (0, 3), 1.0, 0.0, events=floor())
    for events in (Event(event, -1, action=action), Event(event, -1, action=rebound), floor(action=action),
                   Event(compiled(event), -1, action=compiled(action))):
        s = solve(ball(), (0, 3), 1.0, 0.0, events=events)
        assert np.array_equal(s.t, python.t) and np.array_equal(s.v, python.v) and np.array_equal(s.q, python.q)
        assert np.array_equal(s.t_events[0], python.t_events[0])
    both = solve(ball(), (0, 3), 1.0, 0.0, events=[Event(event, -1, action=action), lambda t, q, v: v[0]])
    assert [x.size for x in both.t_events] == [6, 6]


def test_compiled_functions_of_another_kind_are_refused():
    event, action = of_numba()
    with pytest.raises(TypeError, match=r"events\[0\] is compiled as"):
        solve(ball(), (0, 1), 1.0, 0.0, events=action)
    with pytest.raises(TypeError, match=r"action of events\[0\] is compiled as"):
        solve(ball(), (0, 1), 1.0, 0.0, events=Event(event, action=event))


def test_user_data_of_an_event():
    @numba.cfunc(signature("event"))
    def level(n, count, t, q, v, s, ctx):
        s[0] = q[0] - numba.carray(ctx, 1, numba.float64)[0]
        return 0

    s = solve(ball(), (0, 1), 1.0, 0.0, events=[Event(level, user_data=np.array([x])) for x in (0.25, 0.75)])
    assert np.abs(np.concatenate(s.t_events) - np.sqrt(2*np.array([0.75, 0.25])/G)).max() < 1e-13


# ---- Systems that the wrapper reorders ----

def grid():
    """A square grid of masses, counted at random."""
    scipy_sparse = pytest.importorskip("scipy.sparse")
    n = 12
    line = scipy_sparse.dia_array((chain(n), [1, 0, -1]), shape=(n, n)).tocsr()
    plane = scipy_sparse.kron(line, scipy_sparse.eye_array(n)) + scipy_sparse.kron(scipy_sparse.eye_array(n), line)
    mixed = np.random.default_rng(1).permutation(n*n)
    return plane.tocsr()[mixed][:, mixed]


def test_reordered_systems():
    K = grid()
    n = K.shape[0]
    sparse, dense = LinearSystem(np.ones(n), K=K), LinearSystem(np.ones(n), K=K.toarray())
    assert sparse.ordering is not None and dense.ordering is None
    q0 = np.linspace(1, 2, n)
    event, action = of_numba()
    atol = dict(q=np.geomspace(1e-10, 1e-4, n), v=np.full(n, 1e-6))
    runs = []
    method = dynstep.NewmarkExtrapolation(4)                 # rounding errors must not choose other levels
    for events in ([Event(lambda t, q, v: q[0], -1, action=lambda t, q, v: (q, np.concatenate([[-0.8*v[0]], v[1:]]))),
                    lambda t, q, v: q[n//2]],
                   [Event(event, -1, action=action), lambda t, q, v: q[n//2]]):
        for system in (sparse, dense):
            runs.append(solve(system, (0, 3), q0, np.full(n, -3.0), method, rtol=0, atol=atol, events=events,
                              t_eval=[1, 2, 3]))
    first = runs[0]
    assert first.t_events[0].size and first.t_events[1].size
    for s in runs[1:]:
        assert s.counts["steps"] == first.counts["steps"]
        for x, y in ((s.q, first.q), (s.v, first.v), (s.q_events[0], first.q_events[0]), (s.v_events[1], first.v_events[1])):
            assert x.shape == y.shape and np.abs(x - y).max() < 1e-9
    A = -K
    both = [solve_ode(LinearOde(a), (0, 0.5), q0, events=Event(lambda t, y: t - 0.25, action=lambda t, y: y + np.arange(n)),
                      rtol=1e-7) for a in (A, A.toarray())]
    assert both[0].t_events[0].size == 1 and np.abs(both[0].y[:, -1] - both[1].y[:, -1]).max() < 1e-8
    assert np.abs(both[0].y_events[0] - both[1].y_events[0]).max() < 1e-8


# ---- Switches ----

def exact(t):
    """q of a mass on a spring that is four times as stiff for q < 0, from 1 at rest."""
    t = np.mod(t, 1.5*np.pi)
    return np.select([t < np.pi/2, t < np.pi], [np.cos(t), -0.5*np.sin(2*t - np.pi)], np.sin(t - np.pi))


def bilinear(**options):
    def force(t, q, v):
        return -q if system.side[0] > 0 else -4*q

    system = MechanicalSystem(1, force, velocity_free=True, switches=height, **options)
    return system


@pytest.mark.parametrize("steps, error", [({"h": 0.1, "method": dynstep.NewmarkExtrapolation(levels=5)}, 1e-13),
                                          ({"rtol": 1e-10, "atol": 1e-10}, 1e-8)])
def test_switches_keep_the_accuracy(steps, error):
    system = bilinear()
    assert system.side.dtype == np.int32 and system.side.shape == (1,)
    s = solve(system, (0, 10), 1.0, 0.0, **steps)
    assert s.success and np.abs(s.q[0] - exact(s.t)).max() < error
    assert s.t_events is None
    without = MechanicalSystem(1, lambda t, q, v: np.where(q > 0, -q, -4*q), velocity_free=True)
    if "h" in steps:
        s = solve(without, (0, 10), 1.0, 0.0, **steps)
        assert np.abs(s.q[0] - exact(s.t)).max() > 1e3*error
    s = solve_ode(first_order_bilinear(), (0, 10), [1.0, 0.0], rtol=1e-10, atol=1e-10)
    assert s.success and np.abs(s.y[0] - exact(s.t)).max() < 1e-8


def first_order_bilinear():
    def rhs(t, y):
        return [y[1], -y[0] if system.side[0] > 0 else -4*y[0]]

    system = OdeSystem(2, rhs, switches=lambda t, y: y[0])
    return system


def test_compiled_switches_read_the_sides():
    side = np.ones(1, np.int32)

    @numba.cfunc(signature("force"))
    def force(n, t, q, v, f, ctx):
        f[0] = -q[0] if numba.carray(ctx, 1, numba.int32)[0] > 0 else -4*q[0]
        return 0

    @numba.cfunc(signature("switches"))
    def switches(n, count, t, q, v, s, ctx):
        s[0] = q[0]
        return 0

    system = MechanicalSystem(1, force, switches=switches, side=side, user_data=side, velocity_free=True)
    assert system.side is side
    s, python = (solve(x, (0, 10), 1.0, 0.0, rtol=1e-9) for x in (system, bilinear()))
    assert np.array_equal(s.t, python.t) and np.array_equal(s.q, python.q)


def test_several_switches():
    def force(t, q, v):
        # a gap of 2 between springs
        return -np.where(system.side[0] > 0, 100*(q - 1), np.where(system.side[1] < 0, 100*(q + 1), 0.0))

    system = MechanicalSystem(1, force, switches=lambda t, q, v: [q[0] - 1, q[0] + 1], n_switches=2)
    s = solve(system, (0, 20), 0.0, 1.0, rtol=1e-10, atol=1e-10)
    period = 4 + 2*np.pi/10
    assert s.success and np.array_equal(system.side, [-1, 1]) and abs(solve(
        system, (0, period), 0.0, 1.0, rtol=1e-10, atol=1e-10).q[0, -1]) < 1e-8
    with pytest.raises(ValueError, match=r"switches returned an array of shape \(2,\), expected \(1,\)"):
        solve(MechanicalSystem(1, force, switches=lambda t, q, v: [1.0, 2.0]), (0, 1), 1.0, 0.0)


@pytest.mark.parametrize("options, error, words", [
    (dict(n_switches=2), ValueError, "go with switches"), (dict(side=np.ones(1, np.int32)), ValueError, "go with switches"),
    (dict(switches=height, n_switches=0), ValueError, "n_switches = 0"), (dict(switches=3), TypeError, "switches must be"),
    (dict(switches=height, side=np.ones(1)), TypeError, "side must be a vector of int32"),
    (dict(switches=height, side=np.ones(2, np.int32), n_switches=1), ValueError, "side has 2 places"),
])
def test_wrong_switches_are_named(options, error, words):
    with pytest.raises(error, match=words):
        MechanicalSystem(1, lambda t, q, v: -q, **options)
    with pytest.raises(error, match=words):
        OdeSystem(1, lambda t, y: -y, **options)


def test_runs_of_one_system_take_turns():
    system = bilinear()
    one, two = Integrator(system, "newmark-extrapolation"), Integrator(system, "newmark-extrapolation")
    one.start(0.0, 1.0, 0.0)
    two.start(0.0, -0.5, 0.0)
    for _ in range(10):
        one.step(0.05)
        assert system.side[0] == 1
        two.step(0.05)
        assert system.side[0] == -1
    assert abs(one.q[0] - np.cos(0.5)) < 1e-10 and abs(two.q[0] + 0.5*np.cos(1.0)) < 1e-9
    with pytest.raises(RuntimeError, match="share its `side`"):
        solve(system, (0, 1), 1.0, 0.0, observer=lambda t, q, v, a: solve(system, (0, 1), 1.0, 0.0) is None)
    assert solve(system, (0, 1), 1.0, 0.0).success


def test_systems_without_switches_can_be_copied():
    again = copy.deepcopy(LinearSystem(1.0))
    assert solve(again, (0, 1), 1.0, 0.0).success
    system = copy.deepcopy(MechanicalSystem(1, pendulum))
    assert solve(system, (0, 1), 1.0, 0.0).success
    assert solve(pickle.loads(pickle.dumps(system)), (0, 1), 1.0, 0.0).success


def pendulum(t, q, v):
    return -np.sin(q)


def test_threads_have_systems_of_their_own():
    results = {}

    def work(i):
        results[i] = solve(bilinear(), (0, 5), 1.0, 0.0, events=floor(action=None))

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4 and all(np.array_equal(s.q, results[0].q) for s in results.values())


# ---- With constraints ----

def test_actions_under_constraints():
    """A pendulum of length 1 that meets a wall below its pin: the state behind it is made consistent."""
    def wall(t, q, v):
        return q[0]

    rod = MechanicalSystem(2, lambda t, q, v: [0.0, -G], constraint=lambda t, q: q @ q - 1)
    s = solve(rod, (0, 3), [1.0, 0.0], [0.0, 0.0], "soi2", h=0.002,
              events=Event(wall, -1, action=lambda t, q, v: (q, -v + [0.0, 1e-5])))
    assert s.success and s.t_events[0].size == 3
    # a quarter of the period of a pendulum from the horizontal
    assert abs(s.t_events[0][0] - 1.8540746773013719/np.sqrt(G)) < 1e-5
    pairs = np.flatnonzero(np.diff(s.t) == 0)
    assert np.abs(s.q[:, pairs + 1]**2).sum() == pytest.approx(3.0) and s.lam.shape == (1, s.t.size)
    assert max(s.constraint_drift.g.max(), s.constraint_drift.gv.max()) < 1e-10
    assert np.abs(s.v[0, pairs + 1] + s.v[0, pairs]).max() < 1e-10
