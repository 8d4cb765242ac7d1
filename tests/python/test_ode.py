# SPDX-License-Identifier: BSD-3-Clause
"""First-order systems: what they take, and what they refuse."""
import numpy as np
import pytest

import dynstep
from dynstep import Integrator, LinearOde, LinearSystem, LoadTable, MechanicalSystem, OdeSystem, solve, solve_ode


def decay(t, y):
    return -y


@pytest.mark.parametrize("make, error, match", [
    (lambda: OdeSystem(0, decay), ValueError, "n = 0"),
    (lambda: OdeSystem(1.5, decay), TypeError, "n must be an integer"),
    (lambda: OdeSystem(2, None), TypeError, "rhs is None"),
    (lambda: OdeSystem(2, 3), TypeError, "rhs must be a function"),
    (lambda: OdeSystem(2, decay, "no"), TypeError, "jacobian must be a function"),
    (lambda: OdeSystem(2, decay, jacobian_kind="banded"), ValueError, "jacobian_kind must be"),
    (lambda: OdeSystem(2, decay, jacobian_kind=(2, 0)), ValueError, "kl of jacobian_kind = 2"),
    (lambda: OdeSystem(2, decay, user_data=np.ones(1)), ValueError, "user_data is passed to compiled functions"),
    (lambda: LinearOde(None), TypeError, "A is None"),
    (lambda: LinearOde(np.ones((2, 3))), ValueError, "A has the shape"),
    (lambda: LinearOde([[1.0, np.nan], [0.0, 1.0]]), ValueError, r"A\[0, 1\] = nan"),
    (lambda: LinearOde(np.eye(2), 3.0), TypeError, "source must be a function"),
    (lambda: LinearOde(np.eye(2), LoadTable((0, 1), np.ones((3, 4)))), ValueError, "the sizes do not fit"),
    (lambda: LinearSystem(1.0, feedback=(1.0, 2.0)), ValueError, r"feedback must be a tuple \(b, k, c\)"),
    (lambda: LinearSystem(1.0, feedback=([1.0, 2.0], [1.0], None)), ValueError, "k of feedback has the shape"),
    (lambda: LinearSystem(1.0, feedback=([1.0, np.inf], None, None)), ValueError, r"b of feedback\[1\] = inf"),
    (lambda: LinearSystem(np.ones(3), feedback=([1.0, 2.0], None, None)), ValueError, "feedback has 2 rows"),
])
def test_wrong_systems_are_named(make, error, match):
    with pytest.raises(error, match=match):
        make()


@pytest.mark.parametrize("changed, error, match", [
    ({"system": LinearSystem(1.0)}, TypeError, "goes with solve"),
    ({"system": 7.0}, TypeError, "system must be"),
    ({"system": OdeSystem(2, decay)}, ValueError, r"y0 has the shape \(1,\), expected \(2,\)"),
    ({"system": OdeSystem(1, decay), "args": (1,)}, ValueError, "args go with a function"),
    ({"y0": [[1.0]]}, ValueError, "y0 has the shape"),
    ({"y0": None}, TypeError, "y0 is None"),
    ({"y0": np.nan}, ValueError, "y0"),
    ({"t_span": (0, 1, 2)}, ValueError, "t_span"),
    ({"h": 0.0}, ValueError, "h must not be zero"),
    ({"h": -0.1}, ValueError, "points away"),
    ({"t_eval": [2.0]}, ValueError, r"t_eval\[0\]"),
    ({"every": -1}, ValueError, "every"),
    ({"max_steps": 0}, ValueError, "max_steps"),
    ({"dense_output": 1}, TypeError, "dense_output"),
    ({"observer": 1}, TypeError, "observer"),
    ({"method": "runge"}, ValueError, "method must be"),
    ({"method": "newmark"}, ValueError, "first order"),
])
def test_wrong_runs_are_named(changed, error, match):
    method = {} if "bi" in dynstep.methods() else {"method": "newmark"}
    if method and match in ("h must not be zero", "points away"):
        pytest.skip("no method for first-order systems yet")
    with pytest.raises(error, match=match):
        solve_ode(**{"system": decay, "t_span": (0, 1), "y0": 1.0, "h": 0.1, **method, **changed})


def test_each_system_has_its_own_solve():
    for act in (lambda s: solve(s, (0, 1), 1, 0, h=0.1), Integrator, lambda s: dynstep.check_system(s, 0, [1], [0])):
        for system in (OdeSystem(1, decay), LinearOde(1.0)):
            with pytest.raises(TypeError, match="goes with solve_ode"):
                act(system)
    with pytest.raises(TypeError, match="goes with solve;"):
        solve_ode(MechanicalSystem(1, lambda t, q, v: -q), (0, 1), 1.0, "newmark", h=0.1)


def test_feedback_wants_a_method_that_takes_it():
    system = LinearSystem(np.ones(2), feedback=([1.0, 0.0], [0.0, 1.0], None))
    assert "feedback" in repr(system) and system.n == 2
    with pytest.raises(ValueError, match="coupling"):
        solve(system, (0, 1), [1, 2], [0, 0], h=0.1)


def test_systems_show_what_they_are():
    sparse = pytest.importorskip("scipy.sparse")
    assert repr(OdeSystem(3, decay, lambda t, y: 1)) == "<first-order system of 3 unknown(s) with rhs and jacobian>"
    assert "A dense" in repr(LinearOde(np.ones((2, 2)))) and LinearOde(3.0).n == 1
    n = 40
    ring = np.roll(np.eye(n), 1, axis=1) + np.roll(np.eye(n), -1, axis=1)
    system = LinearOde(sparse.csr_array(ring))
    assert system.ordering is not None and "reordered" in repr(system) and "kl=2, ku=2" in system.storage
