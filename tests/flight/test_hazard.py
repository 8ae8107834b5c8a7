"""Densities and distances against closed forms, and the M107 of 1944."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flight import LANDING, ConstantAir, Cylinder, Fragments, InputError, Panel, Status, fly
from flight.files.text_tables import read_columns
from flight.hazard.criteria import Criteria, hit_probability
from flight.hazard.density.tally import tally
from flight.hazard.density.witness_hazard import by_azimuth, density_on
from validation.m107_1944.counts import falling_through

LIMIT = 1.0 / 55.7


def landed(distance, azimuth, energy=100.0, angle=90.0) -> np.ndarray:
    rows = np.zeros(np.size(distance), dtype=LANDING)
    rows["status"] = Status.LANDED
    rows["distance"], rows["azimuth"], rows["energy"], rows["angle"] = distance, azimuth, energy, angle
    return rows


def isotropic(number: int, height: float, speed: float = 1e5) -> Fragments:
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


def test_distance_is_linear_between_centres() -> None:
    place = np.array([5.0, 15.0, 25.0, 35.0])
    assert falling_through(place, np.array([9.0, 4.0, 2.0, 0.0]), 3.0) == pytest.approx(20.0)
    assert falling_through(place, np.array([9.0, 1.0, 4.0, 2.0]), 3.0) == pytest.approx(30.0)  # the farthest counts
    assert falling_through(place, np.array([9.0, 9.0, 9.0, 9.0]), 3.0) == 35.0
    assert falling_through(place, np.zeros(4), 3.0) == 0.0
    # N / (4 pi r^2) on cells: the exact distance within their width squared
    edges = np.linspace(0.0, 100.0, 101)
    middle = 0.5 * (edges[1:] + edges[:-1])
    exact = np.sqrt(900.0 / (4.0 * np.pi * LIMIT))
    assert falling_through(middle, 900.0 / (4.0 * np.pi * middle**2), LIMIT) == pytest.approx(exact, rel=1e-4)


def test_probability() -> None:
    assert hit_probability(LIMIT) == pytest.approx(1.0 - np.exp(-0.58 / 55.7))
    assert hit_probability(0.0) == 0.0


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


def test_messages() -> None:
    with pytest.raises(InputError, match=r"sector width is 7\.0 degrees"):
        tally(landed([1.0], [0.0]), sector_width=7.0)


def test_criteria_messages() -> None:
    with pytest.raises(InputError, match="density is 0"):
        Criteria(density=0.0)
    with pytest.raises(InputError, match="energy is nan"):
        Criteria(energy=np.nan)


def test_m107_of_1944() -> None:
    """US Ordnance Department (1944), Table 56: single M107; Mott law of 1760 fragments, mu = 7.5 g, 1067 m/s."""
    table = read_columns(Path(__file__).parent / "m107_1944_table56.csv")
    dense = 4  # fragments a unit of the law: N(m) resolved to a quarter
    rank = (np.arange(1760 * dense) + 0.5) / dense
    mass = 7.5e-3 * np.log(1760.0 / rank) ** 2
    assert mass.sum() / dense == pytest.approx(26.4, rel=0.01)
    azimuth = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, mass.size)
    velocity = 1067.0 * np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
    fragments = Fragments(mass, (0.0, 0.0, 0.0), velocity, shape_factor=2600.0)
    table_radii = 0.3048 * table["distance_ft"]
    radii = np.concatenate([table_radii, np.arange(40.0, 90.0, 2.0)])
    result = fly(
        fragments, air=ConstantAir(1.225, 340.294), gravity=0.0, ground=None, time_limit=60.0,
        witnesses=[Cylinder(r, name=f"{i}") for i, r in enumerate(radii)],
    )  # fmt: skip
    number, speed = np.zeros(radii.size), np.zeros(radii.size)
    for i in range(radii.size):
        hits = result.hits_on(f"{i}")
        hazardous = hits[hits["energy"] >= 79.0]
        number[i] = len(hazardous) / dense
        speed[i] = hazardous["speed"][np.argmin(hazardous["mass"])]
    gates = (table["distance_ft"] >= 20.0) & (table["distance_ft"] <= 150.0)
    speed_error = speed[: gates.size] / (0.3048 * table["speed_ft_s"]) - 1.0
    number_error = number[: gates.size] / table["number"] - 1.0
    reported = f"speed {np.round(speed_error, 3)}, number {np.round(number_error, 3)}"
    assert np.abs(speed_error[gates]).max() < 0.10, reported
    assert np.abs(number_error[gates]).max() < 0.10, reported
    near = radii[gates.size :]
    distance = falling_through(near, number[gates.size :] / (4.0 * np.pi * near**2), LIMIT)
    assert 62.0 * 0.95 <= distance <= 63.0 * 1.05, f"hazardous fragment distance {distance:.1f} m; {reported}"
