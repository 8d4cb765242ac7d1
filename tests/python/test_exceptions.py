# SPDX-License-Identifier: BSD-3-Clause
"""User functions that raise, or return what they should not."""
import gc
import sys
import traceback
import weakref

import numpy as np
import pytest
from problems import pendulum_force

import dynstep
from dynstep import Integrator, LinearSystem, MechanicalSystem, solve


class Mine(Exception):
    pass


def frames(error):
    return [frame.name for frame in traceback.extract_tb(error.__traceback__)]


def failing(kind, action, after=0.35):
    """System or observer whose function `kind` does `action` once t > after."""
    def late(good):
        def function_of_the_user(t, *rest):
            return action() if t > after else good(t, *rest)
        return function_of_the_user

    good = {"force": lambda t, q, v: -q, "mass": lambda t, q, v: np.eye(2), "tangent":
            lambda t, q, v, a: (np.eye(2), np.zeros((2, 2))), "load": lambda t: np.zeros(2)}
    if kind == "observer":
        return LinearSystem(np.ones(2), K=1.0), {"observer": late(lambda *_: False)}
    if kind == "load":
        return LinearSystem(np.ones(2), K=1.0, load=late(good["load"])), {}
    functions = {"force": good["force"], **({kind: good[kind]} if kind != "force" else {})}
    functions[kind] = late(functions[kind])
    return MechanicalSystem(2, **functions), {}


KINDS = ["force", "mass", "tangent", "load", "observer"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("error", [Mine("an object of its own"), KeyboardInterrupt(), SystemExit(3), StopIteration(7)])
def test_exceptions_come_out_unchanged(kind, error):
    def action():
        raise error

    system, options = failing(kind, action, after=-1.0 if kind == "tangent" else 0.35)
    with pytest.raises(type(error)) as caught:
        solve(system, (0, 1), [1, 2], [0, 0], "newmark", h=0.1, **options)
    assert caught.value is error
    assert error.__cause__ is None and error.__context__ is None
    assert frames(error)[-2:] == ["function_of_the_user", "action"] and "solve" in frames(error)


def test_chained_exceptions_keep_their_chain():
    def force(t, q, v):
        try:
            {}["missing"]
        except KeyError as error:
            raise Mine("because") from error

    with pytest.raises(Mine) as caught:
        solve(MechanicalSystem(1, force), (0, 1), 1, 0, h=0.1)
    assert isinstance(caught.value.__cause__, KeyError)


@pytest.mark.parametrize("start", [0.0, -1.0])
def test_exceptions_at_the_start(start):
    def force(t, q, v):
        raise Mine

    with pytest.raises(Mine):
        solve(MechanicalSystem(1, force), (start, 1), 1, 0, h=0.1)
    with pytest.raises(ZeroDivisionError):
        solve(LinearSystem(1.0, load=lambda t: [1/0]), (start, 1), 1, 0, h=0.1)


WRONG = [
    (None, TypeError, "None"),
    (np.zeros(3), ValueError, r"shape \(3,\), expected \(2"),
    (np.zeros(1), ValueError, r"shape \(1,\), expected \(2"),
    (np.zeros((2, 1)), ValueError, r"shape \(2, 1\), expected \(2"),
    (0.0, ValueError, r"shape \(\), expected \(2"),
    (np.zeros(2, complex), TypeError, "complex128"),
    (["a", "b"], TypeError, "real numbers"),
    (np.array([None, 1.0]), TypeError, "object"),
    (np.zeros(100000), ValueError, "100000"),
]


@pytest.mark.parametrize("kind", ["force", "load"])
@pytest.mark.parametrize("value, error, words", WRONG, ids=[w[2] for w in WRONG])
def test_wrong_vectors(kind, value, error, words):
    system, options = failing(kind, lambda: value)
    with pytest.raises(error, match=f"{kind} returned.*{words}"):
        solve(system, (0, 1), [1, 2], [0, 0], "newmark", h=0.1, **options)


@pytest.mark.parametrize("value, error, words", [
    (None, TypeError, "None"), (np.zeros(2), ValueError, r"shape \(2,\), expected \(2, 2\)"),
    (np.eye(3), ValueError, r"shape \(3, 3\), expected \(2, 2\)"), (np.eye(2)*1j, TypeError, "complex")])
@pytest.mark.parametrize("kind", ["mass", "tangent"])
def test_wrong_matrices(kind, value, error, words):
    system, _ = failing(kind, lambda: (value, np.eye(2)) if kind == "tangent" else value, after=-1.0)
    with pytest.raises(error, match=f"{kind} returned.*{words}"):
        solve(system, (0, 1), [1, 2], [0, 0], "newmark", h=0.1)


@pytest.mark.parametrize("value", [np.eye(2), (np.eye(2),), None, (1, 2, 3), np.zeros((2, 2, 2))])
def test_tangents_are_two(value):
    system = MechanicalSystem(2, lambda t, q, v: -q, tangent=lambda t, q, v, a: value)
    with pytest.raises(TypeError, match=r"tangent returned .*, expected a tuple \(K, C\)"):
        solve(system, (0, 1), [1, 2], [0, 0], "newmark", h=0.1)


def test_wrong_energies():
    for value, error in ((None, TypeError), ("a", TypeError), ([1.0, 2.0], ValueError), (1j, TypeError)):
        integrator = Integrator(MechanicalSystem(1, pendulum_force, energy=lambda t, q, v, value=value: value))
        integrator.start(0, 1, 0)
        with pytest.raises(error, match="energy returned"):
            integrator.energy


def test_wrong_number_of_arguments():
    with pytest.raises(TypeError, match="positional argument"):
        solve(MechanicalSystem(1, lambda t, q: -q), (0, 1), 1, 0, h=0.1)


def test_observer_with_a_result_that_is_no_truth():
    with pytest.raises(ValueError, match="observer returned an array.*any"):
        solve(LinearSystem(np.ones(2)), (0, 1), [1, 2], [0, 0], h=0.1, observer=lambda t, q, v, a: q > 0)


@pytest.mark.parametrize("value", [[1, 2], (1.0, 2.0), np.array([1, 2], np.int8), np.array([1, 2], np.float32),
                                   np.array([1.0, 9, 2])[::2], np.array([2.0, 1])[::-1], np.array([1, 2], ">f8"),
                                   np.array([1, 2], np.longdouble), [True, np.float64(2)]])
def test_results_that_numpy_can_read(value):
    plain = solve(MechanicalSystem(2, lambda t, q, v: np.array([1.0, 2.0])), (0, 1), [0, 0], [0, 0], "newmark", h=0.1)
    s = solve(MechanicalSystem(2, lambda t, q, v: value), (0, 1), [0, 0], [0, 0], "newmark", h=0.1)
    expected = plain.q*np.array([[1], [1 if value is not True else 1]])
    if np.array_equal(np.asarray(value, float), [1.0, 2.0]):
        assert np.array_equal(s.q, expected)


def test_a_number_does_for_one_coordinate():
    for force in (lambda t, q, v: -4*q[0], lambda t, q, v: -4*q):
        s = solve(MechanicalSystem(1, force, mass=lambda t, q, v: 1.0), (0, 2), 1, 0, h=0.1)
        assert np.abs(s.q[0] - np.cos(2*s.t)).max() < 1e-9


# ---- Arrays that functions get ----

def test_arrays_may_be_kept_and_changed():
    kept = []

    def force(t, q, v):
        kept.append((t, q, v))
        result = -q
        q[:] = 99.0                              # one's own copy
        return result

    seen = []
    s = solve(MechanicalSystem(1, force, velocity_free=True), (0, 1), 1.0, 0.0, "central-difference", h=0.1,
              observer=lambda *point: seen.append(point))
    assert s.success and len({id(q) for _, q, _ in kept}) == len(kept)
    assert all(q[0] == 99.0 for _, q, _ in kept)
    gc.collect()
    assert np.array_equal([q[0] for _, q, _, _ in seen], s.q[0, 1:])
    assert np.array_equal([a[0] for _, _, _, a in seen], s.a[0, 1:])
    assert all(x.flags.owndata and x.flags.writeable for _, *point in seen for x in point)


def test_a_result_may_be_used_again():
    result = np.zeros(2)

    def force(t, q, v):
        result[:] = -q
        return result
    a = solve(MechanicalSystem(2, force), (0, 1), [1, 2], [0, 0], h=0.1)
    b = solve(MechanicalSystem(2, lambda t, q, v: -q), (0, 1), [1, 2], [0, 0], h=0.1)
    assert np.array_equal(a.q, b.q)


# ---- Nesting, and integrators used where they must not ----

def test_solve_inside_a_force():
    def inner(t):
        return solve(MechanicalSystem(1, pendulum_force), (0, 0.5), 1.0, t, "newmark", h=0.1).q[0, -1]

    def force(t, q, v):
        return -q + inner(t)

    s = solve(MechanicalSystem(1, force), (0, 1), 1, 0, "central-difference", h=0.1)
    again = solve(LinearSystem(1.0, K=1.0, load=lambda t: [inner(t)]), (0, 1), 1, 0, "central-difference", h=0.1)
    assert s.success and np.abs(s.q - again.q).max() < 1e-14


def test_exception_of_an_inner_solve_goes_through_both():
    def bad(t, q, v):
        raise Mine("inner")

    def force(t, q, v):
        return solve(MechanicalSystem(1, bad), (0, 1), 1, 0, h=0.1).q[0, -1:]
    with pytest.raises(Mine) as caught:
        solve(MechanicalSystem(1, force), (0, 1), 1, 0, h=0.1)
    assert frames(caught.value).count("solve") == 2


def test_an_integrator_in_its_own_force():
    integrator = Integrator(MechanicalSystem(1, lambda t, q, v: integrator.q))
    with pytest.raises(RuntimeError, match="own functions"):
        integrator.start(0.0, 1.0, 0.0)
    calls = []

    def force(t, q, v):
        if t > 0.25 and not calls:
            calls.append(t)
            other.step(0.1)
        return -q
    other = Integrator(MechanicalSystem(1, force), "newmark")
    other.start(0.0, 1.0, 0.0)
    with pytest.raises(RuntimeError, match="own functions"):
        other.run(1.0, 0.1)
    assert other.t == pytest.approx(0.2) and other.run(1.0, 0.1) and other.t == 1.0


def test_an_integrator_goes_on_after_an_exception():
    raised = []

    def force(t, q, v):
        if t > 0.45 and not raised:
            raised.append(t)
            raise Mine
        return -q
    integrator = Integrator(MechanicalSystem(1, force))
    integrator.start(0.0, 1.0, 0.0)
    with pytest.raises(Mine):
        integrator.run(1.0, 0.1)
    assert integrator.t == pytest.approx(0.4)
    integrator.run(1.0, 0.1)
    assert integrator.q[0] == pytest.approx(np.cos(1.0), abs=1e-9)


# ---- References ----

def test_references_are_given_back():
    def force(t, q, v):
        return -q

    system = MechanicalSystem(1, force, args=())
    solve(system, (0, 1), 1, 0, h=0.1)
    gc.collect()
    counts = sys.getrefcount(force), sys.getrefcount(system), sys.getrefcount(None)
    for _ in range(50):
        solve(system, (0, 1), 1, 0, h=0.1, observer=lambda *_: None)
    gc.collect()
    assert (sys.getrefcount(force), sys.getrefcount(system)) == counts[:2]
    assert abs(sys.getrefcount(None) - counts[2]) < 40


def test_frames_of_exceptions_are_released():
    class Big:
        pass

    alive = []

    def force(t, q, v):
        big = Big()
        alive.append(weakref.ref(big))
        raise Mine

    for _ in range(3):
        try:
            solve(MechanicalSystem(1, force), (0, 1), 1, 0, h=0.1)
        except Mine:
            pass
    gc.collect()
    assert len(alive) == 3 and all(ref() is None for ref in alive)


def test_integrators_in_a_cycle_are_collected():
    class Owner:
        def __init__(self):
            self.integrator = Integrator(MechanicalSystem(1, self.force))

        def force(self, t, q, v):
            return -q

    owner = Owner()
    gone = weakref.ref(owner)
    del owner
    gc.collect()
    assert gone() is None


def test_integrators_are_not_copied():
    import copy
    import pickle
    integrator = Integrator(LinearSystem(1.0))
    for action in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="cannot be copied"):
            action(integrator)


def test_systems_are_pickled_with_their_functions():
    import pickle
    for system in (LinearSystem(np.ones(2), K=np.eye(2)), MechanicalSystem(1, pendulum_force),
                   LinearSystem(np.ones(2), load=dynstep.LoadTable((0, 1), np.ones((2, 3))))):
        again = pickle.loads(pickle.dumps(system))
        start = np.ones(system.n), np.zeros(system.n)
        assert np.array_equal(solve(system, (0, 1), *start, h=0.1).q, solve(again, (0, 1), *start, h=0.1).q)
