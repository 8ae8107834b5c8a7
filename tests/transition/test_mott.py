"""Mott's law against closed forms and samples."""

from __future__ import annotations

from math import factorial

import numpy as np
import pytest
from scipy.integrate import quad

from transition import InputError, MottLaw
from transition.law.mean_mass import (
    explosive_constant,
    gurney_coefficient,
    gurney_sarmousakis,
    gurney_speed,
    mott_linfoot,
    ruptured,
)

MEAN = 0.0149
DIMENSIONS = (2, 3, "mixed")


@pytest.mark.parametrize(("dimension", "divisor"), [(2, 2.0), (3, 6.0)])
def test_mean_gives_mu_and_mu_gives_the_mean_back(dimension, divisor):
    law = MottLaw.from_mean(MEAN, dimension)
    assert law.parts[0].mu == pytest.approx(MEAN / divisor, rel=1e-15)
    assert law.mean == pytest.approx(MEAN, rel=1e-14)
    # mu Gamma(1 + 1/lambda) is the integral of N(m)/N0
    integral = quad(lambda x: float(law.survival(MEAN * x**3)) * 3.0 * x**2 * MEAN, 0.0, 60.0, epsabs=0.0, limit=400)
    assert integral[0] == pytest.approx(MEAN, rel=1e-8)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_moments_are_factorials(dimension, order):
    law = MottLaw.from_mean(MEAN, dimension)
    mu = law.parts[0].mu
    assert law.moment(order) == pytest.approx(mu**order * factorial(dimension * order), rel=1e-13)


def test_mixture_is_weighted_by_mass():
    law = MottLaw.from_mean(MEAN, "mixed", 0.3)
    two, three = MottLaw.from_mean(MEAN, 2), MottLaw.from_mean(MEAN, 3)
    masses = np.geomspace(1e-7, 0.5, 50)
    for name in ("survival", "mass_fraction_above"):
        expected = 0.7 * getattr(two, name)(masses) + 0.3 * getattr(three, name)(masses)
        np.testing.assert_allclose(getattr(law, name)(masses), expected, rtol=1e-13)
    assert law.mean == pytest.approx(MEAN, rel=1e-14)
    assert MottLaw.from_mean(MEAN, "mixed", 0.0) == two


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_inverse_undoes_survival_over_twelve_decades(dimension):
    law = MottLaw.from_mean(MEAN, dimension)
    shares = np.concatenate([np.geomspace(1e-12, 0.5, 60), 1.0 - np.geomspace(1e-6, 0.5, 30), [1.0]])
    np.testing.assert_allclose(law.survival(law.inverse(shares)), shares, rtol=1e-12)
    with pytest.raises(InputError, match="shares above 0"):
        law.inverse(0.0)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_sampled_moments_follow_the_closed_forms(dimension):
    law = MottLaw.from_mean(MEAN, dimension)
    drawn = law.inverse(1.0 - np.random.default_rng(5).random(100_000))
    for order in (0.5, 1.0, 2.0):
        error = np.sqrt((law.moment(2 * order) - law.moment(order) ** 2) / drawn.size)
        assert abs((drawn**order).mean() - law.moment(order)) < 4.0 * error, (order, error)
    heavy = 3.0 * MEAN
    assert drawn[drawn > heavy].sum() / drawn.sum() == pytest.approx(float(law.mass_fraction_above(heavy)), rel=0.04)


def test_eq_21_of_a_155_mm_shell_agrees_with_its_measured_mean():
    """M107 (US Ordnance Department 1944, Table 56): mean 14.9 g at 1067 m/s, with the default prefactor."""
    radius, wall = ruptured(0.0775, 0.018, 0.75)
    assert (radius, wall) == pytest.approx((0.135625, 0.0102857), rel=1e-5)
    mean = mott_linfoot(4.0, 7850.0, radius, 14.7e4, wall, 1067.0)
    assert mean == pytest.approx(0.0149, rel=0.05)
    assert mott_linfoot("paper", 7850.0, radius, 14.7e4, wall, 1067.0) == pytest.approx(mean * 0.3815 / 4.0)


def test_casing_at_rest_does_not_break():
    assert mott_linfoot(4.0, 7850.0, 0.1, 14.7e4, 0.01, 0.0) == float("inf")


def test_gurney_sarmousakis_by_hand():
    """B = 3.81, t = 18 mm, d = 119 mm: M_A = 3.81 * 0.035162 * 0.491867 * 1.151261 = 0.075861 kg^(1/2)."""
    assert gurney_sarmousakis(3.81, 0.018, 0.119) == pytest.approx(2.0 * 0.075861**2, rel=1e-4)
    assert gurney_sarmousakis(3.81, 0.018, 0.0) == float("inf")
    assert explosive_constant("comp_b", None) == explosive_constant("Composition B", None) == 2.71
    with pytest.raises(InputError, match=r"explosive 'TNTX'; did you mean 'TNT'\? \(allowed: Composition B, TNT\)"):
        explosive_constant("TNTX", None)
    assert (explosive_constant("anything", 3.0), explosive_constant("TNT", 0.0)) == (3.0, 0.0)


def test_gurney_speed_of_tnt():
    """Eq. 24 for D = 6940 m/s: 0.52 + 1.9432 = 2.4632 km/s; Eq. 23 at beta = 0.25: times sqrt(0.25/1.125)."""
    assert gurney_coefficient(6940.0) == pytest.approx(2463.2, rel=1e-12)
    assert gurney_speed(6940.0, 0.25) == pytest.approx(2463.2 * np.sqrt(2.0 / 9.0), rel=1e-12)
    assert gurney_speed(6940.0, 0.0) == 0.0


@pytest.mark.parametrize("mean", [0.0, -1e-3, np.inf, np.nan])
def test_a_mean_mass_that_is_none_is_refused(mean):
    with pytest.raises(InputError, match="a finite mass above zero is needed"):
        MottLaw.from_mean(mean)
