"""Bands, pooled distances and their convergence over many realisations; the files of an ensemble."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.stats import binom

from flight import Fragments, InputError
from flight.files.ensemble import (
    CSV_FILES,
    read_ensemble,
    read_fragment_ensemble,
    write_ensemble,
    write_fragment_ensemble,
)
from flight.files.text_tables import read_columns
from flight.hazard.assessment import assess, falling_through, hazard_of
from flight.hazard.bands import Band, band_of
from flight.hazard.criteria import Criteria
from flight.hazard.density.directions import Directions
from flight.hazard.density.distance import ExpectedDistance
from flight.hazard.density.expected import expected_distance
from flight.hazard.density.polar_grid import PolarGrid
from flight.hazard.density.tally import Tally, tally
from flight.hazard.density.witness_hazard import SECTOR_HITS, by_azimuth, sector_hits
from flight.hazard.distances import DISTANCES, FEWEST
from flight.hazard.ensemble import EnsembleHazard, assess_ensemble
from flight.result import HITS, LANDING, Status
from tests.flight.fields import groups_of_landings

LIMIT = 1.0 / 55.7
FLAT = Criteria(person_height=0.0)


def poisson_field(generator: np.random.Generator, reach: float = 150.0, number: float = 3000.0) -> np.ndarray:
    """Hazardous landings of mean density number / (2 pi d reach) exp(-d / reach): exponential in distance."""
    rows = np.zeros(generator.poisson(number), dtype=LANDING)
    rows["status"], rows["energy"], rows["angle"] = Status.LANDED, 100.0, 90.0
    rows["distance"] = generator.exponential(reach, len(rows))
    rows["azimuth"] = generator.uniform(0.0, 360.0, len(rows))
    return rows


def ensemble(realisations: int, seed: int = 1, **settings: float) -> EnsembleHazard:
    generator = np.random.default_rng(seed)
    counts = [tally(poisson_field(generator, **settings), FLAT, sector_width=30.0) for _ in range(realisations)]
    return assess_ensemble(counts, FLAT)


def test_pooled_is_the_assessment_of_all_rows_together() -> None:
    generator = np.random.default_rng(4)
    parts = [poisson_field(generator) for _ in range(5)]
    found = assess_ensemble([tally(part, FLAT) for part in parts], FLAT)
    together = assess(np.concatenate(parts), FLAT, realisations=5)
    for name in ("ground_density", "normal_density", "ground_distance", "max_throw", "fragments", "hazardous"):
        assert getattr(found.pooled, name) == pytest.approx(getattr(together, name), rel=1e-12), name
    assert found.bands["hazardous_fragment_distance"].pooled == together.hazardous_fragment_distance


def test_a_realisation_in_the_ensemble_is_that_alone() -> None:
    """However far the others flew: what one realisation gives does not depend on the cells that another one needs."""
    generator = np.random.default_rng(5)
    parts = [poisson_field(generator, reach) for reach in (20.0, 300.0)]
    found = assess_ensemble([tally(part, FLAT) for part in parts], FLAT)
    for number, part in enumerate(parts):
        alone = assess(part, FLAT)
        assert found.each["hazardous_fragment_distance"][number] == alone.hazardous_fragment_distance
        assert found.each["hazardous_fragment_distance_all_round_ground"][number] == alone.all_round_ground_distance
        assert found.each["max_range"][number] == alone.max_throw.max()
        assert found.sector_distance["normal"][number] == pytest.approx(alone.normal_distance, abs=0)


def test_pooled_density_converges_to_the_field() -> None:
    """Density of the field at d: number / (2 pi reach d) exp(-d / reach); its distance by the same fall."""
    found = ensemble(200)
    place = found.distance
    edges = found.counts.edges
    exact = 3000.0 * -np.diff(np.exp(-edges / 150.0)) / (np.pi * np.diff(edges**2))
    counted = found.counts.landings.sum(axis=(0, 1))
    noise = 5.0 / np.sqrt(np.maximum(counted, 1.0))
    seen = counted > 50
    assert (np.abs(found.by_distance["ground_density"].pooled[seen] / exact[seen] - 1.0) < noise[seen]).all()
    band = found.bands["hazardous_fragment_distance_all_round_ground"]
    assert band.pooled == pytest.approx(
        falling_through(place, exact, LIMIT), abs=4.0 * (band.pooled_standard_error or 0)
    )
    assert band.converged


def test_bands_hold_nine_realisations_of_ten() -> None:
    found = ensemble(400)
    for name in DISTANCES:
        each, band = found.each[name], found.bands[name]
        assert np.mean((each >= band.low) & (each <= band.high)) == pytest.approx(0.9, abs=0.02), name
        assert band.low <= band.median <= band.high
        assert band.realisations == 400
    curve = found.by_distance["ground_density"]
    assert (curve.low <= curve.median).all()
    assert (curve.median <= curve.high).all()
    assert (found.by_distance["probability"].high <= 1.0).all()


def test_standard_error_is_the_scatter_of_repeated_ensembles() -> None:
    """Of 250 ensembles the medians and pooled distances scatter as each of them says; the error falls as 1 / root n.

    250 of them know their scatter to 4.5 % (1 / sqrt(500)). The bootstrap of a median of few realisations says a little
    too much: for normal values by what its exact distribution gives (Efron 1979, Ann. Statist. 7, section 3).
    """
    name = "hazardous_fragment_distance_all_round_ground"
    repeated = [ensemble(25, seed, reach=60.0, number=500.0).bands[name] for seed in range(100, 350)]
    # The median of a draw of 25 is at most the k-th value where 13 or more of its members are.
    weight = np.diff(binom.sf(12, 25, np.arange(26) / 25.0))
    values = np.sort(np.random.default_rng(1).normal(size=(20_000, 25)), axis=1)
    variance = values**2 @ weight - (values @ weight) ** 2
    too_much = float(np.sqrt(variance.mean()) / values[:, 12].std())
    assert too_much == pytest.approx(1.09, abs=0.01)
    for value, error in (("median", "standard_error"), ("pooled", "pooled_standard_error")):
        scatter = np.std([getattr(band, value) for band in repeated], ddof=1)
        reported = np.sqrt(np.mean([getattr(band, error) ** 2 for band in repeated]))
        expected = {"median": too_much, "pooled": 1.0}[value] * scatter
        assert reported == pytest.approx(expected, rel=0.09), (value, reported, scatter)
    errors = [
        np.mean([ensemble(n, seed, reach=60.0, number=500.0).bands[name].pooled_standard_error for seed in range(3)])
        for n in (32, 128, 512)
    ]
    rate = np.polyfit(np.log([32, 128, 512]), np.log(errors), 1)[0]
    assert rate == pytest.approx(-0.5, abs=0.05), errors


def test_standard_error_of_a_median_is_that_of_theory() -> None:
    """Of n normal values sqrt(pi / 2 n) times their deviation, on the average of many bootstraps (Kendall).

    4,000 medians know their scatter to 1.1 %; the mean of 60 reported errors is known to about 3 %.
    """
    number, generator = 400, np.random.default_rng(12)
    bands = [band_of(generator.normal(100.0, 5.0, number), 100.0, None, 0.05) for _ in range(60)]
    reported = np.sqrt(np.mean([band.standard_error**2 for band in bands]))
    theory = np.sqrt(0.5 * np.pi / number) * 5.0
    scatter = np.median(generator.normal(100.0, 5.0, (4000, number)), axis=1).std(ddof=1)
    assert scatter == pytest.approx(theory, rel=0.035)
    assert reported == pytest.approx(theory, rel=0.08)
    assert all(abs(band.median - 100.0) < 4.5 * theory for band in bands)


def test_one_realisation_has_no_band_and_few_have_not_converged() -> None:
    one = ensemble(1).bands["hazardous_fragment_distance"]
    assert one.median == one.low == one.high == one.pooled
    assert (one.standard_error, one.change_between_halves, one.converged, one.needed) == (None, None, False, None)
    few = ensemble(FEWEST - 1)
    assert set(few.not_converged) == set(DISTANCES)
    assert ensemble(40).summary()["converged"] is True


def test_convergence_asks_for_what_is_needed() -> None:
    """A distance that scatters by 20 % needs the number at which the error of its median is within the tolerance."""
    each = 100.0 + 20.0 * np.random.default_rng(1).normal(size=20)
    band = band_of(each, 100.0, None, 0.01)
    assert not band.converged
    assert band.standard_error == pytest.approx(20.0 * np.sqrt(np.pi / 2.0 / 20.0), rel=0.5)
    assert band.needed == np.ceil(20 * (band.standard_error / (0.01 * band.median)) ** 2)
    assert band_of(each, 100.0, None, 0.5).converged
    assert band_of(np.zeros(20), 0.0, np.zeros(5), 0.05).converged
    assert band_of(np.array([0.0] * 15 + [9.0] * 6), 0.0, None, 0.05).needed in (None, FEWEST)
    assert band.change_between_halves == pytest.approx(np.median(each[10:]) - np.median(each[:10]))


def test_the_order_of_the_realisations_changes_no_distance() -> None:
    generator = np.random.default_rng(9)
    counts = [tally(poisson_field(generator), FLAT) for _ in range(6)]
    there, back = assess_ensemble(counts, FLAT), assess_ensemble(counts[::-1], FLAT)
    for name, band in there.bands.items():
        for value in ("median", "low", "high"):
            assert getattr(band, value) == getattr(back.bands[name], value)
        assert band.pooled == pytest.approx(back.bands[name].pooled, rel=1e-12)


def test_files_hold_the_ensemble(tmp_path: Path) -> None:
    found = ensemble(12)
    hits = np.zeros((12, 12), dtype=SECTOR_HITS)
    hits["hits"] = np.arange(144).reshape(12, 12)
    hits["mean_initial_speed"] = 0.5 * hits["hits"]
    paths = write_ensemble(found, {"ring": hits}, tmp_path, {"seed": "7"})
    assert [path.name for path in paths] == ["ensemble.h5", *CSV_FILES]
    again, witnesses = read_ensemble(tmp_path / "ensemble.h5")
    assert again.summary() == found.summary()
    assert again.criteria == FLAT
    assert list(witnesses) == ["ring"]
    assert (witnesses["ring"] == hits).all()
    with h5py.File(tmp_path / "ensemble.h5") as file:
        assert file.attrs["seed"] == "7"
        band = file["bands/hazardous_fragment_distance"].attrs
        assert band["median"] == found.bands["hazardous_fragment_distance"].median
        assert band["realisations"] == 12
    table = read_columns(tmp_path / "ensemble.csv")
    assert table["hazardous_fragment_distance"] == pytest.approx(found.each["hazardous_fragment_distance"], rel=1e-9)
    table = read_columns(tmp_path / "hazard_by_distance.csv")
    assert table["normal_density_high"] == pytest.approx(found.by_distance["normal_density"].high, rel=1e-9)
    table = read_columns(tmp_path / "hazard_by_sector.csv")
    assert table["azimuth_deg"].tolist() == [30.0 * i for i in range(12)]
    with h5py.File(tmp_path / "ensemble.h5", "a") as file:
        del file["counts/tracks"]
    with pytest.raises(InputError, match=r"ensemble\.h5: data cut off or damaged"):
        read_ensemble(tmp_path / "ensemble.h5")
    with pytest.raises(InputError, match="no such file"):
        read_ensemble(tmp_path / "other.h5")


def test_fragments_of_realisations_come_back(tmp_path: Path) -> None:
    generator = np.random.default_rng(2)
    many = [
        Fragments.from_arrays(
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


def test_files_hold_the_hazard_distance(tmp_path: Path) -> None:
    generator = np.random.default_rng(2)
    parts = [poisson_field(generator) for _ in range(12)]
    grid = PolarGrid.of(72, 10.0, 10.0, 2000.0)
    counts = [tally(part, FLAT) for part in parts]
    for basis, reason in (("all_azimuths", ""), ("worst_direction", "none landed")):
        groups = groups_of_landings(parts, Directions(grid, basis, 10.0, (0.0,) if reason else ()))
        found = assess_ensemble(counts, FLAT, expected=expected_distance(groups, LIMIT), undetermined=reason)
        write_ensemble(found, {}, tmp_path)
        back, _ = read_ensemble(tmp_path / "ensemble.h5")
        assert back.headline == found.headline
        assert back.undetermined == reason
        for entry in fields(ExpectedDistance):
            mine, theirs = getattr(found.expected, entry.name), getattr(back.expected, entry.name)
            assert np.array_equal(mine, theirs) if isinstance(mine, np.ndarray) else mine == theirs, entry.name
        if not reason:
            assert found.headline["single_event"]["low"] < found.headline["single_event"]["high"]
        else:
            assert found.headline["expected"] is None
            assert found.headline["determined"] is False


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: assess_ensemble([]), "no realisation"),
        (lambda: assess_ensemble(ensemble(2).counts, tolerance=0.0), "tolerance is 0.0"),
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_tallies_of_different_grids_are_refused() -> None:
    rows = poisson_field(np.random.default_rng(0))
    with pytest.raises(InputError, match="different sectors"):
        Tally.join([tally(rows, sector_width=5.0), tally(rows, sector_width=10.0)])
    with pytest.raises(InputError, match="different distance cells"):
        Tally.join([tally(rows, distance=10.0), tally(rows, distance=20.0)])


def test_hazard_of_a_tally_names_the_band() -> None:
    assert isinstance(ensemble(3).bands["max_range"], Band)
    counts = ensemble(3).counts
    assert hazard_of(counts, FLAT).realisations == 3
