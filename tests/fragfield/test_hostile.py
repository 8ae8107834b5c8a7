"""What surrounds a command and cannot be used is one line and exit code 2."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from typer.main import get_command

from fragfield.cli import app
from fragfield.cli.application import file_path
from tests.fragfield.short_run import RINGS, ROOT, invoke


def command(folder: Path, variables: dict[str, str], *arguments: object) -> subprocess.CompletedProcess[str]:
    """The command as an installed program starts it, with the source tree as its installation."""
    start = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from fragfield.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-P", "-c", start, *map(str, arguments)], cwd=folder, env=variables, capture_output=True,
        text=True, errors="replace", check=False,
    )  # fmt: skip


def test_a_working_folder_that_is_no_more_is_one_line_and_exit_2(tmp_path):
    script = f'mkdir gone && cd gone && rmdir ../gone && exec "{sys.executable}" -P -m fragfield check case.toml'
    known = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, env=known, capture_output=True, text=True, check=False)
    assert (done.returncode, "the working folder cannot be used" in done.stderr) == (2, True), done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("variables", "arguments", "words"),
    [
        ({"NUMBA_NUM_THREADS": "0"}, ("check", "case.toml"), "NUMBA_NUM_THREADS: found '0' in the environment"),
        ({"OMP_NUM_THREADS": "all"}, ("check", "case.toml"), "OMP_NUM_THREADS: found 'all' in the environment"),
        ({}, ("run", "case.toml", "--out=~unknown-user/x"), "there is no such home"),
        ({}, ("check", b"a\xff.toml"), "a name that is not UTF-8"),
    ],
)  # fmt: skip
def test_surroundings_that_no_run_survives_are_one_line_and_exit_2(tmp_path, variables, arguments, words):
    (tmp_path / "case.toml").write_text(RINGS)
    known = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    done = command(tmp_path, known | variables, *(os.fsdecode(one) for one in arguments))
    assert (done.returncode, words in done.stderr) == (2, True), done.stderr
    assert done.stderr.startswith("fragfield: ")
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "runs").exists()


def test_every_file_that_is_typed_is_made_absolute():
    """The command line leaves the folder in which it began: a relative name would mean another file."""
    loose, found = [], 0
    for command, one in get_command(app).commands.items():
        hints = get_type_hints(one.callback, localns={"Path": Path}, include_extras=True)
        for name, hint in hints.items():
            kinds = (hint.__origin__, *get_args(hint.__origin__)) if hasattr(hint, "__metadata__") else ()
            if Path in kinds:
                found += 1
                loose += [f"{command} {name}"] if hint.__metadata__[0].parser is not file_path else []
    assert found > 20
    assert loose == []


def test_fifty_thousand_unknown_keys_take_a_second(tmp_path):
    import time

    (tmp_path / "many.toml").write_text("".join(f"key{number} = 1\n" for number in range(50_000)) + RINGS)
    began = time.process_time()
    done = invoke("check", tmp_path / "many.toml")
    assert time.process_time() - began < 5.0
    assert done.exit_code == 2
    assert "50000 faults" in done.stderr
    assert "and 49988 more" in done.stderr


@pytest.mark.dolfinx
@pytest.mark.parametrize(
    ("damaged", "command_"), [("burst_snapshot.h5", "break-up"), ("fragments.h5", "fly"), ("summary.json", "break-up")]
)
def test_a_damaged_input_is_refused_before_anything_is_removed(whole_run, tmp_path, damaged, command_):
    run = tmp_path / "run"
    shutil.copytree(whole_run[0], run)
    whole = bytearray((run / damaged).read_bytes())
    whole[len(whole) // 2] ^= 1
    (run / damaged).write_bytes(whole)
    before = {path: path.stat().st_mtime_ns for path in run.rglob("*") if path.is_file() and path.name != "run.log"}
    done = invoke(command_, run)
    assert done.exit_code == 2, done.output
    assert damaged in done.stderr
    after = {path: path.stat().st_mtime_ns for path in run.rglob("*") if path.is_file() and path.name != "run.log"}
    assert {path.name for path in before} == {path.name for path in after}


@pytest.mark.mpi
def test_ranks_of_another_launcher_are_refused(tmp_path):
    (tmp_path / "one.toml").write_text(RINGS)
    known = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    ours = importlib.import_module("mpi4py.MPI").get_vendor()[0]
    foreign = {"OMPI_COMM_WORLD_RANK": "0", "OMPI_COMM_WORLD_SIZE": "2"}
    if ours == "Open MPI":
        foreign = {"PMI_RANK": "0", "PMI_SIZE": "2", "PMI_FD": "9"}
    done = command(tmp_path, known | foreign, "run", "one.toml")
    assert done.returncode == 2, done.stderr
    assert "found 2 ranks by the launcher's variables, and 1 by MPI" in done.stderr
