"""A study of uncertainty in the report of its nominal run and on its own page."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fragfield.case import load_case
from fragfield.files.run_directory import stamped_json
from fragfield.interface.results import Run
from fragfield.report import write_report, write_uncertainty_page
from fragfield.results.part import to_json
from fragfield.results.summary import Summary
from fragfield.studies.study import Row
from fragfield.studies.uncertainty.plan import plan_samples
from fragfield.studies.uncertainty.study import assess
from fragfield.studies.workers import Outcome
from tests.fragfield.example_results import complete
from tests.fragfield.synthetic_run import write_run

M107 = Path(__file__).parents[2] / "cases" / "m107_tnt.toml"
SUMMARY = complete(Summary, {
    "burst": {"mean_initial_speed": 980.0, "speed_quantiles": {"99": 1370.0}},
    "break_up": {"fragments": 2500},
    "hazard": {"method": "realisations", "determined": True, "expected": 100.0, "upper": 103.0, "standard_error": 1.5},
    "convergence": {"reason": "", "quantities": {"expected_distance": {"uncertainty": 5.0, "kind": "monotone"}}},
    "exposed": [
        {"name": "<gate>", "expected_hits": {"expected": 0.01, "standard_error": 0.001},
         "density_normal": {"expected": 0.02, "standard_error": 0.002}, "density_ground": None,
         "probability": {"expected": 0.00995}},
    ],
})  # fmt: skip


def _study(summary=SUMMARY, lost=()):
    study = plan_samples(load_case(M107), samples=60)
    rows = [Row(f"sample {number}", None, "", {}) for number in range(60)]
    for number in range(60):
        values = study.points[number] - 0.5
        distance = 100.0 + 20.0 * values[1] - 10.0 * values[6] + np.random.default_rng(number).normal(0.0, 1.0)
        hits = 0.01 * float(np.exp(3.0 * values[5]))
        place = {"name": "<gate>", "density": 2 * hits, "density_standard_error": 0.1 * hits, "hits": hits,
                 "hits_standard_error": 0.1 * hits, "probability": hits}  # fmt: skip
        results = {"distance": distance, "standard_error": 1.0, "determined": True, "reason": "", "exposed": [place],
                   "mean_initial_speed": 980.0, "speed_99": 1370.0, "fragments": 2500}  # fmt: skip
        rows[number].fill(Outcome(0, "", results))
    for number in lost:
        rows[number] = Row(f"sample {number}", None, "", {})
        rows[number].fill(Outcome(3, "cell 7 is <lost>"))
    return assess(study, rows, Summary.read(summary))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = write_run(tmp_path_factory.mktemp("report") / "run", rounds=1, title="A <round>")
    (folder / "uncertainty.json").write_text(stamped_json(to_json(_study(lost=(3, 4)))))
    return folder


def test_the_run_has_a_section_and_a_card(folder):
    text = write_report(folder).read_text()
    found = Run(folder).study
    recommended = int(np.ceil(found.hazard.recommended))
    assert '<section id="uncertainty">' in text
    assert re.search(rf">Recommended distance</dt>\s*<dd><span class=\"value\">{recommended}</span>", text)
    for words in (
        "Parts of the recommended distance", "Share of each input in the variance of the distance",
        "heat of detonation",         "Uncertain inputs and their sources", "judgement", "figure-uncertainty_tornado",
        "figure-uncertainty_distribution", "Exposed sites over the inputs", "number of samples",
        "2 samples gave no distance", "sample 3: exit code 3: cell 7 is &lt;lost&gt;", "&lt;gate&gt;",
    ):  # fmt: skip
        assert words in text, words
    assert "<gate>" not in text
    for entry in found.inputs:
        assert entry.source.split(":")[0][:30] in text.replace("&#39;", "'")


def test_a_run_without_a_study_has_no_section(folder, tmp_path, without_figures):
    plain = write_run(tmp_path / "plain", rounds=1, title="plain")
    assert '<section id="uncertainty">' not in write_report(plain).read_text()


def test_too_few_samples_give_no_result(folder, tmp_path):
    found = _study(lost=range(55))
    assert found.exit_code == 3
    assert found.distance is None
    text = write_uncertainty_page(tmp_path, folder, found).read_text()
    assert "No result: 5 samples gave a distance; at least 8 are needed." in text


def test_what_moves_the_distance_stands_under_its_own_heading(folder):
    page = write_uncertainty_page(folder, folder, Run(folder).study).read_text()
    shares = page[page.index('<section id="shares">') : page.index('<section id="uncertain-inputs">')]
    assert "figure-uncertainty_tornado" in shares
    assert "Share of each input" in shares
