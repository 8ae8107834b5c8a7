"""Ensembles: single events by the same estimate, throws and numbers by sector, and the files of an ensemble."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from flight import Fragments, InputError
from flight.files.ensemble import (
    CSV_FILES,
    read_ensemble,
    read_fragment_ensemble,
    write_ensemble,
    write_fragment_ensemble,
)
from flight.files.text_tables import read_columns
from flight.fluence import PolarGrid
from flight.hazard.criteria import hit_probability
from flight.hazard.density.directions import Directions
from flight.hazard.density.expected import ExpectedDistance
from flight.hazard.density.sectors import SECTOR_HITS, Tally, by_azimuth, sector_hits, tally
from flight.hazard.ensemble import EnsembleHazard, quantiles
from flight.hazard.pool import KEPT
from flight.rows import HITS, LANDING, Status
from tests.flight.fields import ensemble_of_landings

GRID = PolarGrid.of(sectors=12)
BASES = ("all_azimuths", "worst_direction")


def poisson_field(generator: np.random.Generator, reach: float = 150.0, number: float = 3000.0) -> np.ndarray:
    """Hazardous landings of mean density number / (2 pi d reach) exp(-d / reach): exponential in distance."""
    rows = np.zeros(generator.poisson(number), dtype=LANDING)
    rows["status"], rows["energy"], rows["angle"] = Status.LANDED, 100.0, 90.0
    rows["distance"] = generator.exponential(reach, len(rows))
    rows["azimuth"] = generator.uniform(0.0, 360.0, len(rows))
    return rows


def ensemble(realisations: int, seed: int = 1, basis: str = "all_azimuths", **settings: float) -> EnsembleHazard:
    generator = np.random.default_rng(seed)
    parts = [poisson_field(generator, **settings) for _ in range(realisations)]
    return ensemble_of_landings(parts, Directions(GRID, basis))


@pytest.mark.parametrize("basis", BASES)
def test_an_event_in_the_ensemble_is_that_event_alone(basis: str) -> None:
    """However far the others flew: its distance is that of an ensemble of it alone, by the same estimate."""
    generator = np.random.default_rng(5)
    parts = [poisson_field(generator, reach) for reach in (20.0, 300.0, 100.0)]
    directions = Directions(GRID, basis)
    found = ensemble_of_landings(parts, directions)
    for number, part in enumerate(parts):
        alone = ensemble_of_landings([part], directions)
        assert found.events[number] == pytest.approx(alone.expected.distance, rel=1e-12)
        assert found.events[number] == pytest.approx(alone.events[0], rel=1e-12)
        assert found.throw[number] == alone.throw[0] == part["distance"].max()
        assert alone.expected.upper is None


def test_nine_events_of_ten_lie_within_the_band_and_their_mean_in_its_middle() -> None:
    found = ensemble(100)
    median, low, high = found.single_event
    assert np.mean((found.events >= low) & (found.events <= high)) == pytest.approx(0.9, abs=0.02)
    assert median == pytest.approx(found.expected.distance, rel=0.02)
    assert low < 0.97 * median < 1.03 * median < high


def test_in_the_worst_direction_single_events_reach_farther_than_their_mean() -> None:
    """Of an even field each event has a worst direction of its own: the largest of many counts."""
    found, even = ensemble(6, basis="worst_direction"), ensemble(6)
    assert found.events.min() > even.events.max()
    assert found.events.min() > found.expected.distance


def test_the_first_realisations_alone_are_kept() -> None:
    found = ensemble(KEPT + 3, number=50.0)
    assert found.realisations == len(found.events) == len(found.throw) == KEPT
    assert found.expected.realisations == KEPT + 3
    assert found.headline["single_event"]["realisations"] == KEPT
    assert found.headline["realisations"] == KEPT + 3


def test_the_order_of_the_realisations_changes_no_event() -> None:
    generator = np.random.default_rng(9)
    parts = [poisson_field(generator) for _ in range(2)]
    there, back = (ensemble_of_landings(one, Directions(GRID, "worst_direction")) for one in (parts, parts[::-1]))
    assert there.single_event == back.single_event
    assert there.summary() == back.summary()


def test_throws_and_numbers_by_sector() -> None:
    generator = np.random.default_rng(3)
    parts = [poisson_field(generator) for _ in range(20)]
    found = ensemble_of_landings(parts, Directions(GRID))
    here = [(np.floor(part["azimuth"] / 30.0 + 0.5).astype(int) % 12) == 4 for part in parts]
    throws = [part["distance"][one].max() for part, one in zip(parts, here, strict=True)]
    row = found.summary()["by_sector"][4]
    assert row["azimuth_deg"] == 120.0
    assert row["fragments"] == row["hazardous"] == np.mean([one.sum() for one in here])
    assert (row["max_throw"], row["max_throw_largest"]) == (np.median(throws), max(throws))
    assert [row["max_throw_low"], row["max_throw_high"]] == pytest.approx(quantiles(throws, [0.05, 0.95]))
    farthest = [part["distance"].max() for part in parts]
    assert found.summary()["max_range"] == np.median(farthest)
    assert found.headline["largest_throw"] == pytest.approx(quantiles(farthest, 0.95))


def _same(one: object, other: object) -> bool:
    if isinstance(one, ExpectedDistance) and isinstance(other, ExpectedDistance):
        return all(_same(getattr(one, entry.name), getattr(other, entry.name)) for entry in fields(one))
    return np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other


@pytest.mark.parametrize("basis", BASES)
def test_files_hold_the_ensemble(basis: str, tmp_path: Path) -> None:
    found = ensemble(4, basis=basis)
    found = replace(found, expected=replace(found.expected, without_ricochet=replace(found.expected, distance=1.0)))
    hits = np.zeros((4, 12), dtype=SECTOR_HITS)
    hits["hits"] = np.arange(48).reshape(4, 12)
    hits["mean_initial_speed"] = 0.5 * hits["hits"]
    paths = write_ensemble(found, {"ring": hits}, tmp_path, {"seed": "7"})
    assert [path.name for path in paths] == ["ensemble.h5", *CSV_FILES]
    again, witnesses = read_ensemble(tmp_path / "ensemble.h5")
    assert _same(again.expected, found.expected)
    assert again.headline == found.headline
    assert again.summary() == found.summary()
    assert again.criteria == found.criteria
    assert list(witnesses) == ["ring"]
    assert (witnesses["ring"] == hits).all()
    with h5py.File(tmp_path / "ensemble.h5") as file:
        assert file.attrs["seed"] == "7"
        assert file["expected"].attrs["upper"] == found.expected.upper
    table = read_columns(tmp_path / "ensemble.csv")
    assert table["distance_m"] == pytest.approx(found.events, rel=1e-9)
    assert table["max_throw_m"] == pytest.approx(found.throw, rel=1e-9)
    table = read_columns(tmp_path / "hazard_by_distance.csv")
    assert table["distance_m"] == pytest.approx(found.expected.radius, rel=1e-9)
    assert table["normal_density_high_1_m2"] == pytest.approx(found.expected.density_high[1], rel=1e-9)
    assert table["probability"] == pytest.approx(hit_probability(found.expected.density[1]), rel=1e-9)
    table = read_columns(tmp_path / "hazard_by_sector.csv")
    assert table["azimuth_deg"].tolist() == [30.0 * i for i in range(12)]
    assert table["upper_m"].max() <= found.expected.upper * (1.0 + 1e-9)
    with h5py.File(tmp_path / "ensemble.h5", "a") as file:
        del file["expected/density_by_direction"]  # as earlier versions wrote it
    assert read_ensemble(tmp_path / "ensemble.h5")[0].expected.density_by_direction.shape == (2, 0, 0)
    with h5py.File(tmp_path / "ensemble.h5", "a") as file:
        del file["counts/throw"]
    with pytest.raises(InputError, match=r"ensemble\.h5: data cut off or damaged"):
        read_ensemble(tmp_path / "ensemble.h5")
    with pytest.raises(InputError, match="no such file"):
        read_ensemble(tmp_path / "other.h5")


def test_a_density_below_zero_by_round_off_is_none(tmp_path: Path) -> None:
    found = ensemble(3)
    density = found.expected.density.copy()
    density[:, -3:] = -4e-14
    write_ensemble(replace(found, expected=replace(found.expected, density=density)), {}, tmp_path)
    table = read_columns(tmp_path / "hazard_by_distance.csv")
    assert (table["normal_density_1_m2"][-3:] == 0.0).all()
    assert (table["probability"][-3:] == 0.0).all()


def test_what_is_not_determined_has_no_distance_in_any_file(tmp_path: Path) -> None:
    found = replace(ensemble(3), undetermined="none landed")
    write_ensemble(found, {}, tmp_path)
    again, _ = read_ensemble(tmp_path / "ensemble.h5")
    assert again.undetermined == "none landed"
    assert again.headline == found.headline
    assert found.headline["expected"] is found.headline["single_event"] is None
    assert found.headline["determined"] is False
    for name in ("ensemble.csv", "hazard_by_sector.csv"):
        assert np.isnan(read_columns(tmp_path / name)["distance_m"]).all()


def test_fragments_of_realisations_come_back(tmp_path: Path) -> None:
    generator = np.random.default_rng(2)
    many = [
        Fragments(
            generator.uniform(0.001, 0.1, n), generator.normal(size=(n, 3)), generator.normal(size=(n, 3)),
            round=np.arange(n) % 2, round_names=("a", "b"),
        )
        for n in (3, 5, 1)
    ]  # fmt: skip
    path = write_fragment_ensemble(many, tmp_path / "ensemble_fragments.h5", {"seed": "1"})
    again = read_fragment_ensemble(path)
    assert [len(one) for one in again] == [3, 5, 1]
    for one, other in zip(many, again, strict=True):
        for name in ("mass", "position", "velocity", "round", "shape_factor"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
        assert other.round_names == ("a", "b")
    with pytest.raises(InputError, match="needed 'fragfield fragments'"):
        Fragments.read(path)


def test_hits_by_sector_are_the_table_of_the_summary() -> None:
    hits = np.zeros(4, dtype=HITS)
    hits["azimuth"], hits["mass"] = [0.0, 2.0, 358.0, 90.0], [1.0, 1.0, 2.0, 1.0]
    hits["initial_speed"], hits["energy"] = [100.0, 200.0, 400.0, 50.0], [80.0, 79.0, 78.0, 500.0]
    table = sector_hits(hits)
    assert (table["hits"][0], table["hazardous_hits"][0], table["hits"][18]) == (3, 2, 1)
    assert table["mean_initial_speed"][0] == pytest.approx((100.0 + 200.0 + 800.0) / 4.0)
    assert table["mean_initial_speed"][1] == 0.0
    rows = by_azimuth(hits)
    for name in SECTOR_HITS.names or ():
        assert [row[name] for row in rows] == table[name].tolist()


def test_tallies_of_different_sectors_are_refused() -> None:
    rows = poisson_field(np.random.default_rng(0))
    with pytest.raises(InputError, match="different sectors"):
        Tally.join([tally(rows, sector_width=5.0), tally(rows, sector_width=10.0)])
    with pytest.raises(InputError, match="no realisation"):
        Tally.join([])
