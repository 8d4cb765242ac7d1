# SPDX-License-Identifier: BSD-3-Clause
"""The interpreter's lock, threads, Ctrl-C, and memory."""
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest
from problems import duffing_force, same_bits

import dynstep
from dynstep import Integrator, LinearSystem, MechanicalSystem, solve


def long_run(system, seconds=0.5, **options):
    """Seconds in which `system` was integrated, at least about so many."""
    steps, elapsed = 1000, 0.0
    while elapsed < seconds:
        steps *= max(2, min(50, int(1.3*seconds/max(elapsed, 1e-3))))
        begun = time.perf_counter()
        s = solve(system, (0, steps), np.ones(system.n), np.zeros(system.n), "newmark", h=1.0, every=0, **options)
        elapsed = time.perf_counter() - begun
        assert s.success
    return elapsed


def compiled_force():
    numba = pytest.importorskip("numba")

    @numba.cfunc(dynstep.signature("force"))
    def force(n, t, q, v, f, ctx):
        for i in range(n):
            f[i] = -q[i]*(1.0 + q[i]*q[i])*1e-3
        return 0
    return force


@pytest.mark.parametrize("kind", ["matrices", "compiled force"])
def test_other_threads_run_during_a_run(kind):
    if kind == "matrices":
        k = np.eye(60)*2e-3 - np.eye(60, k=1)*1e-3 - np.eye(60, k=-1)*1e-3
        system = LinearSystem(1.0, K=k)
    else:
        system = MechanicalSystem(3, compiled_force(), tangent_kind="diagonal", velocity_free=True)
    ticks, done = [], threading.Event()

    def ticker():
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.0005)

    thread = threading.Thread(target=ticker)
    thread.start()
    try:
        # between its pieces of 50 ms a run gives the lock away in any case: look inside of them
        elapsed = long_run(system)
    finally:
        done.set()
        thread.join()
    longest = np.diff(ticks).max()
    assert len(ticks) > 60*elapsed, f"{len(ticks)} ticks in {elapsed:.2f} s, longest pause {longest:.3f} s"


def test_integrators_in_parallel_give_the_same_bits():
    force = compiled_force()
    systems = [MechanicalSystem(3, duffing_force), MechanicalSystem(3, force), LinearSystem(np.ones(3), K=np.eye(3)),
               MechanicalSystem(3, duffing_force, velocity_free=False, energy=lambda t, q, v: 0.0)]
    start = np.array([1.0, 0.5, 0.2]), np.zeros(3)

    def job(system):
        return solve(system, (0, 20), *start, h=0.1, observer=lambda *_: False)

    expected = [job(s) for s in systems]
    results = {}
    threads = [threading.Thread(target=lambda i=i: results.update({i: job(systems[i % len(systems)])}))
               for i in range(3*len(systems))]          # the same system in three threads, too
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert len(results) == len(threads)
    assert all(same_bits(results[i], expected[i % len(systems)]) for i in results)


def test_one_integrator_in_two_threads_is_refused():
    inside, go_on = threading.Event(), threading.Event()

    def force(t, q, v):
        inside.set()
        go_on.wait(10)
        return -q

    integrator = Integrator(MechanicalSystem(1, force), "newmark")
    thread = threading.Thread(target=integrator.start, args=(0.0, 1.0, 0.0))
    thread.start()
    assert inside.wait(10)
    try:
        for call in (lambda: integrator.step(0.1), lambda: integrator.q, lambda: integrator.start(0.0, 1.0, 0.0)):
            with pytest.raises(RuntimeError, match="two threads"):
                call()
    finally:
        go_on.set()
        thread.join()
    integrator.step(0.1)
    assert integrator.t == 0.1


def test_a_run_is_not_disturbed_between_its_pieces():
    integrator = Integrator(LinearSystem(1.0, K=1.0), "newmark")
    integrator.start(0.0, 1.0, 0.0)
    errors, done = [], threading.Event()

    def disturb():
        while not done.is_set():
            try:
                integrator.step(1.0)
            except RuntimeError as error:
                errors.append(str(error))
            time.sleep(0.001)

    integrator.run(1.0, 0.5)
    thread = threading.Thread(target=disturb)
    begun = time.perf_counter()
    with integrator._handle:                     # the same that run() holds
        thread.start()
        while time.perf_counter() - begun < 0.3:
            assert integrator.t == 1.0
        done.set()
        thread.join()
    assert errors and all("two threads" in e for e in errors)


def test_exceptions_belong_to_their_thread():
    def job(i, results):
        def force(t, q, v):
            if t > 0.5:
                raise KeyError(i)
            return -q
        try:
            solve(MechanicalSystem(1, force), (0, 1), 1, 0, h=0.01)
        except KeyError as error:
            results[i] = error.args[0]

    results = {}
    threads = [threading.Thread(target=job, args=(i, results)) for i in range(6)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert results == {i: i for i in range(6)}


# ---- Ctrl-C ----

INTERRUPTED = {
    "matrices": "system = dynstep.LinearSystem(np.ones(5), K=1.0)",
    "python": "system = dynstep.MechanicalSystem(5, lambda t, q, v: -q)",
    "compiled": """
        import numba
        @numba.cfunc(dynstep.signature("force"))
        def force(n, t, q, v, f, ctx):
            for i in range(n):
                f[i] = -q[i]
            return 0
        system = dynstep.MechanicalSystem(5, force, velocity_free=True)""",
    "events": """
        import numba
        @numba.cfunc(dynstep.signature("event"))
        def event(n, count, t, q, v, s, ctx):
            s[0] = q[0]
            return 0
        system = dynstep.LinearSystem(np.ones(5), K=1.0)""",
    "integrator": "system = dynstep.LinearSystem(np.ones(5), K=1.0)",
    "first order": "system = dynstep.LinearOde(-np.ones(5))",
}


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
@pytest.mark.parametrize("kind", INTERRUPTED)
def test_ctrl_c_within_a_second(kind):
    if kind in ("compiled", "events"):
        pytest.importorskip("numba")
    run = {"integrator": "i = dynstep.Integrator(system); i.start(0, np.ones(5), np.zeros(5)); i.run(1e9, 0.1)",
           "events": "dynstep.solve(system, (0, 1e9), np.ones(5), np.zeros(5), t_eval=[], events=event)",
           "first order": "dynstep.solve_ode(system, (0, 1e9), np.ones(5), 'pade', h=0.1, every=0)"}.get(
               kind, "dynstep.solve(system, (0, 1e9), np.ones(5), np.zeros(5), h=0.1, every=0)")
    code = f"""
import signal, time
import numpy as np, dynstep
signal.signal(signal.SIGINT, signal.default_int_handler)
{textwrap.dedent(INTERRUPTED[kind])}
print("ready", flush=True)
try:
    {run}
except KeyboardInterrupt:
    print("interrupted", time.time(), flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            time.sleep(0.7)
            sent = time.time()
            process.send_signal(signal.SIGINT)
            words = process.stdout.readline().split()
            process.wait(20)
        finally:
            process.kill()
    assert words[0] == "interrupted" and process.returncode == 0
    assert float(words[1]) - sent < 1.0


# ---- Memory ----

def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1])*os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="needs /proc")
@pytest.mark.parametrize("kind", ["raise", "wrong shape", "failed", "fine"])
def test_memory_does_not_grow(kind):
    def force(t, q, v):
        ballast = np.ones(100_000)               # 800 kB in the frame that raises
        if t < 0.15 or kind == "fine":
            return -q*ballast[0]
        if kind == "raise":
            raise ValueError("no")
        return np.ones(7) if kind == "wrong shape" else q*np.nan

    system = MechanicalSystem(3, force, energy=lambda t, q, v: 0.0)

    def once():
        try:
            solve(system, (0, 0.3), np.ones(3), np.zeros(3), "central-difference", h=0.1, observer=lambda *_: False)
        except ValueError:
            pass

    for _ in range(300):
        once()
    before = resident()
    for _ in range(3000):
        once()
    assert resident() - before < 8*2**20         # a leak of one frame each would be 2.4 GB
