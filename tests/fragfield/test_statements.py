"""How often statements of 95 % hold: exposed sites, single events, and the number of a study, in 200 repetitions.

The distance itself: `tests.flight.test_expected`.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from flight.fluence import PolarGrid
from flight.hazard.ensemble import quantiles
from fragfield.hazard.places import PlaceSums
from fragfield.studies.uncertainty.plan import latin_hypercube
from fragfield.studies.uncertainty.statistics import spread_of

REPETITIONS, REALISATIONS = 200, 32
GRID = PolarGrid.of(72, 10.0, 10.0, 100.0)
SITE = np.array([[60.5, 1.0], [61.0, 1.0], [61.0, 1.5], [60.5, 1.5]])


@pytest.mark.parametrize(("events", "bundle"), [(0.1, 1.0), (3.0, 1.0), (0.5, 20.0)])
def test_bounds_of_exposed_sites(events: float, bundle: float) -> None:
    """Rare hits, many hits, and hits in bundles: expected `events` a realisation of `bundle` hits each."""
    generator, held = np.random.default_rng(1), []
    sums = PlaceSums(GRID, 1.8)
    place = sums.places.touched([SITE])
    assert len(place) == 1
    turns, cells = np.nonzero(sums.places.of_cells == place[0])
    truth = events * bundle / sums.places.area[place[0]]
    for _ in range(REPETITIONS):
        sums = PlaceSums(GRID, 1.8)
        for hits in bundle * generator.poisson(events, REALISATIONS):
            field = np.zeros(GRID.shape)
            field[turns[0], cells[0]] = hits
            sums.add(field, field)
        held.append([entry.upper >= truth for entry in sums.worst([SITE], [])[0]])
    landings, paths = np.mean(held, axis=0)
    assert 0.92 <= landings <= 0.995
    assert paths >= landings, "a single path may be longer than the place is high: its bound is wider"


SHAPES = {"normal": lambda z: z, "skew": lambda z: np.exp(0.5 * z), "heavy": np.sinh}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("number", [20, 32, 200])
def test_one_further_event_in_twenty_exceeds_the_band(shape: str, number: int) -> None:
    """Of the events of a run the 95 % quantile holds for one more, however few there are."""
    of = SHAPES[shape]
    drawn = of(np.random.default_rng(2).standard_normal((number, REPETITIONS)))
    normal = np.linspace(-8.0, 8.0, 100_001)
    high = ndtr(np.interp(quantiles(drawn, 0.95), of(normal), normal)).mean()
    assert 0.935 <= high <= 0.965
    if number == 20:
        plain = ndtr(np.interp(np.quantile(drawn, 0.95, axis=0), of(normal), normal)).mean()
        assert plain < 0.925, "the plain quantile of few is too small"


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("number", [32, 100])
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_the_inputs_of_one_case_in_twenty_exceed_the_number_of_a_study(
    shape: str, number: int, noise: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A result of six inputs by a Latin hypercube, with errors of the samples that are known."""
    monkeypatch.setattr("fragfield.studies.uncertainty.statistics._QUANTILE_DRAWS", 2)
    part, of, covered = np.array([0.8, 0.4, 0.3, 0.2, 0.2, 0.1]), SHAPES[shape], []
    part /= math.hypot(*part)
    scale = noise * float(of(np.random.default_rng(0).standard_normal(100_000)).std())
    normal = np.linspace(-8.0, 8.0, 100_001)
    for repetition in range(REPETITIONS):
        generator = np.random.default_rng(repetition)
        values = of(ndtri(latin_hypercube(len(part), number, repetition)) @ part)
        errors = np.full(number, scale) if noise else None
        high = spread_of(values + scale * generator.standard_normal(number), errors, generator).high
        covered.append(ndtr(np.interp(high, of(normal), normal)))
    assert 0.93 <= np.mean(covered) <= 0.97
