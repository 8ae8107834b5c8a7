"""A signed run stays as it was signed, whichever command would write into it."""

from __future__ import annotations

import re

import pytest

from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.files.stamped import SIGNATURE, read_signature, sign
from fragfield.studies.uncertainty import results
from tests.fragfield.short_run import invoke

COMMANDS = (
    ("run", "--overwrite"), ("run", "--resume"), ("burst", "--overwrite"), ("break-up",), ("fly",), ("report",),
    ("view", "--html"),
)  # fmt: skip


def _contents(run):
    return {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}


def test_no_command_writes_into_a_signed_run(run_copy):
    signature = sign(run_copy, " A. Person ")
    before = _contents(run_copy)
    message = rf"{re.escape(str(run_copy))}: was signed by A\. Person on {signature.when} .* another --out, or withdraw"
    for words in COMMANDS:
        done = invoke(words[0], run_copy, *words[1:], "--quiet")
        assert done.exit_code == 2, words
        assert re.search(message, done.stderr), done.stderr
    with pytest.raises(InputError, match="was signed by"):
        sign(run_copy, "B. Person")
    assert _contents(run_copy) == before
    assert read_signature(run_copy).changed(run_copy) == []
    (run_copy / "report.html").write_text("another")
    assert read_signature(run_copy).changed(run_copy) == ["report.html"]
    (run_copy / SIGNATURE).write_text("[]")  # a damaged signature still locks
    assert "was signed and is kept" in invoke("report", run_copy).stderr
    (run_copy / SIGNATURE).unlink()
    assert invoke("fly", run_copy, "--quiet").exit_code == 0


def test_a_study_leaves_its_signed_nominal_run_alone(run_copy, tmp_path, monkeypatch):
    sign(run_copy, "A. Person")
    before = _contents(run_copy)
    monkeypatch.setattr(results, "assess", lambda *_: {"distance": None})
    monkeypatch.setattr(results, "_write_samples", lambda *_: None)
    study = tmp_path / "study"
    study.mkdir()
    results.write_results(None, {}, RunDirectory(run_copy), study, {})
    assert (study / results.RESULT).is_file()
    assert _contents(run_copy) == before


@pytest.mark.parametrize(("file", "who", "message"), [("report.html", "A", "has no report.html to sign; run"),
                                                      ("", "  ", r"document.prepared_by: missing")])  # fmt: skip
def test_what_cannot_be_signed(file, who, message, tmp_path):
    for name in {"report.html", "summary.json", "case.toml"} - {file}:
        (tmp_path / name).write_text("x")
    with pytest.raises(InputError, match=message):
        sign(tmp_path, who)
    assert read_signature(tmp_path) is None
