# SPDX-License-Identifier: BSD-3-Clause
"""A block on a spring, on a belt that moves.

It sticks to the belt until the spring is stronger than static friction, slips back against the weaker kinetic one, and
sticks again.  What the force is depends on the phase, and events change it.

usage: stick_slip.py [CYCLE.png]
"""
import sys

import numpy as np

import dynstep

SPRING, BELT, STATIC, KINETIC = 1.0, 0.5, 1.0, 0.6          # mass 1
slip = -1                                       # sign of the velocity on the belt, 0: it sticks; at rest it is too slow


def force(t, q, v):
    return -SPRING*q - slip*KINETIC if slip else [0.0]      # with the belt, at constant speed


def speed_of_belt(t, q, v):                     # each phase watches for its own end; a constant is never zero
    return v[0] - BELT if slip else 1.0


def static_friction(t, q, v):
    return 1.0 if slip else STATIC - SPRING*abs(q[0])


def stop(t, q, v):
    global slip
    slip = 0 if SPRING*abs(q[0]) < STATIC else int(-np.sign(q[0]))
    return q, [BELT]                            # within rounding it is that already


def let_go(t, q, v):
    global slip
    slip = int(-np.sign(q[0]))                  # against the pull of the spring
    return True                                 # the force has changed


events = [dynstep.Event(speed_of_belt, action=stop), dynstep.Event(static_friction, action=let_go)]
block = dynstep.MechanicalSystem(1, force)
solution = dynstep.solve(block, (0, 40), 0.0, 0.0, rtol=1e-10, atol=1e-12, events=events)

sticks, slips = solution.t_events
# omega = 1: it slips on a circle about (KINETIC, 0), from (STATIC, BELT) to (2*KINETIC - STATIC, BELT)
excess = STATIC - KINETIC
period = 2*excess/BELT + 2*(np.pi - np.arctan(excess/BELT))
print(solution)
print(f"period {np.diff(slips).mean():.12f}, exact {period:.12f}")
error = max(np.abs(np.diff(slips) - period).max(), np.abs(np.diff(sticks[1:]) - period).max(),
            np.abs(solution.q_events[0][1:] - (2*KINETIC - STATIC)).max())
print(f"largest error of a period or place {error:.1e} in {slips.size} cycles")
assert solution.success and slips.size == 6 and error < 1e-10

if len(sys.argv) > 1:
    import matplotlib.pyplot as plt

    plt.plot(solution.q[0], solution.v[0], ".-", markersize=3)
    plt.xlabel("q")
    plt.ylabel("v")
    plt.savefig(sys.argv[1])
