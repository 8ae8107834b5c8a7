"""Signals within steps and files, full disks: what is resumed equals what was left alone, to the last bit."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import h5py
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx import simulation
from burst_fenicsx.errors import InputError
from burst_fenicsx.files.output import TimeSeries
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.run_burst import simulate
from tests.burst_fenicsx.tubes import SETTINGS, tube
from tests.datasets import datasets, same_data
from tests.faults import limited_file_size

pytestmark = pytest.mark.dolfinx

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
    "calls",
    [
        pytest.param([(TimeSeries, "_grid", 2)], id="in the middle of an output"),
        # The second Ctrl-C ends at once and writes nothing of the broken step.
        pytest.param([(BurstSolver, "check_cells", 2), (BurstSolver, "_add_forces", 5)], id="twice"),
    ],
)
def test_ctrl_c_keeps_the_state(whole, tmp_path, monkeypatch, calls):
    with monkeypatch.context() as patch:
        for owner, method, number in calls:
            _signal_within(patch, owner, method, number, signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            _run(tmp_path)
    _run(tmp_path, resume=True)
    _assert_equal(tmp_path, whole[0])


def test_several_sigterm_are_one(whole, tmp_path, monkeypatch):
    usual = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with monkeypatch.context() as patch:
            for number in (3, 4, 5):
                _signal_within(patch, BurstSolver, "_add_forces", number, signal.SIGTERM)
            with pytest.raises(KeyboardInterrupt):
                _run(tmp_path)
    finally:
        signal.signal(signal.SIGTERM, usual)
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
    with pytest.raises(InputError, match=r": cannot be written: the file or its folder is not there any more"):
        _run(tmp_path)
    assert not tmp_path.exists()  # nothing has made it again
