"""Presented areas: Cauchy's theorem, distributions, and random numbers that depend on seed and fragment only."""

from __future__ import annotations

import numpy as np
import pytest

from flight import Fragments, InputError, fly
from flight.shape import BOX_5_2_1_STEEL, Box, Lognormal, Mean, box_shape_factor, shaped
from tests.flight.clouds import cloud


@pytest.mark.parametrize("ratios", [(5.0, 2.0, 1.0), (1.0, 1.0, 1.0), (10.0, 1.0, 0.2)])
def test_mean_over_orientations_is_a_quarter_of_the_surface(ratios: tuple[float, float, float]) -> None:
    """Cauchy (1832), within four standard errors of the mean over 200,000."""
    fragments = cloud(200_000, seed=1)
    area = shaped(fragments, Box(ratios, "fixed"), seed=3).presented_area / fragments.mass ** (2.0 / 3.0)
    mean = box_shape_factor(7800.0, *ratios) ** (-2.0 / 3.0)
    error = area.std() / np.sqrt(area.size)
    assert abs(area.mean() - mean) < 4.0 * error
    a, b, c = np.asarray(ratios) / (7800.0 * np.prod(ratios)) ** (1.0 / 3.0)
    assert area.min() >= min(a * b, b * c, c * a) * (1.0 - 1e-12)
    assert area.max() <= np.sqrt((a * b) ** 2 + (b * c) ** 2 + (c * a) ** 2) * (1.0 + 1e-12)


def test_a_cube_shows_the_area_of_its_mean_direction() -> None:
    """Second moment of a cube's area, side 1: <(|x| + |y| + |z|)^2> = 1 + 4 / pi over the unit sphere."""
    fragments = Fragments.from_arrays(np.full(200_000, 7800.0), (0.0, 0.0, 1.0), (300.0, -200.0, 50.0))
    area = shaped(fragments, Box((1.0, 1.0, 1.0), "fixed"), seed=5).presented_area
    assert (area**2).mean() == pytest.approx(1.0 + 4.0 / np.pi, rel=4.0 * (area**2).std() / 2.27 / 447.0)


def test_tumbling_and_mean() -> None:
    fragments = cloud(5)
    assert shaped(fragments, Box()).shape_factor == pytest.approx(BOX_5_2_1_STEEL, rel=1e-3)
    assert shaped(fragments, Mean(2370.0)).shape_factor.tolist() == [2370.0] * 5


def test_lognormal_has_its_median_and_spread() -> None:
    k = np.log(shaped(cloud(200_000), Lognormal(0.2, median=2500.0), seed=9).shape_factor)
    assert np.median(k) == pytest.approx(np.log(2500.0), abs=4.0 * 1.2533 * 0.2 / 447.0)
    assert k.std() == pytest.approx(0.2, rel=4.0 / np.sqrt(2.0) / 447.0)
    assert np.mean(((k - k.mean()) / k.std()) ** 3) == pytest.approx(0.0, abs=4.0 * np.sqrt(6.0) / 447.0)


@pytest.mark.parametrize("shape", [Lognormal(0.3), Box((5.0, 2.0, 1.0), "fixed")])
def test_random_numbers_depend_on_seed_and_fragment_only(shape: Lognormal | Box) -> None:
    fragments = cloud(4001, seed=2)
    whole = shaped(fragments, shape, seed=7).shape_factor
    chosen = np.random.default_rng(0).permutation(4001)[:1500]
    part = shaped(fragments.select(chosen), shape, seed=7, identity=chosen).shape_factor
    assert (part == whole[chosen]).all()
    assert (shaped(fragments.select(slice(0, 100)), shape, seed=7).shape_factor == whole[:100]).all()
    assert (shaped(fragments, shape, seed=8).shape_factor != whole).mean() > 0.99


def test_the_flight_takes_the_model_and_says_so() -> None:
    fragments = cloud(2000, seed=4)
    fixed = Box((5.0, 2.0, 1.0), "fixed")
    drawn = fly(fragments, shape=fixed, seed=6)
    assert drawn.summary["presented_area"]["model"] == "box"
    assert drawn.summary["presented_area"]["orientation"] == "fixed"
    assert drawn.summary["presented_area"]["shape_factor_5_percent"] < BOX_5_2_1_STEEL
    assert (drawn.landing == fly(shaped(fragments, fixed, seed=6)).landing).all()
    assert fly(fragments).summary["presented_area"] == {
        "model": "as given", "shape_factor_5_percent": 2600.0, "shape_factor_median": 2600.0,
        "shape_factor_95_percent": 2600.0,
    }  # fmt: skip
    farthest = drawn.summary["max_range"]
    assert farthest > fly(fragments, shape=Box()).summary["max_range"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Mean(0.0), r"shape: shape factor of the mean is 0\.0, needed: finite and above zero"),
        (lambda: Lognormal(-0.1), "spread of the lognormal is -0.1, allowed: 0 to 2"),
        (lambda: Box((1.0, 0.0, 1.0)), "ratios of the box are"),
        (lambda: Box(orientation="spinning"), "orientation is 'spinning', allowed: 'tumbling', 'fixed'"),  # type: ignore[arg-type]
        (lambda: shaped(cloud(2), Mean(), identity=[1]), "identity must be 2 whole numbers"),
        (lambda: fly(cloud(1), shape="box"), "shape is 'box', allowed: flight.shape.Mean"),  # type: ignore[arg-type]
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
