# SPDX-License-Identifier: BSD-3-Clause
"""What `solve` returns."""

import numpy as np


class Solution:
    """A trajectory and how it came about, in the manner of scipy's `solve_ivp`.

    Attributes
    ----------
    t : ndarray, shape (nt,)
        Times.
    q, v, a : ndarray, shape (n, nt)
        Coordinates, velocities, accelerations.
    sol : Interpolant or None
        With ``dense_output=True``: ``sol(t)`` gives q, v, a at any time.
    status : int
        0: the end was reached; 1: an observer stopped the run; < 0: it failed (the codes of `dynstep.h`).
    message : str
        What happened, where, and what helps.
    success : bool
        status >= 0.  Otherwise the arrays hold the trajectory up to the failure.
    counts : dict
        Work: steps, substeps, forces, tangents, factorizations, ...
    method, system
        What `solve` was given.
    """

    def __init__(self, t, q, v, a, *, status, message, counts, method, system, sol=None):
        self.t, self.q, self.v, self.a = t, q, v, a
        self.sol = sol
        self.status = status
        self.message = message
        self.counts = counts
        self.method = method
        self.system = system

    @property
    def success(self):
        """True where the end was reached, or an observer stopped the run."""
        return self.status >= 0

    def energy(self):
        """Energy at each time, shape (nt,).

        Raises
        ------
        ValueError
            The system has no energy: no energy function, or M or K not symmetric.
        """
        return self.system._energies(self.t, self.q, self.v)

    def plot(self, coordinates=None, of="q", ax=None):
        """Draw coordinates over time.

        Parameters
        ----------
        coordinates : int or sequence of int, optional
            Default: all, but no more than ten, evenly chosen.
        of : {"q", "v", "a"}
            What to draw.
        ax : matplotlib Axes, optional
            Default: the current one.

        Returns
        -------
        matplotlib Axes
        """
        from ._plot import plot_solution
        return plot_solution(self, coordinates, of, ax)

    def __repr__(self):
        n, nt = self.q.shape
        span = f"t = {self.t[0]:g} to {self.t[-1]:g}, " if nt else ""
        work = ", ".join(f"{name} {number}" for name, number in self.counts.items() if number)
        return "\n".join([
            f"message: {self.message}", f"success: {self.success} (status {self.status})",
            f" points: {span}{nt} point(s) of {n} coordinate(s)", f" method: {self.method!r}", f" counts: {work}"])
