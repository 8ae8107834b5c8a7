"""Names of files as people give them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fragfield_base import paths
from fragfield_base.errors import InputError


def test_a_tilde_is_a_home_and_a_name_is_relative_to_the_beginning(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", "/home/somebody")
    monkeypatch.chdir(tmp_path)
    assert paths.absolute("~/x", InputError) == Path("/home/somebody/x")
    assert paths.absolute("./~x", InputError) == tmp_path / "~x"
    assert paths.absolute(b"a/b.toml", InputError) == tmp_path / "a/b.toml"
    assert paths.absolute("b.csv", InputError, Path("/case")) == Path("/case/b.csv")
    monkeypatch.setattr(paths, "_start", None)
    paths.leave_folder(InputError)
    assert Path.cwd() == Path("/")
    assert paths.absolute("x.toml", InputError) == tmp_path / "x.toml"
    text = {"error": [f"{tmp_path}/runs/a: no such file"], "number": 1}
    assert paths.shown(text) == {"error": ["runs/a: no such file"], "number": 1}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "an empty name"),
        ("~unknown-user/x", "no such home; a name with a tilde: ./~unknown-user/x"),
        (b"a\xff.toml", "not UTF-8; allowed: rename it"),
        ("a\0b", "the character NUL"),
        ("loop/x.toml", "a loop of symbolic links"),
        ("x" * 300, "too long for this file system"),
    ],
)
def test_what_cannot_be_a_name_is_refused_in_one_line(tmp_path, name, words):
    (tmp_path / "loop").symlink_to("other")
    (tmp_path / "other").symlink_to("loop")
    with pytest.raises(InputError, match=words):
        paths.absolute(name, InputError, tmp_path)


def test_a_working_folder_that_is_gone_is_refused(tmp_path, monkeypatch):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    with pytest.raises(InputError, match="the working folder cannot be used"):
        paths.absolute("x", InputError)
    os.chdir(tmp_path)
