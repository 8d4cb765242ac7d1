# SPDX-License-Identifier: BSD-3-Clause
"""A ball that bounces until it rests.

Each bounce keeps three fourths of the speed, so there are infinitely many of them in a finite time: below a speed that
does not matter any more, the ball lies on the floor.

usage: bouncing_ball.py [HEIGHT.png]
"""
import sys

import numpy as np

import dynstep

GRAVITY, RESTITUTION, SLOW = 9.81, 0.75, 1e-3    # m/s^2, -, m/s
rests = False


def force(t, q, v):
    return [0.0 if rests else -GRAVITY]


def height(t, q, v):                             # where the ball rests there is nothing to watch for
    return 1.0 if rests else q[0]


def bounce(t, q, v):
    global rests
    rests = -RESTITUTION*v[0] < SLOW
    return (0.0*q, 0.0*v) if rests else (q, -RESTITUTION*v)


ball = dynstep.MechanicalSystem(1, force, velocity_free=True)
floor = dynstep.Event(height, direction=-1, action=bounce)
solution = dynstep.solve(ball, (0, 5), 1.0, 0.0, events=floor, dense_output=True)
times, speeds = solution.t_events[0], -solution.v_events[0][:, 0]

first = np.sqrt(2/GRAVITY)                       # in closed form
expected = GRAVITY*first*RESTITUTION**np.arange(times.size)
flights = 2*expected[1:]/GRAVITY
error = max(np.abs(speeds - expected).max(), np.abs(times - first - np.append(0.0, flights.cumsum())).max())
print(solution)
print(f"{times.size} bounces to t = {times[-1]:.6f} s, largest error of a time or speed {error:.1e}")
print(f"infinitely many would end at {first*(1 + RESTITUTION)/(1 - RESTITUTION):.6f} s")
assert solution.success and rests and error < 1e-13 and not solution.q[0, -1]

if len(sys.argv) > 1:
    import matplotlib.pyplot as plt

    t = np.linspace(0, 5, 2001)
    plt.plot(t, solution.sol(t)[0][0])
    plt.plot(times, 0*times, ".")
    plt.xlabel("t [s]")
    plt.ylabel("height [m]")
    plt.savefig(sys.argv[1])
