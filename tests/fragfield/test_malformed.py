"""The ten malformed inputs: exit code 2 and one clear message, of `check` and `run` once in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import chdir
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.fragfield.short_run import invoke

HERE = Path(__file__).parent / "malformed"
ROOT = Path(__file__).parents[2]


def in_a_process(*arguments, cwd=ROOT):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    return subprocess.run(
        [sys.executable, "-m", "fragfield", *map(str, arguments)],
        capture_output=True, text=True, cwd=cwd, env=environment, timeout=60, check=False,
    )  # fmt: skip


def here(*arguments, cwd=ROOT):
    """The command in this process."""
    with chdir(cwd):
        return invoke(*arguments)


def _assert_one_message(done, *parts):
    code = done.returncode if isinstance(done, subprocess.CompletedProcess) else done.exit_code
    assert code == 2, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert done.stderr.startswith("fragfield: ")
    for part in parts:
        assert part in done.stderr, done.stderr


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("unknown_key", ["burst.cell_sise: unknown key", 'did you mean "cell_size"?']),
        (
            "missing_unit",
            ["burst.cell_size: found the bare number 8 without a unit", "a length with its unit", '"6 mm"'],
        ),
        ("wrong_unit", ['burst.cell_size: found "8 kg", which is a mass', "a length", '"6 mm"']),
        ("negative_wall", ["round[1].profile", "-22.5 mm", "must be positive"]),
        ("crossing_contours", ["round[1].profile", "the cavity crosses the outer contour", "station 300 mm"]),
        ("small_heat", ["round[1].explosive.heat_of_detonation: found Q = 3 MJ/kg", "more than D^2/16 = 3.01 MJ/kg"]),
        ("no_ignition", ["round[1].ignition: found no ignition point", "at least one point"]),
        ("ignition_outside", ["round[1].ignition[2].station: found 350 mm, outside the charge", "0 mm to 300 mm"]),
    ],
)
@pytest.mark.parametrize("command", ["check", "run"])
def test_a_malformed_case_ends_with_one_message(command, name, parts, tmp_path):
    path = HERE / f"{name}.toml"
    start = in_a_process if (command, name) in (("check", "unknown_key"), ("run", "small_heat")) else here
    done = start(command, path, cwd=tmp_path)
    _assert_one_message(done, str(path), *parts)
    assert list(tmp_path.iterdir()) == [], "a refused case leaves nothing behind"


def test_an_output_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    done = here("run", HERE / "sound.toml", "--out", tmp_path / "file" / "run")
    _assert_one_message(done, str(tmp_path / "file" / "run"), "the output folder cannot be made")


@pytest.mark.skipif(
    os.geteuid() == 0 and not Path("/proc/version").exists(), reason="needs a folder closed to root too"
)
def test_an_output_folder_that_cannot_be_written_is_refused():
    closed = "/proc" if os.geteuid() == 0 else "/usr"  # /proc refuses new entries even to root
    done = here("run", HERE / "sound.toml", "--out", closed)
    _assert_one_message(done, closed, "cannot be written")


@pytest.mark.parametrize("command", ["break-up", "info"])
def test_a_burst_file_that_is_cut_off_is_refused(command, tmp_path):
    case = HERE / "sound.toml"
    path = tmp_path / "burst_snapshot.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "fragfield burst snapshot"
        file["nodes/position"] = np.zeros((1000, 3))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    done = here("break-up", case, "--out", tmp_path) if command == "break-up" else here("info", path)
    _assert_one_message(done, str(path), "cut off")


def test_a_fragment_file_that_is_cut_off_is_refused(tmp_path):
    path = tmp_path / "mine.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "fragfield fragments"
        file["fragments/mass"] = np.ones(10_000)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    done = in_a_process("fly", HERE / "sound.toml", "--fragments", path, "--out", tmp_path / "run")
    _assert_one_message(done, str(path), "cut off")
