"""Presented areas: the mean of a tumbling box, the lognormal distribution, what the flight says of them."""

from __future__ import annotations

import numpy as np
import pytest

from flight import InputError, fly
from flight.shape import BOX_5_2_1_STEEL, Box, Lognormal, Mean, shaped
from tests.flight.clouds import cloud


def test_tumbling_and_mean() -> None:
    fragments = cloud(5)
    assert shaped(fragments, Box()).shape_factor == pytest.approx(BOX_5_2_1_STEEL, rel=1e-3)
    assert shaped(fragments, Mean(2370.0)).shape_factor.tolist() == [2370.0] * 5


def test_lognormal_has_its_median_and_spread() -> None:
    k = np.log(shaped(cloud(200_000), Lognormal(0.2, median=2500.0), seed=9).shape_factor)
    assert np.median(k) == pytest.approx(np.log(2500.0), abs=4.0 * 1.2533 * 0.2 / 447.0)
    assert k.std() == pytest.approx(0.2, rel=4.0 / np.sqrt(2.0) / 447.0)
    assert np.mean(((k - k.mean()) / k.std()) ** 3) == pytest.approx(0.0, abs=4.0 * np.sqrt(6.0) / 447.0)


def test_the_flight_takes_the_model_and_says_so() -> None:
    fragments = cloud(2000, seed=4)
    spread = Lognormal(0.3)
    drawn = fly(fragments, shape=spread, seed=6)
    assert drawn.summary["presented_area"]["model"] == "lognormal"
    assert drawn.summary["presented_area"]["spread"] == 0.3
    assert (drawn.landing == fly(shaped(fragments, spread, seed=6)).landing).all()
    assert (shaped(fragments, spread, seed=7).shape_factor != shaped(fragments, spread, seed=6).shape_factor).all()
    assert fly(fragments).summary["presented_area"] == {
        "model": "as given", "shape_factor_5_percent": 2600.0, "shape_factor_median": 2600.0,
        "shape_factor_95_percent": 2600.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Mean(0.0), r"shape: shape factor of the mean is 0\.0, needed: finite and above zero"),
        (lambda: Lognormal(-0.1), "spread of the lognormal is -0.1, allowed: 0 to 2"),
        (lambda: Box((1.0, 0.0, 1.0)), "ratios of the box are"),
        (lambda: fly(cloud(1), shape="box"), "shape is 'box', allowed: flight.shape.Mean"),  # type: ignore[arg-type]
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
