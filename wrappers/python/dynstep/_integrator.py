# SPDX-License-Identifier: BSD-3-Clause
"""One step at a time."""

import numpy as np

from . import _core
from ._arguments import integer, number, vector
from ._drift import start_correction, warn_of_correction
from ._handle import TOO_MANY_STEPS
from ._matrices import NOTHING
from ._method_table import method_for
from ._record import NoRecord
from ._request import make_handle, message
from ._run import drive
from ._solve import check_mechanical, start


class IntegrationError(RuntimeError):
    """A step or a start of an :class:`Integrator` failed; `status` is the code of `dynstep.h`."""

    def __init__(self, text, status=None):
        super().__init__(text)
        self.status = status


class Integrator:
    """A system and a method, one step at a time.

    Parameters
    ----------
    system : LinearSystem or MechanicalSystem
    method : Method or str, optional
        As for :func:`solve`.

    Notes
    -----
    After a step that failed (:class:`IntegrationError`, or an exception of a function of the system) the state is
    that of the last good step; a shorter step may be tried.  An integrator belongs to one thread at a time;
    different ones run in parallel.

    Examples
    --------
    >>> integrator = dynstep.Integrator(dynstep.LinearSystem(2.0, K=8.0), "newmark")
    >>> integrator.start(0.0, 1.0, 0.0)
    >>> while integrator.t < 10.0:
    ...     integrator.step(0.1)
    """

    def __init__(self, system, method=None):
        check_mechanical(system)
        self.system = system
        self.method = method_for(system, method)
        self._handle = make_handle(system, self.method)

    def start(self, t, q, v):
        """Begin at time t with coordinates q and velocities v, shape (n,); zeroes the counts.

        Raises
        ------
        ValueError, TypeError
            An argument, or the system, cannot be.
        IntegrationError
            The accelerations cannot be computed, or the method refuses a start that is off its constraints.

        Warns
        -----
        StartCorrected
            As :func:`solve` does.
        """
        n = self.system.n
        q, v = vector("q", q, n), vector("v", v, n)
        self._check(start(self._handle, self.system, number("t", t), q, v))
        warn_of_correction(self.start_correction, q, v, stacklevel=2)

    def step(self, h):
        """Make a step of length h, of either sign; it may differ from the one before.

        Raises
        ------
        IntegrationError
            The step failed; the state is that before the step.
        """
        self._check(self._handle.call(_core.dynstep_step, number("h", h)))

    def run(self, t_end, h, max_steps=None):
        """Make steps of length h up to t_end (the last one shorter where need be); nothing is recorded.

        Parameters
        ----------
        t_end : float
        h : float
            Of the sign of t_end - t.
        max_steps : int, optional
            Stop after so many steps.

        Returns
        -------
        bool
            True if t_end is reached, False after `max_steps` steps.

        Raises
        ------
        IntegrationError
            A step failed; the state is that of the last good one.
        """
        if max_steps is not None:
            max_steps = integer("max_steps", max_steps, 1, 2**62)
        with self._handle:
            self._handle.call(_core.dynstep_begin, number("t_end", t_end), number("h", h), 0, NOTHING)
            code = drive(self._handle, NoRecord(self._handle.sizes), max_steps)
        if code == TOO_MANY_STEPS:
            return False
        self._check(code)
        return True

    @property
    def t(self):
        """Time of the last good step."""
        return self._get()[0]

    @property
    def q(self):
        """Coordinates, a new array of shape (n,)."""
        return self._get()[1]

    @property
    def v(self):
        """Velocities, a new array of shape (n,)."""
        return self._get()[2]

    @property
    def a(self):
        """Accelerations, a new array of shape (n,)."""
        return self._get()[3]

    @property
    def lam(self):
        """Multipliers of g(t,q) = 0, a new array of shape (m,)."""
        return self._multipliers()[0]

    @property
    def psi(self):
        """Multipliers of k(t,q,v) = 0, a new array of shape (p,)."""
        return self._multipliers()[1]

    @property
    def start_correction(self):
        """:class:`StartCorrection` of the last start; None without constraints."""
        return start_correction(self._handle)

    @property
    def energy(self):
        """Energy of the present state.

        Raises
        ------
        ValueError
            The system has no energy: no energy function, or M or K not symmetric.
        """
        code, energy = self._handle.call(_core.dynstep_energy)
        self._check(code)
        return energy

    @property
    def counts(self):
        """Work since the start: steps, substeps, forces, tangents, factorizations, ..."""
        return self._handle.counts()

    def tableau(self):
        """Extrapolation table of the last step, of a method that extrapolates.

        Returns
        -------
        table : ndarray, shape (2, n, levels, levels)
            ``table[0]`` is q, ``table[1]`` is v; row j is the result with ``numbers[j]`` substeps, its column
            k <= j (else NaN) the one after k eliminations.  ``table[..., -1, -1]`` is the step's result, but for
            rounding.
        numbers : ndarray of int, shape (levels,)

        Raises
        ------
        ValueError
            No step has been made, or the method does not extrapolate.
        """
        n, levels = self.system.n, self.method._levels_of_steps
        _, table, numbers = self._handle.call(_core.dynstep_tableau, 2*n, levels)
        table = table.T.reshape(2, n, levels, levels)            # [q; v], row, column
        if self.system.ordering is not None:
            table = table[:, np.argsort(self.system.ordering)]
        return np.where(np.tri(levels, dtype=bool), table, np.nan), numbers

    def _get(self):
        _, t, q, v, a = self._handle.call(_core.dynstep_get, self.system.n)
        if self.system.ordering is None:
            return t, q, v, a
        place = np.argsort(self.system.ordering)
        return t, q[place], v[place], a[place]

    def _multipliers(self):
        return self._handle.call(_core.dynstep_get_multipliers, self._handle.m, self._handle.p)[1:]

    def _check(self, code):
        if code < 0:
            raise IntegrationError(message(self._handle, self.system, code), code)

    def __reduce__(self):
        raise TypeError("an integrator cannot be copied or pickled; make a new one from its system and method")

    def __repr__(self):
        return f"Integrator({self.system!r}, {self.method!r})"
