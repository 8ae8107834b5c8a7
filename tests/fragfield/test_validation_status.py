"""What the report says of the validation: of the very version, of another one, or of none."""

from __future__ import annotations

import json
from functools import cache
from itertools import product
from pathlib import Path

import pytest

from fragfield.case import load_case
from fragfield.case.conversion.geometry import burst_geometry
from fragfield.case.tables.plane import PlaneTable
from fragfield.errors import InputError
from fragfield.report.blocks import Paragraph, Table
from fragfield.report.findings.bearing import STUDIES, bears_on
from fragfield.report.findings.validation_status import read_record, validation_blocks
from fragfield.report.reading.run_files import RunFiles
from validation.__main__ import CASES
from validation.runs import ROOT


def row(quantity="speed at 19 mm", passed: bool | None = True, tolerance: float | None = 0.03) -> dict:
    return {
        "case": "copper_cylinder", "quantity": quantity, "ours": 1440.0, "reference": 1397.0, "error": -0.031,
        "tolerance": tolerance, "passed": passed, "source": "LLNL handbook", "unit": "m/s",
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


def test_every_miss_is_named_with_its_error_and_source(tmp_path):
    found = record(tmp_path, row("speed at 6 mm"), row(passed=False), row("bound", passed=False, tolerance=0.0))
    paragraph, cases, misses = validation_blocks(found, run_of("0.1.0", "abcdef012345"))
    assert isinstance(paragraph, Paragraph)
    assert isinstance(cases, Table)
    assert isinstance(misses, Table)
    assert cases.lines == (("copper_cylinder", "1 of 3", "full", "0.1.0", "abcdef012345", "2026-01-02"),)
    assert misses.lines[0] == ("copper_cylinder: speed at 19 mm", "1,440 m/s", "1,397 m/s", "−3.1 %", "3.0 %")
    assert misses.lines[1][-2:] == ("−0.0310", "a bound")
    assert "LLNL handbook" in misses.note


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
    """Studies of the shipped record with their misses that bear on a run."""
    found = {}
    for row in read_record().misses():
        if bears_on(row, run):
            found.setdefault(row["case"], []).append(row["quantity"])
    return found


def test_every_study_of_the_ladder_has_subjects():
    assert STUDIES.keys() == CASES.keys()


def test_a_single_tube_is_not_held_against_stacks_and_a_stack_is():
    """Both are held against what holds for any casing: strength, wall speed, counts of single rounds."""
    tube, pair = near(ready("tube")), near(ready("m107_pair"))
    assert {"solid", "steel_tubes", "axisymmetric", "m107_1944", "polar_zones", "attitudes"} == tube.keys()
    everything = {row["case"] for row in read_record().misses()}
    assert pair.keys() == everything - {"copper_cylinder"}
    assert len(pair["m107_pair"]) == sum(row["case"] == "m107_pair" for row in read_record().misses())
    mirrored = near(ready("m107_pair_mirrored"))
    assert mirrored == pair  # one round before a plane of symmetry is a pair
    single = ready("m107_tnt")
    ground = PlaneTable(name="ground", kind="ground")
    standing = run_of(case=single.case.model_copy(update={"plane": [ground]}), geometry="3d")
    assert near(standing).keys() == near(run_of(case=single.case, geometry="3d")).keys() | {"colliding_tubes"}


def test_misses_of_a_law_of_the_products_belong_to_it():
    assert "copper_cylinder" in near(ready("grenade_155_tnt"))
    assert ready("grenade_155_tnt").case.burst.products == "landau"
    assert all("landau_cj" not in name for name in near(ready("tube", "jwl"))["axisymmetric"])


def test_given_fragments_are_held_against_the_flight_alone():
    arena = run_of(summary={"flight": {"fragments_file": "fragments.h5"}})
    checks = [row for case in read_record().cases.values() for row in case["rows"] if bears_on(row, arena)]
    assert checks
    assert {row["case"] for row in checks} == {"m107_1944"}
    assert all(row["quantity"].startswith("law prescribed") for row in checks)


def test_no_miss_vanishes_from_every_report():
    names = ("tube", "grenade_155_tnt", "m107_tnt", "m107_pair", "m107_row4", "m107_pallet_2x4")
    laws = ("landau", "landau_cj", "jwl")
    runs = [ready(name, law) for name, law in product(names, laws)]
    for row in read_record().misses():
        assert any(bears_on(row, run) for run in runs), row["quantity"]


def test_a_check_of_an_unknown_study_or_a_run_without_its_case_leaves_nothing_out():
    assert bears_on({"case": "a new study", "quantity": "speed"}, ready("tube"))
    bare, misses = near(run_of()), read_record().misses()
    assert {row["case"] for row in misses} - bare.keys() <= {"axisymmetric"}  # its geometry is known without the case
    for study in bare.keys() - {"axisymmetric"}:
        assert len(bare[study]) == sum(row["case"] == study for row in misses)


def test_the_section_names_what_bears_on_the_case_and_counts_the_others():
    misses = len(read_record().misses())
    for name in ("tube", "m107_pair"):
        run = ready(name)
        paragraph, _, table, rest = validation_blocks(read_record(), run)
        shown = sum(map(len, near(run).values()))
        assert f"Of the {misses} missed {shown} bear on this case." in paragraph.text
        assert len(table.lines) == shown
        assert rest.text.startswith(f"{misses - shown} more checks were missed")
        assert "fragfield/data/validation.json" in rest.text
