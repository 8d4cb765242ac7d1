# SPDX-License-Identifier: BSD-3-Clause
"""A square membrane that is let go from a bump: matrices of scipy.sparse.

w_tt = w_xx + w_yy on a grid of 40 by 40 points, w = 0 on the edges.  The points are counted at random, as a mesh
generator might; the package puts them into a narrow band by itself.
"""
import sys

import numpy as np

import dynstep

try:
    import scipy.sparse as sparse
except ImportError:
    print("this example needs scipy")
    sys.exit(0)

SIDE = 40
STEP = np.pi/(SIDE + 1)                         # of the grid, on a square of side pi

second = sparse.diags_array([-np.ones(SIDE - 1), 2*np.ones(SIDE), -np.ones(SIDE - 1)], offsets=[-1, 0, 1])/STEP**2
stiffness = sparse.csr_array(sparse.kronsum(second, second))
x, y = np.meshgrid(STEP*np.arange(1, SIDE + 1), STEP*np.arange(1, SIDE + 1), indexing="ij")
bump = (np.sin(x)*np.sin(y) + 0.3*np.sin(2*x)*np.sin(3*y)).ravel()

places = np.random.default_rng(7).permutation(SIDE**2)
shuffled = stiffness[places][:, places]
i, j = shuffled.nonzero()
system = dynstep.LinearSystem(M=1.0, K=shuffled)
print(f"{system.n} unknowns; band as the points are counted: {np.abs(i - j).max()} below and above the diagonal")
print(f"inside the library: {system.storage['K']}")

s = dynstep.solve(system, (0, 10), bump[places], np.zeros(system.n), h=0.05, t_eval=[2.5, 5.0, 10.0])


def omega(k):                                   # of the grid, not of the membrane
    return 2/STEP*np.sin(k*STEP/2)


for t, w in zip(s.t, s.q.T):
    exact = np.cos(np.hypot(omega(1), omega(1))*t)*np.sin(x)*np.sin(y) \
        + 0.3*np.cos(np.hypot(omega(2), omega(3))*t)*np.sin(2*x)*np.sin(3*y)
    print(f"t = {t:4}: largest deflection {np.abs(w).max():.6f}, error {np.abs(w - exact.ravel()[places]).max():.1e}")
print(f"energy kept to {np.ptp(s.energy())/s.energy()[0]:.1e}")
