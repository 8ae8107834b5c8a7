"""Whether a distance can be determined: what became of the mass that could be hazardous."""

from __future__ import annotations

import numpy as np
import pytest

import flight
from flight import Cylinder, Fragments, Wall
from flight.hazard.criteria import Criteria
from flight.hazard.pool import Completeness

CRITERIA = Criteria()


def cloud(number: int = 200, speed: float = 500.0) -> Fragments:
    generator = np.random.default_rng(1)
    velocity = generator.normal(size=(number, 3))
    velocity[:, 2] = np.abs(velocity[:, 2]) + 0.1
    velocity *= speed / np.linalg.norm(velocity, axis=1)[:, None]
    return Fragments(np.full(number, 0.01), (0.0, 0.0, 1.0), velocity)


def completeness(fragments: Fragments, **options) -> Completeness:
    lowest = None if options.get("ground", 0.0) is None else 0.0
    return Completeness.of(flight.fly(fragments, threads=1, **options), fragments, CRITERIA.energy, lowest=lowest)


def test_a_cloud_that_lands_is_determined() -> None:
    found = completeness(cloud())
    assert found.reason == ""
    assert (found.fragments, found.landed, found.missing) == (200, 200, 0.0)
    assert found.possible == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"time_limit": 0.5}, "ran out of time"),
        ({"domain": flight.Domain(radius=20.0)}, "left the domain"),
        ({"ground": None, "time_limit": 5.0}, "200 ran out of time"),
    ],
)
def test_mass_that_has_not_landed_leaves_it_open(options, words: str) -> None:
    found = completeness(cloud(), **options)
    assert "of the mass that could be hazardous neither landed nor was stopped" in found.reason
    assert words in found.reason
    assert "at most 0.1 % is allowed" in found.reason


@pytest.mark.filterwarnings("ignore::flight.FlightWarning")
def test_a_fragment_without_a_path_counts_as_hazardous() -> None:
    fragments = cloud()
    without = cloud()
    without.velocity[7] = [1e200, 0.0, 0.0]  # overflows: no path; what is given so is refused
    found = completeness(without)
    assert "1 have no path (NaN)" in found.reason
    assert found.missing == pytest.approx(0.01)
    result = flight.fly(fragments, threads=1)
    result.landing["initial_speed"][3] = np.nan
    assert Completeness.of(result, fragments, 1e9).possible == pytest.approx(0.01)


def test_a_thousandth_of_the_mass_may_be_missing_and_no_more() -> None:
    few, many = Completeness(1000, 999, 0, 0, 10.0, 0.00999), Completeness(1000, 998, 0, 0, 10.0, 0.01002)
    assert few.reason == ""
    assert "0.1 % of the mass" in many.reason
    assert (few + many).reason != ""


def test_light_or_slow_fragments_do_not_matter_but_their_fall_does() -> None:
    slow = completeness(cloud(speed=20.0), time_limit=0.01)
    assert slow.possible == 0.0
    assert slow.missing == 0.0
    high = cloud(speed=20.0)
    position = high.position + np.array([0.0, 0.0, 1000.0])
    falling = Fragments(high.mass, position, high.velocity)
    assert completeness(falling, time_limit=0.01).missing == pytest.approx(2.0)
    # 0.01 kg at rest has 79 J after a fall of 805.57 m
    for height, missing in ((805.0, 0.0), (806.2, 2.0)):
        at_rest = Fragments(high.mass, (0.0, 0.0, height), 1e-6 * high.velocity)
        assert completeness(at_rest, time_limit=0.01).missing == pytest.approx(missing)


def test_hits_without_landings_leave_it_open() -> None:
    """An arena: every fragment is stopped by walls around it."""
    ends = [(-9.0, 8.0, 9.0, 8.0), (-9.0, -8.0, 9.0, -8.0), (8.0, -9.0, 8.0, 9.0), (-8.0, -9.0, -8.0, 9.0)]
    walls = [Wall((a, b), (c, d), 2000.0, 0.5, name=f"wall {k}") for k, (a, b, c, d) in enumerate(ends)]
    found = completeness(cloud(speed=50.0), obstacles=walls, witnesses=[Cylinder(5.0)], gravity=0.0, time_limit=1e4)
    assert found.landed == 0
    assert found.reason.startswith("none of 200 fragments landed")
    assert f"{found.hits} crossings of witness surfaces" in found.reason
    assert found.missing == 0.0
