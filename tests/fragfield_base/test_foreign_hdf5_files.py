"""Foreign HDF5 files: what leads to another file or claims too much is refused; nothing is written through a link."""

from __future__ import annotations

import os

import h5py
import numpy as np
import pytest

from fragfield_base.hdf5_files import reading
from fragfield_base.writing import DRAFT
from tests.fragfield_base.hdf5_states import RefusedError, create


def _soft(file):
    file["loop"] = h5py.SoftLink("/loop2")
    file["loop2"] = h5py.SoftLink("/loop")


def _outside(file):
    file["passwords"] = h5py.ExternalLink("/etc/passwd", "/")


def _huge(file):
    file.create_dataset("mass", shape=(10**12,), dtype="f8", chunks=(1000,))


def _external(file):
    file.create_dataset("mass", shape=(3,), dtype="u1", external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])


def _packed(file):
    file.create_dataset("mass", data=np.zeros(100), compression="lzf")


def _packed_behind_another(file):
    file.create_dataset("mass", data=np.zeros(100), shuffle=True, compression="lzf")


def _beyond(file):
    file.create_dataset("mass", shape=(2**23 + 1,), dtype="f8", chunks=(1000,))


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
        (_packed, r"mass is packed by the filter 32000; allowed: deflate"),
        (_packed_behind_another, "mass is packed by the filter 32000"),
        (_beyond, "declares 67108872 bytes"),
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
        file.create_dataset("packed", data=np.zeros(100), compression="gzip", shuffle=True, fletcher32=True)
        file.create_dataset("unwritten", shape=(2**23,), dtype="f8", chunks=(1000,))  # 64 MiB: any file may say so
        _circle(file)
    with reading(path, RefusedError) as file:
        assert file["mass"][3] == 3.0


def test_what_h5py_stumbles_over_is_one_message(tmp_path):
    path = tmp_path / "a.h5"
    create(path)
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
            create(tmp_path / "a.h5")
        link.unlink()
    create(tmp_path / "a.h5")
    (tmp_path / "b.h5").symlink_to(tmp_path / "a.h5")
    with pytest.raises(RefusedError, match=r"b.h5: is a symbolic link"):
        create(tmp_path / "b.h5")
    assert target.read_text() == "keep me"


def test_a_pipe_and_a_folder_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.h5")
    for name in ("pipe.h5", "."):
        with pytest.raises(RefusedError, match="not a file"), reading(tmp_path / name, RefusedError):
            pass
