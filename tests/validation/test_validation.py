"""The comparison machinery of the validation, on made-up runs."""

from __future__ import annotations

import json

import pytest

from validation.__main__ import main
from validation.grid import convergence
from validation.paper_3_1.check import REFERENCE, check
from validation.rows import compare, within


def _summary(speed=1050.0, error=0.004, cell_size=3e-3):
    burst = {
        "cells": 350000,
        "steps": 400,
        "cell_steps": 400_000_000,
        "cell_size": cell_size,
        "products": "landau",
        "mean_initial_speed": speed,
        "max_initial_speed": 1400.0,
        "outer_diameter": 0.34,
        "lost_cells": 0,
        "products_balance": 1.12,
        "energy_error": 2 * error,
        "energy_error_at_outputs": error,
        "wall_seconds": 200.0,
        "threads": 2,
        "ranks": 1,
        "peak_memory_bytes": 7e8,
        "kinetic_energy_growth": 0.03,
        "rounds": [{"fastest_station": 0.264, "length": 0.66}],
    }
    return {"burst": burst, "versions": {"fragfield": "0.1.0", "numpy": "1.24"}}


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_order_and_limit_of_an_exact_power_are_found(order):
    sizes = (8.0, 6.0, 4.0, 3.0)
    found = convergence(sizes, [100.0 - 0.3 * size**order for size in sizes])
    assert found.monotone
    assert found.order == pytest.approx(order, abs=1e-6)
    assert found.limit == pytest.approx(100.0, abs=1e-6)


def test_a_sequence_that_turns_round_has_no_order():
    assert not convergence((6.0, 4.0, 3.0), (10.0, 12.0, 11.0)).monotone
    assert not convergence((6.0, 4.0, 3.0), (10.0, 12.0, 12.0)).monotone


def test_comparison_gives_a_signed_relative_error_and_a_verdict():
    row = compare("case", "speed", 110.0, 100.0, 0.05, "book", "m/s")
    assert row.error == pytest.approx(0.10)
    assert row.passed is False
    assert compare("case", "speed", 110.0, 100.0, None, "book").passed is None
    assert within("case", "place", 0.6, 0.25, 0.5, "book").error == pytest.approx(0.1)
    assert within("case", "place", 0.4, 0.25, 0.5, "book").passed is True


def test_case_3_1_is_compared_only_where_the_ledger_is_closed():
    assert len(check(_summary())) > 5
    void = check(_summary(error=0.02))
    assert [row.quantity for row in void] == ["energy error at the outputs", "lost cells"]
    assert void[0].passed is False


def test_case_3_1_fails_outside_the_ten_per_cent():
    by_name = {row.quantity: row for row in check(_summary(speed=0.89 * REFERENCE["mean_initial_speed"]))}
    assert by_name["mean initial speed"].passed is False
    assert by_name["diameter at the end"].passed is True


def test_a_finished_run_is_compared_from_the_command_line(tmp_path, capsys):
    (tmp_path / "summary.json").write_text(json.dumps(_summary()), encoding="utf-8")
    assert main(["paper_3_1", "--run", str(tmp_path), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert {"case", "quantity", "ours", "reference", "error", "tolerance", "passed", "source"} <= set(rows[0])


def test_an_unknown_case_is_refused_by_name(capsys):
    assert main(["paper_31"]) == 2
    reported = capsys.readouterr().err
    assert "no case is named 'paper_31' (did you mean \"paper_3_1\"?); there are products, solid" in reported
