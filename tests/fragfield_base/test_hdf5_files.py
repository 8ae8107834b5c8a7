"""HDF5 files that are whole after every fault: killed at any call, disk full at any call, cut, flipped, foreign."""

from __future__ import annotations

import errno
import os
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from fragfield_base.hdf5_files import SEAL_LENGTH, creating, reading
from fragfield_base.interruption import Interruption
from fragfield_base.writing import DRAFT, write_files
from fragfield_base.xdmf import quoted
from tests.faults import at_every_call, failing_call, limited_file_size
from tests.fragfield.short_run import environment
from tests.fragfield_base.hdf5_states import RefusedError, create, no_leftovers, states


def test_a_new_file_is_the_old_or_the_new_one_whenever_the_process_is_killed(tmp_path):
    path = tmp_path / "a.h5"
    seen = []

    def prepare():
        path.unlink(missing_ok=True)
        with creating(path, RefusedError) as file:
            file["old"] = np.ones(3)

    def check(number):
        with reading(path, RefusedError) as file:
            seen.append(sorted(file))
        assert seen[-1] in (["old"], ["cells", "steps"])

    assert at_every_call(lambda: create(path), prepare, check) >= 6
    assert seen[0] == ["old"]
    assert seen[-1] == ["cells", "steps"]
    create(path)
    no_leftovers(tmp_path, path)


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EACCES])
def test_a_call_that_fails_ends_in_one_message_and_leaves_the_file_whole(tmp_path, code):
    path = tmp_path / "a.h5"
    failed = 0
    for number in range(200):
        create(path)
        said = None
        with failing_call(number, code) as calls:
            try:
                create(path, 2)
            except RefusedError as error:
                said = str(error)
        if said is not None:
            failed += 1
            assert said.startswith(f"{path}: ")
            assert "\n" not in said
        assert states(path) in (1, 2)
        if number >= len(calls):
            break
    assert failed >= 3
    assert states(path) == 2


def test_a_process_in_which_calls_failed_ends_in_good_order(tmp_path):
    # The library closes what is left when the interpreter has gone: a property list that a fault kept ended it there.
    code = """
import errno, sys
from pathlib import Path
from tests.faults import failing_call
from tests.fragfield_base.hdf5_states import RefusedError, create

for number in range(40):
    path = Path(sys.argv[1]) / f"{number}.h5"
    create(path)
    with failing_call(number, errno.EIO):
        try:
            create(path, 2)
        except RefusedError:
            print(number)
"""
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)],
        capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(root)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.split()) >= 3


def test_a_full_disk_says_so_what_was_kept_and_how_to_go_on(tmp_path):
    path = tmp_path / "a.h5"
    create(path)
    size = path.stat().st_size
    for room in (0, 100, 2000, 6000):
        with limited_file_size(size + room), pytest.raises(RefusedError, match=r"File too large.*unchanged.*--resume"):
            create(path, 3)
        assert states(path) == 1
        assert path.stat().st_size == size
        no_leftovers(tmp_path, path)
    with limited_file_size(1000), pytest.raises(RefusedError, match=r"b.h5: cannot be written: .*; what stood there"):
        create(tmp_path / "b.h5")
    assert not (tmp_path / "b.h5").exists()
    create(path, 3)
    assert states(path) == 3


def test_a_flipped_bit_or_a_cut_anywhere_is_noticed_or_changes_nothing(tmp_path):
    path, other = tmp_path / "a.h5", tmp_path / "b.h5"
    create(path, 2)
    whole = path.read_bytes()
    end = len(whole) - SEAL_LENGTH
    random = np.random.default_rng(18)
    refused = 0
    for trial in range(24):
        data = bytearray(whole)
        if trial % 3:
            data[random.integers(len(whole))] ^= 1 << random.integers(8)
        else:
            data = data[: random.integers(len(whole))]
        if bytes(data[:end]) == whole[:end]:
            continue  # only the seal is hurt: covered below
        other.write_bytes(data)
        with pytest.raises(RefusedError, match=r"b.h5: (damaged|cut off|not a)"), reading(other, RefusedError):
            pass
        refused += 1
    assert refused > 16
    for cut in (1, 16, 40, SEAL_LENGTH):
        other.write_bytes(whole[:-cut])
        said = "b.h5: damaged"
        try:
            found = states(other)
        except RefusedError as error:
            said, found = str(error), 2
        assert found == 2, "without its seal the file is looked through, and its data is the same"
        assert "b.h5: damaged" in said


def test_a_signal_waits_for_the_file_and_comes_afterwards(tmp_path):
    path = tmp_path / "a.h5"
    with pytest.raises(KeyboardInterrupt), creating(path, RefusedError) as file:  # noqa: PT012 - when it comes counts
        for _ in range(3):
            os.kill(os.getpid(), signal.SIGINT)
        file["later"] = 1.0
    with reading(path, RefusedError) as file:
        assert list(file) == ["later"]


def test_the_outer_deferral_gets_the_signal_of_the_inner_one():
    with Interruption() as outer:
        with Interruption(patient=True):
            os.kill(os.getpid(), signal.SIGINT)
        assert outer.asked()
        with pytest.raises(KeyboardInterrupt):
            outer.check()


def test_other_threads_write_as_the_main_one_does(tmp_path):
    path = tmp_path / "a.h5"
    thread = threading.Thread(target=create, args=(path,))
    thread.start()
    thread.join()
    assert states(path) == 1


def test_a_file_that_is_open_when_python_ends_does_not_crash_it(tmp_path):
    """HDF5 would close it after Python has gone, through an object of Python's: signal 11."""
    create(tmp_path / "whole.h5")
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from fragfield_base import hdf5_files\n"
        "sys.kept = hdf5_files.creating(Path(sys.argv[1]), ValueError)\n"
        "sys.kept.__enter__()['more'] = list(range(1000))\n"
    )
    command = [sys.executable, "-X", "faulthandler", "-c", script, str(tmp_path / "whole.h5")]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False)
    assert (done.returncode, done.stderr) == (0, "")
    with reading(tmp_path / "whole.h5", ValueError) as file:
        assert "more" not in file


def test_without_h5py_the_message_says_what_to_install(tmp_path, monkeypatch):
    create(tmp_path / "a.h5")
    monkeypatch.setitem(sys.modules, "h5py", None)
    for use in (create, states):
        with pytest.raises(RefusedError, match=r'a.h5: an HDF5 file needs h5py: pip install "fragfield-flight\[hdf5'):
            use(tmp_path / "a.h5")


# --- Files written together, and texts in XDMF files


class _WriteError(Exception):
    pass


def test_files_written_together_are_all_flushed_before_their_folders(tmp_path, monkeypatch):
    """Nothing less durable than files written one by one: every file, then every folder, once."""
    flushed, real = [], os.fsync

    def note(descriptor):
        flushed.append("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file")
        real(descriptor)

    monkeypatch.setattr(os, "fsync", note)
    (tmp_path / "other").mkdir()
    files = {tmp_path / f"{i}.svg": b"%d" % i for i in range(3)} | {tmp_path / "other" / "a": b"other"}
    write_files(files, _WriteError)
    assert flushed == ["file"] * 4 + ["folder"] * 2
    assert {path: path.read_bytes() for path in files} == files
    assert not list(tmp_path.rglob(f"*{DRAFT}"))


def test_a_file_that_cannot_be_written_leaves_all_others_whole(tmp_path):
    (tmp_path / "b").mkdir()
    (tmp_path / "c").write_bytes(b"old")
    with pytest.raises(_WriteError, match=r"b: is not a regular file"):
        write_files({tmp_path / "a": b"new", tmp_path / "b": b"new", tmp_path / "c": b"new"}, _WriteError)
    assert (tmp_path / "a").read_bytes() == b"new"
    assert (tmp_path / "c").read_bytes() == b"old"


@pytest.mark.parametrize("text", ["plain", "a<b>&'\"c\n\td\r", "µs – é", ""])
def test_a_quoted_text_is_read_as_it_was(text):
    assert ET.fromstring(f"<a b={quoted(text)}/>").get("b") == text
