"""The recommended distance: its arithmetic, its coverage, its words, and what it does not include."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fragfield.hazard.recommended import recommended_of
from fragfield.results.convergence import Convergence
from fragfield.results.hazard import Hazard, WithoutRicochet
from fragfield.results.part import to_json
from fragfield.results.uncertainty import SampledQuantity, Spread, UncertaintyResult
from fragfield.results.words import not_included_words, parts_of, parts_words
from tests.fragfield.example_results import example

NORMAL_95 = 1.6448536269514722

HAZARD = example(
    Hazard, method="realisations", determined=True, reason="", expected=100.0, upper=103.0, standard_error=1.8
)


def grid(uncertainty, reason=""):
    quantity = {"uncertainty": uncertainty, "kind": "monotone"}
    return example(Convergence, reason=reason, quantities={"expected_distance": quantity})


def study(median, high, error=1.0):
    spread = Spread.known(low=90.0, median=median, high=high, high_standard_error=error)
    return UncertaintyResult.known(distance=SampledQuantity.known(spread=spread))


def test_without_a_study_randomness_and_grid_are_added_as_squares():
    found = recommended_of(HAZARD, grid(4.0))
    assert found.recommended == pytest.approx(105.0)
    assert {name: width for name, width in to_json(found.parts).items() if width is not None} == {
        "expected": 100.0, "randomness": 3.0, "grid": 4.0
    }  # fmt: skip
    assert recommended_of(replace(HAZARD, table_width=12.0), grid(4.0)).recommended == pytest.approx(113.0)
    assert found.not_included == {"inputs": "no study of uncertain inputs"}
    own = {name: getattr(HAZARD, name) for name in ("recommended", "parts", "not_included", "without_ricochet")}
    assert replace(found, **own) == HAZARD  # nothing of the run's own is changed


def test_a_study_adds_what_its_quantile_exceeds_the_expected_distance_by():
    found = recommended_of(HAZARD, grid(4.0), study(101.0, 113.0))
    assert found.parts.inputs == 13.0
    assert found.recommended == pytest.approx(100.0 + math.sqrt(13.0**2 + 9.0 + 16.0))
    assert found.not_included == {}


def test_an_integral_has_the_error_of_its_points_and_no_randomness():
    found = recommended_of(replace(HAZARD, method="integral", upper=100.2), grid(4.0))
    assert found.parts.quadrature == pytest.approx(0.2)
    assert found.parts.randomness is None
    assert found.recommended == pytest.approx(100.0 + math.hypot(0.2, 4.0))
    assert "randomness" not in found.not_included
    assert "points of the expected density 0.2 m, grid 4.0 m" in parts_words(found)


@pytest.mark.parametrize("spread", [(60.0, 70.0, 0.0), (98.0, 98.0, 0.0), (99.0, 101.0, 2.0), (120.0, 150.0, 3.0)])
def test_a_study_never_lowers_the_distance(spread):
    alone = recommended_of(HAZARD, grid(4.0)).recommended
    with_study = recommended_of(HAZARD, grid(4.0), study(*spread))
    assert with_study.recommended >= alone
    assert with_study.parts.inputs == max(spread[1] - 100.0, 0.0)


@pytest.mark.parametrize(
    ("convergence", "reason"),
    [
        (
            Convergence(reason="no grid convergence: the fragments are from another source"),
            "the fragments are from another",
        ),
        (None, "no other cell size gave a distance"),
        (Convergence(quantities={}, reason="12 mm gave no distance: airborne"), "12 mm gave no distance: airborne"),
        (grid(None), "no other cell size gave a distance"),
    ],
)
def test_a_grid_that_is_not_known_is_left_out_and_said(convergence, reason):
    found = recommended_of(HAZARD, convergence)
    assert found.recommended == pytest.approx(103.0)
    assert found.parts.grid is None
    assert found.not_included["grid"].startswith(reason)
    assert f"grid ({reason}" in not_included_words(found)


def test_a_single_realisation_has_no_randomness():
    found = recommended_of(replace(HAZARD, upper=None, standard_error=None), grid(4.0))
    assert found.recommended == pytest.approx(104.0)
    assert found.not_included["randomness"] == "a single realisation has no bound"


def test_a_distance_that_is_not_determined_has_no_recommended_one():
    short = WithoutRicochet(expected=None, upper=None, standard_error=None, recommended=None)
    hazard = replace(HAZARD, determined=False, expected=None, upper=None, without_ricochet=short)
    found = recommended_of(hazard, grid(4.0), study(101.0, 113.0))
    assert found.recommended is None
    assert set(vars(found.parts).values()) == {None}
    assert found.without_ricochet.recommended is None
    assert (parts_of(found), parts_words(found), not_included_words(found)) == ([], "", "")


def test_without_ricochet_the_same_grid_and_its_own_randomness():
    short = WithoutRicochet(expected=90.0, upper=90.0 + math.sqrt(20.0), standard_error=1.0, recommended=None)
    hazard = replace(HAZARD, without_ricochet=short)
    found = recommended_of(hazard, grid(4.0))
    assert replace(found.without_ricochet, recommended=None) == short
    assert found.without_ricochet.recommended == pytest.approx(96.0)
    found = recommended_of(hazard, grid(4.0), study(102.0, 102.0, 0.0))
    assert found.without_ricochet.recommended == pytest.approx(90.0 + math.sqrt(40.0))


def test_the_rule_covers_95_percent():
    """Normal inputs, randomness, and a grid error to one side of which U bounds 95 %: 95 % lie below, not 99."""
    rng = np.random.default_rng(3)
    n = 40_000
    of_inputs, of_randomness, index = 6.0, 1.5, 4.0
    hazard = replace(HAZARD, upper=100.0 + NORMAL_95 * of_randomness)
    inputs = study(100.0, 100.0 + NORMAL_95 * of_inputs, 0.0)
    found = recommended_of(hazard, grid(index), inputs).recommended
    random = 100.0 + rng.normal(0.0, of_inputs, n) + rng.normal(0.0, of_randomness, n)
    for sigma in (index / 1.96, index / NORMAL_95):
        assert 0.945 < (random + rng.normal(0.0, sigma, n) <= found).mean() < 0.965
    # A limit known to lie above: the index is the whole band, its error is not centred.
    assert (random + rng.uniform(0.0, 0.5 * index, n) <= found).mean() > 0.93
