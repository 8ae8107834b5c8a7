"""Real studies of uncertainty, as slow tests: their files, workers that are killed, and samples that share bursts."""

from __future__ import annotations

import csv
import json
import subprocess
from pathlib import Path

import pytest

from fragfield.files.run_directory import RunDirectory
from tests.fragfield.short_run import SHORT, command, environment

pytestmark = [pytest.mark.slow, pytest.mark.dolfinx]
ROOT = Path(__file__).parents[2]
_INPUTS = """
[uncertainty]
defaults = false
realisations = 10
bursts = 3
[[uncertainty.input]]
name = "front"
keys = ["round.*.explosive.detonation_velocity"]
distribution = "uniform"
low = "6700 m/s"
high = "7000 m/s"
source = "a test"
[[uncertainty.input]]
name = "mean fragment mass"
keys = ["break_up.prefactor"]
applies = "factor"
distribution = "lognormal"
median = 1.0
factor = 1.6
source = "a test"
"""


def _real(case, out, *options):
    return [*command("uncertainty", case, "--out", out, "--samples", "12", "--json", "--quiet"), *map(str, options)]


@pytest.fixture(scope="module")
def short_meridian(tmp_path_factory):
    """A short tube in its meridian with few realisations: a second a sample."""
    path = tmp_path_factory.mktemp("study") / "short.toml"
    text = (ROOT / "cases" / "tube.toml").read_text()
    text = text.replace('end_time = "120 us"', 'end_time = "60 us"').replace('cell_size = "6 mm"', 'cell_size = "7 mm"')
    assert "60 us" in text
    path.write_text(text + "\n[uncertainty]\nrealisations = 10\n")
    return path


@pytest.fixture(scope="module")
def real_study(short_meridian, tmp_path_factory):
    out = tmp_path_factory.mktemp("studies") / "one"
    done = subprocess.run(
        _real(short_meridian, out, "--jobs", 1), capture_output=True, text=True, env=environment(), check=False
    )
    assert done.returncode == 0, done.stderr
    return out, json.loads(done.stdout)


def test_real_samples_and_their_files(real_study):
    out, printed = real_study
    assert printed["states"]["done"] == 12
    nominal = RunDirectory(out / "nominal").summary()["hazard"]
    assert {key: nominal[key] for key in printed["hazard"]} == printed["hazard"]
    page, report = ((out / name).read_text() for name in ("uncertainty.html", "nominal/report.html"))
    for text in (page, report):
        assert "Effect of each input on the expected distance" in text
        assert "Published radii at which casings vent" in text
    assert (out / "figures" / "uncertainty_tornado.svg").is_file()
    assert printed["distance"]["spread"]["high"] > printed["distance"]["spread"]["low"] > 0.0


def test_real_samples_that_share_bursts(tmp_path):
    """A tube in three dimensions: the speed of the front in three bursts, the mean mass in every sample."""
    case, out = tmp_path / "short.toml", tmp_path / "out"
    case.write_text(SHORT + _INPUTS)
    done = subprocess.run(
        _real(case, out, "--jobs", 1, "--set", "hazard.max_realisations=20"),
        capture_output=True,
        text=True,
        env=environment(),
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["design"]["bursts"] == 3
    assert sorted(path.name for path in (out / "bursts").glob("*/burst_snapshot.h5")) == ["burst_snapshot.h5"] * 3
    rows = list(csv.DictReader((out / "samples.csv").open()))
    assert len({row["front_m_s"] for row in rows}) == 3
    assert len({row["mean fragment mass"] for row in rows}) == 12
    by_front = {row["front_m_s"]: row["mean_initial_speed_m_s"] for row in rows}
    speeds = [float(by_front[front]) for front in sorted(by_front, key=float)]
    assert speeds == sorted(speeds)
    assert speeds[0] < speeds[-1]
    assert all(row["mean_initial_speed_m_s"] == by_front[row["front_m_s"]] for row in rows)
    assert "grid" in found["hazard"]["not_included"]  # three dimensions have no grid convergence unasked
    counts = [int(row["fragments"]) for row in sorted(rows, key=lambda row: float(row["mean fragment mass"]))]
    assert counts[0] > counts[-1]  # finer fragments are more of them
