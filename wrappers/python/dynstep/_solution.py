# SPDX-License-Identifier: BSD-3-Clause
"""What `solve` and `solve_ode` return."""

from functools import cached_property

from ._drift import constraint_drift


class _Outcome:
    """How a trajectory came about."""

    def __init__(self, status, message, counts, method, system, sol, warning, run):
        self._run = run
        self.sol = sol
        self.warning = warning
        self.status = status
        self.message = message
        self.counts = counts
        self.method = method
        self.system = system

    @property
    def success(self):
        """True where the end was reached, or an observer or an event ended the run."""
        return self.status >= 0

    def checkpoint(self, path):
        """Write what the rest of the run depends on to a file, from which :func:`resume` goes on with the same bits, now or in
        another program.  For runs that ended by `max_steps`, an observer, or an event, at the end, or without success.

        Parameters
        ----------
        path : str or path
            A file of this name is replaced.  Its format is told in docs/howto/restarting.md.

        Raises
        ------
        OSError
            It cannot be written.
        ValueError
            No run stands behind this solution any more: it was copied, or :meth:`resume` went on; or there never was one, for
            the start failed.
        """
        self._left_run().checkpoint(path)

    def resume(self, max_steps=None, *, progress=False):
        """Go on to the end of the interval, or for `max_steps` steps: a solution with what follows the last point of this one,
        the same bits as if the run had not been left.  A run that failed goes on, too, after its reason is mended.

        Returns
        -------
        Solution or OdeSolution
            What was recorded since; ``t_events`` are those that were met since, `counts` is for the whole run.

        Raises
        ------
        ValueError
            As for :meth:`checkpoint`.
        """
        run, self._run = self._left_run(), None
        try:
            return run.go_on(self.system, self.method, max_steps, progress, stacklevel=2)
        except BaseException:
            self._run = run
            raise

    def _left_run(self):
        if self._run is None:
            raise ValueError("no run stands behind this solution: it was copied, or resume went on from it")
        return self._run

    def __getstate__(self):
        return self.__dict__ | {"_run": None}

    def _summary(self, points):
        span = f"t = {self.t[0]:g} to {self.t[-1]:g}, " if self.t.size else ""
        work = ", ".join(f"{name} {number}" for name, number in self.counts.items() if number)
        met = getattr(self, "t_events", None)
        if met:
            work += "\n events: " + ", ".join(str(t.size) for t in met)
        return "\n".join([
            f"message: {self.message}", f"success: {self.success} (status {self.status})",
            f" points: {span}{self.t.size} point(s) of {points}", f" method: {self.method!r}", f" counts: {work}"])


class Solution(_Outcome):
    """A trajectory and how it came about, in the manner of scipy's `solve_ivp`.

    Attributes
    ----------
    t : ndarray, shape (nt,)
        Times.
    q, v, a : ndarray, shape (n, nt)
        Coordinates, velocities, accelerations.
    lam, psi : ndarray, shape (m, nt) and (p, nt)
        Multipliers of g(t,q) = 0 and of k(t,q,v) = 0; no rows where there are none.
    start_correction : StartCorrection or None
        What the start found and moved (or would have to move, where it is refused); None without constraints.
    sol : Interpolant or None
        With ``dense_output=True``: ``sol(t)`` gives q, v, a at any time.
    t_events, q_events, v_events : list of ndarray, or None
        For each event the times when it was met, shape (k,), and the coordinates and velocities there, before its action,
        shape (k, n); None where no events were asked for.
    status : int
        0: the end was reached; 1: an observer stopped the run; 3: a terminal event ended it (scipy has 1 for that); < 0: it
        failed (the codes of `dynstep.h`).
    message : str
        What happened, where, and what helps.
    success : bool
        status >= 0.  Otherwise the arrays hold the trajectory up to the failure.
    counts : dict
        Work: steps, substeps, forces, tangents, factorizations, ...
    warning : str or None
        The sentence of a :class:`StabilityWarning`.
    method, system
        What `solve` was given.
    """

    def __init__(self, t, q, v, a, lam, psi, *, status, message, counts, method, system, sol=None,
                 start_correction=None, events=(None, None, None), warning=None, run=None):
        super().__init__(status, message, counts, method, system, sol, warning, run)
        self.t, self.q, self.v, self.a, self.lam, self.psi = t, q, v, a, lam, psi
        self.start_correction = start_correction
        self.t_events, self.q_events, self.v_events = events

    @cached_property
    def constraint_drift(self):
        """:class:`ConstraintDrift`: largest abs(g), abs(g'), abs(k) at each time; computed when it is first asked
        for, by one call of each function of the constraints for each time."""
        return constraint_drift(self.system, self.t, self.q, self.v)

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
        return plot_solution(self, ("coordinates", coordinates), of, ax,
                             {"q": "displacement q", "v": "velocity v", "a": "acceleration a"})

    def plot_drift(self, ax=None):
        """Draw `constraint_drift` over time, on a logarithmic axis.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Default: the current one.

        Returns
        -------
        matplotlib Axes

        Raises
        ------
        ValueError
            The system has no constraints.
        """
        from ._plot import plot_drift
        if not self.system.is_constrained:
            raise ValueError("the system has no constraints")
        return plot_drift(self, ax)

    def __repr__(self):
        m, p = len(self.lam), len(self.psi)
        more = f", {m} + {p} multiplier(s)" if m + p else ""
        return self._summary(f"{len(self.q)} coordinate(s){more}")


class OdeSolution(_Outcome):
    """A trajectory of a first-order system and how it came about, in the manner of scipy's `solve_ivp`.

    Attributes
    ----------
    t : ndarray, shape (nt,)
        Times.
    y, yp : ndarray, shape (n, nt)
        y and y'.
    sol : OdeInterpolant or None
        With ``dense_output=True``: ``sol(t)`` gives y at any time, ``sol.derivative(t)`` y'.
    t_events, y_events : list of ndarray, or None
        For each event the times when it was met, shape (k,), and y there, before its action, shape (k, n).
    status, message, success, counts, warning
        As in :class:`Solution`; the count `forces` is that of f, or of b(t).
    method, system
        What `solve_ode` was given; a function has become an :class:`OdeSystem`.
    """

    def __init__(self, t, y, yp, *, status, message, counts, method, system, sol=None,
                 events=(None, None), warning=None, run=None):
        super().__init__(status, message, counts, method, system, sol, warning, run)
        self.t, self.y, self.yp = t, y, yp
        self.t_events, self.y_events = events

    def plot(self, unknowns=None, of="y", ax=None):
        """Draw unknowns over time.

        Parameters
        ----------
        unknowns : int or sequence of int, optional
            Default: all, but no more than ten, evenly chosen.
        of : {"y", "yp"}
            What to draw.
        ax : matplotlib Axes, optional
            Default: the current one.

        Returns
        -------
        matplotlib Axes
        """
        from ._plot import plot_solution
        return plot_solution(self, ("unknowns", unknowns), of, ax, {"y": "y", "yp": "y'"})

    def __repr__(self):
        return self._summary(f"{len(self.y)} unknown(s)")
