# SPDX-License-Identifier: BSD-3-Clause
"""Problems that several tests solve."""
import numpy as np

import dynstep


def chain(n):
    """Band storage of the stiffness of n springs between n masses, fixed at one end."""
    ab = np.zeros((3, n))
    ab[0, 1:] = ab[2, :-1] = -1.0
    ab[1] = 2.0
    ab[1, -1] = 1.0
    return ab


def free_vibration(n=1, omega=2.0):
    """System, start and solution q(t) of an undamped oscillator in each coordinate."""
    system = dynstep.LinearSystem(M=2.0*np.ones(n), K=2.0*omega**2*np.ones(n))
    q0 = np.arange(1.0, n + 1)
    return system, q0, np.zeros(n), lambda t: np.outer(q0, np.cos(omega*np.asarray(t)))


def duffing_force(t, q, v):
    """Stiffening springs with damping and a load; each operation rounds once, in this order, in any language."""
    return -q*(1.0 + q*q) - 0.1*v + 0.3*t


def pendulum_force(t, q, v):
    return -np.sin(q)


def pendulum_energy(t, q, v):
    return 0.5*v[0]**2 - np.cos(q[0])


def same_bits(first, second):
    return all(np.array_equal(getattr(first, x), getattr(second, x)) for x in ("t", "q", "v", "a"))
