# SPDX-License-Identifier: BSD-3-Clause
"""Pictures, where matplotlib is there."""

import numpy as np

from ._arguments import choice, integer

_MOST_LINES = 10
_FLOOR = 1e-18                   # drawn in place of a residual of zero


def plot_solution(solution, chosen, of, ax, labels):
    """`chosen` are the name and the value of the argument that chooses rows; `labels` the axis for each `of`."""
    plt = _pyplot("plot()")
    choice("of", of, labels)
    name, rows = chosen
    x = getattr(solution, of)
    n = x.shape[0]
    if rows is None:
        rows = range(n) if n <= _MOST_LINES else np.unique(np.linspace(0, n - 1, _MOST_LINES).astype(int))
    elif np.ndim(rows) == 0:
        rows = [rows]
    if ax is None:
        ax = plt.gca()
    for i in rows:
        i = integer(name, i, -n, n - 1)
        ax.plot(solution.t, x[i], label=f"{of}[{i % n}]")
    ax.set_xlabel("time t")
    ax.set_ylabel(labels[of])
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
