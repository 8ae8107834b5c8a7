"""Foreign HDF5 files: what h5py stumbles over is one message, and no file is written through a link."""

from __future__ import annotations

import os

import pytest

from fragfield_base.hdf5_files import reading
from fragfield_base.writing import DRAFT
from tests.fragfield_base.hdf5_states import RefusedError, create


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
