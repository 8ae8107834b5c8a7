"""What holds for all cases of the ladder: soundness first, a record by case, one stop that does not stop the rest."""

from __future__ import annotations

import json
import math

import pytest

from validation import __main__ as ladder
from validation import record
from validation.rows import compare, rows_table, within
from validation.runs import StudyError
from validation.soundness import all_passed, sound

BOUNDS = {"energy_error": 0.01, "coarsest_cell_size": 5e-3}


def _summary(error=0.004, lost=0, size=5e-3):
    return {"burst": {"energy_error_at_outputs": error, "lost_cells": lost, "cell_size": size}}


def _row(passed, error=0.01):
    return compare("case", "speed", 100.0 * (1.0 + error), 100.0, 0.02 if passed else 0.001, "book", "m/s")


def test_a_sound_burst_may_be_compared():
    rows = sound("case", _summary(), BOUNDS, "tube")
    assert all_passed(rows)
    assert [row.quantity for row in rows] == [
        "tube: energy error at the outputs",
        "tube: lost cells",
        "tube: cell size",
    ]


@pytest.mark.parametrize(
    ("changes", "quantity"),
    [({"error": 0.011}, "energy error at the outputs"), ({"lost": 1}, "lost cells"), ({"size": 5.1e-3}, "cell size")],
)
def test_an_unsound_burst_says_why(changes, quantity):
    rows = sound("case", _summary(**changes), BOUNDS)
    assert not all_passed(rows)
    assert [row.quantity for row in rows if not row.passed] == [quantity]


def test_rows_that_inform_do_not_fail():
    assert all_passed([compare("case", "x", 2.0, 1.0, None, "book")])


def _run(monkeypatch, tmp_path, arguments, studies):
    monkeypatch.setattr(ladder, "CASES", studies)
    monkeypatch.setattr(ladder, "IN_FULL", tuple(studies))
    return ladder.main([*arguments, "--out", str(tmp_path)])


def _stops(*_):
    raise StudyError("the burst ended with exit code 3", 3)


def test_a_case_that_stops_does_not_keep_the_others_from_being_computed(monkeypatch, tmp_path, capsys):
    studies = {"stops": _stops, "passes": lambda *_: [_row(True)]}
    assert _run(monkeypatch, tmp_path, ["--json"], studies) == 3
    reported = capsys.readouterr()
    assert [row["case"] for row in json.loads(reported.out)] == ["case"]
    assert "the burst ended with exit code 3" in reported.err


@pytest.mark.parametrize(("passed", "code"), [(True, 0), (False, 1)])
def test_the_exit_code_shows_failure(monkeypatch, tmp_path, capsys, passed, code):
    assert _run(monkeypatch, tmp_path, [], {"one": lambda *_: [_row(passed)]}) == code
    assert ("MISSED" in capsys.readouterr().out) is not passed


def test_the_record_keeps_the_cases_that_were_not_computed_again(monkeypatch, tmp_path, capsys):
    path = tmp_path / "data" / "validation.json"
    monkeypatch.setattr(ladder, "read_record", lambda: record.read_record(path))
    monkeypatch.setattr(ladder, "write_record", lambda entries: record.write_record(entries, path))
    studies = {"one": lambda *_: [_row(True)], "two": lambda *_: [_row(False)], "three": _stops}
    _run(monkeypatch, tmp_path, ["two", "--quick", "--record"], studies)
    _run(monkeypatch, tmp_path, ["one", "three", "--record"], studies)
    capsys.readouterr()
    entries = record.read_record(path)
    assert list(entries) == ["one", "two", "three"]
    assert (entries["one"]["quick"], entries["two"]["quick"]) == (False, True)
    assert entries["one"]["fragfield"] == entries["one"]["versions"]["fragfield"]
    assert entries["one"]["rows"][0]["quantity"] == "speed"
    assert entries["three"]["stopped"] == "the burst ended with exit code 3"
    table = record.overview(entries, (*studies, "four"))
    assert "| `one` | 1 | 1 | none |" in table
    assert "| `two` | 1 | 0 | speed +1.0 % |" in table
    assert "stopped: the burst ended with exit code 3" in table
    assert "| `four` | - | - | not computed |" in table


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
    monkeypatch.setattr(ladder, "LADDER", full)
    monkeypatch.setattr(ladder, "read_record", dict)
    monkeypatch.setattr(ladder, "README", front)
    rows = [_row(True), within("one", "n", 3.0, 0.0, 2.0, "own")]
    _run(monkeypatch, tmp_path, ["--readme"], {"one": lambda *_: rows})
    capsys.readouterr()
    assert "| `one` | 2 | 1 | n +1 |" in front.read_text(encoding="utf-8")
    assert "| speed | 101 m/s | 100 m/s | +1.0 % | 2 % | passed | book |" in full.read_text(encoding="utf-8")
    assert "| n | 3 | 2 | +1 | 0 to 2 | MISSED | own |" in rows_table(rows)


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
