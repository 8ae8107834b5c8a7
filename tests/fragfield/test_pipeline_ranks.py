"""The chain of stages on several ranks: the same results, each message once."""

from __future__ import annotations

import json
import shutil

import pytest

import fragfield
from tests.datasets import same_data
from tests.fragfield.short_run import SHORT


@pytest.mark.dolfinx
@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_realisations_shared_over_ranks_are_those_of_one(on_ranks, whole_run, tmp_path, ranks):
    folder = tmp_path / "run"
    folder.mkdir()
    for name in ("case.toml", "summary.json", "burst_snapshot.h5"):
        shutil.copy(whole_run[0] / name, folder)
    script = tmp_path / "stages.py"  # both stages in one start of the ranks
    script.write_text(
        "import sys, fragfield\n"
        "from mpi4py import MPI\n"
        "for stage in ('break-up', 'fly'):\n"
        f"    run = fragfield.run({str(folder)!r}, only=stage, progress=False)\n"
        'sys.stdout.write(f\'{run.summary["break_up"]["realisations"]}/{len(run.landing)}\\n\')\n'
    )
    printed = on_ranks(ranks, script)
    landed = len(fragfield.open(whole_run[0]).landing)
    assert printed.split() == ranks * [f"32/{landed}"]  # every rank has the run, and the script goes on there
    for name in ("fragments.h5", "ensemble_fragments.h5", "landing.h5", "hits.h5", "ensemble.h5"):
        assert same_data(folder / name, whole_run[0] / name) > 5, name


@pytest.mark.dolfinx
@pytest.mark.mpi
def test_a_fault_of_the_flight_on_two_ranks_is_reported_once(mpirun, tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(SHORT)
    done = mpirun(2, "-m", "fragfield", "fly", case, "--out", tmp_path / "run", check=False)
    assert done.returncode == 2
    assert done.stderr.count("fragments.h5: no such file; run `fragfield break-up` first") == 1


@pytest.mark.dolfinx
@pytest.mark.mpi
def test_two_ranks_give_the_burst_of_one(mpirun, short_case, whole_run, tmp_path):
    """The command, with a report without pictures, during which the second rank waits."""
    done = mpirun(2, "-m", "tests.fragfield.plain_reports", "run", short_case, "--out", tmp_path / "run", "--json")
    summary = json.loads(done.stdout)  # one object: rank 0 alone prints
    assert summary["burst"]["ranks"] == 2
    alone = json.loads((whole_run[0] / "summary.json").read_text())["burst"]
    for name in ("cells", "steps", "casing_mass", "mean_initial_speed", "max_initial_speed", "outer_diameter"):
        assert summary["burst"][name] == pytest.approx(alone[name], rel=1e-9), name
    assert (tmp_path / "run" / "report.html").is_file()


@pytest.mark.mpi
def test_a_command_of_one_rank_is_done_once(mpirun, short_case):
    done = mpirun(2, "-m", "fragfield", "check", short_case, "--json")
    assert json.loads(done.stdout)["mesh"]["cells"] > 500


@pytest.mark.mpi
def test_an_input_error_on_two_ranks_is_reported_once(mpirun, tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text(SHORT.replace('"12 mm"', "12"))
    done = mpirun(2, "-m", "fragfield", "run", bad, "--out", tmp_path / "run", check=False)
    assert done.returncode == 2
    assert done.stderr.count("burst.cell_size: found the bare number 12") == 1
    assert "Traceback" not in done.stderr


@pytest.mark.dolfinx
@pytest.mark.mpi
def test_a_stop_on_two_ranks_ends_both_and_is_reported_once(mpirun, tmp_path):
    tight = tmp_path / "tight.toml"
    tight.write_text(SHORT.replace("energy_tolerance = 1.0", "energy_tolerance = 1e-9"))
    done = mpirun(2, "-m", "fragfield", "run", tight, "--out", tmp_path / "run", check=False)
    assert done.returncode == 3, done.stderr
    assert done.stderr.count("the energy ledger is open") == 1
    assert "Traceback" not in done.stderr
