"""The Python interface: what a run gives back, its tables and figures, its stages, its progress and its errors."""

from __future__ import annotations

import json
import shutil

import pandas as pd
import pytest

import flight
import fragfield
from burst_fenicsx.errors import NumericalStop as BurstStop
from fragfield.errors import exit_code_of
from fragfield.files.run_directory import stamped_json
from fragfield.results.part import to_json
from tests.fragfield.short_run import invoke
from tests.fragfield.small_tube import BURST, TUBE, tube_case


@pytest.fixture(scope="module")
def tube():
    return tube_case()


@pytest.fixture(scope="module")
def done(tmp_path_factory, tube):
    """A whole run from Python, with the progress it reported; its report has figures."""
    steps = []
    out = tmp_path_factory.mktemp("interface") / "run"
    return fragfield.run(tube, out=out, progress=steps.append, threads=1), steps


def test_a_run_holds_what_the_command_line_computes(tmp_path, done, tube, without_figures):
    """The same files to the last number, by the same functions."""
    run, _ = done
    written = tube.write(tmp_path / "tube.toml")
    printed = invoke("run", written, "--out", tmp_path / "run", "--json", "--quiet")
    assert printed.exit_code == 0, printed.output
    theirs = json.loads(printed.stdout)
    assert theirs["burst"]["max_initial_speed"] == run.summary.burst.max_initial_speed
    assert theirs["hazard"] == to_json(run.summary.hazard)
    other = fragfield.open(tmp_path / "run")
    assert other.case == run.case == tube
    assert (other.landing == run.landing).all()


def test_results_are_arrays(done):
    run, _ = done
    assert all(run.stages.values())
    assert run.report.is_file()
    assert "burst: begins" in run.log
    assert len(run.fragments) == run.summary.break_up.fragments == len(run.landing)
    assert len(run.realisations) == run.summary.break_up.realisations > 1
    assert len(run.realisations[1]) != 0
    assert run.landing.dtype == flight.LANDING
    assert len(run.hits) == run.summary.witness[0].hits
    assert run.burst.mesh.time == pytest.approx(12e-6, rel=0.05)
    assert run.burst.mesh.is_axisymmetric
    assert run.burst.mesh.velocity.shape == run.burst.mesh.position.shape
    assert run.burst.history["time"].max() == pytest.approx(run.burst.mesh.time)
    assert [one.name for one in run.burst.rounds] == ["tube"]
    assert run.summary.exposed == ()
    assert any("Warning" in text for text in run.findings)


def test_the_hazard_distance(done):
    run, _ = done
    hazard, part = run.hazard, run.summary.hazard
    assert hazard.determined is part.determined is True
    assert (hazard.recommended, hazard.expected, hazard.upper, hazard.standard_error) == (
        part.recommended, part.expected, part.upper, part.standard_error,
    )  # fmt: skip
    assert hazard.recommended >= hazard.upper > hazard.expected > 0.0
    assert (hazard.parts, hazard.not_included) == (part.parts, part.not_included)
    assert hazard.realisations == part.realisations == 8
    assert run.ensemble.realisations == min(hazard.realisations, 200)  # of which single counts are kept
    assert hazard.direction is None
    assert hazard.reason == ""


def test_a_distance_that_is_not_determined_is_an_error_once_it_is_asked_for(done, tmp_path):
    run, _ = done
    copy = shutil.copytree(run.path, tmp_path / "copy")
    summary = to_json(run.summary)
    summary["hazard"] |= {
        "determined": False,
        "reason": "half of it never came down",
        "recommended": None,
        "upper": None,
    }
    (copy / "summary.json").write_text(stamped_json(summary))
    found = fragfield.open(copy)
    assert not found.hazard.determined
    assert "not determined" in str(found.hazard)
    assert "not determined" in str(found)
    for name in ("recommended", "parts", "not_included", "expected", "upper", "standard_error"):
        with pytest.raises(fragfield.NotDeterminedError, match="not determined: half of it never came down") as error:
            getattr(found.hazard, name)
        assert exit_code_of(error.value) == 3


def test_tables_are_those_of_the_csv_files(done):
    run, _ = done
    names = {"fragments", "arena", "landing", "witness", "ensemble", "hazard_by_distance", "hazard_by_sector"}
    assert set(run.tables) == names | {"history", "along"}
    for name in names:
        table = run.table(name)
        head = next(line for line in (run.path / f"{name}.csv").read_text().splitlines() if not line.startswith("#"))
        assert list(table.columns) == head.split(","), name
        assert len(table) > 0
    assert run.table("landing")["distance_m"].to_numpy() == pytest.approx(
        pd.read_csv(run.path / "landing.csv")["distance_m"], rel=1e-9
    )
    assert set(run.table("witness")["name"]) == {"ring"}
    assert set(run.table("along")["round"]) == {"tube"}
    with pytest.raises(
        fragfield.InputError, match=r"found 'landings' \(did you mean \"landing\"\?\); allowed: history"
    ):
        run.table("landings")
    with pytest.raises(
        fragfield.InputError, match=r"obstacle_hits.h5: no such file, which holds the table obstacle_hit"
    ):
        run.table("obstacle_hits")


def test_figures_are_the_reports(done, tmp_path):
    run, _ = done
    written = {path.stem for path in (run.path / "figures").glob("*.svg")}
    assert written - {"drawing_1", "plan", "elevation"} <= set(run.figures)
    assert run.figures["density_curve"] == "Density by distance"
    figure = run.figure("density_curve")
    assert len(figure.axes) >= 1
    assert figure.axes[0].lines
    figure.savefig(tmp_path / "density.png")
    assert (tmp_path / "density.png").stat().st_size > 10_000
    words = r'found .density. \(did you mean "density_curve"\?\); allowed: .*speed_along_round, '
    with pytest.raises(fragfield.InputError, match=words):
        run.figure("density")
    with pytest.raises(fragfield.InputError, match="holds no data for the figure site_map"):
        run.figure("site_map")


def test_progress_is_reported(done):
    _, steps = done
    stages = list(dict.fromkeys(step.stage for step in steps))
    assert stages == ["burst", "break-up", "fly", "report"]
    assert all(0.0 <= step.share <= 1.0 for step in steps)
    for stage in ("burst", "break-up", "fly", "report"):
        shares = [step.share for step in steps if step.stage == stage]
        assert shares[-1] == 1.0
    assert any("us" in step.detail for step in steps if step.stage == "burst")
    assert str(fragfield.Progress("burst", 0.5, "half", 90.0)) == "burst 50 %   half   1 min 30 s left"


def test_what_progress_raises_ends_the_run(tmp_path, tube):
    def stop(step):
        message = f"enough of {step.stage}"
        raise LookupError(message)

    with pytest.raises(LookupError, match=r"enough of (kernels|burst)"):
        fragfield.run(tube, out=tmp_path / "run", progress=stop)


def test_stages_alone_and_resumed(done, tmp_path, tube):
    run, _ = done
    copy = shutil.copytree(run.path, tmp_path / "copy")
    (copy / "landing.h5").unlink()
    part = fragfield.open(copy)
    assert part.stages == {"burst": True, "break-up": True, "fly": False, "report": True}
    with pytest.raises(fragfield.InputError, match=r"landing\.h5: no such file; run `fragfield fly` first"):
        _ = part.landing
    again = fragfield.run(copy, only="fly", progress=False)
    assert (again.landing == run.landing).all()
    thicker = fragfield.run(tube.changed({"hazard.energy": "200 J"}), out=copy, only="fly", progress=False)
    assert thicker.hazard.expected < run.hazard.expected
    with pytest.raises(fragfield.InputError, match=r"holds burst\.xdmf .*allowed: --resume"):
        fragfield.run(thicker.case, out=copy)
    with pytest.raises(
        fragfield.InputError, match=r"found 'flay' \(did you mean \"fly\"\?\); allowed: burst, break-up"
    ):
        fragfield.run(copy, only="flay")
    with pytest.raises(fragfield.InputError, match='fragments: found without only="fly"'):
        fragfield.run(copy, fragments="x.csv")


def test_a_run_needs_a_directory_and_a_burst(tube, tmp_path):
    with pytest.raises(fragfield.InputError, match=r"out: missing; a case made in Python needs"):
        fragfield.run(tube)
    with pytest.raises(fragfield.InputError, match=r"2 faults.*\n.*burst: missing.*\n.*round: missing"):
        fragfield.run(fragfield.Case(title="Nothing"), out=tmp_path / "run")
    with pytest.raises(fragfield.InputError, match=r"none\.toml: no such case file"):
        fragfield.run(tmp_path / "none.toml")
    with pytest.raises(fragfield.InputError, match="nowhere: no such run directory"):
        fragfield.open(tmp_path / "nowhere")
    with pytest.raises(fragfield.InputError, match="threads: found 0; allowed: a whole number of 1 or more"):
        fragfield.run(tube, out=tmp_path / "run", threads=0)
    assert not (tmp_path / "run").exists()


def test_a_numerical_stop_is_one_error(tmp_path, tube):
    """The ledger's bound, set to what no burst keeps."""
    strict = tube.changed({"burst.energy_tolerance": 1e-6})
    with pytest.raises(fragfield.NumericalStop, match="the energy ledger is open by") as found:
        fragfield.run(strict, out=tmp_path / "run", progress=False)
    assert exit_code_of(found.value) == 3
    assert isinstance(found.value, BurstStop)
    assert "the energy ledger is open" in fragfield.open(tmp_path / "run").log


@pytest.mark.slow  # as `test_realisations_shared_over_ranks_are_those_of_one`, from the burst on
@pytest.mark.mpi
@pytest.mark.dolfinx
def test_a_script_under_mpirun(tmp_path, mpirun):
    """Every rank gets the run, whose report has its pictures, and the script goes on behind it on all of them."""
    script = tmp_path / "script.py"
    script.write_text(
        "import sys, fragfield\n"
        "from mpi4py import MPI\n"
        f"case = fragfield.Case(title='Two ranks', burst={BURST!r}, round=[{TUBE!r}])\n"
        f"run = fragfield.run(case, out={str(tmp_path / 'run')!r}, progress=False)\n"
        f"again = fragfield.run(case, out={str(tmp_path / 'again')!r}, progress=False, only='burst')\n"
        "rank = MPI.COMM_WORLD.Get_rank()\n"
        'sys.stdout.write(f\'rank {rank}: {len(run.landing)} {again.stages["burst"] if rank == 0 else ""}\\n\')\n'
    )
    printed = sorted(mpirun(2, script).stdout.splitlines())
    assert list((tmp_path / "run" / "figures").glob("*.svg"))
    number = len(fragfield.open(tmp_path / "run").landing)
    assert printed[0].split() == ["rank", "0:", str(number), "True"]
    assert printed[1].split() == ["rank", "1:", str(number)]
