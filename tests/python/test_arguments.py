# SPDX-License-Identifier: BSD-3-Clause
"""Wrong input is a ValueError or a TypeError that names the argument."""
import ctypes

import numpy as np
import pytest

import dynstep
from dynstep import Integrator, LinearSystem, LoadTable, MechanicalSystem, banded, solve

SYSTEM = LinearSystem(np.ones(2), K=np.ones(2))
GOOD = {"t_span": (0, 1), "q0": [1.0, 2.0], "v0": [0.0, 0.0], "h": 0.1}


def identity(t, q, v):
    return q


@pytest.mark.parametrize("name, value, error, words", [
    ("t_span", (0, 1, 2), ValueError, "t_span"),
    ("t_span", 5, ValueError, "t_span"),
    ("t_span", (0, np.nan), ValueError, "t_span"),
    ("t_span", (0, np.inf), ValueError, "t_span"),
    ("t_span", ("a", "b"), TypeError, "t_span"),
    ("t_span", None, TypeError, "t_span"),
    ("q0", [1.0], ValueError, r"q0 has the shape \(1,\), expected \(2,\)"),
    ("q0", [1.0, 2.0, 3.0], ValueError, "q0"),
    ("q0", 1.0, ValueError, "q0"),
    ("q0", [[1.0, 2.0]], ValueError, "q0"),
    ("q0", [1.0, np.nan], ValueError, r"q0\[1\] = nan"),
    ("q0", [1.0, -np.inf], ValueError, "q0"),
    ("q0", [1j, 0], TypeError, "q0"),
    ("q0", ["a", "b"], TypeError, "q0"),
    ("q0", [[1], [1, 2]], ValueError, "q0"),
    ("q0", None, TypeError, "q0 is None"),
    ("v0", [0.0], ValueError, "v0"),
    ("v0", [np.inf, 0.0], ValueError, "v0"),
    ("h", 0.0, ValueError, "h must not be zero"),
    ("h", -0.1, ValueError, "sign"),
    ("h", np.nan, ValueError, "h = nan"),
    ("h", np.inf, ValueError, "h = inf"),
    ("h", 1e-18, ValueError, "h = "),
    ("h", "0.1", TypeError, "h must be a number"),
    ("tol", 1e-6, ValueError, "h and tol exclude each other"),
    ("h", [0.1, 0.2], TypeError, "h must be a number"),
    ("h", 0.1j, TypeError, "h must be a number"),
    ("every", -1, ValueError, "every"),
    ("every", 1.5, TypeError, "every"),
    ("every", True, TypeError, "every"),
    ("every", 2**40, ValueError, "every"),
    ("t_eval", [0.5, 1.5], ValueError, r"t_eval\[1\] = 1.5 lies outside"),
    ("t_eval", [-0.5], ValueError, r"t_eval\[0\]"),
    ("t_eval", [0.5, 0.4], ValueError, r"t_eval\[1\] = 0.4 comes after 0.5"),
    ("t_eval", [0.5, np.nan], ValueError, "t_eval"),
    ("t_eval", [[0.5]], ValueError, "t_eval"),
    ("t_eval", "all", TypeError, "t_eval"),
    ("max_steps", 0, ValueError, "max_steps"),
    ("max_steps", 10.0, TypeError, "max_steps"),
    ("dense_output", 1, TypeError, "dense_output"),
    ("progress", "yes", TypeError, "progress"),
    ("observer", 5, TypeError, "observer"),
    ("observer", np.zeros(3), TypeError, "observer"),
    ("rtol", 1e-6, ValueError, "rtol goes without h"),
    ("atol", 1e-6, ValueError, "atol goes without h"),
    ("h_min", 1e-6, ValueError, "h_min goes without h"),
    ("events", 5, TypeError, "events must be a function"),
])
def test_solve(name, value, error, words):
    with pytest.raises(error, match=words):
        solve(SYSTEM, **{**GOOD, name: value})


def test_h_is_keyword_only():
    with pytest.raises(TypeError, match="positional"):
        solve(SYSTEM, (0, 1), [1, 2], [0, 0], "newmark", 0.1)


@pytest.mark.parametrize("system", [None, identity, np.eye(2), LinearSystem])
def test_not_a_system(system):
    for call in (lambda: solve(system, **GOOD), lambda: Integrator(system)):
        with pytest.raises(TypeError, match="system must be"):
            call()


@pytest.mark.parametrize("arguments, error, words", [
    (dict(M=np.ones((2, 3))), ValueError, "M has the shape"),
    (dict(M=np.ones((2, 2, 2))), ValueError, "M has the shape"),
    (dict(M=np.ones(2), K=np.ones((3, 3))), ValueError, "M has 2 rows, K has 3 rows"),
    (dict(M=np.ones(2), C=banded(np.ones((1, 4)), 0, 0)), ValueError, "C has 4 rows"),
    (dict(M=np.ones(2), load=LoadTable((0, 1), np.ones((3, 4)))), ValueError, "load has 3 rows"),
    (dict(K=[[1.0, np.nan], [0, 1]]), ValueError, r"K\[0, 1\] = nan"),
    (dict(M=[1.0, np.inf]), ValueError, r"M\[1\] = inf"),
    (dict(M=1.0, K=np.nan), ValueError, "K"),
    (dict(K=np.eye(2)*1j), TypeError, "K has the type complex128"),
    (dict(K=[["a"]]), TypeError, "K"),
    (dict(M=np.empty((0, 0))), ValueError, "M has no rows"),
    (dict(M=1.0, load=5), TypeError, "load must be a function"),
    (dict(M=1.0, load=np.ones(3)), TypeError, "load must be a function"),
    (dict(M=1.0, load=identity, user_data=3), ValueError, "user_data"),
    (dict(M=1.0, args=(3,)), ValueError, "args"),
    (dict(M=1.0, load=identity, args=range(40)), TypeError, ""),
])
def test_linear_system(arguments, error, words):
    if arguments.get("args") == range(40):
        arguments = {**arguments, "args": tuple(range(40))}
        error, words = ValueError, "args has 40 entries"
    with pytest.raises(error, match=words):
        LinearSystem(**arguments)


def test_sparse_matrices_that_cannot_be():
    sparse = pytest.importorskip("scipy.sparse")
    k = sparse.eye_array(3).tolil()
    k[1, 2] = np.nan
    with pytest.raises(ValueError, match=r"K\[1, 2\] = nan"):
        LinearSystem(K=k)
    with pytest.raises(TypeError, match="K has the type complex"):
        LinearSystem(K=sparse.eye_array(3)*1j)
    with pytest.raises(ValueError, match="K has the shape"):
        LinearSystem(K=sparse.csr_array((2, 3)))


@pytest.mark.parametrize("arguments, error, words", [
    ((np.ones((2, 3)), 1, 1), ValueError, "ab has the shape"),
    ((np.ones(3), 0, 0), ValueError, "ab has the shape"),
    ((np.ones((1, 3)), 0, 3), ValueError, "ku = 3"),
    ((np.ones((3, 3)), -1, 1), ValueError, "kl = -1"),
    ((np.ones((3, 3)), 1.0, 1), TypeError, "kl"),
    (([[0, np.nan, 1], [1, 1, 1], [1, 1, 0]], 1, 1), ValueError, r"ab\[0, 1\] = nan"),
    ((np.ones((1, 3))*1j, 0, 0), TypeError, "ab"),
])
def test_banded(arguments, error, words):
    with pytest.raises(error, match=words):
        banded(*arguments)


def test_banded_does_not_read_outside_the_matrix():
    a = banded([[np.nan, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, np.nan]], 1, 1)
    assert np.array_equal(a.toarray(), [[3, 1, 0], [6, 4, 2], [0, 7, 5]])
    assert np.array_equal(dynstep.Banded.from_dense(a.toarray()).ab, np.nan_to_num(a.ab))
    assert a.shape == (3, 3) and "kl=1" in repr(a)
    wide = np.triu(np.ones((4, 4)), -1)
    assert np.array_equal(dynstep.Banded.from_dense(wide).toarray(), wide)


@pytest.mark.parametrize("arguments, error, words", [
    (dict(n=0), ValueError, "n = 0"),
    (dict(n=1.0), TypeError, "n must be an integer"),
    (dict(n=True), TypeError, "n must be an integer"),
    (dict(n=2**30), ValueError, "n = 1073741824 must be 1 to 1073741823"),
    (dict(force=None), TypeError, "force"),
    (dict(force=3), TypeError, "force must be a function"),
    (dict(force="f"), TypeError, "force must be a function"),
    (dict(mass=np.ones(3)), ValueError, "mass has 3 rows"),
    (dict(mass=np.ones((2, 3))), ValueError, "mass has the shape"),
    (dict(mass=[1.0, np.nan]), ValueError, "mass"),
    (dict(mass=[1.0, 1.0], mass_kind="diagonal"), ValueError, "mass_kind"),
    (dict(mass_constant=True), ValueError, "mass_constant"),
    (dict(mass=identity, mass_kind="sparse"), ValueError, "mass_kind must be"),
    (dict(mass=identity, mass_kind=(1, 2)), ValueError, "ku of mass_kind = 2"),
    (dict(mass=identity, mass_kind=(0, 1), mass_symmetric=True), ValueError, "mass_symmetric"),
    (dict(tangent_kind=(1,)), ValueError, "tangent_kind"),
    (dict(tangent_kind=(-1, 0)), ValueError, "kl of tangent_kind"),
    (dict(tangent=5), TypeError, "tangent must be a function"),
    (dict(tangent_symmetric="yes"), TypeError, "tangent_symmetric"),
    (dict(linear=1), TypeError, "linear"),
    (dict(velocity_free=0), TypeError, "velocity_free"),
    (dict(energy=2.0), TypeError, "energy must be a function"),
    (dict(user_data=np.ones(2)), ValueError, "user_data"),
    (dict(args=tuple(range(33))), ValueError, "args has 33"),
])
def test_mechanical_system(arguments, error, words):
    with pytest.raises(error, match=words):
        MechanicalSystem(**{"n": 2, "force": identity, **arguments})


def test_user_data_and_addresses():
    with pytest.raises(TypeError, match="user_data must be"):
        dynstep.compiled(1000, user_data="text")
    with pytest.raises(ValueError, match="contiguous"):
        dynstep.compiled(1000, user_data=np.zeros(9)[::2])
    for wrong in (identity, None, 1.5, True):
        with pytest.raises(TypeError, match="compiled function"):
            dynstep.compiled(wrong)
    with pytest.raises(ValueError, match="no address"):
        dynstep.compiled(0)
    prototype = dynstep.signature("force", "ctypes")(lambda *_: 0)
    with pytest.raises(ValueError, match="args"):
        MechanicalSystem(1, prototype, args=(1,))
    assert "compiled function at" in repr(dynstep.compiled(prototype, ctypes.c_int(3)))


@pytest.mark.parametrize("arguments, error, words", [
    (((0, 0.0), [1, 2]), ValueError, "dt = 0"),
    (((0, -1), [1, 2]), ValueError, "dt = -1"),
    (((0, np.nan), [1, 2]), ValueError, "dt"),
    (([0, 1, 1], [1, 2, 3]), ValueError, r"times\[2\]"),
    (([0, 1], [1, 2, 3]), ValueError, "times has 2 entries for 3 samples"),
    (([0, np.inf], [1, 2]), ValueError, "times"),
    (((0, 1), [1]), ValueError, "two or more samples"),
    (((0, 1), [[1, 2], [3, np.nan]]), ValueError, r"samples\[1, 1\]"),
    (((0, 1), 5.0), ValueError, "samples"),
    (((0, 1), np.ones((2, 3)), np.ones((4, 3))), ValueError, "pattern has the shape"),
    (((0, 1), np.ones((2, 3)), np.ones(4)), ValueError, "pattern has the shape"),
    (((0, 1), np.ones(3), [1.0, np.nan]), ValueError, "pattern"),
    (((0, 1), [1, 2], None, "forever"), ValueError, "outside must be one of"),
    (((0, 1), [1j, 2]), TypeError, "samples"),
])
def test_load_table(arguments, error, words):
    with pytest.raises(error, match=words):
        LoadTable(*arguments)


@pytest.mark.parametrize("call, error, words", [
    (lambda i: i.step(0.0), ValueError, "h = 0"),
    (lambda i: i.step(np.nan), ValueError, "h"),
    (lambda i: i.step("1"), TypeError, "h"),
    (lambda i: i.run(np.nan, 0.1), ValueError, "t_end"),
    (lambda i: i.run(1.0, -0.1), ValueError, "sign"),
    (lambda i: i.run(1.0, 0.1, max_steps=0), ValueError, "max_steps"),
    (lambda i: i.start(np.nan, [1, 2], [0, 0]), ValueError, "t = nan"),
    (lambda i: i.start(0.0, [1], [0, 0]), ValueError, "q has the shape"),
    (lambda i: i.start(0.0, [1, 2], [0, np.nan]), ValueError, r"v\[1\]"),
])
def test_integrator(call, error, words):
    integrator = Integrator(SYSTEM, "newmark")
    integrator.start(0.0, [1, 2], [0, 0])
    with pytest.raises(error, match=words):
        call(integrator)
    integrator.start(0.0, [1, 2], [0, 0])
    integrator.step(0.1)
    assert integrator.t == 0.1


def test_integrator_before_its_start():
    integrator = Integrator(SYSTEM, "newmark")
    for call in (lambda: integrator.step(0.1), lambda: integrator.run(1.0, 0.1), lambda: integrator.t,
                 lambda: integrator.energy, lambda: integrator.tableau()):
        with pytest.raises(ValueError, match="start"):
            call()
