"""What a file that is no table of ours looks like, and the command that converts it: the end of an error message."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from flight.errors import InputError
from flight.files.dialect import decoded, dialect_of

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["foreign_words"]

_SEEN = 1 << 16  # bytes that are looked at
_MAGIC = {
    b"PK\x03\x04": "a workbook or another archive (XLSX, ODS)",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook (.xls; save it as .xlsx)",
    b"\x1f\x8b": "a file compressed by gzip (unpack it)",
    b"%PDF": "a PDF (copy its table into a spreadsheet)",
}


def foreign_words(path: Path, kind: str = "", *, names: bool = False) -> str:
    """End of a message about a table that cannot be read as it is; empty where its form is ours.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        Of `fragfield import --kind`.
    names : bool
        Its column names are others, so that it is to be converted whatever its form.
    """
    looks, ours = _looks(path)
    if not looks or (ours and not names):
        return ""
    known = f" --kind {kind}" if kind else ""
    out = shlex.quote(f"{path.stem}_converted.csv")
    return f"; it looks like {looks}, to be converted by: fragfield import {shlex.quote(str(path))}{known} --out {out}"


def _looks(path: Path) -> tuple[str, bool]:
    """What the first bytes of a file look like, and whether that is the form of our own tables."""
    try:
        if not path.is_file():
            return "", True
        with path.open("rb") as file:
            data = file.read(_SEEN)
    except OSError:
        return "", True
    for magic, words in _MAGIC.items():
        if data.startswith(magic):
            return words, False
    if not data.strip():
        return "", True
    if len(data) == _SEEN and not data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data[: data.rfind(b"\n") + 1] or data
    try:
        text, encoding = decoded(data)
    except InputError:
        return "", True
    try:
        dialect = dialect_of(text, encoding)
    except InputError:
        return "a table of another form", False
    ours = encoding.value in ("utf-8", "utf-8-sig") and dialect.separator.value in ",;\t" and not dialect.skip
    return dialect.words, ours and dialect.decimal in ("point", "either", "")
