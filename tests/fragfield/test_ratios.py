"""One run over another: values, ratios and their errors, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import fragfield
from fragfield.files.run_directory import RunDirectory, read_stamped_json
from tests.fragfield.synthetic_run import write_run


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ratios")
    return write_run(folder / "pair", rounds=2, title="Two rounds"), write_run(folder / "single")


def test_the_pair_over_the_single_round(runs):
    found = fragfield.compare_runs(fragfield.open(runs[0]), runs[1])
    rows = found.set_index("quantity").T
    fragments = rows["break_up.fragments"]
    assert (fragments["run"], fragments["reference"], fragments["ratio"]) == (3600, 1800, 2.0)
    expected = rows["hazard.expected"]
    values = [read_stamped_json(folder / "summary.json")["hazard"] for folder in runs]
    assert expected["ratio"] == values[0]["expected"] / values[1]["expected"] > 1.1
    trials = [  # of errors ten times as small: there the ratio is linear in both
        np.random.default_rng(seed).normal(one["expected"], 0.1 * one["standard_error"], 200_000)
        for seed, one in enumerate(values)
    ]
    assert expected["ratio_error"] == pytest.approx(10.0 * np.std(trials[0] / trials[1]), rel=0.02)
    assert np.isnan(rows["hazard.largest_throw"]["ratio_error"])


def test_a_run_over_itself_is_one(runs):
    np.testing.assert_array_equal(fragfield.compare_runs(runs[0], runs[0])["ratio"], 1.0)


def test_sums_of_unlike_parts_are_not_divided(runs, tmp_path):
    other = write_run(tmp_path / "other")
    summary = read_stamped_json(other / "summary.json")
    summary["hazard"]["parts"] |= {"inputs": 10.0}
    summary["hazard"]["recommended"] += 5.0
    RunDirectory(other).write_summary(summary)
    found = fragfield.compare_runs(runs[1], other)
    ratios = dict(zip(found["quantity"], found["ratio"], strict=True))
    assert np.isnan(ratios["hazard.recommended"])
    assert ratios["hazard.expected"] == 1.0


def test_a_burst_alone_and_what_is_no_run(runs, tmp_path):
    burst = write_run(tmp_path / "burst", stages=1)
    assert {row.partition(".")[0] for row in fragfield.compare_runs(runs[0], burst)["quantity"]} == {"burst"}
    begun = write_run(tmp_path / "begun", stages=0)
    for folder, message in (
        (tmp_path / "none", "no such run directory"), (tmp_path, "it contains no case.toml"),
        (begun, "its summary.json has no results"),
    ):  # fmt: skip
        with pytest.raises(fragfield.InputError, match=message):
            fragfield.compare_runs(runs[0], folder)
