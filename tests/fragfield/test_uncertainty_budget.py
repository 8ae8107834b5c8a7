"""The budget of the distance: its arithmetic, its coverage, and statistical errors taken out of the spread."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fragfield.studies.uncertainty.budget import NORMAL_95, budget_of
from fragfield.studies.uncertainty.spread import Spread, spread_of, without_statistical_error

HAZARD = {"distance": 100.0, "upper": 103.0}


def _spread(**changes):
    values = {
        "low": 90.0, "median": 101.0, "high": 113.0, "low_standard_error": 0.5, "median_standard_error": 0.4,
        "high_standard_error": 1.0, "mean": 101.2, "standard_deviation": 7.0, "statistical_error": 1.4,
        "resolved": True, "samples": 200,
    }  # fmt: skip
    return Spread(**{**values, **changes})


def _grid(uncertainty, kind="monotone", reason=""):
    return {"reason": reason, "quantities": {"hazard_distance": {"uncertainty": uncertainty, "kind": kind}}}


def test_contributions_add_up_as_squares():
    found = budget_of(_spread(), HAZARD, _grid(4.0))
    widths = {one["name"]: one["half_width"] for one in found["contributions"]}
    assert widths == {
        "inputs": 12.0,
        "number of samples": pytest.approx(NORMAL_95),
        "statistical error": 3.0,
        "grid": 4.0,
    }
    total = math.sqrt(12.0**2 + NORMAL_95**2 + 3.0**2 + 4.0**2)
    assert found["sum"] == pytest.approx(total)
    assert found["signed"] == pytest.approx(101.0 + total)
    assert sum(one["share"] for one in found["contributions"]) == pytest.approx(1.0)
    assert found["governed_by"] == "sum"
    assert found["complete"]


def test_without_inputs_and_grid_the_upper_bound_governs():
    """Inputs that do nothing leave the bound of the run: never less is signed than a run alone would give."""
    found = budget_of(_spread(low=98.0, median=98.0, high=98.0, high_standard_error=0.0), HAZARD, _grid(0.0))
    assert found["signed"] == 103.0
    assert found["governed_by"] == "nominal run"


@pytest.mark.parametrize("convergence", [{}, {"reason": "no grid convergence: the burst is in three dimensions"}])
def test_a_grid_that_is_not_known_is_said(convergence):
    found = budget_of(_spread(), HAZARD, convergence)
    assert not found["complete"]
    (grid,) = [one for one in found["contributions"] if one["name"] == "grid"]
    assert grid["half_width"] is None
    assert grid["share"] is None
    assert "not known, and not in the sum" in grid["note"]
    assert convergence.get("reason", "the nominal run has none") in grid["note"]
    assert found["signed"] == pytest.approx(101.0 + math.sqrt(12.0**2 + NORMAL_95**2 + 9.0))


def test_a_statistical_grid_index_is_marked():
    found = budget_of(_spread(), HAZARD, _grid(9.0, "statistical"))
    assert "mostly statistical error, an upper limit" in found["contributions"][3]["note"]


def test_the_rule_covers_95_percent():
    """Normal inputs, statistical error and samples, and a grid error to one side of which U bounds 95 %: 95 % lie below, not 99."""  # noqa: E501
    rng = np.random.default_rng(3)
    n = 40_000
    sd_inputs, sd_statistical, u_grid = 6.0, 1.5, 4.0
    spread = _spread(
        low=100.0 - NORMAL_95 * sd_inputs, median=100.0, high=100.0 + NORMAL_95 * sd_inputs, high_standard_error=0.0
    )
    hazard = {"distance": 100.0, "upper": 100.0 + NORMAL_95 * sd_statistical}
    signed = budget_of(spread, hazard, _grid(u_grid))["signed"]
    for sigma in (u_grid / 1.96, u_grid / NORMAL_95):
        true = 100.0 + rng.normal(0.0, sd_inputs, n) + rng.normal(0.0, sd_statistical, n) + rng.normal(0.0, sigma, n)
        assert 0.945 < (true <= signed).mean() < 0.965
    one_sided = (
        100.0 + rng.normal(0.0, sd_inputs, n) + rng.normal(0.0, sd_statistical, n) + rng.uniform(0.0, 0.5 * u_grid, n)
    )
    assert (one_sided <= signed).mean() > 0.93  # a limit known to lie above: the index is U, its error is not centred


def test_statistical_error_is_taken_out_of_the_spread():
    rng = np.random.default_rng(1)
    exact = rng.normal(100.0, 6.0, 5_000)
    values = exact + rng.normal(0.0, 3.0, 5_000)
    own, resolved = without_statistical_error(values, 9.0)
    assert resolved
    assert own.std() == pytest.approx(6.0, rel=0.03)
    assert own.mean() == pytest.approx(values.mean())
    found = spread_of(values, np.full(5_000, 3.0), rng)
    assert found.high == pytest.approx(100.0 + NORMAL_95 * 6.0, abs=0.45)
    assert found.low == pytest.approx(100.0 - NORMAL_95 * 6.0, abs=0.45)
    assert found.statistical_error == pytest.approx(3.0)


def test_inputs_below_the_statistical_error_stay_too_wide_and_are_marked():
    rng = np.random.default_rng(1)
    values = rng.normal(100.0, 1.0, 500) + rng.normal(0.0, 3.0, 500)
    own, resolved = without_statistical_error(values, 9.0)
    assert not resolved
    np.testing.assert_array_equal(own, values)
    assert not spread_of(values, np.full(500, 3.0), rng).resolved


def test_the_error_of_a_quantile_is_its_spread():
    errors, highs = [], []
    for seed in range(80):
        rng = np.random.default_rng(seed)
        found = spread_of(rng.normal(100.0, 6.0, 200), None, rng)
        errors.append(found.high_standard_error)
        highs.append(found.high)
    assert np.mean(errors) == pytest.approx(np.std(highs, ddof=1), rel=0.25)
