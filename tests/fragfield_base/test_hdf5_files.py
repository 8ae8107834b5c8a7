"""HDF5 files that are whole after every fault: killed at any call, disk full at any call, cut, flipped, foreign."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from fragfield_base.hdf5_files import JOURNAL, appending, creating, reading
from fragfield_base.interruption import Interruption
from fragfield_base.seal import BLOCK
from fragfield_base.writing import DRAFT, append_text_file
from tests.faults import at_every_call, failing_call, limited_file_size
from tests.fragfield.short_run import environment


class RefusedError(Exception):
    """The error class that the calls below are given."""


def _state(number):
    return np.arange(1000.0) + 1e3 * number


def _create(path):
    with creating(path, RefusedError) as file:
        file.attrs["title"] = "states"
        file["cells"] = np.arange(5000)
        file["steps/0/data"] = _state(0)


def _append(path, number):
    with appending(path, RefusedError) as file:
        file[f"steps/{number}/data"] = _state(number)
        file.attrs["title"] = f"{number} states"  # a change in the old part


def _states(path):
    with reading(path, RefusedError) as file:
        assert np.array_equal(file["cells"], np.arange(5000))
        for name, step in file["steps"].items():
            assert np.array_equal(step["data"], _state(int(name)))
        return len(file["steps"])


def _no_leftovers(folder, path):
    assert [entry.name for entry in folder.iterdir() if entry.name.endswith((DRAFT, JOURNAL))] == []
    assert path.is_file()


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

    assert at_every_call(lambda: _create(path), prepare, check) >= 8
    assert seen[0] == ["old"]
    assert seen[-1] == ["cells", "steps"]
    _create(path)
    _no_leftovers(tmp_path, path)


def test_a_growing_file_has_the_new_state_whole_or_not_at_all_whenever_the_process_is_killed(tmp_path):
    path, model = tmp_path / "a.h5", tmp_path / "model.h5"
    _create(model)
    _append(model, 1)
    found = []

    def prepare():
        for one in tmp_path.glob("a.h5*"):
            one.unlink()
        shutil.copy(model, path)

    def check(number):
        found.append(_states(path))
        _no_leftovers(tmp_path, path)
        _append(path, 7)  # and it grows on
        assert _states(path) == found[-1] + 1

    assert at_every_call(lambda: _append(path, 2), prepare, check) >= 20
    assert set(found) == {2, 3}
    assert found == sorted(found), "after the journal is there the state is not lost again"


def test_a_file_that_loses_a_state_has_the_old_or_the_new_content_whenever_the_process_is_killed(tmp_path):
    # A resumed burst deletes the outputs after its checkpoint.
    path, model = tmp_path / "a.h5", tmp_path / "model.h5"
    _create(model)
    _append(model, 1)
    found = []

    def prepare():
        for one in tmp_path.glob("a.h5*"):
            one.unlink()
        shutil.copy(model, path)

    def work():
        with appending(path, RefusedError) as file:
            del file["steps/1"]

    def check(number):
        found.append(_states(path))
        _no_leftovers(tmp_path, path)

    assert at_every_call(work, prepare, check) >= 10
    assert set(found) == {1, 2}


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EACCES])
def test_a_call_that_fails_ends_in_one_message_and_leaves_the_file_whole(tmp_path, code):
    path, model = tmp_path / "a.h5", tmp_path / "model.h5"
    _create(model)
    failed = 0
    for number in range(200):
        for one in tmp_path.glob("a.h5*"):
            one.unlink()
        shutil.copy(model, path)
        said = None
        with failing_call(number, code) as calls:
            try:
                _append(path, 1)
            except RefusedError as error:
                said = str(error)
        if said is not None:
            failed += 1
            assert said.startswith(f"{path}: ")
            assert "\n" not in said
        assert _states(path) in (1, 2)
        if number >= len(calls):
            break
    assert failed >= 10
    assert _states(path) == 2


def test_a_process_in_which_calls_failed_ends_in_good_order(tmp_path):
    # The library closes what is left when the interpreter has gone: a property list that a fault kept ended it there.
    code = """
import errno, sys
from pathlib import Path
from tests.faults import failing_call
from tests.fragfield_base.test_hdf5_files import RefusedError, _append, _create

for number in range(40):
    path = Path(sys.argv[1]) / f"{number}.h5"
    _create(path)
    with failing_call(number, errno.EIO):
        try:
            _append(path, 1)
        except RefusedError:
            print(number)
"""
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)],
        capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(root)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.split()) >= 10


def test_a_full_disk_says_so_what_was_kept_and_how_to_go_on(tmp_path):
    path = tmp_path / "a.h5"
    _create(path)
    size = path.stat().st_size
    for room in (0, 100, 2000, 6000):
        with limited_file_size(size + room), pytest.raises(RefusedError, match=r"would be larger.*unchanged.*--resume"):
            _append(path, 1)
        assert _states(path) == 1
        assert path.stat().st_size == size
        _no_leftovers(tmp_path, path)
    with limited_file_size(1000), pytest.raises(RefusedError, match=r"b.h5: cannot be written: .*; what stood there"):
        _create(tmp_path / "b.h5")
    assert not (tmp_path / "b.h5").exists()
    _append(path, 1)
    assert _states(path) == 2


def test_every_flipped_byte_and_every_cut_is_noticed_or_changes_nothing(tmp_path):
    path, other = tmp_path / "a.h5", tmp_path / "b.h5"
    _create(path)
    _append(path, 1)
    whole = path.read_bytes()
    sealed = len(whole)
    with h5py.File(path) as file:
        end = file.id.get_filesize()
    random = np.random.default_rng(18)
    refused = 0
    for trial in range(300):
        data = bytearray(whole)
        if trial % 3:
            data[random.integers(sealed)] ^= 1 << random.integers(8)
        else:
            data = data[: random.integers(sealed)]
        if bytes(data[:end]) == whole[:end]:
            continue  # only the seal is hurt: covered below
        other.write_bytes(data)
        with pytest.raises(RefusedError, match=r"b.h5: (damaged|cut off|not a)"), reading(other, RefusedError):
            pass
        refused += 1
    assert refused > 250
    for cut in (1, 16, 40, 60, 72):
        other.write_bytes(whole[:-cut])
        said = "b.h5: damaged"
        try:
            found = _states(other)
        except RefusedError as error:
            said, found = str(error), 2
        assert found == 2, "without its seal the file is looked through, and its data is the same"
        assert "b.h5: damaged" in said


def test_blocks_far_apart_are_sealed_one_by_one(tmp_path):
    path = tmp_path / "a.h5"
    with creating(path, RefusedError) as file:
        file["big"] = np.zeros(BLOCK)
    for number in range(3):
        with appending(path, RefusedError) as file:
            file["big"][BLOCK // 2] = number
            file[f"more{number}"] = np.full(300_000, number)
        with reading(path, RefusedError) as file:
            assert file["big"][BLOCK // 2] == number
            assert file[f"more{number}"][-1] == number


def _soft(file):
    file["loop"] = h5py.SoftLink("/loop2")
    file["loop2"] = h5py.SoftLink("/loop")


def _outside(file):
    file["passwords"] = h5py.ExternalLink("/etc/passwd", "/")


def _huge(file):
    file.create_dataset("mass", shape=(10**12,), dtype="f8", chunks=(1000,))


def _external(file):
    file.create_dataset("mass", shape=(3,), dtype="u1", external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])


def _circle(file):
    file.create_group("a/b")
    file["a/b/c"] = file["a"]


@pytest.mark.parametrize(
    ("fill", "words"),
    [
        (_soft, "is a link to elsewhere"),
        (_outside, "is a link to elsewhere"),
        (_huge, "declares 8000000000000 bytes, which a file of .* cannot hold"),
        (_external, "lies in another file"),
    ],
)
def test_a_file_from_elsewhere_that_leads_elsewhere_is_refused(tmp_path, fill, words):
    path = tmp_path / "theirs.h5"
    with h5py.File(path, "w") as file:
        fill(file)
    with pytest.raises(RefusedError, match=rf"theirs.h5: .*{words}"), reading(path, RefusedError):
        pass


def test_a_file_from_elsewhere_that_is_sound_is_read_and_a_circle_of_groups_ends(tmp_path):
    path = tmp_path / "theirs.h5"
    with h5py.File(path, "w") as file:
        file["mass"] = np.arange(4.0)
        _circle(file)
    with reading(path, RefusedError) as file:
        assert file["mass"][3] == 3.0


def test_what_h5py_stumbles_over_is_one_message(tmp_path):
    path = tmp_path / "a.h5"
    _create(path)
    for stumble in (
        lambda file: file["none"],
        lambda file: file["steps"][()],
        lambda file: file["cells"][10**6],
        lambda file: float(file.attrs["title"]),
        lambda file: file["cells"].asstr()[()],
    ):
        with pytest.raises(RefusedError, match=r"a.h5: data cut off or damaged \(.+\); ask again"):  # noqa: SIM117
            with reading(path, RefusedError, "ask again") as file:
                stumble(file)


def test_no_file_is_written_through_a_link(tmp_path):
    target = tmp_path / "precious"
    target.write_text("keep me")
    for name in ("a.h5", f"a.h5{DRAFT}"):
        link = tmp_path / name
        link.symlink_to(target)
        with pytest.raises(RefusedError, match=rf"{name}: is a symbolic link, and this program writes through none"):
            _create(tmp_path / "a.h5")
        link.unlink()
    _create(tmp_path / "a.h5")
    (tmp_path / "b.h5").symlink_to(tmp_path / "a.h5")
    with pytest.raises(RefusedError, match=r"b.h5: is a symbolic link"):
        _append(tmp_path / "b.h5", 1)
    assert target.read_text() == "keep me"


def test_no_copy_by_hard_links_is_changed_in_place(tmp_path):
    path, copy = tmp_path / "a.h5", tmp_path / "copy.h5"
    _create(path)
    copy.hardlink_to(path)
    before = copy.read_bytes()
    with pytest.raises(
        RefusedError, match=r"a.h5: has 2 names \(hard links\), and all of them would change; put a copy"
    ):
        _append(path, 1)
    with pytest.raises(RefusedError, match=r"a.h5: has 2 names"):
        append_text_file(path, RefusedError, fresh=False)
    _create(path)  # a new file takes the name alone
    assert copy.read_bytes() == before
    _append(path, 1)
    assert _states(path) == 2


def test_a_pipe_and_a_folder_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.h5")
    for name in ("pipe.h5", "."):
        with pytest.raises(RefusedError, match="not a file"), reading(tmp_path / name, RefusedError):
            pass


def test_a_reader_waits_for_a_writer_that_lives(tmp_path):
    path = tmp_path / "a.h5"
    _create(path)
    code = (
        "import sys, time; from pathlib import Path; from fragfield_base.hdf5_files import appending\n"
        "with appending(Path(sys.argv[1]), ValueError) as file:\n"
        "    file['later'] = 1.0; print('in', flush=True); time.sleep(1.0)\n"
    )
    root = Path(__file__).parents[2]
    environment = {**os.environ, "PYTHONPATH": str(root)}
    writer = subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, env=environment)
    assert writer.stdout.readline() == b"in\n"
    began = time.monotonic()
    with reading(path, RefusedError) as file:
        assert "later" in file
    assert time.monotonic() - began > 0.3
    assert writer.wait(30) == 0


def test_a_signal_waits_for_the_file_and_comes_afterwards(tmp_path):
    path = tmp_path / "a.h5"
    _create(path)
    with pytest.raises(KeyboardInterrupt), appending(path, RefusedError) as file:  # noqa: PT012 - when it comes counts
        for _ in range(3):
            os.kill(os.getpid(), signal.SIGINT)
        file["steps/1/data"] = _state(1)
    assert _states(path) == 2


def test_the_outer_deferral_gets_the_signal_of_the_inner_one():
    with Interruption() as outer:
        with Interruption(patient=True):
            os.kill(os.getpid(), signal.SIGINT)
        assert outer.asked()
        with pytest.raises(KeyboardInterrupt):
            outer.check()


def test_other_threads_write_as_the_main_one_does(tmp_path):
    path = tmp_path / "a.h5"
    thread = threading.Thread(target=_create, args=(path,))
    thread.start()
    thread.join()
    assert _states(path) == 1


@pytest.mark.parametrize("opener", ["creating", "appending"])
def test_a_file_that_is_open_when_python_ends_does_not_crash_it(tmp_path, opener):
    """HDF5 would close it after Python has gone, through an object of Python's: signal 11."""
    _create(tmp_path / "whole.h5")
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from fragfield_base import hdf5_files\n"
        f"sys.kept = hdf5_files.{opener}(Path(sys.argv[1]), ValueError)\n"
        "sys.kept.__enter__()['more'] = list(range(1000))\n"
    )
    command = [sys.executable, "-X", "faulthandler", "-c", script, str(tmp_path / "whole.h5")]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False)
    assert (done.returncode, done.stderr) == (0, "")
    with reading(tmp_path / "whole.h5", ValueError) as file:
        assert "more" not in file


@pytest.mark.parametrize(
    ("kind", "size", "content"),
    [
        (b"redo", 1 << 43, b""),  # eight terabytes of nothing, and a seal of them
        (b"undo", 1 << 43, b""),
        (b"redo", 100, struct.pack("<QQ", 1 << 62, 4) + b"abcd"),
        (b"redo", 100, struct.pack("<QQ", 1 << 63, 4) + b"abcd"),
        (b"redo", 100, struct.pack("<QQ", 0, 1 << 40) + b"abcd"),
        (b"redo", 100, b"abc"),
        (b"else", 100, b""),
        (None, 0, b""),
    ],
)
def test_a_journal_that_is_none_of_ours_changes_nothing(tmp_path, kind, size, content):
    """Its checksum is right: whoever makes a run directory can make that as well."""
    path = tmp_path / "states.h5"
    _create(path)
    before = path.read_bytes()
    text = b"short" if kind is None else struct.pack("<4sQQ", kind, size, len(content)) + content
    digest = hashlib.blake2b(text, digest_size=32).digest()
    path.with_name(path.name + JOURNAL).write_bytes(b"fragfield journal 1" + digest + text)
    with reading(path, RefusedError) as file:
        assert len(file["cells"]) == 5000
    assert path.read_bytes() == before
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["states.h5"]


def test_a_journal_larger_than_its_file_is_not_read(tmp_path):
    path = tmp_path / "states.h5"
    _create(path)
    with path.with_name(path.name + JOURNAL).open("wb") as file:
        file.truncate(1 << 40)
    began = time.process_time()
    with reading(path, RefusedError) as found:
        assert "cells" in found
    assert time.process_time() - began < 5.0
