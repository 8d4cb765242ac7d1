# SPDX-License-Identifier: BSD-3-Clause
"""Dense output: the trajectory between recorded steps."""

import numpy as np

from ._hermite import HermiteSteps


class _Between:
    """A trajectory through nodes at the times t; ends are the numbers of those where steps end, None: all of them."""

    def __init__(self, t, ends=None):
        self._knows_ends = ends is not None
        ends = np.asarray(ends) if self._knows_ends else np.arange(t.size)
        if ends[0] != 0 or ends[-1] != t.size - 1 or (np.diff(ends) < 1).any():
            raise ValueError(f"ends must increase from 0 to {t.size - 1}, the number of the last node")
        self._ends = ends
        self._t_nodes = t
        self._t = t[ends]
        self._sign = -1.0 if t.size > 1 and t[-1] < t[0] else 1.0
        self._curves = {}

    @property
    def t_min(self):
        return float(min(self._t[0], self._t[-1]))

    @property
    def t_max(self):
        return float(max(self._t[0], self._t[-1]))

    def _times(self, t):
        times = np.atleast_1d(np.asarray(t, float))
        slack = 4*np.spacing(max(abs(self.t_min), abs(self.t_max)))
        outside = ~((times >= self.t_min - slack) & (times <= self.t_max + slack))
        if outside.any():
            raise ValueError(f"t = {times[outside][0]} lies outside the run, {self.t_min} to {self.t_max}")
        return times

    def _steps(self, times):
        """Step i that holds each time, its length h, and where in it the time is, 0 <= s <= 1."""
        i = np.searchsorted(self._sign*self._t[1:-1], self._sign*times, side="right")
        h = (self._t[i + 1] - self._t[i])[:, np.newaxis]
        return i, h, (times - self._t[i])[:, np.newaxis]/h

    def _through_nodes(self, times, y, f, results):
        """Write y and y' at those times whose step has nodes inside to results, a pair of arrays [nt, n].  The
        coefficients are kept for the next call."""
        i, _, s = self._steps(times)
        counts = np.diff(self._ends) + 1
        for count in np.unique(counts[i]):
            if count == 2:
                continue
            if count not in self._curves:
                steps = np.flatnonzero(counts == count)
                number = np.zeros(counts.size, int)
                number[steps] = np.arange(steps.size)
                self._curves[count] = number, HermiteSteps(self._t_nodes, y(), f(), self._ends[steps], count)
            number, curve = self._curves[count]
            at = np.flatnonzero(counts[i] == count)
            for result, value in zip(results, curve(number[i[at]], s[at, 0])):
                result[at] = value

    def __repr__(self):
        return f"<interpolant over {self._t.size} points, t = {self.t_min} to {self.t_max}>"


class Interpolant(_Between):
    """q, v, a at any time of a run; calls like ``sol(t)``.

    Inside a step with m nodes between its ends it is the polynomial of degree 2m + 3 through [q, v] and its derivative [v, a] at
    all m + 2 of them.  Its own error is h^(2m+4) in q and v and h^(2m+3) in a, so that with 2m + 3 >= order the errors
    are those of the method, h^order in q, v and a.  Without nodes inside, m = 0: q and v are those of the polynomial of degree
    5 through q, v, a at both ends, a is that of the polynomial of degree 3 through v and a; with a method of
    order p the errors are h^min(p, 6) in q, h^min(p, 5) in v, h^min(p, 3) in a.  Where ends is not given, which says that
    nobody looked at the order, a is the second derivative of that of degree 5: h^min(p - 1, 4), for an
    error h^(p+1) of a step in q comes back as h^(p-1).

    A load or force that jumps inside a step spoils that step.  Constraints hold at the steps, between them to these errors.
    """

    def __init__(self, t, q, v, a, lam, psi, ends=None):
        super().__init__(t, ends)
        self._qva = q.T, v.T, a.T
        self._multipliers = lam, psi

    def _points(self, times):
        """q, v, a, lam, psi at times."""
        return *self(times), *self.multipliers(times)

    def __call__(self, t):
        """q, v, a at time t (a number: shape (n,)) or at times t (shape (nt,): (n, nt)).

        Raises
        ------
        ValueError
            A time outside the run.
        """
        times = self._times(t)
        q, v, a = self._at(times)
        return (q[0], v[0], a[0]) if np.ndim(t) == 0 else (q.T, v.T, a.T)

    def multipliers(self, t):
        """lam and psi at time t (a number: shapes (m,) and (p,)) or at times t (shapes (m, nt) and (p, nt)): linear
        between the ends of a step, an error of h^2.

        Raises
        ------
        ValueError
            A time outside the run.
        """
        times = self._times(t)
        order = slice(None, None, int(self._sign))
        both = tuple(np.array([np.interp(times, self._t[order], x[self._ends][order]) for x in rows]
                              ).reshape(len(rows), times.size) for rows in self._multipliers)
        return tuple(x[:, 0] for x in both) if np.ndim(t) == 0 else both

    def _at(self, times):
        if self._t.size == 1:
            return tuple(np.repeat(x, times.size, axis=0) for x in self._qva)
        q, v, a = self._by_ends(times)
        if self._ends.size < self._t_nodes.size:
            y, f = np.hstack((q, v)), np.hstack((v, a))
            self._through_nodes(times, lambda: np.hstack(self._qva[:2]), lambda: np.hstack(self._qva[1:]), (y, f))
            n = q.shape[1]
            q, v, a = y[:, :n], y[:, n:], f[:, n:]
        return q, v, a

    def _by_ends(self, times):
        i, h, s = self._steps(times)
        (q0, v0, a0), (q1, v1, a1) = ([x[self._ends[j]] for x in self._qva] for j in (i, i + 1))
        d0 = (q1 - q0) - h*(v0 + 0.5*h*a0)          # what the parabola misses in q,
        d1 = h*((v1 - v0) - h*a0)                   # in h v,
        d2 = h**2*(a1 - a0)                         # in h^2 a
        c0 = 10*d0 - 4*d1 + 0.5*d2
        c1 = -15*d0 + 7*d1 - d2
        c2 = 6*d0 - 3*d1 + 0.5*d2
        if self._knows_ends:
            a = a0 + s*(2*(3*d1 - d2) + s*3*(d2 - 2*d1))/h**2
        else:
            a = a0 + s*(6*c0 + s*(12*c1 + s*20*c2))/h**2
        return (q0 + s*(h*v0 + s*(0.5*h**2*a0 + s*(c0 + s*(c1 + s*c2)))),
                v0 + s*(h*a0 + s*(3*c0 + s*(4*c1 + s*5*c2))/h),
                a)


class OdeInterpolant(_Between):
    """y at any time of a run; calls like ``sol(t)``.

    Inside a step with m nodes between its ends it is the polynomial of degree 2m + 3 through y, y' at all m + 2 of
    them: its own error is h^(2m+4) in y and h^(2m+3) in y', so that with 2m + 4 >= order the error is that of the method,
    h^order in y.  Without nodes inside, m = 0: h^4 in y, h^3 in y', where the order of the method is not lower.
    """

    def __init__(self, t, y, yp, ends=None):
        super().__init__(t, ends)
        self._y, self._yp = y.T, yp.T

    def _points(self, times):
        """y, y' at times."""
        return self(times), self.derivative(times)

    def __call__(self, t):
        """y at time t (a number: shape (n,)) or at times t (shape (nt,): (n, nt)).

        Raises
        ------
        ValueError
            A time outside the run.
        """
        return self._at(t)[0]

    def derivative(self, t):
        """y' in the same way."""
        return self._at(t)[1]

    def _at(self, t):
        times = self._times(t)
        if self._t.size == 1:
            both = [np.repeat(x, times.size, axis=0) for x in (self._y, self._yp)]
        else:
            both = self._by_ends(times)
            if self._ends.size < self._t_nodes.size:
                self._through_nodes(times, lambda: self._y, lambda: self._yp, both)
        return [x[0] if np.ndim(t) == 0 else x.T for x in both]

    def _by_ends(self, times):
        i, h, s = self._steps(times)
        (y0, f0), (y1, f1) = ((self._y[self._ends[j]], self._yp[self._ends[j]]) for j in (i, i + 1))
        d0 = (y1 - y0) - h*f0                       # what the straight line misses in y,
        d1 = h*(f1 - f0)                            # in h y'
        c0 = 3*d0 - d1
        c1 = d1 - 2*d0
        return y0 + s*(h*f0 + s*(c0 + s*c1)), f0 + s*(2*c0 + s*3*c1)/h
