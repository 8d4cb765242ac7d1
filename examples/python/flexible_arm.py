# SPDX-License-Identifier: BSD-3-Clause
"""A flexible arm turns from 90 degrees to 0 by feedback of hub and tip (Xie 1995, section 4.5).

The thesis starts at 90 degrees; the beam is linear, though its deflections are not small then.

usage: flexible_arm.py [FIGURE.png]      draws a figure where a name is given
"""
import sys

import numpy as np

import dynstep

arm = dynstep.FlexibleArm(segments=20, closed_loop=True)
q0 = arm.straight(np.pi/2)
solution = dynstep.solve(arm, t_span=(0, 8), q0=q0, v0=0*q0, method=dynstep.Pade(3, 4), h=0.01)
hub, tip = np.degrees(arm.hub_angle(solution.q)), arm.tip_deflection(solution.q)

print(f"{'t':>4}{'hub [degrees]':>16}{'tip deflection':>16}")
for i in range(0, solution.t.size, 100):
    print(f"{solution.t[i]:3.0f}.{hub[i]:16.8f}{tip[i]:16.10f}")
print(solution.counts["steps"], "steps,", solution.counts["factorizations"], "factorizations")
print(f"largest deflection of the tip: {tip.min():.4f} and {tip.max():.4f} of the arm's length")
assert solution.success and abs(hub[-1]) < 1

if len(sys.argv) > 1:
    import matplotlib.pyplot as plt

    figure, (above, below) = plt.subplots(2, sharex=True, layout="constrained")
    above.plot(solution.t, hub)
    above.set_ylabel("hub angle [degrees]")
    below.plot(solution.t, tip)
    below.set_ylabel("tip deflection / arm's length")
    below.set_xlabel("time (dimensionless)")
    for axes in above, below:
        axes.grid(alpha=0.3)
    figure.suptitle(f"Flexible arm, closed loop, {arm.segments} segments, {solution.method!r}, h = 0.01")
    figure.savefig(sys.argv[1])
