"""Every refusal and warning of a case, word for word: refusals.txt holds what is changed and what is said of it.

A block is the changes of the base, a line each as `--set` takes them, and below what the loader refuses (`!`), or what
`check` warns of beyond what it says of the base (`?`). `python -m tests.fragfield.test_refusals` writes the answers
again.
"""

from __future__ import annotations

import tomllib
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

from fragfield.case.changes import changed_document, load_case, read_settings
from fragfield.case.load import case_from_document
from fragfield.checking.check import check_report
from fragfield_base.errors import InputError
from tests.fragfield.short_run import SHORT

PAGE = Path(__file__).with_name("refusals.txt")
BASE: dict[str, Any] = {**tomllib.loads(SHORT), "title": "base"}
BASE["round"][0].pop("attitude")
ALWAYS = check_report(case_from_document(BASE, source="case.toml", folder=PAGE.parent))["warnings"]


def blocks(text: str) -> list[list[str]]:
    """The changes of every block."""
    lines = [line for line in text.splitlines() if line.startswith("> ") or not line]
    return [[line[2:] for line in group] for empty, group in groupby(lines, lambda line: not line) if not empty]


def answer(settings: list[str]) -> str:
    """What is said of the base with these changes."""
    folder = PAGE.parent
    try:
        document = changed_document(BASE, read_settings(settings), source="case.toml", folder=folder)
        case = case_from_document(document, source="case.toml", folder=folder)
    except InputError as error:
        return "\n".join(f"! {line}" for line in str(error).replace(str(folder), "FOLDER").splitlines())
    return "\n".join(f"? {line}" for line in check_report(case)["warnings"] if line not in ALWAYS) or "? nothing new"


def written(text: str) -> str:
    """The page with the answers of now."""
    return "\n\n".join("\n".join([*(f"> {one}" for one in block), answer(block)]) for block in blocks(text)) + "\n"


@pytest.mark.dolfinx
def test_every_refusal_and_warning_is_worded_as_on_the_page() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert text.count("\n! ") > 200
    assert text.count("\n? ") > 20
    assert written(text) == text


@pytest.mark.parametrize(
    ("content", "part"),
    [(b"[burst\n", "not valid TOML"), (b"\xff\xfe", "not text in UTF-8"), (None, "no such case file")],
)
def test_a_file_that_is_no_case_is_refused(content, part, tmp_path) -> None:
    path = tmp_path / "bad.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=part):
        load_case(path)


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
