# SPDX-License-Identifier: BSD-3-Clause
"""The flexible arm: its frequencies, its feedback, its torque, what it refuses."""
import numpy as np
import pytest

import dynstep
from dynstep import FlexibleArm, Pade, solve

TIMOSHENKO = {"beam": "timoshenko"}


@pytest.mark.parametrize("segments, options, frequencies", [       # docs/theory/flexible-arm.md
    (20, {}, [10.1386, 20.6687, 35.5307, 60.9669, 92.3043, 124.5055]),
    (10, TIMOSHENKO, [10.4657, 19.8450, 30.5413, 49.4786, 72.7140, 95.1285]),
    (10, {**TIMOSHENKO, "variant": "symmetric"}, [10.4168, 19.8294, 30.5603, 49.5286, 72.7620, 95.1670])])
def test_frequencies(segments, options, frequencies):
    linalg = pytest.importorskip("scipy.linalg")
    arm = FlexibleArm(segments, **options)
    squares = np.sort(linalg.eigvals(arm.K.toarray(), arm.M.toarray()).real)
    assert abs(squares[0]) < 1e-6                                   # the free arm
    assert np.sqrt(squares[1:7]) == pytest.approx(frequencies, abs=6e-5)
    assert np.abs(arm.K.toarray() @ arm.straight(1.0)).max() < 1e-9
    assert arm.has_energy == (options.get("variant") == "symmetric" or not options)


@pytest.mark.parametrize("options", [
    {}, {**TIMOSHENKO, "segments": 8}, {"variant": "listing"}, {"gains": [9.0, 4.0, 0.5, 0.1]}])
def test_closed_loop_is_the_dense_one(options):
    arm = FlexibleArm(closed_loop=True, **options)
    b, k, c = arm.feedback
    full = dynstep.LinearSystem(arm.M.toarray(), np.outer(b, c), arm.K.toarray() + np.outer(b, k))
    q0 = arm.straight(np.pi/2)
    one, other = (solve(x, (0, 5), q0, 0*q0, Pade(3, 4), h=0.01, every=50) for x in (arm, full))
    assert one.success and other.success
    assert arm.hub_angle(q0) == np.pi/2 and abs(arm.tip_deflection(q0)) == 0.0
    assert np.abs(one.q - other.q).max() < 1e-11
    assert np.array_equal(arm.tip_deflection(one.q), one.q[-1] - arm.hub_angle(one.q))


def test_torque():
    arm = FlexibleArm(10, input=lambda t: 0.1)
    s = solve(arm, (0, 2), np.zeros(11), np.zeros(11), "pade", h=0.005)
    assert arm.hub_angle(s.q[:, -1]) == pytest.approx(0.655736783452, abs=1e-11)     # an independent study
    pushed = FlexibleArm(10, closed_loop=True, input=lambda t: 0.1)
    s = solve(pushed, (0, 100), np.zeros(11), np.zeros(11), Pade(3, 4), h=0.05)
    assert s.q[:, -1] == pytest.approx(pushed.straight(0.1/18.655), abs=1e-4)     # slowest pole -0.067 +- 3.183i
    with pytest.raises(ZeroDivisionError):
        solve(FlexibleArm(10, input=lambda t: 1/0), (0, 1), np.zeros(11), np.zeros(11), "pade", h=0.1)


@pytest.mark.parametrize("error, name, arguments", [
    (ValueError, "segments", {"segments": 3}), (ValueError, "segments", {"segments": 0}),
    (TypeError, "segments", {"segments": 4.0}), (ValueError, "segments", {**TIMOSHENKO, "segments": 1}),
    (ValueError, "beam", {"beam": "bernoulli"}), (ValueError, "variant", {"variant": "printed"}),
    (ValueError, "arm_listing", {**TIMOSHENKO, "variant": "listing"}), (TypeError, "closed_loop", {"closed_loop": 1}),
    (ValueError, "gains", {"closed_loop": True, "gains": [1.0, 2.0]}),
    (ValueError, "gains", {"gains": [1.0, 2.0, 3.0, 4.0]}),
    (ValueError, "gains", {"closed_loop": True, "gains": [1.0, np.nan, 3.0, 4.0]}),
    (TypeError, "input", {"input": 0.1}), (ValueError, "eta", {"eta": 0.0}),
    (ValueError, "beta", {"beta": -1.0}), (ValueError, "delta", {"delta": np.inf}),
    (ValueError, "zeta", {"zeta": 5.0}), (ValueError, "gamma", {**TIMOSHENKO, "gamma": 0.0}), (TypeError, "mu", {"mu": None})])
def test_refuses(error, name, arguments):
    with pytest.raises(error, match=name):
        FlexibleArm(**arguments)


def test_arguments_of_methods():
    arm = FlexibleArm(5)
    with pytest.raises(ValueError, match="q has the shape"):
        arm.hub_angle(np.zeros(5))
    with pytest.raises(ValueError, match="angle"):
        arm.straight(np.nan)
    with pytest.raises(ValueError, match="Pade|pade|bi"):                  # feedback, and Newmark
        solve(FlexibleArm(5, closed_loop=True), (0, 1), arm.straight(1.0), arm.straight(0.0), "newmark", h=0.1)
