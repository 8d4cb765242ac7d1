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


# ---- Constrained systems ----

GRAVITY = 9.81


def rod_constraint(t, q):
    return q[0]*q[0] + q[1]*q[1] - 1.0


def rod(**options):
    """A mass on a rod of length 1, in Cartesian coordinates."""
    options = {"constraint": rod_constraint, "velocity_free": True, **options}
    return dynstep.MechanicalSystem(2, lambda t, q, v: np.array([0.0, -GRAVITY]), **options)


ROD_START = np.array([np.sin(1.0), -np.cos(1.0)]), np.array([np.cos(1.0), np.sin(1.0)])*0.5


def rod_solution(times):
    """q, v, a, lam of `rod` from ROD_START, by its angle."""
    angle = dynstep.solve(dynstep.MechanicalSystem(1, lambda t, q, v: -GRAVITY*np.sin(q), velocity_free=True),
                          (times[0], times[-1]), 1.0, 0.5, dynstep.NewmarkExtrapolation(6), h=0.02, t_eval=times)
    (th,), (w,), (a,) = angle.q, angle.v, angle.a
    along, across = np.array([np.sin(th), -np.cos(th)]), np.array([np.cos(th), np.sin(th)])
    return along, across*w, across*a - along*w**2, (w**2 + GRAVITY*np.cos(th))[np.newaxis]/2


def knife_edge(**options):
    """A knife edge on a slope, q = (x, y, phi): it moves along itself alone."""
    options = {"velocity_constraint": lambda t, q, v: v[0]*np.sin(q[2]) - v[1]*np.cos(q[2]), **options}
    return dynstep.MechanicalSystem(3, lambda t, q, v: np.array([2.0, 0.0, 0.0]), **options)


KNIFE_START = np.zeros(3), np.array([0.0, 0.0, 1.5])


def knife_solution(times, slope=2.0, w=1.5):
    """q, v, a, psi of `knife_edge`: it spins evenly and does not slide down the slope."""
    s, c, zero = np.sin(w*times), np.cos(w*times), np.zeros_like(times)
    q = np.array([slope/(2*w**2)*s**2, slope/(2*w**2)*(w*times - s*c), w*times])
    v = np.array([slope/w*s*c, slope/w*s**2, w + zero])
    return q, v, np.array([slope*(c**2 - s**2), 2*slope*s*c, zero]), 2*slope*s[np.newaxis]


def driven_pendulum(**options):
    """A mass on a rod whose other end moves by 0.3 sin(3 t): g depends on t."""
    def constraint(t, q):
        return [(q[0] - 0.3*np.sin(3*t))**2 + q[1]**2 - 1.0]
    return dynstep.MechanicalSystem(2, lambda t, q, v: np.array([0.0, -GRAVITY]), constraint=constraint, **options)


DRIVEN_START = np.array([np.sin(0.4), -np.cos(0.4)]), np.array([0.9, 0.0])


def driven_solution(times):
    """q, v of `driven_pendulum`, by its angle."""
    angle = dynstep.solve(dynstep.MechanicalSystem(1, lambda t, q, v: 2.7*np.sin(3*t)*np.cos(q) - GRAVITY*np.sin(q)),
                          (times[0], times[-1]), 0.4, 0.0, dynstep.NewmarkExtrapolation(6), h=0.02, t_eval=times)
    (th,), (w,) = angle.q, angle.v
    q = np.array([np.sin(th) + 0.3*np.sin(3*times), -np.cos(th)])
    return q, np.array([np.cos(th)*w + 0.9*np.cos(3*times), np.sin(th)*w])


def rods(count, **options):
    """Chain of masses on `count` rods of length 1, hung up at the origin: q = (x1, y1, x2, y2, ...)."""
    def ends(q):
        x = q.reshape(count, 2)
        return np.diff(x, axis=0, prepend=np.zeros((1, 2)))

    def jacobian(t, q):
        d, i = 2*ends(q), np.arange(count)
        g = np.zeros((count, count, 2))
        g[i, i] = d
        g[i[1:], i[:-1]] = -d[1:]
        return g.reshape(count, 2*count)

    force = np.tile([0.0, -GRAVITY], count)
    given = {"constraint": lambda t, q: (ends(q)**2).sum(axis=1) - 1.0, "constraint_jacobian": jacobian}
    return dynstep.MechanicalSystem(2*count, lambda t, q, v: force,
                                    **{**given, "velocity_free": True, "tangent_kind": "diagonal", **options})


def rods_start(count):
    """A straight line at 45 degrees."""
    return np.repeat(np.arange(1.0, count + 1), 2)*np.tile([1.0, -1.0], count)/np.sqrt(2), np.zeros(2*count)


def rods_pattern(count):
    """(indptr, indices) of the Jacobian of `rods`."""
    indices = np.concatenate([np.arange(max(0, 2*i - 2), 2*i + 2) for i in range(count)])
    return np.concatenate([[0], np.cumsum([2] + [4]*(count - 1))]), indices
