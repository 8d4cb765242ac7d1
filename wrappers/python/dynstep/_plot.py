# SPDX-License-Identifier: BSD-3-Clause
"""Pictures, where matplotlib is there."""

import numpy as np

from ._arguments import choice, integer

_MOST_LINES = 10
_FARTHEST_SAMPLE = 40.0          # |z| of crossings that a picture of a sampled domain shows
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


def plot_domain(domain, ax, extent):
    """Shaded where it is stable, on a grid; the boundary where it is known as curves; poles and zeros."""
    plt = _pyplot("plot()")
    if ax is None:
        ax = plt.gca()
    if extent is None:
        extent = _extent(domain)
    left, right, low, high = map(float, extent)
    x, y = np.meshgrid(np.linspace(left, right, 301), np.linspace(low, high, 301))
    z = x + 1j*y
    inside = domain.contains(z)
    ax.contourf(x, y, inside.astype(float), levels=[0.5, 1.5], colors=["#c9dcf0"])
    for curve in domain.boundary:
        ax.plot(curve.real, curve.imag, color="C0", lw=1.2)
    if domain.is_certified and not domain.boundary:
        ax.axvline(0.0, color="C0", lw=1.2)
    if not domain.is_certified:
        r, phi = (np.concatenate(a) if a else np.empty(0) for a in (
            domain.crossings, [np.full(c.size, t) for c, t in zip(domain.crossings, np.radians(domain.angles))]))
        for sign in (1.0, -1.0):
            ax.plot(r*np.cos(phi), sign*r*np.sin(phi), ".", color="C0", ms=3)
    ax.plot(domain.poles.real, domain.poles.imag, "x", color="C3", ms=6, label="poles")
    ax.plot(domain.zeros.real, domain.zeros.imag, "o", mfc="none", color="C2", ms=5, label="zeros")
    ax.axhline(0.0, color="0.6", lw=0.6, zorder=0)
    ax.axvline(0.0, color="0.6", lw=0.6, zorder=0)
    ax.set_xlim(left, right)
    ax.set_ylim(low, high)
    ax.set_aspect("equal")
    ax.set_xlabel("Re(h lambda)")
    ax.set_ylabel("Im(h lambda)")
    return ax


def _extent(domain):
    """Poles, zeros and the boundary, all of it where the domain is bounded; else no farther than four times the poles and
    zeros, so that these can be seen."""
    features = np.concatenate([domain.poles, domain.zeros, [1.0, -1.0]])
    crossings = [c*np.exp(1j*t) for c, t in zip(domain.crossings, np.radians(domain.angles))]
    edge = np.concatenate([*crossings, *domain.boundary, [0.0]])
    if not domain.is_certified:
        farthest = _FARTHEST_SAMPLE
        if edge.size == 1:
            features = np.array([-10.0, 10.0, 10.0j])
    else:
        farthest = np.inf if domain.r_infinity > 1.0 + 1e-9 else 4.0*max(2.0, np.abs(features).max())
    shown = np.concatenate([features, edge[np.abs(edge) <= farthest]])
    left, right, high = shown.real.min(), shown.real.max(), np.abs(shown.imag).max()
    margin = 0.1*max(right - left, 2.0*high)
    return left - margin, right + margin, -high - margin, high + margin


def plot_accuracy(domain, ax, style):
    plt = _pyplot("plot()")
    if ax is None:
        ax = plt.gca()
    z = domain.h*np.exp(1j*np.radians(domain.angles))
    z = np.concatenate([z, z[::-1].conj()])
    ax.plot(z.real, z.imag, **{"label": repr(domain.method), **style})
    ax.set_aspect("equal")
    ax.set_xlabel("Re(h lambda)")
    ax.set_ylabel("Im(h lambda)")
    return ax


def plot_damping(result, axes, style):
    plt = _pyplot("plot()")
    if axes is None:
        axes = plt.gcf().subplots(1, 2, gridspec_kw={"wspace": 0.4})      # room for the right label
    pairs = ((result.damping, result.exact_damping, "damping"), (result.frequency, result.exact_frequency, "frequency"))
    for ax, (of_method, exact, name) in zip(axes, pairs):
        ax.plot(result.r, exact, color="0.4", lw=1.0, label="exact")
        ax.plot(result.r, of_method, **{"label": repr(result.method), **style})
        ax.set_xlabel("r")
        ax.set_ylabel(name)
    return axes
