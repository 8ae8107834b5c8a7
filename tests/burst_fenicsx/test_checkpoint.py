"""Interrupted bursts, resumed, equal those left alone; signals within steps, full disks; files that are refused."""

from __future__ import annotations

import json
import os
import signal
import threading
from dataclasses import replace

import h5py
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx import assembled, simulation
from burst_fenicsx.errors import InputError
from burst_fenicsx.files.output import TimeSeries
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.problem import Leakage
from burst_fenicsx.run_burst import simulate
from fragfield_base.interruption import Interruption
from tests.burst_fenicsx.tubes import SETTINGS, interrupted, tube
from tests.datasets import datasets, same_data
from tests.faults import limited_file_size

pytestmark = pytest.mark.dolfinx


LEAKING = replace(SETTINGS, end_time=42e-6, leakage=Leakage(True, 1.02))


@pytest.mark.parametrize(("quadrature", "products"), [("one_point", "landau_cj"), ("full", "jwl")])
def test_a_resumed_run_equals_the_uninterrupted_one(tmp_path, monkeypatch, quadrature, products):
    """Bit by bit: state, history and the outputs on the way."""
    monkeypatch.setattr(simulation, "_PROGRESS_SECONDS", 0.0)
    settings = replace(LEAKING, quadrature=quadrature, products=products)
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    whole.mkdir()
    parts.mkdir()
    one = simulate([tube()], settings, whole, comm=MPI.COMM_SELF, provenance={"case": "tube"})
    for time in (3e-6, 36e-6):
        interrupted(parts, settings, time, resume=(parts / "checkpoint.h5").exists())
        with h5py.File(parts / "checkpoint.h5") as file:
            assert time < file.attrs["time"] < time + 2e-6
            assert file.attrs["case"] == "tube"
    two = simulate([tube()], settings, parts, comm=MPI.COMM_SELF, provenance={"case": "tube"}, resume=True)
    assert not (parts / "checkpoint.h5").exists()
    assert two.summary["steps"] == one.summary["steps"]
    for name in ("burst_snapshot.h5", "burst"):
        same_data(whole / name, parts / name)


def test_another_case_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(simulation, "_PROGRESS_SECONDS", 0.0)
    interrupted(tmp_path, SETTINGS, 2e-6)
    other = replace(SETTINGS, products="jwl")
    with pytest.raises(
        InputError, match=r"checkpoint.h5 belongs to another case: 960 cells, \w+; this one is 960 cells"
    ):
        simulate([tube()], other, tmp_path, comm=MPI.COMM_SELF, resume=True)


HERE = {"versions": json.dumps({"dolfinx": "0.11.0", "numpy": "2.5.5"})}


def _written_by_dolfinx_0_5(path):
    with h5py.File(path, "a") as file:
        file.attrs["versions"] = json.dumps({"dolfinx": "0.5.2", "numpy": "2.5.5"})


def test_another_build_goes_on_where_it_numbers_the_cells_alike(whole, tmp_path, monkeypatch):
    monkeypatch.setattr(simulation, "_PROGRESS_SECONDS", 0.0)
    interrupted(tmp_path, SHORT, 2e-6)
    _written_by_dolfinx_0_5(tmp_path / "checkpoint.h5")
    simulate([tube()], SHORT, tmp_path, comm=MPI.COMM_SELF, provenance={"case": "tube", **HERE}, resume=True)
    _assert_equal(tmp_path, whole[0])


def test_another_numbering_of_the_same_mesh_is_refused(tmp_path, monkeypatch):
    """Rows of a cell must not go to another: as another version of dolfinx could number them."""
    monkeypatch.setattr(simulation, "_PROGRESS_SECONDS", 0.0)
    interrupted(tmp_path, SETTINGS, 2e-6)
    _written_by_dolfinx_0_5(tmp_path / "checkpoint.h5")
    usual = assembled.THREE_DIMENSIONS

    def reversed_cells(*arguments):
        mesh, found = usual.make_mesh(*arguments)
        of_cells = ("cells", "part", "round", "segment", "station")
        return replace(mesh, **{name: getattr(mesh, name)[::-1].copy() for name in of_cells}), found

    monkeypatch.setattr(assembled, "THREE_DIMENSIONS", replace(usual, make_mesh=reversed_cells))
    with pytest.raises(InputError, match=r"otherwise \(dolfinx 0.5.2 there, 0.11.0 here\); resume it there, or delete"):
        simulate([tube()], SETTINGS, tmp_path, comm=MPI.COMM_SELF, provenance=HERE, resume=True)


def test_cut_off_and_foreign_files_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(simulation, "_PROGRESS_SECONDS", 0.0)
    interrupted(tmp_path, SETTINGS, 2e-6)
    path = tmp_path / "checkpoint.h5"
    whole = path.read_bytes()

    def resume():
        simulate([tube()], SETTINGS, tmp_path, comm=MPI.COMM_SELF, resume=True)

    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"checkpoint.h5: cut off, .*; delete it to start the burst again"):
        resume()
    path.write_bytes(whole)
    with h5py.File(path, "a") as file:
        del file["ranks/0/nodes/force"]
    with pytest.raises(InputError, match=r"checkpoint.h5: data cut off .*force.*; delete it to start the burst"):
        resume()
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "something else"
    with pytest.raises(InputError, match=r"is not a checkpoint of a burst \(format 'something else'\)"):
        resume()


def test_a_checkpoint_that_cannot_be_written_is_reported(tmp_path):
    (tmp_path / "checkpoint.h5.part").mkdir()
    with pytest.raises(InputError, match=r"checkpoint.h5.part: is not a regular file; remove it"):
        simulate([tube()], SETTINGS, tmp_path, comm=MPI.COMM_SELF)


def test_off_the_main_thread_signals_are_left_alone():
    usual, seen = signal.getsignal(signal.SIGINT), []

    def enter():
        with Interruption():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert seen == [usual]


SHORT = replace(SETTINGS, end_time=12e-6, output_interval=3e-6)
FILES = ("burst_snapshot.h5", "burst")


def _run(folder, *, resume=False):
    return simulate([tube()], SHORT, folder, comm=MPI.COMM_SELF, provenance={"case": "tube"}, resume=resume)


def _assert_equal(folder, whole):
    for name in FILES:
        same_data(folder / name, whole / name)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A burst that is left alone; its folder and its number of steps."""
    folder = tmp_path_factory.mktemp("whole")
    return folder, _run(folder).summary["steps"]


def _signal_within(monkeypatch, owner, method, number, kind):
    """Send a signal from within the call of this number of a method, in its middle: after its work, before its end."""
    calls, usual = [], getattr(owner, method)

    def call(self, *arguments, **options):
        result = usual(self, *arguments, **options)
        calls.append(None)
        if len(calls) == number:
            os.kill(os.getpid(), kind)
        return result

    monkeypatch.setattr(owner, method, call)


@pytest.mark.parametrize(
    ("kind", "share"),
    [(signal.SIGTERM, 0.0), (signal.SIGINT, 0.3), (signal.SIGHUP, 0.7), (signal.SIGTERM, 1.0)],
)
def test_a_signal_in_the_middle_of_a_step_is_resumed_bitwise(whole, tmp_path, monkeypatch, kind, share):
    """Forces are added within a step, when positions and stresses belong to different times."""
    _, steps = whole
    usual = signal.signal(kind, signal.default_int_handler)
    try:
        with monkeypatch.context() as patch:
            _signal_within(patch, BurstSolver, "check_cells", max(1, round(share * steps)), kind)
            with pytest.raises(KeyboardInterrupt):
                _run(tmp_path)
    finally:
        signal.signal(kind, usual)
    with h5py.File(tmp_path / "checkpoint.h5") as file:
        assert file.attrs["steps"] == max(1, round(share * steps))
    _run(tmp_path, resume=True)
    assert not (tmp_path / "checkpoint.h5").exists()
    _assert_equal(tmp_path, whole[0])


@pytest.mark.parametrize(
    ("kind", "calls"),
    [
        pytest.param(signal.SIGINT, [(TimeSeries, "_grid", 2)], id="in the middle of an output"),
        # The second Ctrl-C ends at once and writes nothing of the broken step; several SIGTERM are one.
        pytest.param(signal.SIGINT, [(BurstSolver, "check_cells", 2), (BurstSolver, "_add_forces", 5)], id="twice"),
        pytest.param(signal.SIGTERM, [(BurstSolver, "_add_forces", number) for number in (3, 4, 5)], id="SIGTERM"),
    ],
)
def test_signals_in_a_row_keep_the_state(whole, tmp_path, monkeypatch, kind, calls):
    usual = signal.signal(kind, signal.default_int_handler)
    try:
        with monkeypatch.context() as patch:
            for owner, method, number in calls:
                _signal_within(patch, owner, method, number, kind)
            with pytest.raises(KeyboardInterrupt):
                _run(tmp_path)
    finally:
        signal.signal(kind, usual)
    _run(tmp_path, resume=True)
    _assert_equal(tmp_path, whole[0])


@pytest.mark.parametrize("share", [0.5, 0.95])
def test_a_full_disk_is_one_message_and_is_resumed_bitwise(whole, tmp_path, monkeypatch, share):
    monkeypatch.setattr(simulation, "_CHECKPOINT_SECONDS", 0.0)  # one at every output
    largest = max(path.stat().st_size for path in (whole[0] / "burst_snapshot.h5", *(whole[0] / "burst").iterdir()))
    room = int(share * largest)
    with limited_file_size(room), pytest.raises(InputError, match=r"h5: cannot be written: .*; ") as said:
        _run(tmp_path)
    assert "\n" not in str(said.value)
    for path in tmp_path.rglob("*.h5"):
        datasets(path)  # everything before can be read
    _run(tmp_path, resume=True)
    _assert_equal(tmp_path, whole[0])


def test_a_folder_that_vanishes_is_one_message(tmp_path, monkeypatch):
    calls, usual = [], BurstSolver.check_cells

    def vanish(self):
        usual(self)
        calls.append(None)
        if len(calls) == 2:
            tmp_path.rename(tmp_path.with_name(f"{tmp_path.name}_gone"))  # at once: a state may be being written

    monkeypatch.setattr(BurstSolver, "check_cells", vanish)
    with pytest.raises(InputError, match=r": cannot be written: No such file or directory; .* name a folder"):
        _run(tmp_path)
    assert not tmp_path.exists()  # nothing has made it again
