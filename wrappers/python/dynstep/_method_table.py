# SPDX-License-Identifier: BSD-3-Clause
"""Shorthands of methods, and the table of their facts."""

import math

from ._alpha_methods import HHT, SOI2, GeneralizedAlpha
from ._methods import Method, Midpoint, MidpointExtrapolation, Newmark, NewmarkExtrapolation
from ._rational_methods import BI, BIExtrapolation, Pade

_NAMED = {
    "newmark": Newmark(),
    "linear-acceleration": Newmark(1/6),
    "fox-goodwin": Newmark(1/12),
    "central-difference": Newmark(0.0),
    "midpoint": Midpoint(),
    "newmark-extrapolation": NewmarkExtrapolation(),
    "midpoint-extrapolation": MidpointExtrapolation(),
    "generalized-alpha": GeneralizedAlpha(),
    "hht": HHT(),
    "soi2": SOI2(),
    "hht-soi2": HHT(),
    "hht-i3": HHT(variant="index-3"),
    "pade": Pade(),
    "bi": BI(),
    "bi45": BI((4, 5), 0.44),
    "bi-extrapolation": BIExtrapolation(),
}


def as_method(method):
    """The method that an object or a shorthand means."""
    if isinstance(method, Method):
        return method
    if isinstance(method, str) and method in _NAMED:
        return _NAMED[method]
    raise (ValueError if isinstance(method, str) else TypeError)(
        f"method must be a method object such as dynstep.Newmark(), or one of {', '.join(map(repr, _NAMED))}; "
        f"not {method!r}")


def method_for(system, method):
    """The same, with a default that suits the system."""
    if method is None:
        fed_back = getattr(system, "feedback", None) is not None
        method = "soi2" if system.is_constrained else "pade" if fed_back else "newmark-extrapolation"
    return as_method(method)


class MethodTable(dict):
    """{shorthand: MethodProperties}; prints as a table."""

    def __str__(self):
        rows = [("method", "order", "of a", "of lam", "stages", "symmetric", "stable for omega*h", "source")]
        for name, p in self.items():
            limit = _limit(p.stability_limit, _NAMED[name])
            rows.append((name, str(p.order), str(p.acceleration_order), str(p.multiplier_order or "-"), str(p.stages),
                         "yes" if p.symmetric else "no", limit, p.source))
        widths = [max(map(len, column)) for column in zip(*rows)]
        return "\n".join("  ".join(x.ljust(w) for x, w in zip(row, widths)).rstrip() for row in rows)


def _limit(limit, method):
    if limit is None:
        try:
            limit = method.stability_limit()
        except ValueError:
            return "not known"
    return "any" if limit == math.inf else "none" if limit == 0.0 else f"<= {limit:.4g}"


def methods():
    """Table of the methods that have a shorthand, with their facts.

    Returns
    -------
    MethodTable
        A dictionary {shorthand: MethodProperties}; ``print(dynstep.methods())`` shows it as a table, where "-" in the
        column "of lam" stands for a method that takes no constraints.
    """
    return MethodTable({name: method.properties for name, method in _NAMED.items()})
