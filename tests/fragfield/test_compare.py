"""Two runs divided by each other: closed forms of ratios and errors, what is refused, and what is written."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from flight.hazard.density.sectors import SECTOR_HITS
from fragfield.errors import InputError
from fragfield.files.stamped import stamped_toml
from fragfield.studies.compare import compare_runs
from fragfield.studies.compare.witness import Estimates, compare_hits, estimate, sectors_together
from tests.fragfield import synthetic_run
from tests.fragfield.short_run import invoke
from tests.fragfield.synthetic_run import write_run

NOT_INCLUDED = "grid (no other cell size gave a distance), inputs (no study of uncertain inputs)"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    return write_run(folder / "pair", rounds=2, title="Two rounds"), write_run(folder / "single")


@pytest.fixture
def single(runs, tmp_path):
    return Path(shutil.copytree(runs[1], tmp_path / "other"))


def _hits(numbers, speeds=None, masses=None):
    """Hits by realisation and sector from numbers (n, s)."""
    numbers = np.asarray(numbers)
    table = np.zeros(numbers.shape, dtype=SECTOR_HITS)
    table["hits"], table["hazardous_hits"] = numbers, numbers // 2
    table["mass"] = numbers * (1.0 if masses is None else np.asarray(masses))
    speed = np.broadcast_to(1000.0 if speeds is None else speeds, numbers.shape)
    for name in ("max_initial_speed", "mean_initial_speed", "mean_initial_speed_by_number"):
        table[name] = np.where(numbers > 0, speed, 0.0)
    return table


def test_a_standard_error_is_that_of_the_mean():
    each = np.random.default_rng(3).normal([[5.0, 50.0]], [[1.0, 4.0]], size=(400, 2))
    found = estimate(each)
    np.testing.assert_allclose(found.value, each.mean(axis=0))
    np.testing.assert_allclose(found.error, each.std(axis=0, ddof=1) / 20.0)
    holes = estimate(np.array([[1.0, np.nan], [3.0, np.nan], [np.nan, 7.0]]))
    assert (holes.value[0], holes.error[0], holes.value[1]) == (2.0, 1.0, 7.0)
    assert np.isnan(holes.error[1])  # one realisation has no error


def test_the_error_of_a_ratio_is_that_of_many_trials():
    random = np.random.default_rng(4)
    ratio = Estimates(np.array([300.0]), np.array([6.0])).over(Estimates(np.array([100.0]), np.array([3.0])))
    trials = random.normal(300.0, 6.0, 200_000) / random.normal(100.0, 3.0, 200_000)
    assert ratio.value[0] == pytest.approx(3.0)
    assert ratio.error[0] == pytest.approx(trials.std(), rel=0.01)
    nothing = Estimates(np.array([3.0]), np.array([1.0])).over(Estimates(np.array([0.0]), np.array([0.0])))
    assert np.isnan(nothing.value[0])


def test_a_run_over_itself_is_one_everywhere(runs):
    found = compare_runs(runs[0], runs[0])
    (ring,) = found["witness"]
    for row in [*ring["by_azimuth"], ring["total"]]:
        assert row["hits"]["ratio"] == pytest.approx(1.0)
        assert row["max_initial_speed"]["ratio"] == pytest.approx(1.0)
    assert {row["ratio"] for row in found["casing"]} == {1.0}
    assert all(row["ratio"] == pytest.approx(1.0) for row in found["distances"])
    assert not found["differences"]
    assert "both runs are of the same case and seed" in found["notes"][0]


def test_sectors_join_without_moving_their_centres():
    assert sectors_together(72, None) == 3
    assert sectors_together(72, 45.0) == 9
    assert sectors_together(8, None) == 1
    with pytest.raises(InputError, match="--sector: found 10; allowed: 5, 15, 45 degrees, odd multiples"):
        sectors_together(72, 10.0)
    numbers = np.zeros((2, 72), dtype=int)
    numbers[:, [71, 0, 1]] = 4  # -5, 0 and 5 degrees
    found = compare_hits(_hits(numbers), _hits(np.ones((2, 72), dtype=int)), 3)
    assert found["sector_width_deg"] == 15.0
    assert [row["azimuth_deg"] for row in found["by_azimuth"]] == [15.0 * n for n in range(24)]
    assert [row["hits"]["ratio"] for row in found["by_azimuth"]] == [4.0] + [0.0] * 23
    assert found["by_azimuth"][1]["max_initial_speed"]["ratio"] is None  # nothing hit there
    assert found["total"]["hits"]["ratio"] == pytest.approx(12 / 72)


def test_means_weigh_by_mass_and_by_number():
    run = _hits([[1, 3, 0]] * 2, speeds=[1000.0, 500.0, 0.0], masses=[2.0, 1.0, 0.0])
    found = compare_hits(run, _hits([[1, 1, 1]] * 2), 3)["by_azimuth"][0]
    assert found["mean_initial_speed"]["run"] == pytest.approx((2 * 1000 + 3 * 500) / 5)
    assert found["mean_initial_speed_by_number"]["run"] == pytest.approx((1000 + 3 * 500) / 4)
    assert found["max_initial_speed"]["ratio"] == 1.0


def test_all_round_divides_by_the_mean_of_all_azimuths():
    reference = np.array([[1, 3], [3, 1]])
    found = compare_hits(_hits([[4, 2], [4, 2]]), _hits(reference), 1, all_round=True)
    assert [row["hits"]["ratio"] for row in found["by_azimuth"]] == [2.0, 1.0]
    assert found["by_azimuth"][0]["hits"]["ratio_error"] == 0.0  # the mean all round does not scatter


def test_the_pair_has_twice_the_fragments_and_its_focus(runs):
    found = compare_runs(*runs)
    (ring,) = found["witness"]
    assert ring["total"]["hits"]["ratio"] == pytest.approx(2.0)
    fragments = next(row for row in found["casing"] if row["quantity"] == "Fragments")
    assert (fragments["run"], fragments["reference"], fragments["ratio"]) == (3600, 1800, 2.0)
    rows = {row["name"]: row for row in found["distances"]}
    assert rows["expected"]["ratio"] > 1.1
    assert rows["expected"]["ratio_error"] > 0.0
    assert rows["recommended"]["run"] > rows["expected"]["run"]
    assert rows["recommended"]["run_basis"] == "worst_direction"
    assert rows["largest_throw"]["ratio_error"] is None  # grows with the number of realisations
    first = next(row for row in found["by_distance"] if row["distance_m"] > 50.0)
    assert 2.0 < first["ground_density"]["ratio"] < 5.0  # both in their worst directions: of the pair its focus
    assert first["ground_density"]["ratio_error"] > 0.0
    assert found["differences"] == [
        "round: reference 1, run 2",
        "round[1].position: reference ['0.0 m', '0.0 m', '0.0 m'], run ['-0.095 m', '0.0 m', '0.0 m']",
    ]
    assert found["notes"] == [
        "both have the seed 1; standard errors of ratios assume independent realisations",
        f"the recommended distances do not include {NOT_INCLUDED}",
    ]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('radius = "7.62 m"', 'radius = "10.0 m"', '"ring": radius "7.62 m" in '),
        ('name = "ring"', 'name = "wall"', '"wall": only in '),
        ('kind = "cylinder"', 'kind = "cylinder"\ntop = "2.5 m"', '"ring": top nothing in '),
    ],
)
def test_other_witness_surfaces_are_refused_by_name(old, new, message, runs, single):
    text = (single / "case.toml").read_text().rpartition("\n# checksum")[0]
    assert old in text
    (single / "case.toml").write_text(stamped_toml(text.replace(old, new)))
    done = invoke("compare", runs[0], single)
    assert done.exit_code == 2
    assert "the witness surfaces differ; needed: the same in both cases" in done.stderr
    assert message in done.stderr
    assert str(single) in done.stderr


def test_what_is_no_run_is_refused(runs, tmp_path):
    for folder, message in ((tmp_path / "none", "no such run directory"), (tmp_path, "it contains no case.toml")):
        done = invoke("compare", runs[0], folder)
        assert done.exit_code == 2
        assert message in done.stderr
    empty = Path(shutil.copytree(write_run(tmp_path / "begun", stages=0), tmp_path / "empty"))
    done = invoke("compare", empty, runs[0])
    assert "nothing to compare, its summary.json has no results; run `fragfield run` first" in done.stderr


def test_a_burst_alone_has_its_casings_compared(runs, tmp_path):
    burst = write_run(tmp_path / "burst", stages=1)
    found = compare_runs(runs[0], burst)
    assert found["casing"]
    assert not found["witness"]
    assert not found["distances"]
    assert f"{burst} has no flight: only the casings are compared" in found["notes"]
    assert "written" not in invoke("compare", runs[0], burst).stdout


def test_with_one_realisation_there_are_ratios_without_errors(runs, tmp_path, monkeypatch):
    monkeypatch.setattr(synthetic_run, "REALISATIONS", 1)
    single = write_run(tmp_path / "one")
    summary = json.loads((single / "summary.json").read_text())
    summary["seed"] = 5
    (single / "summary.json").write_text(json.dumps(summary))
    assert summary["flight"]["realisations"] == 1
    found = compare_runs(runs[0], single)
    row = found["witness"][0]["by_azimuth"][0]["hits"]
    assert row["ratio"] > 1.0
    assert row["run_error"] > 0.0
    assert row["reference_error"] is row["ratio_error"] is None
    assert found["by_distance"]
    for kind in ("ground_density", "normal_density"):
        assert {one[kind]["reference_error"] for one in found["by_distance"]} == {None}
    assert found["notes"][0] == "the seeds differ, 1 and 5"
    assert f"{single} has one realisation of the break-up: no standard errors" in found["notes"]
    assert invoke("compare", runs[0], single, "--out", tmp_path / "out").exit_code == 0


def test_the_comparison_is_printed_and_written(runs, tmp_path):
    done = invoke("compare", *runs, "--out", tmp_path / "out", "--sector", "45")
    assert done.exit_code == 0, done.stderr
    for part in (
        "witness ring, sectors of 45 degrees",
        "Recommended distance",
        "Largest throw",
        "Mean initial speed, by mass",
        "the cases differ in",
    ):
        assert part in done.stdout
    names = {"comparison.json", "casing.csv", "distances.csv", "by_azimuth.csv", "by_distance.csv", "comparison.png"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
    rows = list(csv.DictReader((tmp_path / "out" / "by_azimuth.csv").open()))
    assert len(rows) == 8
    stored = json.loads((tmp_path / "out" / "comparison.json").read_text())
    assert float(rows[0]["hits_ratio"]) == stored["witness"][0]["by_azimuth"][0]["hits"]["ratio"]
    assert (tmp_path / "out" / "comparison.png").read_bytes().startswith(b"\x89PNG")


def test_a_comparison_does_not_go_into_a_run(runs):
    done = invoke("compare", *runs, "--out", runs[0])
    assert done.exit_code == 2
    assert "holds a run; a comparison needs a folder of its own" in done.stderr
