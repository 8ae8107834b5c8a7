"""Benchmarks over time and of two revisions, and whole runs beside the step."""

from __future__ import annotations

import json
import shutil
import subprocess

import pytest

from benchmarks import history
from benchmarks.first_run import first_run
from benchmarks.goal import at_most
from benchmarks.history import changes, compare, flat, remember
from benchmarks.targets import targets_table
from benchmarks.whole import beside

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


def test_targets_of_every_machine_stand_in_one_row(tmp_path):
    """The newest figure of each; what one machine has not measured stays empty, an old line without targets is none."""
    other = {"date": "2026-11-22", "processor": "Another(R) Processor", "cores": 4}
    (tmp_path / "a.jsonl").write_text('{"date": "2026-11-01", "revision": "1", "figures": {"step.ratio": 0.1}}\n')
    remember(found(0.6, other), tmp_path)
    remember(found(0.5), tmp_path)
    remember({"more": at_most(2.0, 1.0, "more over less"), **found(0.4)}, tmp_path)
    assert targets_table(tmp_path).splitlines() == [
        "| what | target | AMD EPYC, family 25, 2 cores | Another Processor, 4 cores |",
        "| --- | --- | --- | --- |",
        "| step: step over the other | 0.45 | 0.4 (2026-11-24) | 0.6 MISSED (2026-11-22) |",
        "| more: more over less | 1 | 2 MISSED (2026-11-24) |  |",
    ]


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


def test_without_git_revisions_are_refused_and_runs_are_of_an_unknown_one(tmp_path, monkeypatch):
    monkeypatch.setattr(history.shutil, "which", lambda name: None)
    with pytest.raises(ValueError, match="git is not installed"):
        history._unpack("HEAD", tmp_path)
    assert history._revision() == "unknown"


def test_a_revision_is_unpacked_whole(tmp_path):
    try:
        history._unpack("HEAD", tmp_path)
    except ValueError:
        pytest.skip("this is no clone")
    tracked = subprocess.run(
        ["git", "ls-tree", "-r", "--name-only", "HEAD"], cwd=history._ROOT, capture_output=True, text=True, check=True
    ).stdout.split("\n")
    assert (tmp_path / "pyproject.toml").is_file()
    assert sum(path.is_file() for path in tmp_path.rglob("*")) == len([name for name in tracked if name])


def test_a_whole_run_stands_beside_the_plain_step():
    parts = [{"part": f"part {n}", "seconds": 2.0 - 0.1 * n, "share": 0.1, "calls": 3} for n in range(12)]
    burst = {
        "cell_size": 3e-3, "cells": 10, "cell_steps": 1000, "wall_seconds": 3.0, "seconds_per_cell_step": 3e-7,
        "profile": parts,
    }  # fmt: skip
    figures = beside(burst, 1.5e-7, "pair")
    assert figures["ratio"] == pytest.approx(2.0)
    assert not figures["met"]
    assert len(figures["parts"]) == 8
    assert figures["parts"][0]["seconds_per_cell_step"] == pytest.approx(2e-3)
    assert figures["alone"]["ratio"] == pytest.approx(0.3 / 0.14)
    assert not figures["alone"]["met"]


def test_the_first_run_is_compared_with_the_second(monkeypatch):
    times = iter([{"seconds": 50.0, "processor_seconds": 80.0}, {"seconds": 10.0, "processor_seconds": 12.0}] * 2)
    caches = []

    def timed(command, out, environment):
        caches.append(environment["NUMBA_CACHE_DIR"])
        return next(times)

    monkeypatch.setattr("benchmarks.first_run._timed", timed)
    figures = first_run(None)
    assert len(set(caches)) == 1
    for one in figures.values():
        assert one["seconds_compiling"] == pytest.approx(40.0)
        assert one["ratio"] == pytest.approx(2.0)
