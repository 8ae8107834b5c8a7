"""Texts of unknown origin do not control a terminal: neither in messages and tables nor in the log."""

from __future__ import annotations

import logging

import h5py
import pytest

from fragfield.terminal.logs import logged
from fragfield.terminal.visible_text import hidden_in, visible
from tests.fragfield.short_run import invoke


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain é – 😀\n\tnext", "plain é – 😀\n\tnext"),
        ("\x1b[31mred", "\\x1b[31mred"),
        ("a\x9b2J\x7f\r", "a\\x9b2J\\x7f\\r"),
        ("abc\u202edcb", "abc\\u202edcb"),
        ("no\udcffname", "no\\udcffname"),
    ],
)
def test_control_characters_are_shown_as_python_writes_them(text, shown):
    assert visible(text) == shown
    assert visible({"a": [text, (1, text)], text: None}) == {"a": [shown, (1, shown)], shown: None}
    assert [sign for _, sign in hidden_in({"a": [{"b": text}]})] == ([] if text == shown else [_sign(text)])


def _sign(text):
    return next(f"U+{ord(one):04X}" for one in text if visible(one) != one)


def test_a_file_from_elsewhere_commands_no_terminal(tmp_path):
    path = tmp_path / "theirs.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "x\x1b]0;title\x07"
        file["a\x1b[2J"] = 1.0
    done = invoke("info", path)
    assert done.exit_code == 0
    assert "\x1b" not in done.stdout
    assert "x\\x1b]0;title\\x07" in done.stdout
    done = invoke("info", tmp_path / "no\x1b[2J\udcff.h5")
    assert done.exit_code == 2
    assert "no\\x1b[2J\\udcff.h5: a name that is not UTF-8" in done.stderr


def test_a_log_holds_no_control_characters(tmp_path):
    with logged(tmp_path / "run.log", fresh=True):
        logging.getLogger("fragfield.some").warning("of %s", "\x1b[31mred")
    assert "of \\x1b[31mred" in (tmp_path / "run.log").read_text()
