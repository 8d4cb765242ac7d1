# SPDX-License-Identifier: BSD-3-Clause
"""Time integrators for mechanical systems, M(t,q,v) q'' = f(t,q,v), free or constrained, and for y' = f(t,y).

    >>> import dynstep
    >>> system = dynstep.LinearSystem(M=2.0, K=8.0)
    >>> solution = dynstep.solve(system, (0, 10), 1.0, 0.0, h=0.1)
    >>> solution.plot()

Systems: `LinearSystem`, `MechanicalSystem`, of first order `LinearOde`, `OdeSystem`; a model, `FlexibleArm`.
Methods: `Newmark`, `Midpoint`, `NewmarkExtrapolation`, `MidpointExtrapolation`, `GeneralizedAlpha`, `BI`,
`BIExtrapolation`, `Pade`, and for constraints `SOI2`, `HHT`; `methods()` shows their facts.
`solve` and `solve_ode` integrate over an interval, `resume` goes on from a checkpoint, `Integrator` makes one step at a
time.  `stability_domain`, `accuracy_domain`, `damping_frequency` look into a method.  `dynstep.scipy` has methods for
`scipy.integrate.solve_ivp`.
"""

from ._alpha_methods import HHT, SOI2, GeneralizedAlpha
from ._at2 import read_at2
from ._check import CheckReport, check_system
from ._compiled import compiled, signature
from ._core import dynstep_version as _version
from ._drift import ConstraintDrift, StartCorrected, StartCorrection
from ._events import Event
from ._functions import OutOfDomain
from ._integrator import IntegrationError, Integrator
from ._linear import LinearSystem
from ._loads import LoadTable, ground_motion
from ._matrices import Banded, banded
from ._mechanical import MechanicalSystem
from ._method_table import methods
from ._methods import MethodProperties, Midpoint, MidpointExtrapolation, Newmark, NewmarkExtrapolation, Newton
from ._models import FlexibleArm
from ._ode import LinearOde, OdeSystem
from ._rational_methods import BI, BIExtrapolation, Pade
from ._resume import resume
from ._run import StabilityWarning
from ._solution import OdeSolution, Solution
from ._solve import solve
from ._solve_ode import solve_ode
from ._stability import (AccuracyDomain, DampingFrequency, StabilityDomain, accuracy_domain, alpha_windows,
                         damping_frequency, spectral_radius, stability_domain, stability_function)

__version__ = ".".join(str(_version()//k % 100) for k in (10000, 100, 1))

__all__ = [
    "AccuracyDomain", "BI", "BIExtrapolation", "Banded", "CheckReport", "ConstraintDrift", "DampingFrequency",
    "Event", "FlexibleArm", "GeneralizedAlpha", "HHT", "IntegrationError", "Integrator", "LinearOde",
    "LinearSystem", "LoadTable", "MechanicalSystem", "MethodProperties", "Midpoint", "MidpointExtrapolation",
    "Newmark", "NewmarkExtrapolation", "Newton", "OdeSolution", "OdeSystem", "OutOfDomain", "Pade", "SOI2",
    "Solution", "StabilityDomain", "StabilityWarning", "StartCorrected", "StartCorrection", "accuracy_domain", "alpha_windows",
    "banded", "check_system", "compiled", "damping_frequency", "ground_motion", "methods", "read_at2", "resume", "signature",
    "solve", "solve_ode", "spectral_radius", "stability_domain", "stability_function"]


def __getattr__(name):
    """dynstep.scipy, which needs scipy, is imported where it is asked for."""
    if name == "scipy":
        from importlib import import_module
        return import_module(".scipy", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
