"""An error on one rank ends all of them, at once and with one message."""

from __future__ import annotations

import textwrap
import time

import pytest

pytest.importorskip("burst_fenicsx.compat")

pytestmark = [pytest.mark.dolfinx, pytest.mark.mpi]

CASE = """
title = "Two tubes"

[burst]
cell_size = "20 mm"
end_time = "40 us"

[[round]]
name = "left"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"

[[round]]
name = "right"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"
position = ["0.3 m", "0 m", "0 m"]
"""

SCRIPT = """
import sys
from pathlib import Path
sys.path.insert(0, str(Path.cwd()))
import numpy as np
from mpi4py import MPI
from burst_fenicsx.mechanics.solver import BurstSolver
from fragfield.cli import main

what, where = sys.argv[1], int(sys.argv[2])
usual = BurstSolver._add_forces

def hurt(solver, step, substep):
    last = substep == 2**solver.levels.highest
    if MPI.COMM_WORLD.rank == where and solver.steps == 7 and last and step > 0.0:
        if what == "fault":
            raise RuntimeError("something gave way")
        dofmap, position = solver.fields.mesh.dofmap, solver.fields.nodes.position
        nodes = dofmap[len(dofmap) // 2]
        position[nodes] = position[nodes[[4, 5, 6, 7, 0, 1, 2, 3]]]
    usual(solver, step, substep)

BurstSolver._add_forces = hurt
sys.argv = ["fragfield", *sys.argv[3:]]
main()
"""


@pytest.mark.parametrize(
    ("ranks", "where", "what"),
    [
        (2, 1, "fault"),
        (2, 0, "lost"),
        pytest.param(3, 2, "lost", marks=pytest.mark.slow),
        pytest.param(4, 3, "fault", marks=pytest.mark.slow),
    ],
)
def test_an_error_on_one_rank_ends_all_with_one_message(tmp_path, mpirun, ranks, where, what):
    """A cell turned inside out, and a fault in the middle of a step, while the others wait for that rank."""
    case, script = tmp_path / "case.toml", tmp_path / "hurt.py"
    case.write_text(CASE)
    script.write_text(textwrap.dedent(SCRIPT))
    code, message = (3, "lost cell: cell ") if what == "lost" else (4, "something gave way")
    began = time.monotonic()
    out = tmp_path / "run"
    done = mpirun(ranks, script, what, str(where), "burst", case, "--out", out, check=False, timeout=120.0)
    assert done.returncode == code, done.stderr
    # Open MPI's own words may come in between, and leave a space before ours.
    reported = [line.strip() for line in done.stderr.splitlines() if line.strip().startswith("fragfield: ")]
    assert len(reported) == 1, done.stderr
    assert message in reported[0]
    if what == "lost":
        assert "has turned inside out (at " in reported[0]
        assert "Traceback" not in done.stderr
    elif where > 0:
        assert reported[0].startswith(f"fragfield: rank {where}: ")
    assert time.monotonic() - began < 100.0
