"""TP-12's rule beside the direct result: rounds counted from their places, and the single round's run."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from flight.files.ensemble import read_ensemble
from flight.hazard.stack_rules import stack_rule
from fragfield.cli import app
from fragfield.hazard.stack_rule import stack_counts
from fragfield.report import read_run
from fragfield.report.tables.distances import stack_rule_table


def grid(*numbers: int, step: float = 0.17) -> np.ndarray:
    return step * np.stack(np.meshgrid(*(np.arange(n) for n in numbers), indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize(
    ("places", "side", "top"),
    [
        (grid(1, 1, 1), 1, 1),
        (grid(2, 1, 1), 2, 2),
        (grid(4, 1, 1), 4, 4),
        (grid(2, 4, 1), 4, 8),
        (grid(2, 4, 3), 12, 8),
        (grid(2, 2, 2) * [1.0, 1.0, 4.0], 4, 4),
    ],
)
def test_rounds_are_counted_from_their_places(places, side, top):
    assert stack_counts(places) == (side, top)
    assert stack_counts(places + np.array([10.0, -3.0, 1.0])) == (side, top)


def _fly(case: Path, out: Path, *options: str) -> dict:
    done = CliRunner().invoke(app, ["fly", str(case), "--out", str(out), "--json", *options])
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def single(tmp_path):
    generator = np.random.default_rng(1)
    velocity = generator.normal(size=(2000, 3)) * [1.0, 1.0, 0.1]
    velocity *= 1000.0 / np.linalg.norm(velocity, axis=1)[:, None]
    rows = [f"0.02,{x:.6g},{y:.6g},{abs(z):.6g},1" for x, y, z in velocity]
    (tmp_path / "field.csv").write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n" + "\n".join(rows) + "\n")
    case = tmp_path / "single.toml"
    case.write_text("seed = 1\n")
    _fly(case, tmp_path / "single", "--fragments", str(tmp_path / "field.csv"))
    return tmp_path


def test_the_rule_stands_beside_the_direct_result(single):
    case = single / "stack.toml"
    case.write_text('seed = 1\n[hazard.stack_rule]\nsingle = "single"\nside = 4\ntop = 8\n')
    summary = _fly(case, single / "stack", "--fragments", str(single / "field.csv"))
    rule = summary["flight"]["stack_rule"]
    assert rule["effective_number"] == pytest.approx(0.9 * 4 + 0.1 * 8)
    alone, _ = read_ensemble(single / "single" / "ensemble.h5")
    assert rule["hazard"]["distance"] == pytest.approx(stack_rule(alone, 4.4).distance)
    assert rule["hazard"]["basis"] == "all_azimuths"
    assert rule["hazard"]["distance"] > alone.expected.by_direction.mean()
    (table,) = stack_rule_table(read_run(single / "stack"))
    assert "4.4 times the field of the single round" in table.note


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('single = "nowhere"', "hazard.stack_rule.single: found 'nowhere', but there is no"),
        ('single = "single"', "side and top are needed where the case has no rounds"),
        ('single = "single"\ncover = "erth"', "hazard.stack_rule.cover"),
        ('single = "single"\nside = 1\ntop = 1\n[hazard]\nenergy = "50 J"', "needs the same in both"),
    ],
)
def test_messages(single, text, message):
    case = single / "stack.toml"
    table = "[hazard.stack_rule]\n" + text
    if "[hazard]" in text:
        own, hazard = text.split("\n[hazard]")
        table = f"[hazard]{hazard}\n[hazard.stack_rule]\n{own}"
    case.write_text(f"seed = 1\n{table}\n")
    done = CliRunner().invoke(
        app, ["fly", str(case), "--fragments", str(single / "field.csv"), "--out", str(single / "stack")]
    )
    assert done.exit_code == 2
    assert message in done.stderr
