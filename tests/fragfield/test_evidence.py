"""What the report says of the validation: whose checks they are, and which comparisons bear on a run."""

from __future__ import annotations

import pytest

from fragfield.case import load_case
from fragfield.case.problem import burst_geometry
from fragfield.report import evidence
from fragfield.results.summary import Summary
from tests.fragfield.example_results import example
from tests.fragfield.plain_reports import plain_report
from tests.fragfield.synthetic_run import run_of, write_run
from validation.record import EVIDENCE, read_record, write_evidence
from validation.runs import ROOT


def checked_by(version="0.1.0", revision="", **others):
    return run_of(provenance={"program_version": version, "revision": revision}, **others)


def ready(name):
    """A run of one of the cases that come with the program, as far as the evidence looks at it."""
    case = load_case(ROOT / "cases" / f"{name}.toml")
    return run_of(values=case, summary=example(Summary, burst={"geometry": burst_geometry(case).geometry}))


@pytest.mark.parametrize(
    ("version", "revision", "recorded", "weight", "words"),
    [
        ("0.1.0", "abcdef012345", ["abcdef012345"], "note", "by the same revision"),
        ("0.1.0", "123456abcdef", ["abcdef012345"], "note", "by another revision"),
        ("0.1.0", "abcdef012345+", ["abcdef012345+"], "note", "by another revision"),
        ("0.1.0", "", [""], "note", "by another revision"),
        ("0.2.0", "abcdef012345", ["abcdef012345"], "warning", "not all computed by version 0.2.0"),
        ("", "", ["abcdef012345"], "warning", "which is not known"),
    ],
)
def test_checks_are_those_of_the_run_only_from_the_same_clean_source(
    monkeypatch, version, revision, recorded, weight, words
):
    known = evidence.Evidence((1, 3), ["0.1.0"], recorded, [])
    monkeypatch.setattr(evidence, "evidence", lambda: known)
    found, text = evidence.validation_words(checked_by(version, revision))
    assert found == weight
    assert text.startswith("Validation: 1 of 3 checks passed")
    assert words in text


def test_a_single_tube_is_not_held_against_stacks_and_a_stack_is():
    tube, pair, mirrored, single = (
        {row.case for row in evidence.bearing(ready(name))}
        for name in ("tube", "m107_pair", "m107_pair_mirrored", "m107_tnt")
    )
    assert "steel_tubes" in tube
    assert not tube & {"paper_3_2", "colliding_tubes"}
    assert pair == mirrored >= {"paper_3_2", "colliding_tubes", "polar_zones"}
    assert {"m107_1944", "copper_cylinder"} <= single


def test_given_fragments_are_held_against_the_flight_alone():
    arena = run_of(summary=example(Summary, flight={"fragments_file": "fragments.h5"}))
    assert {row.case for row in evidence.bearing(arena)} == {"m107_1944"}


def test_a_comparison_is_shown_with_its_difference_and_source(tmp_path):
    page = plain_report(write_run(tmp_path / "run", rounds=1))
    row = next(row for row in evidence.evidence().comparisons if row.case == "m107_1944")
    (line,) = (line for line in page.tables["Comparisons that bear on this case"]
               if line[0] == f"m107_1944: {row.quantity}")  # fmt: skip
    assert line[3] == f"{100 * row.error:+.1f} %"
    assert row.source in page.sections["validation"]
    assert "checks passed" in page.sections["validation"]


def test_the_evidence_is_that_of_the_record_and_short(tmp_path):
    write_evidence(read_record(), tmp_path / "evidence.json")
    text = (tmp_path / "evidence.json").read_text(encoding="utf-8")
    assert text == EVIDENCE.read_text(encoding="utf-8")
    assert text.count("\n") <= 80
