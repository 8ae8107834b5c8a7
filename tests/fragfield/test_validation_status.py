"""What the report says of the validation: of the very version, of another one, or of none."""

from __future__ import annotations

import json

import pytest

from fragfield.errors import InputError
from fragfield.report.blocks import Paragraph, Table
from fragfield.report.findings.validation_status import read_record, validation_blocks, validation_words


def row(quantity="speed at 19 mm", passed: bool | None = True, tolerance: float | None = 0.03) -> dict:
    return {
        "case": "copper_cylinder", "quantity": quantity, "ours": 1440.0, "reference": 1397.0, "error": -0.031,
        "tolerance": tolerance, "passed": passed, "source": "LLNL handbook", "unit": "m/s",
    }  # fmt: skip


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


def test_weight_follows_from_version_and_misses(tmp_path):
    passed = record(tmp_path, row(), row(passed=None))
    assert validation_words(passed, "0.1.0", "abcdef012345")[0] == "good"
    assert "1 of 1 checks passed" in validation_words(passed, "0.1.0", "abcdef012345")[1]
    assert validation_words(passed, "0.1.0", "0")[0] == "note"
    weight, words = validation_words(passed, "9.0", "")
    assert weight == "warning"
    assert "not all computed by version 9.0" in words
    missed = record(tmp_path, row(), row(passed=False), stopped="the ledger is open")
    weight, words = validation_words(missed, "0.1.0", "abcdef012345")
    assert weight == "note"
    assert "1 of 2 checks passed, copper_cylinder stopped, computed by the same revision as this result" in words


def test_every_miss_is_named_with_its_error_and_source(tmp_path):
    found = record(tmp_path, row("speed at 6 mm"), row(passed=False), row("bound", passed=False, tolerance=0.0))
    paragraph, cases, misses = validation_blocks(found, "0.1.0", "abcdef012345")
    assert isinstance(paragraph, Paragraph)
    assert isinstance(cases, Table)
    assert isinstance(misses, Table)
    assert cases.lines == (("copper_cylinder", "1 of 3", "full", "0.1.0", "abcdef012345", "2026-01-02"),)
    assert misses.lines[0] == ("copper_cylinder: speed at 19 mm", "1,440 m/s", "1,397 m/s", "−3.1 %", "3.0 %")
    assert misses.lines[1][-2:] == ("−0.0310", "a bound")
    assert "LLNL handbook" in misses.note


def test_program_without_a_record_says_so(tmp_path):
    found = read_record(tmp_path / "nothing.json")
    weight, words = validation_words(found, "0.1.0", "")
    assert weight == "warning"
    assert "make one by “python -m validation --record”" in words
    assert len(list(validation_blocks(found, "0.1.0", ""))) == 1


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
