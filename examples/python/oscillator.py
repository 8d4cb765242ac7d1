# SPDX-License-Identifier: BSD-3-Clause
import numpy as np

import dynstep

# 2 q1'' + 0.1 q1' + 3 q1 -   q2 = sin(t)
#   q2'' + 0.1 q2' -   q1 + 2 q2 = 0
system = dynstep.LinearSystem(M=[2.0, 1.0], C=0.1, K=[[3.0, -1.0], [-1.0, 2.0]], load=lambda t: [np.sin(t), 0.0])
solution = dynstep.solve(system, t_span=(0, 30), q0=[1.0, 0.0], v0=[0.0, 0.0], h=0.1)
print(solution)
print(f"q(30) = {solution.q[:, -1]}")
