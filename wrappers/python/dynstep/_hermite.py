# SPDX-License-Identifier: BSD-3-Clause
"""Hermite interpolation of y and y' at several nodes of each step, as src/linalg/dynstep_hermite.f90 has it."""

import numpy as np


class HermiteSteps:
    """Steps with the same number of nodes: nodes first[i] ... first[i] + count - 1 of the rows of t, y, f are those of
    step i.

    Between the ends of a step it is the polynomial of degree 2 count - 1 through y and y' at its nodes.  Its
    coefficients are divided differences of what the tangent at the left end misses, so that a motion that is nearly straight
    keeps the accuracy of its increments.
    """

    def __init__(self, t, y, f, first, count):
        rows = first + np.arange(count)[:, np.newaxis]           # [count, steps]
        times = t[rows]
        self._h = (times[-1] - times[0])[:, np.newaxis]
        self._z = np.repeat(_places(times), 2, axis=0)[:, :, np.newaxis]
        self._y, self._f = y[first], f[first]
        self._hf = self._h*self._f
        self._c = self._differences(y, f, rows)

    def _differences(self, y, f, rows):
        z = self._z
        c = np.zeros((z.shape[0], *self._y.shape))               # [2 count, steps, n]
        for k in range(1, len(rows)):
            c[2*k] = (y[rows[k]] - self._y) - z[2*k]*self._hf
            c[2*k + 1] = self._h*f[rows[k]] - self._hf
        for k in range(len(rows) - 1, 0, -1):                    # those of a double node are there
            c[2*k] = (c[2*k] - c[2*k - 2])/(z[2*k] - z[2*k - 2])
        for j in range(2, len(c)):
            for k in range(len(c) - 1, j - 1, -1):
                c[k] = (c[k] - c[k - 1])/(z[k] - z[k - j])
        return c

    def __call__(self, i, s):
        """y and y' at the places 0 <= s <= 1 [nt] of the steps i [nt]: arrays [nt, n]."""
        s = s[:, np.newaxis]
        w, dw = np.ones_like(s), np.zeros_like(s)
        y, f = np.zeros((2, s.size, self._y.shape[1]))
        for j in range(1, len(self._c)):
            d = s - self._z[j - 1, i]
            dw = dw*d + w
            w = w*d
            if j > 1:
                y += w*self._c[j, i]
                f += dw*self._c[j, i]
        return self._y[i] + (s*self._hf[i] + y), self._f[i] + f/self._h[i]


def _places(times):
    """Where the nodes of steps are, 0 ... 1: equal parts where the times are those up to their rounding, which a large t
    would make felt."""
    h = times[-1] - times[0]
    s = (times - times[0])/h
    equal = np.linspace(0, 1, len(times))[:, np.newaxis]
    rounding = 4*np.spacing(np.abs(times).max(axis=0))/np.abs(h)
    return np.where(np.abs(s - equal) <= rounding, equal, s)
