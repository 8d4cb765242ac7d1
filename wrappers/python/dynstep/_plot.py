# SPDX-License-Identifier: BSD-3-Clause
"""Pictures, where matplotlib is there."""

import numpy as np

from ._arguments import integer

_MOST_LINES = 10
_FLOOR = 1e-18                   # drawn in place of a residual of zero
_NAMES = {"q": "displacement q", "v": "velocity v", "a": "acceleration a"}


def plot_solution(solution, coordinates, of, ax):
    plt = _pyplot("plot()")
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


def plot_drift(solution, ax):
    plt = _pyplot("plot_drift()")
    if ax is None:
        ax = plt.gca()
    labels = {"g": "|g|", "gv": "|g'|", "k": "|k|"}
    for name, present in (("g", solution.lam.size), ("gv", solution.lam.size), ("k", solution.psi.size)):
        if present:
            drift = getattr(solution.constraint_drift, name)
            ax.plot(solution.t, np.maximum(drift, _FLOOR), label=labels[name])
    ax.set_yscale("log")
    ax.set_xlabel("time t")
    ax.set_ylabel("largest residual of the constraints")
    if ax.get_legend_handles_labels()[0]:
        ax.legend()
    return ax


def _pyplot(what):
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise ImportError(f"{what} needs matplotlib: pip install matplotlib, or dynstep[plot]") from None
    return plt
