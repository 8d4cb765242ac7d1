# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of what a system declares with what its functions do."""

from . import _core
from ._arguments import number, vector
from ._handle import INVALID_INPUT, Handle
from ._solve import check_mechanical


class CheckReport:
    """What `check_system` found; true where all fits."""

    def __init__(self, findings):
        self.findings = findings          #: sentences, none where all fits

    def __bool__(self):
        return not self.findings

    def __repr__(self):
        return "\n".join(self.findings) or "all that was declared fits what the functions do"


def check_system(system, t, q, v):
    """Compare tangents, Jacobians and declared structure of a system with differences of its functions.

    Parameters
    ----------
    system : MechanicalSystem or LinearSystem
    t : float
    q, v : array_like, shape (n,)
        The point, a general one: at a point of symmetry mistakes may not show.

    Returns
    -------
    CheckReport
        True where all fits; else ``findings`` are sentences that name functions and entries (counted from 1).

    Raises
    ------
    ValueError, TypeError
        An argument cannot be.
    Exception
        Whatever a Python function of the system raises.
    """
    check_mechanical(system)
    q, v = vector("q", q, system.n), vector("v", v, system.n)
    if system.ordering is not None:
        q, v = q[system.ordering], v[system.ordering]
    t = number("t", t)
    handle = Handle(system.n)
    system._install(handle)
    system._install_constraints(handle, t, q, v)
    code, report = handle.call(_core.dynstep_check, t, q, v, refuse=False)
    text = report.decode(errors="replace").strip()
    if code == INVALID_INPUT and not text:
        raise ValueError(handle.sentence)
    return CheckReport(text.splitlines() or ([handle.sentence] if code < 0 else []))
