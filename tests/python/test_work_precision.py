# SPDX-License-Identifier: BSD-3-Clause
"""Forces that depend on the place alone: evaluations for an error, beside those of scipy's DOP853 in the same run."""
import pytest
from point_masses import PROBLEMS, TOLERANCES, by_dop853, by_extrapolation, evaluations

import dynstep

pytest.importorskip("scipy")



@pytest.mark.parametrize("problem", PROBLEMS)
def test_evaluations_beside_dop853(problem):
    ours = [by_extrapolation(problem, tolerance) for tolerance in TOLERANCES]
    theirs = [by_dop853(problem, tolerance) for tolerance in TOLERANCES]
    for error, most in ((1e-6, 0.85), (1e-9, 0.70)):
        ratio = evaluations(ours, error)/evaluations(theirs, error)
        assert ratio <= most, f"{problem}, {error:g}: {ratio:.3f}"
