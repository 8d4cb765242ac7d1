# SPDX-License-Identifier: BSD-3-Clause
"""Austin's Table 2: the extrapolation tableau of x'' + 16 x = 0 after one step of 0.03."""
import numpy as np

import dynstep

integrator = dynstep.Integrator(dynstep.LinearSystem(M=1.0, K=16.0), dynstep.NewmarkExtrapolation(4, "romberg"))
integrator.start(0.0, 1.0, 0.0)
integrator.step(0.03)
table, numbers = integrator.tableau()

for name, rows, exact in (("x", table[0, 0], np.cos(0.12)), ("x'", table[1, 0], -4*np.sin(0.12))):
    print(f"\n{name}(0.03), exact {exact:.15f}")
    print("substeps" + "".join(f"{f'order {2*k}':>20}" for k in (1, 2, 3, 4)))
    for number, row in zip(numbers, rows):
        print(f"{number:8}" + "".join(f"{value:20.15f}" for value in row if np.isfinite(value)))
    print("  error " + "".join(f"{value - exact:20.1e}" for value in rows[-1]))
