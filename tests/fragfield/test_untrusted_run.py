"""Run directories of unknown origin, whose HDF5 files have no checksums: what cannot be is refused by every command."""

from __future__ import annotations

import h5py
import pytest

from fragfield.errors import InputError
from fragfield_base.hdf5_files import SEAL_LENGTH
from fragfield_base.writing import locked
from tests.fragfield.short_run import invoke

pytestmark = pytest.mark.dolfinx


def _foreign(path, change):
    """Take the checksums off a file of ours and change it, as any other program may."""
    path.write_bytes(path.read_bytes()[:-SEAL_LENGTH])
    with h5py.File(path, "r+") as file:
        change(file)


def _set(name, value):
    def change(file):
        file[name][0] = value

    return change


def _group(name):
    def change(file):
        del file[name]
        file.create_group(name)

    return change


def _attribute(name, value):
    def change(file):
        file.attrs[name] = value

    return change


def _names_of_numbers(file):
    del file["round_names"]
    file["round_names"] = [1, 2]


@pytest.mark.parametrize("command", ["report", "break-up"])
@pytest.mark.parametrize("node", [-5, 10**6])
def test_cells_of_a_snapshot_that_name_no_node_are_refused(run_copy, command, node):
    """An IndexError before 2026-11-23; a negative one was drawn from the other end."""
    _foreign(run_copy / "burst_snapshot.h5", _set("cells/nodes", node))
    done = invoke(command, run_copy, "--quiet")
    assert done.exit_code == 2, done.stderr
    assert "burst_snapshot.h5: " in done.stderr


@pytest.mark.parametrize("node", [-5, 10**6])
def test_cells_of_a_series_that_name_no_node_are_refused(run_copy, node):
    _foreign(run_copy / "burst" / "0000.h5", _set("cells", node))
    done = invoke("view", run_copy, "--quiet")
    assert done.exit_code == 2, done.stderr
    assert "burst.xdmf: cells refer to nodes that do not exist" in done.stderr


@pytest.mark.parametrize(
    ("name", "command", "change", "words"),
    [
        ("fragments.h5", "fly", _attribute("format_version", "one"), "format_version is one, this program reads 1"),
        ("fragments.h5", "fly", _group("fragments/mass"), "/fragments/mass is no array; needed: numbers"),
        ("fragments.h5", "report", _group("fragments/mass"), "/fragments/mass is no array; needed: numbers"),
        ("fragments.h5", "report", _set("fragments/position", float("nan")), "position of fragment 0 is [nan nan nan]"),
        ("ensemble_fragments.h5", "fly", _names_of_numbers, "/round_names is no list of texts"),
        ("burst_snapshot.h5", "break-up", _attribute("format_version", "one"), "format_version is one"),
        ("burst_snapshot.h5", "report", _group("cells/nodes"), "/cells/nodes is no array; needed: whole numbers"),
        ("burst_snapshot.h5", "report", _set("cells/part", 9), "/cells/part holds values from 0 to 9; allowed: 0 to 2"),
        ("landing.h5", "report", _attribute("format_version", "one"), "format_version is one, this program reads 2"),
    ],
)
def test_types_and_values_that_cannot_be_are_refused(run_copy, name, command, change, words):
    _foreign(run_copy / name, change)
    done = invoke(command, run_copy, "--quiet")
    assert done.exit_code == 2, done.stderr
    assert f"{run_copy / name}: " in done.stderr
    assert words in done.stderr


def test_info_shows_every_file_of_a_run(whole_run):
    files = sorted(whole_run[0].rglob("*.h5"))
    assert len(files) >= 8
    for path in files:
        done = invoke("info", path)
        assert done.exit_code == 0, done.stderr
        assert str(path) in done.stdout


@pytest.mark.parametrize(
    "words", [("burst", "--overwrite"), ("run", "--overwrite"), ("run", "--resume"), ("break-up",), ("fly",)]
)
def test_a_run_that_another_command_writes_is_left_alone(run_copy, short_case, words):
    before = {entry.name: entry.stat().st_mtime_ns for entry in run_copy.iterdir()}
    verb, *options = words
    target = [short_case, "--out", run_copy] if options else [run_copy]
    with locked(run_copy, InputError):
        done = invoke(verb, *target, *options, "--quiet")
    assert done.exit_code == 2
    assert "another command" in done.stderr
    assert "is writing into it; wait for it to end, or use another --out" in done.stderr
    assert {entry.name: entry.stat().st_mtime_ns for entry in run_copy.iterdir()} == before


def test_a_log_that_cannot_be_written_is_one_message(run_copy):
    (run_copy / "run.log").unlink()
    (run_copy / "run.log").mkdir()
    done = invoke("fly", run_copy, "--quiet")
    assert done.exit_code == 2
    assert done.stderr == f"fragfield: {run_copy / 'run.log'}: is not a regular file; remove it\n"
