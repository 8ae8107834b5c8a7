"""Files written together, and texts in XDMF files."""

from __future__ import annotations

import os
import stat
from xml.etree import ElementTree as ET

import pytest

from fragfield_base.writing import DRAFT, write_files
from fragfield_base.xdmf import quoted


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
