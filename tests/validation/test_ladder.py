"""What holds for all cases of the ladder: soundness first, a record by case, one stop that does not stop the rest.

What is recorded is replaced by whole results only.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from validation import __main__ as ladder
from validation import keeping, record
from validation.rows import compare, rows_table, within
from validation.runs import StudyError
from validation.soundness import all_passed, sound

BOUNDS = {"energy_error": 0.01, "coarsest_cell_size": 5e-3}


def _summary(error=0.004, contact=0.001, lost=0, size=5e-3):
    errors = {"energy_error_at_outputs": error, "contact_error_at_end": contact}
    return {"burst": {**errors, "lost_cells": lost, "cell_size": size}}


def _row(passed, error=0.01):
    return compare("case", "speed", 100.0 * (1.0 + error), 100.0, 0.02 if passed else 0.001, "book", "m/s")


def test_a_sound_burst_may_be_compared():
    rows = sound("case", _summary(), BOUNDS, "tube")
    assert all_passed(rows)
    assert [row.quantity for row in rows] == [
        "tube: energy error at the outputs",
        "tube: energy that contact made, at the end",
        "tube: lost cells",
        "tube: cell size",
    ]


@pytest.mark.parametrize(
    ("changes", "quantity"),
    [
        ({"error": 0.011}, "energy error at the outputs"),
        ({"contact": 0.011}, "energy that contact made, at the end"),
        ({"lost": 1}, "lost cells"),
        ({"size": 5.1e-3}, "cell size"),
    ],
)
def test_an_unsound_burst_says_why(changes, quantity):
    rows = sound("case", _summary(**changes), BOUNDS)
    assert not all_passed(rows)
    assert [row.quantity for row in rows if not row.passed] == [quantity]


def test_rows_that_inform_do_not_fail():
    assert all_passed([compare("case", "x", 2.0, 1.0, None, "book")])


def _gives(*rows):
    """A study that computes these rows."""
    return lambda options, runs, found: found.extend(rows)


def _run(monkeypatch, tmp_path, arguments, studies):
    monkeypatch.setattr(ladder, "CASES", studies)
    monkeypatch.setattr(ladder, "IN_FULL", tuple(studies))
    return ladder.main([*arguments, "--out", str(tmp_path)])


def _stops(*_):
    raise StudyError("the burst ended with exit code 3", 3)


def test_a_case_that_stops_does_not_keep_the_others_from_being_computed(monkeypatch, tmp_path, capsys):
    studies = {"stops": _stops, "passes": _gives(_row(True))}
    assert _run(monkeypatch, tmp_path, ["--json"], studies) == 3
    reported = capsys.readouterr()
    assert [row["case"] for row in json.loads(reported.out)] == ["case"]
    assert "the burst ended with exit code 3" in reported.err


@pytest.mark.parametrize(("passed", "code"), [(True, 0), (False, 1)])
def test_the_exit_code_shows_failure(monkeypatch, tmp_path, capsys, passed, code):
    assert _run(monkeypatch, tmp_path, [], {"one": _gives(_row(passed))}) == code
    assert ("MISSED" in capsys.readouterr().out) is not passed


@pytest.fixture
def kept(monkeypatch, tmp_path, capsys):
    """Run the ladder with a record of the test's own: `kept(arguments, studies)` is exit code, messages and record."""
    path = tmp_path / "data" / "validation.json"
    monkeypatch.setattr(keeping, "RECORD", path)

    def run(arguments, studies):
        code = _run(monkeypatch, tmp_path, arguments, studies)
        return code, capsys.readouterr().err, record.read_record(path)

    return run


def test_the_record_keeps_the_cases_that_were_not_computed_again(kept):
    studies = {"one": _gives(_row(True)), "two": _gives(_row(False))}
    assert kept(["two", "--quick", "--record"], studies)[0] == 1
    code, words, entries = kept(["one", "--record"], studies)
    assert (code, words, list(entries)) == (0, "", ["one", "two"])
    assert (entries["one"]["quick"], entries["two"]["quick"]) == (False, True)
    assert entries["one"]["fragfield"] == entries["one"]["versions"]["fragfield"]
    assert entries["one"]["rows"][0]["quantity"] == "speed"
    table = record.overview(entries, (*studies, "four"))
    assert "| `one` | 1 | 1 | none |" in table
    assert "| `two` | 1 | 0 | speed +1.0 % |" in table
    assert "| `four` | - | - | not computed |" in table


def _faulty(options, runs, rows):
    rows += [_row(True), replace(_row(True), quantity="mass")]
    rows.append(1 // 0)


_NO_NUMBER = within("one", "n", math.nan, 0.0, 2.0, "own")


@pytest.mark.parametrize(
    ("study", "arguments", "code", "why", "rows"),
    [
        (_stops, [], 3, "stopped: the burst ended with exit code 3", []),
        (_faulty, [], 4, "stopped: ZeroDivisionError: integer division or modulo by zero", ["speed", "mass"]),
        (_gives(), [], 1, "there are no rows", []),
        (_gives(_row(True), _row(True), _NO_NUMBER), [], 1, "rows without a number: n", ["speed", "speed", "n"]),
        (_gives(_row(True)), [], 1, "1 rows, the record has 2, among them mass", ["speed"]),
        (_gives(_row(True), _row(True)), ["--quick"], 1, "these are coarse cells (--quick)", ["speed", "speed"]),
    ],
)
def test_only_a_whole_result_replaces_the_record(kept, tmp_path, study, arguments, code, why, rows):
    good = {"one": _gives(_row(True), replace(_row(True), quantity="mass")), "two": _gives(_row(True))}
    _, _, before = kept(["--record"], good)
    found, words, entries = kept(["--record", *arguments], {"one": study, "two": good["two"]})
    beside = tmp_path / "data" / "validation.partial.json"
    assert found == code
    assert f"one: the record not replaced: {why}" in words
    assert words.rstrip().endswith(f"the result is in {beside}")
    assert entries["one"] == before["one"]
    partial = record.read_record(beside)
    assert [row["quantity"] for row in partial["one"]["rows"]] == rows
    assert partial["one"]["stopped"] == (why.removeprefix("stopped: ") if why.startswith("stopped") else None)
    # A whole result replaces the record again, and what lay beside it goes.
    assert kept(["--record"], good)[0] == 0
    assert not beside.exists()


def test_an_interruption_keeps_what_was_whole_before_it(kept, tmp_path):
    def interrupted(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kept(["--record"], {"one": _gives(_row(True)), "two": interrupted})
    assert list(record.read_record(tmp_path / "data" / "validation.json")) == ["one"]


def test_a_foreign_record_is_refused(tmp_path):
    path = tmp_path / "validation.json"
    assert record.read_record(path) == {}
    path.write_text('{"format": "other"}', encoding="utf-8")
    with pytest.raises(ValueError, match=r"validation\.json is no record of the validation in version 1"):
        record.read_record(path)


def test_the_tables_of_the_readmes_are_written(monkeypatch, tmp_path, capsys):
    front, full = tmp_path / "README.md", tmp_path / "LADDER.md"
    front.write_text("<!-- begin validation -->\n<!-- end validation -->\n", encoding="utf-8")
    full.write_text("<!-- begin one -->\n<!-- end one -->\n", encoding="utf-8")
    monkeypatch.setattr(keeping, "LADDER", full)
    monkeypatch.setattr(keeping, "RECORD", tmp_path / "none.json")
    monkeypatch.setattr(keeping, "README", front)
    rows = [_row(True), within("one", "n", 3.0, 0.0, 2.0, "own")]
    _run(monkeypatch, tmp_path, ["--readme"], {"one": _gives(*rows)})
    capsys.readouterr()
    assert "| `one` | 2 | 1 | n +1 |" in front.read_text(encoding="utf-8")
    assert "| speed | 101 m/s | 100 m/s | +1.0 % | 2 % | passed | book |" in full.read_text(encoding="utf-8")
    assert "| n | 3 | 2 | +1 | 0 to 2 | MISSED | own |" in rows_table(rows)
    before = front.read_text(encoding="utf-8"), full.read_text(encoding="utf-8")
    assert _run(monkeypatch, tmp_path, ["--readme"], {"one": _stops}) == 3
    assert "one: tables not replaced: stopped: the burst" in capsys.readouterr().err
    assert (front.read_text(encoding="utf-8"), full.read_text(encoding="utf-8")) == before


@pytest.mark.parametrize(
    ("value", "low", "high", "cells"),
    [
        (1.5, 0.0, 2.0, "1.5 | - | - | 0 to 2 | passed"),
        (0.0, 0.0, 0.0, "0 | - | - | 0 | passed"),
        (9.0, 5.0, math.inf, "9 | - | - | 5 or more | passed"),
        (-1.0, -math.inf, 2.0, "-1 | - | - | 2 or less | passed"),
        (2.5, 0.0, 2.0, "2.5 | 2 | +0.5 | 0 to 2 | MISSED"),
    ],
)
def test_a_value_is_never_its_own_reference(value, low, high, cells):
    row = within("one", "n", value, low, high, "own")
    assert f"| n | {cells} | own |" in rows_table([row])
    assert json.dumps(row.as_dict(), allow_nan=False)
