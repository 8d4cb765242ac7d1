# SPDX-License-Identifier: BSD-3-Clause
"""Stability, accuracy and damping of methods."""

from math import factorial

import numpy as np
import pytest

import dynstep


def taylor(p, q, alpha):
    return (np.array([alpha**k/factorial(k) for k in range(p + 1)]),
            np.array([(alpha - 1)**k/factorial(k) for k in range(q + 1)]))


def test_the_pocket_of_4_5():
    domain = dynstep.stability_domain(taylor(4, 5, 0.47))
    assert domain.is_certified and not (domain.is_a_stable or domain.is_i_stable or domain.is_l_stable)
    assert domain.a_angle == pytest.approx(81.49127969126, abs=1e-9)
    left = domain.poles[domain.poles.real < 0]
    assert sorted(left.imag) == pytest.approx([-5.902519, 5.902519], abs=1e-6)
    assert left.real == pytest.approx([-0.452465]*2, abs=1e-6)
    assert domain.imaginary_intervals.shape == (2, 2) and domain.imaginary_intervals[1, 1] == np.inf
    assert domain.growth == pytest.approx(0.738, abs=5e-4) and domain.growth_at == pytest.approx(6.07, abs=5e-3)
    # the ray of the pole goes in and out
    ray = np.argmin(abs(domain.angles - np.degrees(np.angle(left[left.imag > 0][0]))))
    assert len(domain.crossings[ray]) == 2 and domain.begins[ray] == 1
    assert not domain.contains(left[0]*1.001) and domain.contains(-1.0 + 6.0j)
    assert all(abs(abs(dynstep.stability_function(taylor(4, 5, 0.47), c)) - 1).max() < 1e-10 for c in domain.boundary)


def test_facts_of_a_circle():
    domain = dynstep.stability_domain((np.array([1.0]), np.array([1.0, -1.0])), rays=3)       # backward Euler
    assert domain.is_a_stable and domain.is_l_stable and not domain.is_f_stable and domain.r_infinity == 0.0
    assert list(domain.angles) == [0.0, 90.0, 180.0] and domain.crossings[0] == pytest.approx([2.0])
    assert abs(abs(1 - domain.boundary[0]) - 1).max() < 1e-12
    assert domain.poles == pytest.approx([1.0]) and domain.zeros.size == 0


@pytest.mark.parametrize("method, coefficients", [
    (dynstep.BI((4, 5), 0.47), taylor(4, 5, 0.47)), (dynstep.BI(3, 0.2), taylor(3, 3, 0.2)),
    ("bi", taylor(4, 4, 0.5)), (dynstep.Pade(0, 2), (np.array([1.0]), np.array([1.0, -1.0, 0.5])))])
def test_methods_by_name(method, coefficients):
    z = np.array([0.3j, -2.0 + 5.0j, 40.0])
    assert dynstep.stability_function(method, z) == pytest.approx(dynstep.stability_function(coefficients, z), rel=1e-13)
    named, given = dynstep.stability_domain(method), dynstep.stability_domain(coefficients)
    assert named.a_angle == pytest.approx(given.a_angle, abs=1e-9) and named.is_l_stable == given.is_l_stable
    # what the real step does, on a linear system
    handle = dynstep._handle.Handle(1)
    dynstep._method_table.as_method(method)._install(handle)
    radii = handle.call(dynstep._core.dynstep_spectral_radii, np.array([0.3j, -2.0 + 5.0j]).view(float))[1]
    assert radii == pytest.approx(abs(dynstep.stability_function(method, [0.3j, -2.0 + 5.0j])), rel=1e-12)


def test_fehlberg_halves():
    domain = dynstep.stability_domain(dynstep.BI(halves="fehlberg", alpha=0.47))
    assert domain.a_angle == pytest.approx(79.628984971966, abs=1e-9) and domain.r_infinity == pytest.approx(0.48633, abs=1e-5)
    assert len(domain.poles) == 6


@pytest.mark.parametrize("method", [dynstep.Midpoint(), "newmark"])
def test_methods_that_are_rational(method):
    domain = dynstep.stability_domain(method)
    assert domain.is_certified and domain.is_f_stable and domain.boundary == []
    z = np.array([[0.5j, -2.0], [3.0 + 1.0j, -1e6]])
    assert dynstep.stability_function(method, z) == pytest.approx((1 + z/2)/(1 - z/2))
    assert dynstep.stability_function(method, 2.0) == complex(np.inf, np.inf)
    assert dynstep.spectral_radius(method, 1j) == pytest.approx(1.0)


def test_methods_that_are_sampled():
    method = dynstep.GeneralizedAlpha(rho_inf=0.6)
    domain = dynstep.stability_domain(method, rays=7)
    assert not domain.is_certified and domain.is_a_stable and domain.a_angle == 90.0
    assert domain.r_infinity == pytest.approx(0.6, abs=1e-3) and domain.boundary == []
    assert dynstep.spectral_radius(method, 1e8j) == pytest.approx(0.6, abs=1e-3)
    explicit = dynstep.stability_domain(dynstep.Newmark(0.0), rays=3)
    assert explicit.crossings[1] == pytest.approx([2.0], abs=1e-6)          # omega h = 2
    assert explicit.imaginary_intervals[0, 0] == 0.0 and explicit.imaginary_intervals[0, 1] == pytest.approx(2.0, rel=0.06)
    with pytest.raises(TypeError, match="no stability function"):
        dynstep.stability_function(method, 1j)


def test_alpha_windows():
    assert dynstep.alpha_windows((4, 5)) == pytest.approx(np.array([[0.4362200209669922, 0.4486146148450476]]), abs=1e-10)
    assert dynstep.alpha_windows((4, 5), "a-stable").shape == (0, 2)
    assert dynstep.alpha_windows("fehlberg").tolist() == [[0.5, 0.5]]
    assert dynstep.alpha_windows((2, 2), "a-stable").tolist() == [[0.0, 0.5]]
    with pytest.raises(TypeError, match="order"):
        dynstep.alpha_windows(5)
    with pytest.raises(ValueError, match=r"order\[1\]"):
        dynstep.alpha_windows((5, 7))


def test_accuracy_and_damping():
    domain = dynstep.accuracy_domain(taylor(4, 5, 0.1), angles=[90.0, 120.0, 150.0, 180.0])
    assert domain.h == pytest.approx([0.42204, 0.73449, 0.72740, 0.63742], abs=1e-5)
    result = dynstep.damping_frequency(taylor(4, 5, 0.4), 0.0, [1.0, 2.0, 4.0, 8.0])
    assert result.damping == pytest.approx([0.99984, 1.99316, 3.67153, 3.76769], abs=1e-5)
    assert result.exact_damping == pytest.approx([1.0, 2.0, 4.0, 8.0])
    result = dynstep.damping_frequency(taylor(4, 5, 0.4), 90.0, [4.0])
    assert (result.damping[0], result.frequency[0]) == pytest.approx((-0.01022, -2.55407), abs=1e-5)
    assert result.exact_frequency == pytest.approx([4 - 2*np.pi])
    with pytest.raises(ValueError, match="tol = 0 must"):
        dynstep.accuracy_domain(taylor(1, 1, 0.5), 0.0)


def test_refusals():
    with pytest.raises(ValueError, match="N.0. = D.0. = 1"):
        dynstep.stability_domain((np.array([2.0]), np.array([1.0])))
    with pytest.raises(ValueError, match="rays"):
        dynstep.stability_domain("midpoint", rays=1)
    with pytest.raises(ValueError, match=r"z\["):
        dynstep.stability_function("midpoint", [np.nan])
    with pytest.raises(TypeError, match="z has the type"):
        dynstep.spectral_radius("midpoint", "1")


@pytest.mark.parametrize("result", [
    dynstep.stability_domain(dynstep.Pade(8, 0)), dynstep.stability_domain("newmark", rays=3),
    dynstep.stability_domain(dynstep.GeneralizedAlpha(), rays=3), dynstep.accuracy_domain(taylor(4, 5, 0.1)),
    dynstep.damping_frequency((np.ones(2), np.ones(1)), 90.0), dynstep.damping_frequency("midpoint", r=[])])
def test_results_print_in_a_line(result):
    text = repr(result)
    assert len(text) < 160 and "array" not in text and "\n" not in text and " of " in text


@pytest.mark.parametrize("method", [
    ([1, 1, 0.5], [1]), ([1, 1], [1]), dynstep.Pade(8, 0), dynstep.BI(5), dynstep.Pade(3, 4), "central-difference"])
def test_plots_show_the_whole_domain(method):
    plt = pytest.importorskip("matplotlib.pyplot")
    domain = dynstep.stability_domain(method)
    ax = domain.plot(plt.figure().gca())
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    crossings = [c*np.exp(1j*t) for c, t in zip(domain.crossings, np.radians(domain.angles))]
    shown = np.concatenate([domain.poles, domain.zeros, *domain.boundary, *crossings])
    assert left < shown.real.min() and shown.real.max() < right and low < shown.imag.min() and shown.imag.max() < high
    if domain.real_limit < np.inf:
        assert left < -domain.real_limit
    plt.close("all")


def test_plots():
    plt = pytest.importorskip("matplotlib.pyplot")
    ax = dynstep.stability_domain(dynstep.BI(order=(4, 5), alpha=0.47)).plot()
    assert len(ax.lines) >= 3
    plt.close("all")
    dynstep.stability_domain(dynstep.GeneralizedAlpha(), rays=5).plot(plt.figure().gca(), extent=(-5, 5, -5, 5))
    dynstep.accuracy_domain("midpoint", 1e-2).plot()
    axes = dynstep.damping_frequency("midpoint", 45.0).plot(color="k", label="midpoint")
    assert len(axes) == 2
    plt.close("all")
