"""The chain of stages on a run directory: what a run leaves, and each stage alone."""

from __future__ import annotations

import hashlib
import json
import re
import shutil

import h5py
import numpy as np
import pytest

import fragfield
from fragfield.case import load_case, read_resolved, to_toml
from fragfield.files.run_directory import STAGES
from tests.datasets import same_data
from tests.fragfield.short_run import SHORT, invoke


@pytest.mark.dolfinx
def test_a_run_leaves_every_file_and_the_summary_of_the_contract(whole_run, short_case):
    out, printed = whole_run
    # of a run that was interrupted, has obstacles, contact between fragments, a place, a distance to draw, a study
    absent = {"burst_revolved", "burst_revolved.xdmf", "checkpoint.h5", "contours.geojson", "contours.kml", "map.html"}
    absent.add("uncertainty.json")
    absent |= {f"{name}.{kind}" for name in ("obstacle_hits", "contacts") for kind in ("h5", "csv")}
    for stage in STAGES.values():
        for name in stage.files:
            assert (out / name).exists() != (name in absent), name
    summary = json.loads((out / "summary.json").read_text())
    assert {"mean_mass", "mu", "n0"} <= set(summary["break_up"]["rounds"][0]["segments"][0])
    (ring,) = summary["witness"]
    assert ring["name"] == "ring"
    assert len(ring["by_azimuth"]) == 72
    assert [row["azimuth_deg"] for row in ring["by_azimuth"]] == [5.0 * sector for sector in range(72)]
    assert sum(row["hits"] for row in ring["by_azimuth"]) == ring["hits"]
    assert summary["seed"] == 1
    assert {"python", "numpy", "numba", "dolfinx", "mpi4py"} <= set(summary["versions"])
    assert summary["break_up"]["mass"] == pytest.approx(summary["burst"]["casing_mass"], rel=1e-9)
    assert summary["flight"]["fragments"] == summary["break_up"]["fragments"]
    assert len(summary.pop("checksum")) == 32
    assert json.loads(printed) == {"directory": str(out), **summary}
    assert read_resolved(out / "case.toml") == load_case(short_case)
    log = (out / "run.log").read_text()
    assert [line.split()[-2:] for line in log.splitlines() if line.endswith("begins")] == [
        [f"{name}:", "begins"] for name in STAGES
    ]


@pytest.mark.dolfinx
def test_every_file_carries_case_versions_seed_and_program(whole_run, short_case):
    out, _ = whole_run
    text = to_toml(load_case(short_case))
    names = (
        "burst/0000",
        "burst_snapshot",
        "fragments",
        "ensemble_fragments",
        "hits",
        "landing",
        "trajectories",
        "ensemble",
    )
    for name in (f"{one}.h5" for one in names):
        with h5py.File(out / name) as file:
            found = {
                key: file.attrs[key] for key in ("case", "seed", "program_version", "versions", "date", "platform")
            }
        assert found["case"] == text, name
        assert found["seed"] == "1"
        assert "numpy" in json.loads(found["versions"])


@pytest.mark.dolfinx
def test_stages_alone_give_what_the_run_gave(whole_run, run_copy, without_figures):
    names = {
        "break-up": ["fragments.h5", "ensemble_fragments.h5"],
        "fly": ["hits.h5", "landing.h5", "ensemble.h5"],
        "report": [],
    }
    for stage, files in names.items():
        done = invoke(stage, run_copy, "--json")
        assert done.exit_code == 0, done.stderr
        for name in files:
            assert same_data(run_copy / name, whole_run[0] / name) > 5, name
    assert (run_copy / "report.html").stat().st_size > 10_000
    before, after = (json.loads((path / "summary.json").read_text()) for path in (whole_run[0], run_copy))
    assert before["burst"] == after["burst"]
    assert before["witness"] == after["witness"]


@pytest.mark.dolfinx
def test_an_ensemble_is_flown_and_its_first_realisation_is_that_of_the_files(whole_run, short_case):
    from flight.files.ensemble import read_ensemble
    from flight.files.hdf5 import read_table
    from flight.hazard.density.sectors import tally

    out, _ = whole_run
    summary = json.loads((out / "summary.json").read_text())
    found, witnesses = read_ensemble(out / "ensemble.h5")
    number = load_case(short_case).break_up.realisations
    assert number == summary["break_up"]["realisations"] <= found.realisations == summary["flight"]["realisations"]
    assert summary["hazard"]["realisations"] == found.expected.realisations >= found.realisations
    own, stored = found.headline, summary["hazard"]
    del own["mirror_planes_deg"]
    assert own.pop("without_ricochet").items() <= stored["without_ricochet"].items()
    assert stored["method"] == "weighted_fragments"
    of_realisations = {own.pop("method"), own.pop("largest_throw")}  # the file holds no weighted fragments
    assert "realisations" in of_realisations
    assert own.items() <= stored.items()
    assert summary["hazard"]["basis"] == "all_azimuths"
    assert summary["hazard"]["determined"] is True
    number = found.realisations
    first = tally(read_table(out / "landing.h5", "landing")[0])
    for name in ("fragments", "hazardous", "throw"):
        assert np.array_equal(getattr(found.counts, name)[0], getattr(first, name)[0]), name
    assert not np.array_equal(found.counts.throw[0], found.counts.throw[1])
    assert witnesses["ring"]["hits"][0].tolist() == [row["hits"] for row in summary["witness"][0]["by_azimuth"]]
    single = summary["hazard"]["single_event"]
    assert single["realisations"] == number == len(found.events)
    assert single["low"] < single["median"] < single["high"]
    assert (out / "ensemble.csv").read_text().splitlines()[-1].startswith(f"{number - 1},")


@pytest.mark.dolfinx
def test_a_report_has_number_and_names_of_the_case_file_and_the_digest_of_its_numbers(
    run_copy, short_case, without_figures
):
    """Without computing again what they do not bear on; another cell size belongs to another run."""
    case = run_copy.parent / "signed.toml"
    case.write_text(short_case.read_text() + '\n[document]\nnumber = "R-17"\napproved_by = "A. Engineer"\n')
    done = invoke("report", case, "--out", run_copy)
    assert done.exit_code == 0, done.stderr
    report = (run_copy / "report.html").read_text()
    digest = hashlib.sha256((run_copy / "summary.json").read_bytes()).hexdigest()[:16]
    assert f"R-17 · summary.json SHA-256 {digest}" in report
    assert "A. Engineer" in report
    case.write_text(re.sub(r'cell_size = "[^"]*"', 'cell_size = "33 mm"', case.read_text()))
    done = invoke("report", case, "--out", run_copy)
    assert done.exit_code == 2
    assert "its summary.json does not belong to this case" in done.stderr


@pytest.mark.dolfinx
def test_one_realisation_leaves_nothing_of_an_earlier_ensemble(run_copy, short_case, monkeypatch):
    monkeypatch.setattr("fragfield.pipeline.weighted.why_not_weighted", lambda _: "as rounds that may meet")
    changed = short_case.with_name("one.toml")
    changed.write_text(SHORT.replace("realisations = 8", "realisations = 1"))
    first = (run_copy / "fragments.h5").read_bytes()
    assert invoke("break-up", changed, "--out", run_copy).exit_code == 0
    assert not (run_copy / "ensemble_fragments.h5").exists()
    assert len((run_copy / "fragments.h5").read_bytes()) > 0.9 * len(first)
    done = invoke("fly", changed, "--out", run_copy, "--json")
    hazard = json.loads(done.stdout)["hazard"]
    assert (hazard["realisations"], hazard["converged"], hazard["upper"]) == (1, False, None)
    assert "set break_up.realisations" in done.stderr
    reported = invoke("info", run_copy).stdout
    assert re.search(r"\b1 realisation\b", reported)
    assert "over all azimuths" in reported


@pytest.mark.dolfinx
def test_realisations_are_added_until_the_distance_is_known(run_copy, short_case, monkeypatch):
    """Those that `fly` adds are those that `break-up` would have made: the same numbers, to the last bit."""
    monkeypatch.setattr("fragfield.pipeline.weighted.why_not_weighted", lambda _: "as rounds that may meet")
    found = {}
    for name, fewest, most in (("added", 4, 9), ("made", 9, 9)):
        case = short_case.with_name(f"{name}.toml")
        text = SHORT.replace("tolerance = 0.5\nmax_realisations = 8", f"tolerance = 1e-4\nmax_realisations = {most}")
        case.write_text(text.replace("realisations = 8", f"realisations = {fewest}"))
        assert invoke("break-up", case, "--out", run_copy).exit_code == 0
        done = invoke("fly", case, "--out", run_copy, "--json")
        assert done.exit_code == 0, done.stderr
        found[name] = json.loads(done.stdout)["hazard"]
        assert "9 realisations fix the expected distance to" in done.stderr
        assert "set hazard.max_realisations above 9" in done.stderr
    assert found["added"] == found["made"]
    assert found["added"]["realisations"] == 9
    loose = short_case.with_name("loose.toml")
    loose.write_text(SHORT.replace("max_realisations = 8\n", "").replace("realisations = 8", "realisations = 5"))
    assert invoke("break-up", loose, "--out", run_copy).exit_code == 0
    done = invoke("fly", loose, "--out", run_copy, "--json")
    assert json.loads(done.stdout)["hazard"]["realisations"] == 5
    assert not done.stderr


@pytest.mark.dolfinx
def test_info_shows_stages_numbers_and_origin(whole_run):
    done = invoke("info", whole_run[0], "--json")
    found = json.loads(done.stdout)
    assert found["stages"] == dict.fromkeys(STAGES, True)
    assert found["files"]["report.html"] > 0
    found = json.loads(invoke("info", whole_run[0] / "burst_snapshot.h5", "--json").stdout)
    assert found["format"] == "fragfield burst snapshot"
    assert found["attributes"]["versions"]["numpy"]
    assert found["datasets"]["nodes/position"].endswith("x 3 float64")
    assert "burst_snapshot.h5" in invoke("info", whole_run[0]).stdout


# --- The chain of stages on several ranks: the same results, each message once


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
        "sys.stdout.write(f'{run.summary.break_up.realisations}/{len(run.landing)}\\n')\n"
    )
    printed = on_ranks(ranks, script)
    landed = len(fragfield.open(whole_run[0]).landing)
    assert printed.split() == ranks * [f"8/{landed}"]  # every rank has the run, and the script goes on there
    for name in ("fragments.h5", "ensemble_fragments.h5", "landing.h5", "hits.h5", "ensemble.h5"):
        assert same_data(folder / name, whole_run[0] / name) > 5, name


@pytest.mark.dolfinx
@pytest.mark.mpi
def test_the_command_on_two_ranks_prints_once(mpirun, short_case, whole_run, tmp_path):
    done = mpirun(2, "-m", "fragfield", "burst", short_case, "--out", tmp_path / "run", "--json")
    summary = json.loads(done.stdout)  # one object: rank 0 alone prints
    assert summary["burst"]["ranks"] == 2
    alone = json.loads((whole_run[0] / "summary.json").read_text())["burst"]
    for name in ("cells", "steps", "casing_mass", "mean_initial_speed", "max_initial_speed", "outer_diameter"):
        assert summary["burst"][name] == alone[name], name


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
