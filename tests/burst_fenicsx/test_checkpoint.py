"""An interrupted burst, resumed, equals the uninterrupted one; foreign, other and cut-off files are refused."""

from __future__ import annotations

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
from burst_fenicsx.problem import Leakage
from burst_fenicsx.run_burst import simulate
from fragfield_base.interruption import Interruption
from tests.burst_fenicsx.tubes import SETTINGS, tube
from tests.datasets import same_data

pytestmark = pytest.mark.dolfinx

LEAKING = replace(SETTINGS, end_time=42e-6, leakage=Leakage(True, 1.02))


def interrupted(out_dir, settings, time, resume=False):
    """Run until the first progress report after `time` and press Ctrl-C there."""

    def press(progress):
        if progress.time > time:
            os.kill(os.getpid(), signal.SIGINT)

    options = {"comm": MPI.COMM_SELF, "provenance": {"case": "tube"}, "on_progress": press, "resume": resume}
    with pytest.raises(KeyboardInterrupt):
        simulate([tube()], settings, out_dir, **options)


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


def test_another_numbering_of_the_same_mesh_is_refused(tmp_path, monkeypatch):
    """Rows of a cell must not go to another: as another version of dolfinx could number them."""
    monkeypatch.setattr(simulation, "_PROGRESS_SECONDS", 0.0)
    interrupted(tmp_path, SETTINGS, 2e-6)
    usual = assembled.THREE_DIMENSIONS

    def reversed_cells(*arguments):
        mesh, found = usual.make_mesh(*arguments)
        of_cells = ("cells", "part", "round", "segment", "station")
        return replace(mesh, **{name: getattr(mesh, name)[::-1].copy() for name in of_cells}), found

    monkeypatch.setattr(assembled, "THREE_DIMENSIONS", replace(usual, make_mesh=reversed_cells))
    with pytest.raises(InputError, match=r"numbers the cells of this mesh otherwise .*; resume it there, or delete it"):
        simulate([tube()], SETTINGS, tmp_path, comm=MPI.COMM_SELF, resume=True)


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


def test_ctrl_c_waits_for_the_step_and_a_second_one_does_not():
    usual = signal.getsignal(signal.SIGINT)
    with Interruption() as interruption:
        interruption.check()
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            interruption.check()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is usual


def test_off_the_main_thread_signals_are_left_alone():
    usual, seen = signal.getsignal(signal.SIGINT), []

    def enter():
        with Interruption():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert seen == [usual]
