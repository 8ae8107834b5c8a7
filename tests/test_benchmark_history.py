"""Benchmarks over time and of two revisions, and whole runs beside the step."""

from __future__ import annotations

import json
import shutil

import pytest

from benchmarks import history
from benchmarks.history import changes, compare, flat, remember
from benchmarks.table import at_most

pytestmark = pytest.mark.dolfinx

MACHINE = {"date": "2026-11-24", "processor": "AMD EPYC(R), family 25", "cores": 2}


def found(ratio, machine=MACHINE):
    step = {**at_most(ratio, 0.45, "step over the other"), "share": {"burnt": 1.0}, "rows": [1, 2]}
    return {"step": step, "machine": machine}


def test_figures_are_named_by_their_place():
    assert dict(flat(found(0.4)["step"])) == {"ratio": 0.4, "target": 0.45, "share.burnt": 1.0}


def test_a_ratio_that_moves_is_said_and_every_run_is_kept(tmp_path):
    assert remember(found(0.40), tmp_path) == []
    assert remember(found(0.43), tmp_path) == []
    (moved,) = remember(found(0.50), tmp_path)
    assert moved.startswith("step.ratio: 0.43 on 2026-11-24 (")
    assert moved.endswith("now 0.5")
    (path,) = tmp_path.iterdir()
    assert path.name == "amd_epyc_family_25_2_cores.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["figures"]["step.ratio"] for line in lines] == [0.40, 0.43, 0.50]


def test_what_was_not_measured_last_time_is_compared_with_the_time_before():
    earlier = [
        {"date": "a", "revision": "1", "figures": {"step.ratio": 1.0}},
        {"date": "b", "revision": "2", "figures": {"whole.ratio": 2.0}},
    ]
    words = changes(earlier, {"figures": {"step.ratio": 1.5, "new.ratio": 3.0, "step.seconds": 9.0}})
    assert words == ["step.ratio: 1 on a (1), now 1.5"]


def test_two_revisions_are_measured_in_turns(monkeypatch):
    seen = []

    def figures(root, arguments):
        seen.append((root == history._ROOT, arguments))
        slower = 1.0 if root == history._ROOT else 2.0
        return {"step.seconds_per_cell_step": slower * (1.0 + 0.1 * len(seen)), "step.cells": 8.0, "step.target": 0.5}

    monkeypatch.setattr(history, "_figures_in", figures)
    monkeypatch.setattr(history, "_unpack", lambda revision, folder: None)
    result = compare("v1", ["step"], ["--cell-size", "5"])
    assert [here for here, _ in seen] == [False, True, False, True]
    assert seen[0][1] == ["step", "--cell-size", "5"]
    (row,) = result["figures"]
    assert row["figure"] == "step.seconds_per_cell_step"
    assert row["before"] == pytest.approx(2.2)
    assert row["now_over_before"] == pytest.approx(1.2 / 2.2)


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_an_unknown_revision_is_refused(capsys):
    from benchmarks.__main__ import main

    assert main(["step", "--compare", "no-such-revision"]) == 2
    assert "git has no revision 'no-such-revision'" in capsys.readouterr().err
    assert main(["--compare", "HEAD"]) == 2
    assert "--compare needs the names of benchmarks" in capsys.readouterr().err
