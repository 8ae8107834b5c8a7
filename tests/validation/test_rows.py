"""What holds for all cases: kinds of rows, the record, the pages, exit codes, the grid convergence index."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace

import pytest

from validation import __main__ as validation
from validation import readme, record
from validation.__main__ import CASES
from validation.grid import grid_index
from validation.rows import Rows, rows_table
from validation.runs import ROOT, Runs, StudyError


def rows_of(*, quick: bool = False) -> Rows:
    return Rows("case", ("burst",), quick=quick)


def test_a_verification_passes_within_its_bound_and_fails_outside():
    rows = rows_of()
    assert rows.verify("speed", 110.0, 100.0, 0.1001, "closed form", "m/s").passed is True
    assert rows.sound
    row = rows.verify("speed", 110.0, 100.0, 0.0999, "closed form", "m/s")
    assert (row.passed, row.error) == (False, pytest.approx(0.1))
    assert not rows.sound


@pytest.mark.parametrize(
    ("value", "bounds", "passed", "cells"),
    [
        (1.5, (0.0, 2.0), True, "| 1.5 | - | - | passed (0 to 2) |"),
        (9.0, (5.0, math.inf), True, "| 9 | - | - | passed (5 or more) |"),
        (-1.0, (-math.inf, 2.0), True, "| -1 | - | - | passed (2 or less) |"),
        (0.0, (0.0, 0.0), True, "| 0 | - | - | passed (0) |"),
        (2.5, (0.0, 2.0), False, "| 2.5 | 2 | +0.5 | MISSED (0 to 2) |"),
        (math.nan, (0.0, 2.0), False, "MISSED"),
    ],
)
def test_a_bound_is_never_its_own_reference(value, bounds, passed, cells):
    rows = rows_of()
    row = rows.bound("n", value, bounds, "own")
    assert row.passed is passed
    assert cells in rows_table([row.as_dict()])
    assert (json.loads(json.dumps(row.as_dict()))["bounds"] is None) is False


def test_a_comparison_has_a_verdict_only_where_the_test_states_its_uncertainty_and_is_no_fault():
    rows = rows_of()
    assert rows.compare("speed", 110.0, 100.0, "test").passed is None
    assert rows.compare("speed", 110.0, 100.0, "test", uncertainty=0.11).passed is True
    assert rows.compare("speed", 90.0, 100.0, "test", uncertainty=0.09).passed is False
    assert rows.sound
    table = rows_table([row.as_dict() for row in rows])
    assert [table.count(f"{where} the test's uncertainty") for where in ("within", "outside")] == [1, 1]


def test_a_trend_is_judged_only_where_a_direction_is_required():
    rows = rows_of()
    row = rows.trend("distance", 105.0, 100.0, "base", "m", standard_error=2.0)
    assert (row.passed, row.error) == (None, pytest.approx(0.05))
    assert "105 m ± 2" in rows_table([row.as_dict()])
    assert rows.trend("distance", 105.0, None, "base").error is None
    rows.bound("ratio", 1.1, (0.0, 1.0), "geometry", kind="trend")
    assert not rows.sound


def test_coarse_cells_judge_nothing_but_verification():
    rows = rows_of(quick=True)
    rows.compare("speed", 90.0, 100.0, "test", uncertainty=0.01)
    rows.bound("ratio", 1.1, (0.0, 1.0), "geometry", kind="trend")
    assert [row.passed for row in rows] == [None, None]
    rows.verify("momentum", 1.1, 1.0, 1e-3, "conservation")
    assert not rows.sound


BURST = {"energy_error_at_checks": 0.004, "contact_error_at_end": 0.009, "lost_cells": 0}


@pytest.mark.parametrize(
    ("change", "sound"),
    [
        ({}, 2),
        ({"energy_error_at_checks": 0.011}, 1),
        ({"energy_error_at_checks": math.nan}, 1),
        ({"contact_error_at_end": 0.011}, 1),
        ({"lost_cells": 1}, 1),
    ],
)
def test_every_burst_of_a_study_must_close_its_energy_and_lose_no_cell(tmp_path, change, sound):
    runs, rows = Runs(tmp_path), rows_of()
    runs.bursts.extend([("one_8_mm", BURST), ("two_8_mm", {**BURST, **change})])
    runs.check(rows)
    assert ("two_8_mm" in rows[0].quantity) == (sound != 2)
    assert rows.unsound == ([] if sound == 2 else ["two_8_mm"])
    assert [(row.ours, row.passed) for row in rows] == [(sound, sound == 2)]
    assert not runs.bursts
    runs.check(rows)
    assert len(rows) == 1


# --- command line, record and pages -------------------------------------------------------------------------


def passes(_, rows):
    rows.verify("speed", 1.0, 1.0, 0.01, "closed form", "m/s")


def fails(_, rows):
    rows.verify("speed", 1.1, 1.0, 0.01, "closed form", "m/s")


def stops(*_):
    raise StudyError("the burst ended with exit code 3", 3)


def faulty(_, rows):
    passes(_, rows)
    rows.append(1 // 0)


def unsound(runs, rows):
    passes(runs, rows)
    runs.bursts.append(("open_8_mm", {**BURST, "lost_cells": 1}))


def without_number(_, rows):
    rows.trend("n", math.nan, None, "base")


@pytest.fixture
def ladder(monkeypatch, tmp_path, capsys):
    """`ladder(arguments, studies)` runs studies by name; exit code, stdout, stderr. Record and pages are the test's."""
    page, front = tmp_path / "PAGE.md", tmp_path / "FRONT.md"
    marks = [f"<!-- begin {name} -->\nold\n<!-- end {name} -->\n" for name in ("overview", "totals", "one", "two")]
    page.write_text("".join(marks), encoding="utf-8")
    front.write_text("<!-- begin validation -->\n<!-- end validation -->\n", encoding="utf-8")
    monkeypatch.setattr(validation, "RECORD", tmp_path / "data" / "validation.json")
    monkeypatch.setattr(validation, "EVIDENCE", tmp_path / "data" / "evidence.json")
    monkeypatch.setattr(validation, "write_pages", lambda *two: readme.write_pages(*two, page, front))

    def run(arguments, studies):
        cases = {name: validation.Case(("burst",), f"{name} in words") for name in studies}
        monkeypatch.setattr(validation, "CASES", cases)
        monkeypatch.setattr(
            validation, "import_module", lambda name: SimpleNamespace(study=studies[name.split(".")[1]])
        )
        code = validation.main([*arguments, "--out", str(tmp_path)])
        return (code, *capsys.readouterr())

    return run


@pytest.mark.parametrize(("study", "code"), [(passes, 0), (fails, 1), (stops, 3), (faulty, 4)])
def test_the_exit_code_shows_failure_and_no_case_keeps_the_others_from_being_computed(ladder, study, code):
    found, out, err = ladder(["--json"], {"one": study, "two": passes})
    assert found == code
    assert json.loads(out)[-1]["case"] == "two"
    assert ("exit code 3" in err, "a fault after" in err) == (code == 3, code == 4)


def test_an_unknown_case_is_refused_by_name(capsys):
    assert validation.main(["paper_31"]) == 2
    reported = capsys.readouterr().err
    assert "no case is named 'paper_31' (did you mean \"paper_3_1\"?); there are products, solid" in reported


@pytest.mark.parametrize(
    ("study", "arguments", "why"),
    [
        (stops, [], "stopped: the burst ended with exit code 3"),
        (faulty, [], "stopped: ZeroDivisionError"),
        (lambda *_: None, [], "there are no rows"),
        (unsound, [], "bursts with open energy or lost cells: open_8_mm"),
        (without_number, [], "rows without a number: n"),
        (passes, ["--quick"], "these are coarse cells (--quick)"),
    ],
)
def test_only_a_whole_result_replaces_the_record(ladder, tmp_path, study, arguments, why):
    ladder(["--record"], {"one": passes, "two": fails})
    before = record.read_record(tmp_path / "data" / "validation.json")
    assert [before[name]["rows"][0]["passed"] for name in ("one", "two")] == [True, False]
    code, _, err = ladder(["one", "--record", *arguments], {"one": study, "two": passes})
    assert code != 0
    assert f"one: the record not replaced: {why}" in err
    assert record.read_record(tmp_path / "data" / "validation.json") == before


def test_the_pages_are_written_from_the_record(ladder, tmp_path):
    def compares(_, rows):
        rows.compare("mass", 0.9, 1.0, "a test", "kg", uncertainty=0.2)
        rows.compare("mass", 1.3, 1.0, "a test", "kg", uncertainty=0.2)

    ladder(["--record"], {"one": fails, "two": compares})
    page, front = ((tmp_path / name).read_text(encoding="utf-8") for name in ("PAGE.md", "FRONT.md"))
    assert "| [one](#one) | 0 of 1 | - | one in words |" in page
    assert "| [two](#two) | - | -10 to +30 % | two in words |" in page
    assert "| mass | 0.9 kg | 1 kg | -10.0 % | within the test's uncertainty (20 %) |" in page
    assert "old" not in page
    assert "| verification | 1 | 0 of 1 passed; missed: one, speed |" in front
    assert "| comparison | 2 | 1 of 2 within the uncertainty that the test states |" in front
    with pytest.raises(ValueError, match="has no marks for the table three"):
        readme.insert_tables({"three": ""}, tmp_path / "PAGE.md")


def test_a_foreign_record_is_refused(tmp_path):
    path = tmp_path / "validation.json"
    assert record.read_record(path) == {}
    path.write_text('{"format": "other"}', encoding="utf-8")
    with pytest.raises(ValueError, match=r"validation\.json is no record of the validation in version 1"):
        record.read_record(path)


def test_the_record_that_is_shipped_is_of_the_cases_that_are_there():
    """And no verification is excused but those that the limits name, or the page of the cases under axisymmetric."""
    entries = record.read_record()
    assert list(entries) == list(CASES)
    assert all((ROOT / "validation" / name / "study.py").is_file() for name in CASES)
    rows = [row for entry in entries.values() for row in entry["rows"]]
    missed = {row["quantity"] for row in rows if row["passed"] is False and row["kind"] == "verification"}
    assert missed <= {
        "impact, 12 cells across: energy error",
        "M107, TNT, 6 mm: largest speed, meridian against three dimensions",
        "M107, TNT, 6 mm: mean speed of tenth 3 of the length, the farthest apart",
    }
    assert all(row["subjects"] for row in rows)


# --- grid convergence index ---------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0])
def test_the_index_of_an_exact_power_holds_its_error(order):
    """F(h) = 100 - 0.3 h^p: the index is 1.25 times the true error of the finest size."""
    sizes = (8.0, 6.0, 4.5, 3.375)
    found = grid_index(sizes, [100.0 - 0.3 * size**order for size in sizes])
    assert (found.kind, found.order) == ("monotone", pytest.approx(order, abs=1e-6))
    assert found.limit == pytest.approx(100.0, abs=1e-6)
    finest = 100.0 - 0.3 * 3.375**order
    assert found.index == pytest.approx(1.25 * (100.0 - finest) / finest, rel=1e-6)


def test_an_order_above_that_of_the_scheme_is_not_used():
    """F(h) = 100 - h^5/100 looks converged; the index keeps to order 2: 1.25 (f1 - f2)/f1/(r^2 - 1)."""
    f3, f2, f1 = (100.0 - 0.01 * size**5 for size in (4.0, 2.0, 1.0))
    found = grid_index((4.0, 2.0, 1.0), (f3, f2, f1))
    assert found.order == pytest.approx(5.0, abs=1e-6)
    assert found.index == pytest.approx(1.25 * abs(f1 - f2) / f1 / 3.0)


@pytest.mark.parametrize(
    ("values", "kind"), [((10.0, 12.0, 11.0), "oscillatory"), ((10.0, 12.0, 12.0), "not converging"),
                         ((10.0, 10.5, 12.0), "not converging")]
)  # fmt: skip
def test_a_sequence_without_an_order_has_the_index_of_its_range(values, kind):
    found = grid_index((4.0, 2.0, 1.0), values)
    assert (found.kind, found.limit) == (kind, None)
    assert found.index == pytest.approx(3.0 * (max(values) - min(values)) / values[-1] / 3.0)
