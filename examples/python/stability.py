# SPDX-License-Identifier: BSD-3-Clause
"""Where four methods are stable, and the unstable pocket of BI45, which reaches the imaginary axis at alpha = 0.47.

usage: stability.py [FIGURE.png]      draws a figure where a name is given
"""
import sys

import numpy as np

import dynstep

methods = [dynstep.Pade(4, 4), dynstep.Pade(3, 4), dynstep.BI((4, 5), 0.44), dynstep.BI((4, 5), 0.47)]
domains = [dynstep.stability_domain(method) for method in methods]
for domain in domains:
    fact = "F-stable" if domain.is_f_stable else "L-stable" if domain.is_l_stable else "not A-stable"
    print(f"{domain.method!r:28} {fact:12}  |R| <= 1 within {domain.a_angle:.2f} degrees of the negative axis")
*_, narrow, pocket = domains
stable = " and ".join(f"{low:.4f} to {high:.4f}" for low, high in pocket.imaginary_intervals)
print(f"alpha = 0.47: the imaginary axis is stable from {stable}; between, a step makes motions up to "
      f"{1 + pocket.growth:.3f} times larger, at {pocket.growth_at:.3f}i")
print("alphas with a stable imaginary axis:", dynstep.alpha_windows((4, 5)).round(6).tolist())
assert domains[0].is_f_stable and domains[1].is_l_stable and narrow.is_i_stable and not pocket.is_i_stable
assert not pocket.contains(pocket.growth_at*1j) and np.all(np.abs(pocket.poles.real) > 0.4)

if len(sys.argv) > 1:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 5), layout="constrained")
    for ax, domain, extent in zip(axes, (pocket, narrow), ((-4, 8, -10, 10), (-1.0, 0.6, 4.8, 6.4))):
        domain.plot(ax, extent=extent)
        ax.set_title(f"{domain.method!r}\nstable where blue")
        ax.legend(loc="lower right")
    figure.savefig(sys.argv[1])
