# SPDX-License-Identifier: BSD-3-Clause
"""Loads of linear systems that are given by samples."""

import numpy as np

from . import _core
from ._arguments import array, choice, number, vector
from ._matrices import NOTHING, as_matrix, is_sparse, order_of

_OUTSIDE = {"zero": 0, "hold": 1}


class LoadTable:
    """A load by samples, p(t) = pattern @ s(t) with s linear between its samples.

    Parameters
    ----------
    times : array_like, shape (ns,), or a tuple (t0, dt)
        Increasing times of the samples, or time of the first one and interval (dt > 0).
    samples : array_like, shape (signals, ns) or (ns,)
        Values of each signal; one dimension for a single signal.  ns >= 2.
    pattern : array_like, shape (n, signals) or (n,), optional
        Share of each coordinate in each signal.  Without it there is a signal for each coordinate.
    outside : {"zero", "hold"}
        The load before the first and after the last sample: none, or that sample.

    Notes
    -----
    The load has a kink at each sample.  Steps that end on samples keep the order of the method; a step across a
    sample does not.
    """

    def __init__(self, times, samples, pattern=None, outside="zero"):
        if isinstance(times, tuple) and len(times) == 2 and all(np.ndim(x) == 0 for x in times):
            self.t0, self.dt, self.times = number("t0", times[0]), number("dt", times[1]), None
            if self.dt <= 0.0:
                raise ValueError(f"dt = {self.dt:g} must be more than 0")
        else:
            self.t0, self.dt, self.times = 0.0, 0.0, vector("times", times).copy()
            if np.any(np.diff(self.times) <= 0.0):
                at = int(np.argmax(np.diff(self.times) <= 0.0)) + 1
                raise ValueError(f"times must increase, and times[{at}] = {self.times[at]:g} does not")
        samples = array("samples", samples, (1, 2))
        self.samples = np.array(samples.reshape(-1, samples.shape[-1]), order="F")
        signals, ns = self.samples.shape
        if ns < 2 or signals < 1:
            raise ValueError(f"samples has the shape {samples.shape}, expected two or more samples of a signal")
        if self.times is not None and self.times.size != ns:
            raise ValueError(f"times has {self.times.size} entries for {ns} samples")
        self.pattern = None
        if pattern is not None:
            pattern = array("pattern", pattern, (1, 2))
            self.pattern = np.array(pattern.reshape(pattern.shape[0], -1), order="F")
            if self.pattern.shape[1] != signals:
                raise ValueError(f"pattern has the shape {pattern.shape}, expected (n, {signals}) for "
                                 f"{signals} signal(s)")
        self.outside = outside
        choice("outside", outside, _OUTSIDE)

    @property
    def n(self):
        """Number of coordinates."""
        return (self.samples if self.pattern is None else self.pattern).shape[0]

    def __call__(self, t):
        """p(t), shape (n,)."""
        signals, ns = self.samples.shape
        times = self.t0 + self.dt*np.arange(ns) if self.times is None else self.times
        ends = {"left": 0.0, "right": 0.0} if self.outside == "zero" else {}
        s = np.array([np.interp(t, times, row, **ends) for row in self.samples])
        return s if self.pattern is None else self.pattern @ s

    def __repr__(self):
        signals, ns = self.samples.shape
        return f"<load table of {ns} samples of {signals} signal(s) on {self.n} coordinate(s)>"

    def _install(self, handle, order):
        samples, pattern = self.samples, self.pattern
        if order is not None and pattern is None:
            samples = np.asfortranarray(samples[order])
        elif order is not None:
            pattern = np.asfortranarray(pattern[order])
        handle.call(_core.dynstep_set_load_table, *samples.shape, self.t0, self.dt,
                    NOTHING if self.times is None else self.times, samples.T.reshape(-1),
                    NOTHING if pattern is None else pattern.T.reshape(-1), _OUTSIDE[self.outside])


def ground_motion(M, dt, acceleration, influence=None):
    """Load of a structure on moving ground, -M e a_g(t), for coordinates relative to the ground.

    Parameters
    ----------
    M : array_like, banded or scipy.sparse matrix, shape (n, n) or (n,)
        Mass matrix, as for :class:`LinearSystem`.
    dt : float
        Sampling interval, > 0; the first sample belongs to t = 0.
    acceleration : array_like, shape (ns,)
        Acceleration of the ground.  A record in g is to be multiplied by g in your units (9.80665 m/s^2).
    influence : array_like, shape (n,), optional
        e: displacement of each coordinate when the ground moves by one.  Default: all ones.

    Returns
    -------
    LoadTable
        No load before t = 0 and after the last sample.

    Examples
    --------
    >>> dt, record = dynstep.read_at2("RECORD.AT2")
    >>> system = dynstep.LinearSystem(M, C, K, dynstep.ground_motion(M, dt, 9.80665*record))
    """
    n = order_of("M", M)
    if n is None and influence is None:
        raise ValueError("M is a number: give influence, or M as a vector")
    e = np.ones(n) if influence is None else vector("influence", influence, n)
    me = array("M", M @ e) if is_sparse(M) else as_matrix("M", M, e.size).dot(e)
    return LoadTable((0.0, dt), vector("acceleration", acceleration), -me)
