"""What the report says of the validation: of the very version, of another one, or of none."""

from __future__ import annotations

import json
from functools import cache
from itertools import product
from pathlib import Path

import pytest

from fragfield.case import load_case
from fragfield.case.conversion.symmetry import burst_geometry
from fragfield.case.tables.round import PlaneTable
from fragfield.errors import InputError
from fragfield.report.blocks import Paragraph, Table
from fragfield.report.findings.bearing import bears_on
from fragfield.report.findings.validation_status import read_record, validation_blocks
from fragfield.report.reading.run_files import RunFiles
from validation.runs import ROOT


def row(
    quantity="speed at 19 mm", passed: bool | None = True, tolerance: float | None = 0.03, kind="verification"
) -> dict:
    return {
        "case": "copper_cylinder", "quantity": quantity, "ours": 1440.0, "reference": 1397.0, "error": -0.031,
        "tolerance": tolerance, "passed": passed, "source": "LLNL handbook", "unit": "m/s", "kind": kind,
        "subjects": ["burst"],
    }  # fmt: skip


def run_of(version="0.1.0", revision="", **others):
    return RunFiles(Path(), provenance={"program_version": version, "revision": revision}, **others)


def record(tmp_path, *rows, revision="abcdef012345", version="0.1.0", stopped=None):
    case = {
        "date": "2026-01-02T03:04:05+00:00", "fragfield": version, "revision": revision, "versions": {},
        "quick": False, "stopped": stopped, "rows": list(rows),
    }  # fmt: skip
    path = tmp_path / "validation.json"
    content = {"format": "fragfield validation", "format_version": 1, "cases": {"copper_cylinder": case}}
    path.write_text(json.dumps(content), encoding="utf-8")
    return read_record(path)


@pytest.mark.parametrize(
    ("version", "revision", "recorded", "kinship"),
    [
        ("0.1.0", "abcdef012345", "abcdef012345", "same"),
        ("0.1.0", "123456abcdef", "abcdef012345", "version"),
        ("0.1.0", "abcdef012345+", "abcdef012345+", "version"),
        ("0.1.0", "", "", "version"),
        ("0.2.0", "abcdef012345", "abcdef012345", "other"),
        ("", "", "abcdef012345", "other"),
    ],
)
def test_evidence_is_that_of_the_run_only_from_the_same_clean_source(tmp_path, version, revision, recorded, kinship):
    assert record(tmp_path, row(), revision=recorded).kinship(version, revision) == kinship


def test_every_miss_and_every_comparison_is_named_with_its_error_and_source(tmp_path):
    compared = row("speed at 25 mm", passed=False, kind="comparison")
    checks = (row("speed at 6 mm"), row(passed=False), row("bound", passed=False, tolerance=0.0))
    found = record(tmp_path, *checks, compared)
    paragraph, cases, misses, comparisons = validation_blocks(found, run_of("0.1.0", "abcdef012345"))
    assert isinstance(paragraph, Paragraph)
    assert "Validation: 1 of 3 checks passed" in paragraph.text
    assert all(isinstance(one, Table) for one in (cases, misses, comparisons))
    assert cases.lines == (("copper_cylinder", "1 of 3", "1", "full", "0.1.0", "abcdef012345", "2026-01-02"),)
    assert misses.lines[0] == ("copper_cylinder: speed at 19 mm", "1,440 m/s", "1,397 m/s", "−3.1 %", "3.0 %")
    assert misses.lines[1][-2:] == ("−0.0310", "a bound")
    assert "LLNL handbook" in misses.note
    assert [line[0] for line in comparisons.lines] == ["copper_cylinder: speed at 25 mm"]


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "validation.json"
    for text, words in (
        ('{"format": "else", "format_version": 1, "cases": {}}', "found 'else' of version 1, expected 'fragfield vali"),
        ('{"cases": {}}', "no record of the validation"),
        ("{", "no record of the validation"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_record(path)


@cache
def ready(name, products=None):
    """A run of one of the cases that come with the program, as far as the choice of checks looks at it."""
    case = load_case(ROOT / "cases" / f"{name}.toml")
    changes = {"products": products or case.burst.products}
    case = case.model_copy(update={"burst": case.burst.model_copy(update=changes)})
    return run_of(case=case, geometry=burst_geometry(case).geometry)


def near(run):
    """Studies of the shipped record of which a row bears on a run."""
    return {row["case"] for row in read_record().rows if bears_on(row, run)}


def test_a_single_tube_is_not_held_against_stacks_and_a_stack_is():
    """Both are held against what holds for any casing: strength, wall speed, counts of single rounds."""
    tube, pair = near(ready("tube")), near(ready("m107_pair"))
    assert {"solid", "steel_tubes", "axisymmetric", "mean_mass"} <= tube
    assert not tube & {"paper_3_2", "stack_trends", "colliding_tubes", "attitudes"}
    assert pair >= {"paper_3_2", "stack_trends", "colliding_tubes", "mean_mass"}
    assert near(ready("m107_pair_mirrored")) == pair  # one round before a plane of symmetry is a pair
    single = ready("m107_tnt")
    ground = PlaneTable(name="ground", kind="ground")
    standing = run_of(case=single.case.model_copy(update={"plane": [ground]}), geometry="3d")
    assert near(standing) == near(run_of(case=single.case, geometry="3d")) | {"colliding_tubes"}


def test_a_row_bears_on_a_run_that_has_all_of_its_subjects():
    pair, single = ready("m107_pair"), ready("m107_tnt")
    for subjects, of_pair, of_single in (
        (["profile:m107", "stack"], True, False),
        (["profile:m1_105"], False, False),
        (["explosive:Composition B"], True, False),
        (["products:landau_cj", "explosive:tnt"], False, True),
        (["meridian"], False, True),
        (["flight", "a subject of tomorrow", "kind:of tomorrow"], True, True),
        ([], True, True),
    ):
        assert [bears_on({"subjects": subjects}, run) for run in (pair, single)] == [of_pair, of_single], subjects


def test_given_fragments_are_held_against_the_flight_alone():
    arena = run_of(summary={"flight": {"fragments_file": "fragments.h5"}})
    rows = [row for row in read_record().rows if bears_on(row, arena)]
    assert {row["case"] for row in rows} == {"m107_1944"}
    assert all(row["quantity"].startswith("law prescribed") for row in rows)


def test_a_run_without_its_case_leaves_nothing_of_a_burst_out():
    bare = run_of()
    assert {row["case"] for row in read_record().rows if not bears_on(row, bare)} <= {"axisymmetric"}


def test_no_row_of_the_record_vanishes_from_every_report():
    names, laws = (path.stem for path in sorted((ROOT / "cases").glob("*.toml"))), ("landau", "landau_cj", "jwl")
    runs = [ready(name, law) for name, law in product(names, laws)]
    lost = [row for row in read_record().rows if not any(bears_on(row, run) for run in runs)]
    assert [(row["case"], row["quantity"], row["subjects"]) for row in lost] == []
