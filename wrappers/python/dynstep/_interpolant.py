# SPDX-License-Identifier: BSD-3-Clause
"""Dense output: the trajectory between recorded steps."""

import numpy as np


class _Between:
    """A trajectory between the times t."""

    def __init__(self, t):
        self._t = t
        self._sign = -1.0 if t.size > 1 and t[-1] < t[0] else 1.0

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

    def __repr__(self):
        return f"<interpolant over {self._t.size} points, t = {self.t_min} to {self.t_max}>"


class Interpolant(_Between):
    """q, v, a at any time of a run; calls like ``sol(t)``.

    Between two steps it is the polynomial of degree 5 through q, v, a at both ends: its error is h^6 in q,
    h^5 in v, h^4 in a.  A load or force that jumps inside a step spoils that step.  Constraints hold at the steps,
    between them to these errors.
    """

    def __init__(self, t, q, v, a, lam, psi):
        super().__init__(t)
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
        between the steps, an error of h^2.

        Raises
        ------
        ValueError
            A time outside the run.
        """
        times = self._times(t)
        order = slice(None, None, int(self._sign))
        both = tuple(np.array([np.interp(times, self._t[order], x[order]) for x in rows]).reshape(len(rows), times.size)
                     for rows in self._multipliers)
        return tuple(x[:, 0] for x in both) if np.ndim(t) == 0 else both

    def _at(self, times):
        q, v, a = self._qva
        if self._t.size == 1:
            return tuple(np.repeat(x, times.size, axis=0) for x in self._qva)
        i, h, s = self._steps(times)
        q0, v0, a0, q1, v1, a1 = q[i], v[i], a[i], q[i + 1], v[i + 1], a[i + 1]
        d0 = (q1 - q0) - h*(v0 + 0.5*h*a0)          # what the parabola misses in q,
        d1 = h*((v1 - v0) - h*a0)                   # in h v,
        d2 = h**2*(a1 - a0)                         # in h^2 a
        c0 = 10*d0 - 4*d1 + 0.5*d2
        c1 = -15*d0 + 7*d1 - d2
        c2 = 6*d0 - 3*d1 + 0.5*d2
        return (q0 + s*(h*v0 + s*(0.5*h**2*a0 + s*(c0 + s*(c1 + s*c2)))),
                v0 + s*(h*a0 + s*(3*c0 + s*(4*c1 + s*5*c2))/h),
                a0 + s*(6*c0 + s*(12*c1 + s*20*c2))/h**2)


class OdeInterpolant(_Between):
    """y at any time of a run; calls like ``sol(t)``.

    Between two steps it is the polynomial of degree 3 through y, y' at both ends: its error is h^4 in y, h^3 in y',
    whatever the order of the method.
    """

    def __init__(self, t, y, yp):
        super().__init__(t)
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
            i, h, s = self._steps(times)
            y0, f0, y1, f1 = self._y[i], self._yp[i], self._y[i + 1], self._yp[i + 1]
            d0 = (y1 - y0) - h*f0                   # what the straight line misses in y,
            d1 = h*(f1 - f0)                        # in h y'
            c0 = 3*d0 - d1
            c1 = d1 - 2*d0
            both = y0 + s*(h*f0 + s*(c0 + s*c1)), f0 + s*(2*c0 + s*3*c1)/h
        return [x[0] if np.ndim(t) == 0 else x.T for x in both]
