# SPDX-License-Identifier: BSD-3-Clause
"""What is recorded, and what can be done with it."""
import subprocess
import sys

import numpy as np
import pytest
from problems import free_vibration, pendulum_energy, pendulum_force, same_bits

import dynstep
from dynstep import Integrator, LinearSystem, MechanicalSystem, solve

SYSTEM, Q0, V0, exact = free_vibration(2)


@pytest.mark.parametrize("span, h", [((0, 2), 0.1), ((1, -1), -0.1), ((0, 2), 0.3), ((5, 5), 0.1), ((0, 0.05), 0.1)])
@pytest.mark.parametrize("every", [0, 1, 3, 1000])
def test_every(span, h, every):
    s = solve(SYSTEM, span, Q0, V0, "newmark", h=h, every=every)
    full = round(abs((span[1] - span[0])/h), 9)
    times = [span[0] + k*h for k in range(int(full) + 1)]
    times = times[:1 if every == 0 else None:every or 1]
    if abs(times[-1] - span[1]) > 1e-9:
        times.append(span[1])
    if every == 0:
        times = [span[1]]
    assert np.allclose(s.t, times, rtol=0, atol=1e-14) and s.t[-1] == span[1]
    assert s.q.shape == s.v.shape == s.a.shape == (2, s.t.size) and s.success and s.status == 0
    assert all(x.dtype == np.float64 and x.flags.writeable for x in (s.t, s.q, s.v, s.a))
    assert s.counts["steps"] == int(np.ceil(full))
    assert np.array_equal(s.a, -4*s.q) or np.allclose(s.a, -4*s.q, rtol=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_t_eval(sign):
    times = sign*np.array([0.0, 0.0, 0.1, 0.123, 0.15, 0.15, 0.2, 1.97, 2.0])
    s = solve(SYSTEM, (0, 2*sign), Q0, V0, h=0.1*sign, t_eval=times)
    assert np.array_equal(s.t, times)
    assert np.abs(s.q - exact(times)).max() < 1e-7
    steps = solve(SYSTEM, (0, 2*sign), Q0, V0, h=0.1*sign)
    assert np.array_equal(s.q[:, 2], steps.q[:, 1]) and np.array_equal(s.a[:, -1], steps.a[:, -1])
    few = solve(SYSTEM, (0, 2*sign), Q0, V0, h=0.1*sign, t_eval=times[3])
    assert few.t.tolist() == [times[3]] and np.array_equal(few.q[:, 0], s.q[:, 3])
    none = solve(SYSTEM, (0, 2*sign), Q0, V0, h=0.1*sign, t_eval=[])
    assert none.t.shape == (0,) and none.q.shape == (2, 0) and none.success and none.counts["steps"] == 20


@pytest.mark.parametrize("sign", [1, -1])
def test_dense_output(sign):
    s = solve(SYSTEM, (0, 2*sign), Q0, V0, h=0.1*sign, dense_output=True)
    assert same_bits(s, solve(SYSTEM, (0, 2*sign), Q0, V0, h=0.1*sign))
    times = sign*np.linspace(0, 2, 77)
    q, v, a = s.sol(times)
    assert q.shape == (2, 77)
    assert np.abs(q - exact(times)).max() < 1e-7 and np.abs(a + 4*q).max() < 1e-4
    inside = solve(SYSTEM, (0, 2*sign), Q0, V0, h=0.1*sign, t_eval=times)
    assert np.abs(inside.q - q).max() < 1e-14 and np.abs(inside.a - a).max() < 1e-11
    q1, v1, a1 = s.sol(times[5])
    assert q1.shape == (2,) and np.array_equal(q1, q[:, 5]) and np.array_equal(v1, v[:, 5])
    assert np.array_equal(s.sol(s.t)[0], s.q)
    for outside in (-0.1*sign, 2.1*sign, np.nan, [0.5*sign, 3*sign]):
        with pytest.raises(ValueError, match="outside the run"):
            s.sol(outside)
    assert "interpolant" in repr(s.sol) and s.sol.t_max - s.sol.t_min == 2
    assert solve(SYSTEM, (0, 1), Q0, V0, h=0.1).sol is None


def test_dense_output_with_every_and_t_eval():
    s = solve(SYSTEM, (0, 1), Q0, V0, h=0.1, every=4, dense_output=True)
    assert same_bits(s, solve(SYSTEM, (0, 1), Q0, V0, h=0.1, every=4))
    assert same_bits(solve(SYSTEM, (0, 1), Q0, V0, h=0.1, every=0, dense_output=True),
                     solve(SYSTEM, (0, 1), Q0, V0, h=0.1, every=0))
    assert abs(s.sol(0.15)[0][0] - np.cos(0.3)) < 1e-8
    t = [0.05, 0.55]
    with_sol = solve(SYSTEM, (0, 1), Q0, V0, h=0.1, t_eval=t, dense_output=True)
    assert np.array_equal(with_sol.t, t)
    assert np.abs(with_sol.q - solve(SYSTEM, (0, 1), Q0, V0, h=0.1, t_eval=t).q).max() < 1e-14
    point = solve(SYSTEM, (3, 3), Q0, V0, h=0.1, dense_output=True)
    assert np.array_equal(point.sol(3.0)[0], Q0) and point.sol([3.0, 3.0])[0].shape == (2, 2)


def test_observer_stops():
    seen = []

    def observer(t, q, v, a):
        seen.append(t)
        return q[0] < 0
    s = solve(SYSTEM, (0, 2), Q0, V0, "newmark", h=0.1, observer=observer)
    assert s.status == 1 and s.success and "observer" in s.message
    assert s.q[0, -1] < 0 <= s.q[0, -2] and seen == s.t[1:].tolist()
    for result in (None, False, 0, np.False_, []):
        assert solve(SYSTEM, (0, 1), Q0, V0, h=0.1, observer=lambda *_, r=result: r).status == 0
    with_times = solve(SYSTEM, (0, 2), Q0, V0, "newmark", h=0.1, observer=observer, t_eval=[0.5, 0.75, 1.9])
    assert with_times.t.tolist() == [0.5, 0.75]
    assert solve(SYSTEM, (0, 2), Q0, V0, "newmark", h=0.1, observer=observer, every=0).t[0] == s.t[-1]


def test_max_steps():
    for limit, reached in ((1, 0.1), (7, 0.7), (19, 1.9)):
        s = solve(SYSTEM, (0, 2), Q0, V0, "newmark", h=0.1, max_steps=limit)
        assert not s.success and s.status == -8 and s.counts["steps"] == limit
        assert f"max_steps = {limit}" in s.message and s.t[-1] == pytest.approx(reached) and s.t.size == limit + 1
    for limit in (20, 21, 2**40):
        assert solve(SYSTEM, (0, 2), Q0, V0, "newmark", h=0.1, max_steps=limit).success
    assert solve(SYSTEM, (0, 2), Q0, V0, "newmark", h=0.1, max_steps=5, t_eval=[0.25, 1.0]).t.tolist() == [0.25]
    far = solve(SYSTEM, (0, 1e12), Q0, V0, "newmark", h=0.1, max_steps=10)
    assert far.t.size == 11


def test_a_long_record_grows():
    steps = 2_000_000
    s = solve(LinearSystem([1.0, 1.0], K=1.0), (0, steps), [1, 0], [0, 0], "newmark", h=1.0)
    assert s.t.size == steps + 1 and np.array_equal(s.t, np.arange(steps + 1.0))
    assert s.q.shape == (2, steps + 1) and s.q[0, 0] == 1 and np.abs(s.q[0]).max() < 1.0001
    parts = [solve(LinearSystem([1.0, 1.0], K=1.0), (0, steps), [1, 0], [0, 0], "newmark", h=1.0, every=1000)]
    assert np.array_equal(parts[0].q, s.q[:, ::1000])


def test_no_memory_says_what_helps():
    big = LinearSystem(1.0*np.ones(1000))
    from dynstep._record import Record
    record = Record((10**6, 10**6, 10**6, 0, 0), 2)
    with pytest.raises(MemoryError, match="every=.*t_eval="):
        record._resize(10**13)
    assert solve(big, (0, 1), np.zeros(1000), np.zeros(1000), h=0.5).success


def test_too_many_points_are_refused_beforehand():
    turn = dynstep.LinearOde([[0.0, 1.0], [-4.0, 0.0]])
    many = "no memory for 1000000000000[0-9] points.*every="
    with pytest.raises(MemoryError, match=many):
        dynstep.solve_ode(turn, (0, 1e12), [1.0, 0.0], "pade", h=0.1)
    for options in ({}, {"dense_output": True}, {"dense_output": True, "every": 0}):
        with pytest.raises(MemoryError, match=many):
            solve(SYSTEM, (0, 1e12), Q0, V0, "newmark", h=0.1, **options)
    # an observer may end the run before
    assert solve(SYSTEM, (0, 1e12), Q0, V0, "newmark", h=0.1, observer=lambda t, q, v, a: t > 1).status == 1


# ---- The Solution object ----

def test_solution_attributes_and_repr():
    s = solve(SYSTEM, (0, 2), Q0, V0, "newmark", h=0.1)
    assert s.system is SYSTEM and s.method == dynstep.Newmark()
    assert s.message == "the end of the interval was reached"
    assert set(s.counts) >= {"steps", "substeps", "forces", "factorizations", "solves"}
    assert all(type(c) is int for c in s.counts.values())
    for text in ("success: True", "t = 0 to 2", "21 point(s) of 2 coordinate(s)", "Newmark(", "steps 20"):
        assert text in repr(s)


def test_energy():
    s = solve(MechanicalSystem(1, pendulum_force, energy=pendulum_energy), (0, 2), 1.0, 0.5, h=0.1)
    assert s.energy().shape == s.t.shape and np.ptp(s.energy()) < 1e-8
    with pytest.raises(ValueError, match="no energy function"):
        solve(MechanicalSystem(1, pendulum_force), (0, 2), 1.0, 0.5, h=0.1).energy()
    integrator = Integrator(MechanicalSystem(1, pendulum_force))
    integrator.start(0, 1, 0)
    with pytest.raises(ValueError, match="no energy"):
        integrator.energy


def test_plot():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    s = solve(SYSTEM, (0, 2), Q0, V0, h=0.1)
    ax = s.plot()
    assert len(ax.lines) == 2 and ax.get_xlabel() == "time t" and "q" in ax.get_ylabel()
    assert np.array_equal(ax.lines[1].get_ydata(), s.q[1])
    figure, other = plt.subplots()
    assert s.plot(-1, of="a", ax=other) is other
    assert other.lines[0].get_label() == "a[1]"
    many = solve(LinearSystem(np.ones(50)), (0, 1), np.ones(50), np.zeros(50), h=0.5).plot(ax=plt.figure().gca())
    assert len(many.lines) == 10
    with pytest.raises(ValueError, match="coordinates = 2"):
        s.plot(2)
    with pytest.raises(ValueError, match="of must be"):
        s.plot(of="energy")
    failed = solve(LinearSystem([0.0]), (0, 1), 1, 0, h=0.1)
    assert failed.t.size == 0 and failed.plot(ax=plt.figure().gca()) is not None
    plt.close("all")


# ---- One step at a time ----

def test_integrator_makes_the_steps_of_solve():
    s = solve(SYSTEM, (0, 2), Q0, V0, h=0.1)
    integrator = Integrator(SYSTEM)
    integrator.start(0.0, Q0, V0)
    for k in range(1, 21):
        integrator.step(0.1)
        assert integrator.t == s.t[k]
        assert all(np.array_equal(getattr(integrator, x), getattr(s, x)[:, k]) for x in "qva")
    assert integrator.counts == s.counts
    integrator.start(0.0, Q0, V0)
    assert integrator.run(2.0, 0.1) is True and np.array_equal(integrator.q, s.q[:, -1])
    integrator.start(0.0, Q0, V0)
    assert integrator.run(2.0, 0.1, max_steps=7) is False and integrator.t == s.t[7]
    assert integrator.run(2.0, 0.1) and integrator.t == 2.0
    assert integrator.run(0.0, -0.1) and np.abs(integrator.q - Q0).max() < 1e-9
    assert "Newmark" in repr(integrator) and integrator.q is not integrator.q


def test_a_failed_step_leaves_the_state():
    force = lambda t, q, v: -q if t < 0.25 else np.array([np.nan])                # noqa: E731
    integrator = Integrator(MechanicalSystem(1, force), "newmark")
    integrator.start(0.0, 1.0, 0.0)
    integrator.run(0.2, 0.1)
    q = integrator.q
    with pytest.raises(dynstep.IntegrationError, match="force returned NaN") as caught:
        integrator.step(0.1)
    assert caught.value.status == -10 and integrator.t == 0.2 and np.array_equal(integrator.q, q)
    integrator.step(0.01)
    assert integrator.t == pytest.approx(0.21)
    with pytest.raises(dynstep.IntegrationError):
        integrator.run(1.0, 0.01)
    assert integrator.t == pytest.approx(0.24)
    with pytest.raises(dynstep.IntegrationError, match="singular"):
        Integrator(LinearSystem([0.0])).start(0, 1, 0)


def test_tableau():
    integrator = Integrator(SYSTEM, dynstep.NewmarkExtrapolation(4, "romberg"))
    integrator.start(0.0, Q0, V0)
    integrator.step(0.5)
    table, numbers = integrator.tableau()
    assert numbers.tolist() == [1, 2, 4, 8] and table.shape == (2, 2, 4, 4)
    assert np.isnan(table[0, 0][np.triu_indices(4, 1)]).all()
    assert np.abs(table[0, :, -1, -1] - integrator.q).max() < 1e-14
    one = solve(SYSTEM, (0, 0.5), Q0, V0, "newmark", h=0.125)
    assert np.abs(table[0, :, 2, 0] - one.q[:, -1]).max() < 1e-14
    assert np.abs(table[1, :, 2, 0] - one.v[:, -1]).max() < 1e-14
    assert np.abs((4*table[..., 1, 0] - table[..., 0, 0])/3 - table[..., 1, 1]).max() < 1e-14
    plain = Integrator(SYSTEM, "newmark")
    plain.start(0.0, Q0, V0)
    plain.step(0.1)
    with pytest.raises(ValueError, match="extrapolation"):
        plain.tableau()


# ---- Progress ----

@pytest.mark.parametrize("with_tqdm", [True, False])
def test_progress(with_tqdm):
    if with_tqdm:
        pytest.importorskip("tqdm")
    code = f"""
import sys
if not {with_tqdm}: sys.modules["tqdm"] = None
import dynstep
s = dynstep.solve(dynstep.LinearSystem(1.0, K=1.0), (0, 100), 1, 0, "newmark", h=0.1, progress=True)
assert s.success
try:
    dynstep.solve(dynstep.MechanicalSystem(1, lambda t, q, v: 1/0), (0, 100), 1, 0, h=0.1, progress=True)
except ZeroDivisionError:
    print("ended")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and done.stdout == "ended\n"
    assert "100" in done.stderr and "1000" in done.stderr.replace("1.00k", "1000")
    quiet = subprocess.run([sys.executable, "-c", code.replace("progress=True", "progress=False")],
                           capture_output=True, text=True, timeout=60)
    assert quiet.stderr == ""


# ---- Checks ----

def test_check_system():
    good = MechanicalSystem(2, lambda t, q, v: -q**3 - v, tangent=lambda t, q, v, a: (np.diag(3*q**2), np.eye(2)))
    report = dynstep.check_system(good, 0.0, [1.0, 2.0], [0.1, 0.2])
    assert report and report.findings == [] and "fits" in repr(report)
    wrong = MechanicalSystem(2, lambda t, q, v: -q**3 - v, tangent=lambda t, q, v, a: (np.diag(2*q**2), np.eye(2)))
    report = dynstep.check_system(wrong, 0.0, [1.0, 2.0], [0.1, 0.2])
    assert not report and any("K" in f for f in report.findings)
    undeclared = MechanicalSystem(2, lambda t, q, v: -q - v, velocity_free=True)
    report = dynstep.check_system(undeclared, 0.0, [1.0, 2.0], [0.1, 0.2])
    assert not report and "v" in repr(report)
    assert dynstep.check_system(SYSTEM, 0.0, Q0, V0)
    with pytest.raises(ValueError, match="q has the shape"):
        dynstep.check_system(SYSTEM, 0.0, [1.0], V0)
    with pytest.raises(ZeroDivisionError):
        dynstep.check_system(MechanicalSystem(1, lambda t, q, v: 1/0), 0.0, 1.0, 1.0)
