"""`flight.hazard_distance` against densities that are known over distance, and its errors in words."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

import flight
from flight.hazard import Criteria, ensemble_hazard
from flight.hazard.pool import _too_few

LIMIT = 1.0 / 55.7
VACUUM = {"air": "vacuum", "gravity": 0.0, "ricochet": "none", "threads": 1}


def fan(number: int, height: float, fall: float, *, sector: float = 360.0, turn: float = 0.0) -> flight.Fragments:
    """Equal fragments from a height, evenly over a sector of azimuth (degrees), each falling `fall` over a metre."""
    azimuth = np.radians(turn + sector * ((np.arange(number) + 0.5) / number - 0.5))
    velocity = 600.0 * np.column_stack([np.cos(azimuth), np.sin(azimuth), np.full(number, -fall)])
    return flight.Fragments(0.02, (0.0, 0.0, height), velocity)


def drawn_fan(generator: np.random.Generator, number: float, length: float) -> flight.Fragments:
    """Fragments that land at distances drawn from (1 / L) exp(-r / L), at random azimuths; their number too."""
    count = generator.poisson(number)
    azimuth, reach = generator.uniform(0.0, 2.0 * np.pi, count), generator.exponential(length, count)
    velocity = 600.0 * np.column_stack([np.cos(azimuth), np.sin(azimuth), -1.0 / np.maximum(reach, 1.0)])
    return flight.Fragments(0.02, (0.0, 0.0, 1.0), velocity)


def test_level_paths_have_the_density_of_their_circle() -> None:
    """N fragments on level lines below 1.8 m: N / (2 pi r h) across the paths, at the limit at N / (2 pi h limit)."""
    number, height = 288, 1.8
    exact = number / (2.0 * np.pi * height * LIMIT)
    fragments = fan(number, 1.0, 1.0 / 2e5)  # 200 km to the ground: level up to the end of what is seen
    end = flight.Domain(radius=3000.0)
    with pytest.raises(flight.NotDeterminedError, match="288 left the domain"):
        flight.hazard_distance(fragments, by="all", domain=end, **VACUUM)
    found = ensemble_hazard(fragments, by="all", domain=end, **VACUUM).expected
    assert found.normal == pytest.approx(exact, rel=2e-3)
    inner = (found.radius > 20.0) & (found.radius < 0.8 * exact)
    assert found.density[1][inner] == pytest.approx(number / (2.0 * np.pi * found.radius[inner] * height), rel=5e-3)


def test_an_even_fan_has_one_distance_in_every_direction() -> None:
    """Straight lines from 1 m down to the ground at 400 m: N / (2 pi r h) along them, over all azimuths and in each."""
    number, criteria = 288, Criteria(density=0.1)
    exact = number / (2.0 * np.pi * 1.8 * 0.1)
    fragments = fan(number, 1.0, 1.0 / 400.0)
    for by in ("all", "worst"):
        found = flight.hazard_distance(fragments, criteria, by=by, **VACUUM)
        assert [found.distance, found.normal] == pytest.approx([exact, exact], rel=2e-3)
        assert found.ground == 0.0
        assert found.by_direction == pytest.approx(exact, rel=2e-3)
        assert (found.direction is None) == (by == "all")
        assert found.upper is None


@pytest.mark.parametrize("turn", [0.0, 137.0])
def test_a_sector_has_its_own_direction_and_density(turn: float) -> None:
    """Level lines over 60 degrees about an azimuth: six times the density of as many all around, there."""
    number = 48
    fragments = fan(number, 1.0, 1.0 / 2e5, sector=60.0, turn=turn)
    found = ensemble_hazard(fragments, domain=flight.Domain(radius=3000.0), **VACUUM).expected
    exact = 6.0 * number / (2.0 * np.pi * 1.8 * LIMIT)
    assert found.normal == pytest.approx(exact, rel=5e-3)
    assert abs((found.direction - turn + 180.0) % 360.0 - 180.0) <= 20.0, "a kernel from the ends of the sector"


def test_landings_of_an_exponential_density_and_their_bound() -> None:
    """Ground density N / (2 pi r L) exp(-r / L): its distance within the standard error, below the bound."""
    number, length = 3000.0, 150.0
    radius = np.linspace(1.0, 1000.0, 400_000)
    exact = radius[np.flatnonzero(number / (2.0 * np.pi * radius * length) * np.exp(-radius / length) >= LIMIT)[-1]]
    generator = np.random.default_rng(4)
    events = [drawn_fan(generator, number, length) for _ in range(12)]
    found = flight.hazard_distance(events, Criteria(person_height=0.0), by="all", **VACUUM)
    assert found.realisations == 12
    assert found.standard_error is not None
    assert found.ground == pytest.approx(exact, abs=3.0 * found.standard_error)
    assert 0.002 < found.standard_error / found.distance < 0.03
    assert found.upper > found.distance


def test_fragments_that_pass_far_beyond_the_first_grid_count() -> None:
    found = flight.hazard_distance(fan(600, 1.0, 1.0 / 2500.0), by="all", **VACUUM)
    assert found.distance == pytest.approx(2500.0, rel=0.05)


ONE = fan(3, 1.0, 0.1)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: flight.hazard_distance([]), "there are no realisations; needed: one or more"),
        (lambda: flight.hazard_distance([ONE, 3.0]), "found float among the realisations; needed: flight.Fragments"),
        (lambda: flight.hazard_distance(3.0), "realisations is a float; needed: flight.Fragments, or a sequence"),
        (lambda: flight.hazard_distance(ONE, by="wurst"), "by is 'wurst'.*worst"),
        (lambda: flight.hazard_distance(ONE, kernel=0.2), "kernel is 0.2 degrees, allowed: 1 to 180"),
        (lambda: flight.hazard_distance(ONE, kernel=math.nan), "kernel is nan degrees"),
        (lambda: flight.hazard_distance(ONE, ground=None), "ground is None; needed: a height"),
        (lambda: flight.hazard_distance(ONE, fluence=None), "fluence is its own; give criteria and kernel"),
        (lambda: flight.hazard_distance(ONE, air="vakuum"), "air: unknown name 'vakuum'"),
        (
            lambda: flight.hazard_distance(ONE, time_limit=1e-3),
            "not determined: 100 % of .*3 ran out of time",
        ),
        (lambda: flight.hazard_distance(ONE.select([])), "not determined: there are no fragments"),
    ],
)
def test_errors_in_words(call, words: str) -> None:
    with pytest.raises(flight.InputError, match=words):
        call()


def test_no_other_number_of_a_flight_has_that_name() -> None:
    result = flight.fly(ONE)
    assert not [name for name in dir(result) if "hazard" in name]
    assert not [name for name in result.summary if "hazard" in name]


def test_equal_realisations_are_refused() -> None:
    """Twenty times one event would have a bound without scatter."""
    one, other = fan(90, 1.0, 0.01), fan(90, 1.0, 0.01, turn=1.0)
    with pytest.raises(flight.InputError, match="realisation 2 has the fragments of another one"):
        flight.hazard_distance([one, other, fan(90, 1.0, 0.01)], by="all", **VACUUM)


@pytest.mark.parametrize(
    ("realisations", "by", "words"),
    [
        ([fan(9, 1.0, 0.1)], "all", "9 hazardous fragments in 1 realisations; needed: 10 or more"),
        (
            [fan(60, 1.0, 0.1)],
            "worst",
            "of 60 hazardous fragments within 10 degrees of the worst direction; needed: 10",
        ),
        ([fan(2, 1.0, 0.1, turn=turn) for turn in range(4)], "worst", "8 hazardous fragments in 4 realisations"),
    ],
)
def test_a_distance_of_fewer_than_ten_hazardous_fragments_is_refused(realisations, by: str, words: str) -> None:
    """It would be the kernel's width: one fragment in a worst direction gives 276 m with 5 degrees, 89 m with 20."""
    with pytest.raises(flight.NotDeterminedError, match=words):
        flight.hazard_distance(realisations, by=by, **VACUUM)
    assert words in ensemble_hazard(realisations, by=by, **VACUUM).undetermined


def test_few_fragments_without_hazard_have_no_distance_to_keep() -> None:
    slow = flight.Fragments(0.02, (0.0, 0.0, 1.0), [(20.0, 0.0, 0.0), (0.0, 20.0, 0.0)])
    assert flight.hazard_distance(slow, by="all", threads=1).distance == 0.0


@pytest.mark.parametrize(("realisations", "refused"), [(1, True), (20, False)])
def test_directions_that_are_alike_are_counted_together(realisations: int, refused: bool) -> None:
    """Several realisations pool directions that are alike: 240 fragments leave 13 to each, wherever the worst is."""
    hazardous = np.zeros(3600, dtype=np.int64)
    hazardous[200:3400:40] = 3
    found = SimpleNamespace(direction=0.0, kernel=10.0, realisations=realisations)
    assert bool(_too_few(found, hazardous)) == refused
