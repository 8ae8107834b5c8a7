"""The same inputs give the same number, to the last digit: on a busy machine, with any threads and ranks."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import contextmanager

import pytest

from tests.fragfield.short_run import ROOT, command, environment

SETTINGS = (
    "burst.cell_size=10 mm", "break_up.realisations=6", "hazard.max_realisations=8", "burst.convergence=standard",
)  # fmt: skip
STAGES = ("burst", "break-up", "fly")
_BUSY = "while True: pass"


@contextmanager
def busy(number):
    """So many processes that take all the time of a core each."""
    processes = [subprocess.Popen([sys.executable, "-c", _BUSY]) for _ in range(number)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    from fragfield.case.changes import load_case
    from fragfield.case.write import to_toml

    path = tmp_path_factory.mktemp("case") / "shell.toml"
    path.write_text(to_toml(load_case(ROOT / "cases" / "m107_tnt.toml", SETTINGS)), encoding="utf-8")
    return path


def parts_of(folder):
    """What must not differ, as text: the distances and the grid convergence, without the time that they took."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    convergence = {key: value for key, value in summary["convergence"].items() if key != "seconds"}
    return json.dumps({"hazard": summary["hazard"], "convergence": convergence}, indent=1)


def run_stages(case, folder, threads):
    for stage in STAGES:
        arguments = command(stage, case, "--out", folder, "--quiet", "--threads", threads)
        subprocess.run(arguments, env=environment(), check=True, stdout=subprocess.DEVNULL)
    return parts_of(folder)


@pytest.fixture(scope="module")
def alone(case, tmp_path_factory):
    """The parts of the run with nothing beside it."""
    return run_stages(case, tmp_path_factory.mktemp("alone") / "run", 2)


@pytest.mark.dolfinx
def test_the_number_has_every_part_of_a_single_run(alone):
    found = json.loads(alone)
    assert len(found["convergence"]["sizes"]) == 3
    assert found["convergence"]["reason"] == ""
    assert found["hazard"]["recommended"] > found["hazard"]["upper"] > found["hazard"]["expected"]
    assert found["hazard"]["parts"]["grid"] > 0.0


@pytest.mark.dolfinx
@pytest.mark.parametrize("threads", [1, 2])
def test_a_busy_machine_gives_the_same_number(case, alone, tmp_path, threads):
    with busy(2):
        assert run_stages(case, tmp_path / "run", threads) == alone


@pytest.mark.dolfinx
@pytest.mark.mpi
def test_two_ranks_give_the_same_number(case, alone, mpirun, tmp_path):
    for stage in STAGES:
        mpirun(2, "-m", "fragfield", stage, case, "--out", tmp_path / "run", "--quiet")
    assert parts_of(tmp_path / "run") == alone
