# SPDX-License-Identifier: BSD-3-Clause
"""Pictures, where matplotlib is there."""

import numpy as np

from ._arguments import integer

_MOST_LINES = 10
_NAMES = {"q": "displacement q", "v": "velocity v", "a": "acceleration a"}


def plot_solution(solution, coordinates, of, ax):
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise ImportError("plot() needs matplotlib: pip install matplotlib, or dynstep[plot]") from None
    if of not in _NAMES:
        raise ValueError(f"of must be one of 'q', 'v', 'a', not {of!r}")
    x = getattr(solution, of)
    n = x.shape[0]
    if coordinates is None:
        coordinates = range(n) if n <= _MOST_LINES else np.unique(np.linspace(0, n - 1, _MOST_LINES).astype(int))
    elif np.ndim(coordinates) == 0:
        coordinates = [coordinates]
    if ax is None:
        ax = plt.gca()
    for i in coordinates:
        i = integer("coordinates", i, -n, n - 1)
        ax.plot(solution.t, x[i], label=f"{of}[{i % n}]")
    ax.set_xlabel("time t")
    ax.set_ylabel(_NAMES[of])
    ax.legend()
    return ax
