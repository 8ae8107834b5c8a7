"""Arena tables: sums, the file out and in, and the distances of what is made from them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import flight
from flight.arena import ArenaTable, is_arena_file
from flight.fluence import PolarGrid
from flight.hazard.criteria import Criteria
from flight.hazard.density.density_counts import DensityGroups, density_counts
from flight.hazard.density.directions import Directions
from flight.hazard.density.expected import expected_distance


def burst(seed: int, number: int = 700) -> flight.Fragments:
    """Natural fragments of an upright round: Mott masses, speeds and directions smooth along the wall, a slow base."""
    generator = np.random.default_rng(seed)
    mass = 0.006 * generator.exponential(size=number) ** 2 + 1e-5
    polar = np.clip(generator.normal(96.0, 11.0, number), 3.0, 177.0)
    polar[: number // 12] = generator.uniform(160.0, 180.0, number // 12)
    turn = generator.uniform(0.0, 2.0 * np.pi, number)
    speed = 1150.0 - 6.0 * np.abs(polar - 95.0) + generator.normal(0.0, 30.0, number)
    speed[: number // 12] = 300.0
    sine, cosine = np.sin(np.radians(polar)), np.cos(np.radians(polar))
    way = np.column_stack([sine * np.cos(turn), sine * np.sin(turn), cosine])
    return flight.Fragments(mass, (0.0, 0.0, 1.0), speed[:, None] * way)


def distance_of(realisations) -> tuple[float, float]:
    """Hazard distance and its standard error (m)."""
    grid, criteria = PolarGrid.of(72, 10.0, 10.0, 1500.0), Criteria()
    groups = DensityGroups(Directions(grid))
    for fragments in realisations:
        result = flight.fly(fragments, fluence=criteria.fluence_grid(grid), sample=0, threads=1)
        groups.add(*density_counts(result))
    found = expected_distance(groups, criteria.density)
    return found.distance, found.standard_error


@pytest.fixture(scope="module")
def table() -> ArenaTable:
    return ArenaTable.of([burst(seed) for seed in range(60)])


def test_sums_are_those_of_the_fragments():
    fragments = burst(3)
    zones = ArenaTable.of([fragments]).by_zone()
    speed = np.linalg.norm(fragments.velocity, axis=1)
    polar = np.degrees(np.arccos(fragments.velocity[:, 2] / speed))
    assert zones["number"].sum() == len(fragments)
    assert zones["mass"].sum() == pytest.approx(fragments.mass.sum())
    here = (polar >= 95.0) & (polar < 100.0)
    assert zones["number"][19] == here.sum()
    assert zones["mean_speed"][19] == pytest.approx((fragments.mass * speed)[here].sum() / fragments.mass[here].sum())
    assert zones["max_speed"][19] == pytest.approx(speed[here].max())


def test_two_rounds_with_their_own_axes_give_the_mean_of_one():
    one = burst(1)
    turned = flight.Fragments(one.mass, (5.0, 0.0, 1.0), one.velocity[:, [2, 0, 1]], round=1)
    pair = flight.Fragments.concatenate([one, turned])
    both = ArenaTable.of([pair], [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]).by_zone()
    single = ArenaTable.of([one]).by_zone()
    for name, values in single.items():
        assert both[name] == pytest.approx(values, rel=1e-9), name


def test_file_out_and_in_again_gives_the_same_table_and_the_same_distances(table, tmp_path):
    path = table.write(tmp_path / "arena.csv")
    assert is_arena_file(path)
    back = ArenaTable.read(path)
    for name in ("zones", "zone", "mass_from", "mass_to", "number", "mass", "speed", "max_speed"):
        assert np.array_equal(getattr(back, name), getattr(table, name)), name
    first = distance_of([table.realisation(1, k) for k in range(8)])
    assert distance_of([back.realisation(1, k) for k in range(8)]) == first


def test_a_realisation_has_the_numbers_and_directions_of_its_table(table):
    again = ArenaTable.of([table.realisation(5, k) for k in range(300)])
    ours, theirs = again.by_zone(), table.by_zone()
    full = theirs["number"] > 5.0
    assert ours["number"][full] == pytest.approx(theirs["number"][full], rel=0.02)
    assert ours["mass"].sum() == pytest.approx(theirs["mass"].sum(), rel=0.005)
    assert ours["mean_speed"][full] == pytest.approx(theirs["mean_speed"][full], rel=0.005)


@pytest.mark.parametrize("edges", [(0.0, np.inf), (0.0, 0.003, 0.02, np.inf), (0.0, 0.02, 0.1, np.inf)])
def test_masses_within_wide_groups_are_spread_by_a_law_with_their_mean(edges):
    """Mott masses in few groups: drawn again they keep mean, edges, and the number of heavy ones within 15 %."""
    mass = 0.006 * np.random.default_rng(2).exponential(size=200_000) ** 2 + 1e-7
    rows = []
    for low, high in pairwise(edges):
        here = mass[(mass >= low) & (mass < high)]
        rows.append((low, high, len(here) / 100.0, here.mean(), 1000.0, 1200.0))
    columns = np.array(rows).T
    table = ArenaTable(np.array([0.0, 180.0]), np.zeros(len(rows), dtype=np.int64), *columns)
    drawn = [table.realisation(3, k) for k in range(60)]
    again = np.concatenate([one.mass for one in drawn])
    assert again.sum() / 60 == pytest.approx(mass.sum() / 100.0, rel=0.02)
    for low, high, number, mean, *_ in rows:
        here = again[(again >= low) & (again < high)]
        assert len(here) / 60 == pytest.approx(number, rel=0.01)
        assert here.mean() == pytest.approx(mean, rel=0.03)
    for heavy in (0.03, 0.1):
        assert (again > heavy).sum() / 60 == pytest.approx((mass > heavy).sum() / 100.0, rel=0.15)
    assert len(np.unique(again)) > 0.99 * len(again)
    speed = np.concatenate([one.speed for one in drawn])
    assert speed.mean() == pytest.approx(1000.0, rel=1e-3)
    assert 1190.0 < speed.max() <= 1200.0


def test_joined_zones_hold_what_their_zones_hold(table):
    joined = table.merged()
    assert len(joined.zones) == len(table.zones) // 2 + 1
    assert joined.total_mass == pytest.approx(table.total_mass, rel=1e-12)
    ours, theirs = joined.by_zone(), table.by_zone()
    for name in ("number", "mass", "max_speed"):
        pairs = theirs[name].reshape(-1, 2)
        assert ours[name] == pytest.approx(pairs.max(axis=1) if name == "max_speed" else pairs.sum(axis=1)), name


def test_fragments_at_rest_count_abreast_and_fall(table):
    fragments = flight.Fragments([0.01, 0.02], (0.0, 0.0, 1.0), [(0.0, 0.0, 0.0), (0.0, 0.0, 500.0)])
    found = ArenaTable.of([fragments])
    assert found.by_zone()["number"][[0, 18]].tolist() == [1.0, 1.0]
    again = found.realisation(1)
    assert flight.fly(again, sample=0, threads=1).summary["landed"] == 2


def test_rounds_lie_along_their_axis(table):
    fragments = table.realisation(1, axis=(1.0, 1.0, 0.0), position=(1.0, 2.0, 3.0), round_number=2)
    assert np.all(fragments.position == (1.0, 2.0, 3.0))
    assert set(fragments.round) == {2}
    sideways = ArenaTable.of(
        [flight.Fragments(fragments.mass, fragments.position, fragments.velocity)], (1.0, 1.0, 0.0)
    )
    assert sideways.by_zone()["number"][17:22].sum() > 0.5 * len(fragments)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("0,90,0,1,3,0.01,900\n100,180,0,1,3,0.01,900\n", "nothing from 90 to 100 degrees"),
        ("0,90,0,1,3,0.01,900\n180,180,0,1,3,0.01,900\n", "nothing from 90 to 180 degrees"),
        ("0,100,0,1,3,0.01,900\n90,180,0,1,3,0.01,900\n", "overlaps another"),
        ("0,180,0,1,3,0,900\n", "fragments without mass"),
        ("0,180,0,1,-3,0.1,900\n", "number of row 1 is -3.0, needed: 0 or more"),
        ("10,180,0,1,3,0.1,900\n", "zones must rise from 0 to 180"),
    ],
)
def test_faults_of_a_file_are_named(tmp_path, rows, message):
    path = tmp_path / "z.csv"
    path.write_text("zone_from_deg,zone_to_deg,mass_from_kg,mass_to_kg,number,mean_mass_kg,mean_speed_m_s\n" + rows)
    with pytest.raises(flight.InputError, match=message) as caught:
        ArenaTable.read(path)
    assert str(path) in str(caught.value)


GROUPS = "zone_from_deg,zone_to_deg,mass_from_kg,mass_to_kg,number,mean_mass_kg,mean_speed_m_s\n"


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("0,180,0.01,0.02,3,0.0101,900", ""),
        ("0,180,0.01,0.02,3,0.01999,900", ""),
        (
            "0,180,0.01,0.02,3,0.0098,900",
            "mean mass of row 1 is 0.0098 kg, outside its own group of mass; allowed: 0.01",
        ),
        (
            "0,180,0.01,0.02,3,0.0203,900",
            "mean mass of row 1 is 0.0203 kg, outside its own group of mass; allowed: 0.01",
        ),
        ("0,180,0.01,0.02,3,15,900", "outside its own group of mass; allowed: 0.01 to 0.02 kg"),  # grams
        ("0,180,0,inf,3,0.015,900", ""),
        ("0,180,0.02,0.01,3,0.015,900", "the group of mass of row 1 runs from 0.02 to 0.01 kg"),
        ("0,180,-1,0.02,3,0.015,900", "the group of mass of row 1 runs from -1 to 0.02 kg; allowed: from 0 or more"),
        ("0,180,0,0.01,3,2e-6,900", ""),
        ("0,180,0,0.01,3,5e-7,900\n0,180,0.01,0.1,1,0.02,900", ""),  # a group of a computed table may be lighter
        ("0,180,0,0.01,3,9e-7,900", "mean_mass_kg: the mean of all fragments is 9e-07 kg; allowed: at least 1e-06 kg"),
    ],
)
def test_a_mean_mass_lies_in_its_own_group(row, message, tmp_path):
    (tmp_path / "a.csv").write_text(f"{GROUPS}{row}\n")
    if not message:
        assert len(ArenaTable.read(tmp_path / "a.csv").number) == 1 + row.count("\n")
        return
    with pytest.raises(flight.InputError) as found:
        ArenaTable.read(tmp_path / "a.csv")
    assert message in str(found.value)
    assert str(found.value).startswith(str(tmp_path / "a.csv"))


def test_scaled_tables_hold_more_of_the_same(table):
    twice = table.scaled(2.0)
    assert twice.total_mass == pytest.approx(2.0 * table.total_mass)
    assert np.array_equal(twice.mass, table.mass)
    assert table.scaled(1.0) is table
    with pytest.raises(flight.InputError, match=r"factor on the numbers is 0.0, needed: above zero"):
        table.scaled(0.0)
