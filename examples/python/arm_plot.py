# SPDX-License-Identifier: BSD-3-Clause
import matplotlib.pyplot as plt
import numpy as np
import dynstep

arm = dynstep.FlexibleArm(segments=20, closed_loop=True)
q0 = arm.straight(np.pi/2)                                           # from 90 degrees to 0, at rest
s = dynstep.solve(arm, (0, 8), q0, 0*q0, dynstep.Pade(3, 4), h=0.01)
plt.plot(s.t, arm.hub_angle(s.q), s.t, arm.tip_deflection(s.q))
plt.legend(["angle of the hub [rad]", "deflection of the tip / length"])
plt.xlabel("time (dimensionless)")
plt.savefig("arm.png")
