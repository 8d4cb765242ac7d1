# SPDX-License-Identifier: BSD-3-Clause
"""Point masses that attract each other: errors and evaluations of an extrapolation and of scipy's DOP853, for a test and a
benchmark."""
import numpy as np

import dynstep

MASSES = np.arange(1.0, 8.0)
ECCENTRICITY = 0.9


def pleiades(t, q, v=None):
    """Seven masses that attract each other (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
    section II.10), q = [x, y]."""
    x, y = np.split(q, 2)
    dx, dy = x[:, np.newaxis] - x, y[:, np.newaxis] - y
    r2 = dx**2 + dy**2
    np.fill_diagonal(r2, 1.0)
    w = MASSES[:, np.newaxis]*r2**-1.5
    return np.concatenate(((w*dx).sum(axis=0), (w*dy).sum(axis=0)))


def kepler(t, q, v=None):
    return -q/(q[0]**2 + q[1]**2)**1.5


def kepler_place(t):
    """x = cos E - e, y = sqrt(1 - e^2) sin E with E - e sin E = t."""
    anomaly = t
    for _ in range(100):
        anomaly -= (anomaly - ECCENTRICITY*np.sin(anomaly) - t)/(1 - ECCENTRICITY*np.cos(anomaly))
    return np.array([np.cos(anomaly) - ECCENTRICITY, np.sqrt(1 - ECCENTRICITY**2)*np.sin(anomaly)])


#: force, q, v at 0, end, q there; Pleiades by an explicit extrapolation of order 20 in quadruple precision
PROBLEMS = {
    "pleiades": (
        pleiades,
        np.array([3.0, 3, -1, -3, 2, -2, 2, 3, -3, 2, 0, 0, -4, 4]),
        np.array([0.0, 0, 0, 0, 0, 1.75, -1.5, 0, 0, 0, -1.25, 1, 0, 0]),
        3.0,
        np.array([3.7061391439705127e-01, 3.2372840920572332e+00, -3.2225590324183235e+00, 6.5970914557753080e-01,
                  3.4255817071565797e-01, 1.5621721014006311e+00, -7.0030929222124949e-01, -3.9434375855173922e+00,
                  -3.2713809739725499e+00, 5.2250818434565440e+00, -2.5906124349774693e+00, 1.1982136933922747e+00,
                  -2.4296823449358235e-01, 1.0914492404289797e+00])),
    "kepler": (kepler, np.array([1 - ECCENTRICITY, 0.0]), np.array([0.0, np.sqrt((1 + ECCENTRICITY)/(1 - ECCENTRICITY))]), 20.0,
               kepler_place(20.0)),
}
TOLERANCES = 10.0**np.arange(-6.0, -13.1, -0.5)


def by_extrapolation(problem, tolerance):
    """Error of the place and evaluations; f is called as often as the library says."""
    force, q, v, end, place = PROBLEMS[problem]
    calls = []

    def counted(t, q, v):
        calls.append(t)
        return force(t, q)
    system = dynstep.MechanicalSystem(q.size, counted, velocity_free=True)
    solution = dynstep.solve(system, (0, end), q, v, dynstep.NewmarkExtrapolation(beta=0), rtol=tolerance, atol=tolerance)
    assert solution.success and solution.counts["forces"] == len(calls)
    return np.abs(solution.q[:, -1] - place).max(), len(calls)


def by_dop853(problem, tolerance):
    force, q, v, end, place = PROBLEMS[problem]
    from scipy.integrate import solve_ivp
    solution = solve_ivp(lambda t, y: np.concatenate((y[q.size:], force(t, y[:q.size]))), (0, end), np.concatenate((q, v)),
                         method="DOP853", rtol=tolerance, atol=tolerance)
    assert solution.success
    return np.abs(solution.y[:q.size, -1] - place).max(), solution.nfev


def evaluations(runs, error):
    """By a line of least squares through log evaluations over log error, of runs within a decade and a half of the error."""
    e, n = np.log10(np.array(runs, float)).T
    near = np.abs(e - np.log10(error)) < 1.5
    assert near.sum() >= 4
    return 10**np.polyval(np.polyfit(e[near], n[near], 1), np.log10(error))
