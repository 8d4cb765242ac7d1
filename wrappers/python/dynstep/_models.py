# SPDX-License-Identifier: BSD-3-Clause
"""Models: the matrices come from the library."""

import numpy as np

from . import _core
from ._arguments import array, choice, flag, integer, number, vector
from ._handle import NO_MEMORY, SUCCESS
from ._linear import LinearSystem
from ._matrices import Banded

_BEAMS = {"euler-bernoulli": 1, "timoshenko": 2}
_VARIANTS = {"consistent": 0, "listing": 1, "symmetric": 2}
_NOTHING = np.empty(0)


class FlexibleArm(LinearSystem):
    """One-link flexible arm on a hub, with a load at its tip (Xie 1995, chapters 4 and 5): M q'' + K q = b u(t).

    Parameters
    ----------
    segments : int
        Of the beam; 4 or more, with the Timoshenko beam 2 or more.
    beam : "euler-bernoulli" or "timoshenko"
    closed_loop : bool
        Feedback of the hub's torque, u = -g1 theta - g2 theta' - g3 w - g4 w' in addition to `input`, which turns the arm to
        theta = 0.  theta is the angle of the hub, w the deflection of the tip.  Takes one of the methods :class:`Pade`
        (the default), :class:`BI`.
    variant : "consistent", "listing" or "symmetric"
        The thesis's equations; Euler-Bernoulli with the wrong sign of its listing, which pins the tip; Timoshenko with K
        from the strain energy.
    gains : four floats, optional
        g1 to g4 of the closed loop; default: the thesis's.
    input : callable, optional
        Torque ``u(t)`` on the hub, a number.
    eta, mu, kappa, zeta : float
        Keyword only, as the others below, and dimensionless: inertia of the hub; mass of the load, its inertia about the tip,
        and the distance of its mass centre from the tip.
    alpha, beta, delta, gamma : float
        Mass of the beam, bending rigidity, rotatory inertia over alpha, shear rigidity (Timoshenko).

    Attributes
    ----------
    M, K : Banded
        Its matrices; `feedback` has the vectors of the closed loop, or is None.
    n : int
        Coordinates: (theta, z1, z2, ...), or (theta, phi1, z1, phi2, z2, ...) with the Timoshenko beam.  z are
        deflections and phi rotations of cross sections, the hub's rotation in both.

    Raises
    ------
    ValueError, TypeError
        An argument that is out of its range; the message names it.

    Examples
    --------
    >>> arm = dynstep.FlexibleArm(20, closed_loop=True)
    >>> q0 = arm.straight(np.pi/2)
    >>> solution = dynstep.solve(arm, (0, 5), q0, 0*q0, "pade", h=0.01)
    >>> arm.hub_angle(solution.q), arm.tip_deflection(solution.q)
    """

    def __init__(self, segments=20, beam="euler-bernoulli", closed_loop=False, variant="consistent", gains=None, input=None,
                 *, eta=0.01, mu=0.01, kappa=0.01, zeta=0.001, alpha=1.0, beta=1.0, delta=0.01, gamma=100.0):
        self.segments, self.beam, self.variant = integer("segments", segments, 1), beam, variant
        self.closed_loop = flag("closed_loop", closed_loop)
        if gains is not None and not closed_loop:
            raise ValueError("gains are for closed_loop=True")
        if input is not None and not callable(input):
            raise TypeError(f"input must be a function u(t), not {input!r}")
        parameters = [number(name, value) for name, value in (
            ("eta", eta), ("mu", mu), ("kappa", kappa), ("zeta", zeta), ("alpha", alpha), ("beta", beta), ("delta", delta),
            ("gamma", gamma))]
        which = choice("beam", beam, _BEAMS), choice("variant", variant, _VARIANTS), self.segments
        gains = _NOTHING if gains is None else vector("gains", gains, 4)
        n = _checked(_core.dynstep_arm_matrices, *which, parameters, gains, *[_NOTHING]*5)
        m, k = np.empty((3, n), order="F"), np.empty((5, n), order="F")
        b, gain_q, gain_v = np.empty((3, n))
        _checked(_core.dynstep_arm_matrices, *which, parameters, gains, m.reshape(-1, order="F"), k.reshape(-1, order="F"), b,
                 gain_q, gain_v)
        self.M, self.K = Banded(m, 1, 1), Banded(k, 2, 2)
        super().__init__(self.M, None, self.K, None if input is None else _Torque(input, b),
                         feedback=(b, gain_q, gain_v) if closed_loop else None)

    def straight(self, angle):
        """Coordinates of the undeformed arm with its hub at `angle`."""
        q = np.empty(self.n)
        _checked(_core.dynstep_arm_straight, _BEAMS[self.beam], self.segments, number("angle", angle), q)
        return q

    def hub_angle(self, q):
        """theta of coordinates, or theta' of velocities.

        Parameters
        ----------
        q : array_like, shape (n,) or (n, nt)

        Returns
        -------
        float or ndarray, shape (nt,)
        """
        return self._coordinates(q)[0]

    def tip_deflection(self, q):
        """w = z_n - theta of coordinates, or w' of velocities; arguments as of :meth:`hub_angle`."""
        q = self._coordinates(q)
        return q[-1] - q[0]

    def _coordinates(self, q):
        q = array("q", q, (1, 2))
        if q.shape[0] != self.n:
            raise ValueError(f"q has the shape {q.shape}, expected ({self.n},) or ({self.n}, nt)")
        return q

    def __repr__(self):
        loop = "closed" if self.closed_loop else "open"
        return f"<flexible arm of {self.segments} segments: {self.beam}, {self.variant}, {loop} loop>"


class _Torque:
    """p(t) = b u(t)."""

    def __init__(self, input, b):
        self.input = input
        self.b = b

    def __call__(self, t):
        return float(self.input(t))*self.b


def _checked(function, *arguments):
    """What a function of the library without a handle returns between its code and its message."""
    code, *results, message = function(*arguments)
    if code != SUCCESS:
        raise (MemoryError if code == NO_MEMORY else ValueError)(message.decode(errors="replace"))
    return results[0] if results else None
