"""The same inputs give the same number, to the last digit: on a busy machine, with any threads and ranks."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

import fragfield
from tests.fragfield.short_run import ROOT, environment

pytestmark = [pytest.mark.dolfinx, pytest.mark.cores]  # one worker makes the run of all

SETTINGS = (
    "burst.cell_size=12 mm", "break_up.realisations=6", "hazard.max_realisations=8", "burst.convergence=standard",
)  # fmt: skip
STAGES = """
import sys, fragfield
for stage in ("burst", "break-up", "fly"):
    fragfield.run(sys.argv[1], out=sys.argv[2], only=stage, threads=int(sys.argv[3]), progress=False)
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """A case, and the run of it with nothing beside it on two threads."""
    folder = tmp_path_factory.mktemp("alone")
    case = fragfield.Case.from_toml(ROOT / "cases" / "m107_tnt.toml", set=SETTINGS)
    (folder / "stages.py").write_text(STAGES)
    case.write(folder / "shell.toml")
    for stage in ("burst", "break-up", "fly"):
        fragfield.run(folder / "shell.toml", out=folder / "run", only=stage, threads=2, progress=False)
    return folder


def parts_of(folder):
    """What must not differ: the distances and the grid convergence, without the time that they took."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    convergence = {key: value for key, value in summary["convergence"].items() if key != "seconds"}
    return json.loads(json.dumps({"hazard": summary["hazard"], "convergence": convergence}))


def test_the_number_has_every_part_of_a_single_run(alone):
    found = parts_of(alone / "run")
    assert len(found["convergence"]["sizes"]) == 3
    assert found["convergence"]["reason"] == ""
    assert found["hazard"]["recommended"] > found["hazard"]["upper"] > found["hazard"]["expected"]
    assert found["hazard"]["parts"]["grid"] > 0.0


def test_one_thread_on_a_busy_machine_gives_the_same_number(alone, tmp_path):
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        arguments = [sys.executable, alone / "stages.py", alone / "shell.toml", tmp_path / "run", "1"]
        subprocess.run(arguments, env=environment(), check=True)
    finally:
        busy.kill()
        busy.wait()
    assert parts_of(tmp_path / "run") == parts_of(alone / "run")


@pytest.mark.mpi
def test_two_ranks_give_the_same_number(alone, on_ranks, tmp_path):
    on_ranks(2, alone / "stages.py", alone / "shell.toml", tmp_path / "run", "1")
    assert parts_of(tmp_path / "run") == parts_of(alone / "run")
