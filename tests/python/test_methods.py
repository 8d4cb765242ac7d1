# SPDX-License-Identifier: BSD-3-Clause
"""Method objects are values with checked options."""
import copy
import pickle

import numpy as np
import pytest

import dynstep
from dynstep import HHT, SOI2, GeneralizedAlpha, Midpoint, MidpointExtrapolation, Newmark, NewmarkExtrapolation, Newton

OBJECTS = [Newmark(), Newmark(0.0), Newmark(0.3, 0.6), Newmark(newton=Newton(limit=7)), Midpoint(),
           NewmarkExtrapolation(), NewmarkExtrapolation(2, "romberg", 1/6), NewmarkExtrapolation(3, (1, 2, 5)),
           NewmarkExtrapolation(base=Newmark(1/12)), MidpointExtrapolation(5, "double-harmonic"), GeneralizedAlpha(),
           GeneralizedAlpha(0.5, mass_at="recomputed"), GeneralizedAlpha(alpha_m=0.1, alpha_f=0.3), SOI2(), SOI2(0.2),
           SOI2(alpha_m=0.0, alpha_f=0.2, beta=0.4, gamma=0.7), SOI2(variant="reduced"), SOI2(start="refuse"), HHT(),
           HHT(-0.3, variant="index-3"), HHT(0.0), HHT(-1/3), SOI2(adjust_momentum=False, second_order_start=False),
           SOI2(newton=Newton(limit=9))]


@pytest.mark.parametrize("method", OBJECTS, ids=repr)
def test_repr_copy_pickle_compare(method):
    assert eval(repr(method), vars(dynstep)) == method
    assert copy.deepcopy(method) == method == pickle.loads(pickle.dumps(method)) == copy.copy(method)
    assert hash(copy.copy(method)) == hash(method)
    assert sum(method == other for other in OBJECTS) == 1
    assert method != "newmark" and method is not None
    with pytest.raises(AttributeError):
        method.newton = None


def test_equal_is_what_does_the_same():
    assert NewmarkExtrapolation(base=Midpoint()) == MidpointExtrapolation()
    assert NewmarkExtrapolation(base=Newmark(1/6)) == NewmarkExtrapolation(beta=1/6)
    assert Newmark(np.float64(0.25)) == Newmark() != Newmark(gamma=0.6)
    assert NewmarkExtrapolation(np.int64(4)) == NewmarkExtrapolation(4) != NewmarkExtrapolation(levels=5)
    assert repr(NewmarkExtrapolation(4)) == "NewmarkExtrapolation(levels=4, sequence='automatic', beta=0.25)"
    assert len({Newmark(), Newmark(0.25, 0.5), Midpoint()}) == 2
    assert repr(SOI2()) == "SOI2(rho_inf=0.8)" and repr(HHT(variant="index-3")) == "HHT(alpha=-0.1, variant='index-3')"
    assert SOI2() == SOI2(0.8) == SOI2(start="project") != SOI2(start="keep") and SOI2() != GeneralizedAlpha()
    assert HHT(-0.2) == SOI2(alpha_m=0.0, alpha_f=0.2) and SOI2(0.5) == SOI2(alpha_m=0.0, alpha_f=1/3)


def test_coefficients():
    """Chung and Hulbert's, Jay and Negrut 2008, section 3."""
    assert SOI2(0.2).coefficients == pytest.approx((-1/2, 1/6, 25/36, 7/6))
    assert GeneralizedAlpha(1).coefficients == pytest.approx((1/2, 1/2, 1/4, 1/2))
    assert SOI2(0.8).coefficients == pytest.approx((1/3, 4/9, 25/81, 11/18))
    assert HHT(-0.1).coefficients == pytest.approx((0, 0.1, 1.21/4, 0.6))
    assert GeneralizedAlpha(alpha_m=-0.5, alpha_f=1/6).coefficients == pytest.approx((-1/2, 1/6, 25/36, 7/6))
    assert GeneralizedAlpha(alpha_m=0, alpha_f=0, beta=1/6, gamma=1/2).coefficients == (0, 0, 1/6, 1/2)


def test_facts():
    assert [m.order for m in (Newmark(), Newmark(gamma=0.6), Midpoint(), NewmarkExtrapolation(5))] == [2, 1, 2, 10]
    p = Newmark(0.0).properties
    assert p.stability_limit == pytest.approx(2.0) and p.symmetric and p.mechanical and "Austin" in p.source
    assert Newmark().properties.stability_limit == np.inf


def test_table_of_methods():
    table = dynstep.methods()
    assert {"newmark", "midpoint", "newmark-extrapolation"} <= table.keys()
    lines = str(table).splitlines()
    assert len(lines) == len(table) + 1 and lines[0].startswith("method")
    limits = {line.split()[0]: line for line in lines[1:]}      # the README has the same figure
    assert "any" in limits["newmark"] and "<= 0.2723" in limits["newmark-extrapolation"] and "unknown" not in str(table)
    system = dynstep.LinearSystem(1.0, K=1.0)
    for name in table:                          # each shorthand is one
        s = dynstep.solve(system, (0, 1), 1, 0, name, h=0.1)
        assert s.success and s.method.properties == table[name]


@pytest.mark.parametrize("make, error, words", [
    (lambda: Newmark(-0.1), ValueError, "beta"),
    (lambda: Newmark(np.nan), ValueError, "beta"),
    (lambda: Newmark("1/4"), TypeError, "beta"),
    (lambda: Newmark(0.25, -1), ValueError, "gamma"),
    (lambda: Newmark(0.25, 0.5, Newton()), TypeError, "positional"),
    (lambda: Newmark(newton=5), TypeError, "newton"),
    (lambda: Newton(limit=0), ValueError, "limit"),
    (lambda: Newton(limit=2.0), TypeError, "limit"),
    (lambda: Newton(halvings=-1), ValueError, "halvings"),
    (lambda: Newton(tolerance=1.0), ValueError, "tolerance"),
    (lambda: NewmarkExtrapolation(0), ValueError, "levels"),
    (lambda: NewmarkExtrapolation(13), ValueError, "levels"),
    (lambda: NewmarkExtrapolation(3.5), TypeError, "levels"),
    (lambda: NewmarkExtrapolation(True), TypeError, "levels"),
    (lambda: NewmarkExtrapolation(4, "fibonacci"), ValueError, "sequence"),
    (lambda: NewmarkExtrapolation(4, (1, 2, 3)), ValueError, "sequence"),
    (lambda: NewmarkExtrapolation(2, (2, 2)), ValueError, "sequence"),
    (lambda: NewmarkExtrapolation(2, (0, 2)), ValueError, "sequence"),
    (lambda: NewmarkExtrapolation(2, (1, 2.5)), TypeError, "sequence"),
    (lambda: NewmarkExtrapolation(2, 7), TypeError, "sequence"),
    (lambda: NewmarkExtrapolation(base=Newmark(gamma=0.6)), ValueError, "gamma"),
    (lambda: NewmarkExtrapolation(base="newmark"), TypeError, "base"),
    (lambda: NewmarkExtrapolation(base=NewmarkExtrapolation()), TypeError, "base"),
    (lambda: NewmarkExtrapolation(beta=0.1, base=Newmark()), ValueError, "base"),
    (lambda: NewmarkExtrapolation(beta=-1), ValueError, "beta"),
    (lambda: NewmarkExtrapolation(gamma=0.6), TypeError, "gamma"),
    (lambda: MidpointExtrapolation(99), ValueError, "levels"),
    (lambda: SOI2(1.1), ValueError, "rho_inf"),
    (lambda: SOI2(-0.1), ValueError, "rho_inf"),
    (lambda: GeneralizedAlpha("0.8"), TypeError, "rho_inf"),
    (lambda: SOI2(0.8, 0.1), ValueError, "leave out alpha_m"),
    (lambda: SOI2(alpha_m=0.0), ValueError, "alpha_f is missing"),
    (lambda: SOI2(gamma=0.5, alpha_f=0.1), ValueError, "alpha_m is missing"),
    (lambda: SOI2(alpha_m=1.0, alpha_f=0.1), ValueError, "alpha_m"),
    (lambda: SOI2(alpha_m=np.nan, alpha_f=0.1), ValueError, "alpha_m"),
    (lambda: GeneralizedAlpha(alpha_m=0.0, alpha_f=1.0), ValueError, "alpha_f"),
    (lambda: SOI2(alpha_m=0.0, alpha_f=0.0, beta=-0.1), ValueError, "beta"),
    (lambda: SOI2(variant="soi3"), ValueError, "variant must be one of 'soi2', 'reduced', 'index-3'"),
    (lambda: HHT(start="go"), ValueError, "start must be one of 'project'"),
    (lambda: HHT(mass_at=1), ValueError, "mass_at"),
    (lambda: SOI2(adjust_acceleration=1), TypeError, "adjust_acceleration"),
    (lambda: SOI2(newton=25), TypeError, "newton"),
    (lambda: GeneralizedAlpha(start="keep"), TypeError, "start"),
    (lambda: HHT(0.1), ValueError, "alpha = 0.1 must be"),
    (lambda: HHT(-0.5), ValueError, "alpha = -0.5 must be"),
])
def test_options_out_of_range(make, error, words):
    with pytest.raises(error, match=words):
        make()


@pytest.mark.parametrize("method, error", [("runge-kutta", ValueError), (4, TypeError), (b"soi2", TypeError),
                                           (Newmark, TypeError)])
def test_wrong_methods(method, error):
    with pytest.raises(error, match="method must be"):
        dynstep.solve(dynstep.LinearSystem(1.0), (0, 1), 1, 0, method, h=0.1)


def test_stability_limit():
    """The limits of extrapolated Newmark's method, computed in binary128 elsewhere; 2/sqrt(1 - 4 beta) else."""
    assert Newmark().stability_limit() == np.inf
    assert Newmark(beta=0).stability_limit() == pytest.approx(2.0, rel=1e-6)
    assert NewmarkExtrapolation(4, "romberg").stability_limit() == pytest.approx(0.3315968646, rel=1e-6)
    assert NewmarkExtrapolation(4, "double-harmonic").stability_limit(0.05) == pytest.approx(9.951032037, rel=1e-6)
    with pytest.raises(ValueError, match="damping_ratio"):
        Newmark().stability_limit(-0.1)
    with pytest.raises(ValueError, match="gamma"):
        Newmark(gamma=0.6).stability_limit()
    assert {m.stability_limit() for m in (SOI2(0.3), HHT(), GeneralizedAlpha(1.0))} == {np.inf}
    assert SOI2().stability_limit(0.1) == np.inf
    with pytest.raises(ValueError, match="damping_ratio"):
        SOI2().stability_limit(-0.1)
