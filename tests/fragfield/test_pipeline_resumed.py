"""A run directory that is there: gone on with, changed, refused, interrupted."""

from __future__ import annotations

import json
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest

from fragfield.files.run_directory import stamped_toml
from tests.fragfield.short_run import SHORT, command, environment, invoke


@pytest.mark.dolfinx
def test_another_seed_breaks_up_again_and_keeps_the_burst(whole_run, run_copy, short_case):
    changed = short_case.with_name("seed.toml")
    changed.write_text(SHORT.replace("seed = 1", "seed = 2"))
    done = invoke("break-up", changed, "--out", run_copy, "--json")
    assert done.exit_code == 0, done.stderr
    assert not (run_copy / "landing.h5").exists(), "the flight of other fragments must not stay"
    with h5py.File(run_copy / "fragments.h5") as ours, h5py.File(whole_run[0] / "fragments.h5") as theirs:
        assert ours.attrs["seed"] == "2"
        assert not np.array_equal(ours["fragments/mass"], theirs["fragments/mass"])
    summary = json.loads(done.stdout)
    assert summary["seed"] == 2
    assert "flight" not in summary
    assert summary["burst"]["cells"] > 0


@pytest.mark.dolfinx
def test_a_stage_into_another_folder_leaves_the_run_alone(run_copy, tmp_path):
    before = sorted((path.name, path.stat().st_mtime_ns) for path in run_copy.iterdir())
    done = invoke("fly", run_copy, "--out", tmp_path / "again", "--json")
    assert done.exit_code == 0, done.stderr
    assert sorted((path.name, path.stat().st_mtime_ns) for path in run_copy.iterdir()) == before
    assert {"burst", "break_up", "flight", "witness"} <= set(json.loads(done.stdout))
    assert (tmp_path / "again" / "fragments.h5").is_file()


@pytest.mark.dolfinx
def test_resume_goes_on_with_the_first_missing_stage(run_copy, short_case, without_figures):
    kept = (run_copy / "burst_snapshot.h5").stat().st_mtime_ns
    (run_copy / "landing.h5").unlink()
    done = invoke("run", short_case, "--out", run_copy, "--resume", "--json")
    assert done.exit_code == 0, done.stderr
    assert (run_copy / "burst_snapshot.h5").stat().st_mtime_ns == kept
    log = (run_copy / "run.log").read_text().split("resumed after break-up")
    assert len(log) == 2
    assert "burst: begins" in log[0]
    assert "burst: begins" not in log[1]
    assert "fly: begins" in log[1]


@pytest.mark.dolfinx
def test_a_run_with_settings_is_resumed_with_the_same_ones_or_from_its_directory(run_copy, short_case, without_figures):
    setting = ("--set", "seed=5")
    refused = invoke("run", short_case, *setting, "--out", run_copy)
    assert refused.exit_code == 2
    assert "seed: stored 1, now 5" in refused.stderr
    assert "use another --out, or --overwrite" in refused.stderr
    stored = (run_copy / "case.toml").read_text()
    edited = stored.replace("seed = 1", "seed = 5")
    (run_copy / "case.toml").write_text(edited)
    refused = invoke("run", short_case, *setting, "--out", run_copy, "--resume")
    assert refused.exit_code == 2
    assert "case.toml: was edited or damaged" in refused.stderr
    (run_copy / "case.toml").write_text(stamped_toml(edited.rpartition("\n# checksum")[0]))  # a run that --set has made
    (run_copy / "landing.h5").unlink()
    (run_copy / "fragments.h5").unlink()
    refused = invoke("run", short_case, "--out", run_copy, "--resume")
    assert refused.exit_code == 2
    assert "repeat its --set" in refused.stderr
    done = invoke("run", short_case, *setting, "--out", run_copy, "--resume")
    assert done.exit_code == 0, done.stderr
    assert "seed = 5" in (run_copy / "case.toml").read_text()
    assert invoke("run", run_copy, "--resume").exit_code == 0


@pytest.mark.dolfinx
@pytest.mark.cores
def test_an_interrupted_burst_goes_on_from_its_checkpoint(short_case, whole_run, tmp_path):
    long = tmp_path / "long.toml"
    long.write_text(SHORT.replace('"12 us"', '"60 us"'))
    out = tmp_path / "run"
    child = subprocess.Popen(
        command("run", long, "--out", out, "--quiet"), stderr=subprocess.PIPE, text=True, env=environment()
    )
    deadline = time.monotonic() + 120
    while not (out / "checkpoint.h5").is_file() and child.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    child.send_signal(signal.SIGINT)
    _, reported = child.communicate(timeout=60)
    assert child.returncode == 130, reported
    assert reported.endswith("fragfield: interrupted; what was written stays, --resume goes on from there\n")
    assert "Traceback" not in reported
    assert (out / "checkpoint.h5").is_file()
    assert "interrupted" in (out / "run.log").read_text()
    done = invoke("burst", long, "--out", out, "--resume", "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["burst"]["end_time"] == pytest.approx(60e-6)
    with h5py.File(out / "burst_snapshot.h5") as file:
        assert np.all(np.diff(file["history/time"]) > 0.0)


@pytest.mark.dolfinx
def test_a_numerical_stop_has_its_code_and_keeps_what_was_written(short_case, tmp_path):
    tight = tmp_path / "tight.toml"
    tight.write_text(SHORT.replace("energy_tolerance = 1.0", "energy_tolerance = 1e-9"))
    done = invoke("run", tight, "--out", tmp_path / "run")
    assert done.exit_code == 3, done.stderr
    assert done.stderr.startswith("fragfield: the energy ledger is open by")
    assert (tmp_path / "run" / "burst.xdmf").is_file()
    assert "ended: the energy ledger" in (tmp_path / "run" / "run.log").read_text()
