# SPDX-License-Identifier: BSD-3-Clause
"""An extrapolation that chooses its orders and steps beside scipy's DOP853: evaluations and time for an error.

usage: bench_work_precision.py TESTS      (the folder of point_masses.py)
"""
import sys
import time

import numpy as np

sys.path.insert(0, sys.argv[1])
from point_masses import PROBLEMS, TOLERANCES, by_dop853, by_extrapolation, evaluations  # noqa: E402

GOALS = {1e-6: 0.85, 1e-9: 0.70}
ROUNDS = 2


def measured(method, problem):
    """[(error, evaluations)], [(error, milliseconds)] of runs at all tolerances, the least time of several."""
    counted, timed = [], []
    for tolerance in TOLERANCES:
        best = np.inf
        for _ in range(ROUNDS):
            begun = time.thread_time()
            run = method(problem, tolerance)
            best = min(best, time.thread_time() - begun)
        counted.append(run)
        timed.append((run[0], 1e3*best))
    return counted, timed


print("\nforces f(t,q) in Python, error of the place at the end: Newmark (beta = 0) extrapolated, and DOP853")
print("                        evaluations                              time [ms]")
print("  problem     error     dynstep    DOP853    ratio     goal      dynstep    DOP853    ratio")
for name in PROBLEMS:
    (ours, our_times), (theirs, their_times) = measured(by_extrapolation, name), measured(by_dop853, name)
    for error, goal in GOALS.items():
        n, m = evaluations(ours, error), evaluations(theirs, error)
        t, u = evaluations(our_times, error), evaluations(their_times, error)
        print(f"  {name:10}{error:7.0e}{n:12.0f}{m:10.0f}{n/m:9.2f}  <= {goal:4.2f}{t:13.1f}{u:10.1f}{t/u:9.2f}")
