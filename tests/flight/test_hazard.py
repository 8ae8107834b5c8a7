"""Densities and probabilities against closed forms; tables by sector."""

from __future__ import annotations

import numpy as np
import pytest

from flight import LANDING, Cylinder, Fragments, InputError, Panel, Status, fly
from flight.hazard.criteria import hit_probability
from flight.hazard.density.sectors import by_azimuth, density_on, tally

LIMIT = 1.0 / 55.7


def landed(distance, azimuth, energy=100.0, angle=90.0) -> np.ndarray:
    rows = np.zeros(np.size(distance), dtype=LANDING)
    rows["status"] = Status.LANDED
    rows["distance"], rows["azimuth"], rows["energy"], rows["angle"] = distance, azimuth, energy, angle
    return rows


def isotropic(number: int, height: float, speed: float = 5e4) -> Fragments:
    generator = np.random.default_rng(0)
    direction = generator.normal(size=(number, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return Fragments(0.1, (0.0, 0.0, height), speed * direction)


def test_isotropic_field_on_a_ring() -> None:
    number, radius = 200_000, 10.0
    ring = Cylinder(radius, bottom=-0.5, top=0.5, name="ring")
    panel = Panel((radius, 0.0, 0.0), (1.0, 0.0, 0.0), 2.0, 2.0, name="panel")
    result = fly(
        isotropic(number, 0.0), air="vacuum", gravity=0.0, ground=None, time_limit=1.0, witnesses=[ring, panel]
    )
    field = number / (4.0 * np.pi * radius**2)
    plain, normal = density_on(result.hits_on("ring"), ring)
    share = 0.5 / np.hypot(radius, 0.5)  # part of the sphere that the ring covers
    assert plain == pytest.approx(number * share / ring.area, rel=0.02)
    assert normal == pytest.approx(field, rel=0.02)
    plain, normal = density_on(result.hits_on("panel"), panel)
    assert normal == pytest.approx(field, rel=0.06)
    with pytest.raises(InputError, match="all heights"):
        density_on(result.hits, Cylinder(1.0))


def test_sectors_energy_and_throw() -> None:
    rows = landed([12.0, 18.0, 12.0, 33.0, 12.0], [0.0, 2.4, 357.6, 90.0, 2.6], [79.0, 200.0, 80.0, 78.9, 500.0])
    rows["ricochets"][3], rows["last_status"][3] = 1, Status.LANDED
    rows["last_azimuth"][3], rows["last_distance"][3] = 95.0, 60.0
    found = tally(rows)
    assert found.azimuth[[0, 1, 18]].tolist() == [0.0, 5.0, 90.0]
    assert found.fragments[0, [0, 1, 18]].tolist() == [3, 1, 1]
    assert found.hazardous[0, [0, 1, 18]].tolist() == [3, 1, 0]
    assert found.throw[0, [0, 1, 18, 19]].tolist() == [18.0, 12.0, 0.0, 60.0], "where it came to rest"
    assert (found.fragments.sum(), found.hazardous.sum()) == (5, 4)


def test_probability() -> None:
    assert hit_probability(LIMIT) == pytest.approx(1.0 - np.exp(-0.58 / 55.7))
    assert hit_probability(0.0) == 0.0
    for density in (-1.0, [0.1, np.nan]):
        with pytest.raises(InputError, match=r"density is (-1|nan) 1/m2, needed: zero or more"):
            hit_probability(density)


def test_table_by_azimuth() -> None:
    azimuth = np.radians([0.0, 1.0, -1.0, 90.0, 182.4])
    velocity = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(5)], axis=1) * [[100], [200], [300], [400], [10]]
    fragments = Fragments([0.1, 0.1, 0.2, 0.1, 0.1], (0.0, 0.0, 1.0), velocity)
    result = fly(fragments, air="vacuum", gravity=0.0, ground=None, time_limit=1.0, witnesses=[Cylinder(5.0)])
    table = by_azimuth(result.hits)
    assert [row["azimuth_deg"] for row in table] == [5.0 * i for i in range(72)]
    assert table[0]["hits"] == 3
    assert table[0]["max_initial_speed"] == pytest.approx(300.0)
    assert table[0]["mean_initial_speed"] == pytest.approx(90.0 / 0.4)
    assert table[0]["mean_initial_speed_by_number"] == pytest.approx(200.0)
    assert (table[18]["hits"], table[36]["hits"], table[36]["hazardous_hits"]) == (1, 1, 0)
    assert sum(row["hits"] for row in table) == 5
    assert table[1]["mean_initial_speed"] == 0.0
