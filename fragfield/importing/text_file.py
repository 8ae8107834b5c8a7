"""The sheet of a text file: CSV in any usual dialect."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield.importing.sheet import (
    DATE,
    MOST_BYTES,
    MOST_COLUMNS,
    Cell,
    Guess,
    QuestionError,
    Refused,
    Row,
    Sheet,
    checked_size,
    stripped,
)  # fmt: skip
from fragfield_base.errors import names_allowed
from fragfield_base.reading import read_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path


SEPARATORS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", " ": "space"}
"""What may stand between cells, and its name."""
ENCODINGS = ("cp1252", "latin-1", "mac_roman", "cp850")
"""Encodings of one byte a character that are tried where a file is not Unicode, the usual one first."""
COMMENT = ("#", "%", "//")
"""What a line begins with that is no row."""
_SAMPLE = 400  # lines
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_USUAL = {
    **dict.fromkeys("äöüßéèêàç°²³µ", 1.0), **dict.fromkeys("ÄÖÜÉÈÀÇâëïîôùûœ", 0.8),
    **dict.fromkeys("åøæÅØÆñáíóúÁÍÓÚ±×·–—’‘“”„«»½€§…\xa0", 0.5),
}  # fmt: skip
"""Letters and signs that names and units of columns have, by how usual they are."""
_SPACES = "\xa0\u202f\u2009"  # that stand between thousands
_NUMBER = re.compile(r"[-+−]?(?:\d[\d.,'’ \xa0\u202f\u2009]*|[.,]\d+)(?:[eE][-+−]?\d+)?")


@dataclass(frozen=True)
class Dialect:
    """How the text of a table is written."""

    encoding: Guess
    """Its value is a name that Python knows."""
    separator: Guess
    """Its value is the character between cells; of spaces any number count as one."""
    decimal: str
    """"point", "comma", "both" where cells contradict each other, "either" where nothing shows which, "" without
    any."""
    skip: int
    """Lines at the beginning that are no part of the table: `sep=;`."""

    @property
    def words(self) -> str:
        """One phrase for a message: "text in cp1252 with semicolons and decimal commas"."""
        decimal = {"point": " and decimal points", "comma": " and decimal commas"}.get(self.decimal, "")
        return f"text in {self.encoding.value} with {SEPARATORS[self.separator.value]}s between cells{decimal}"


def decoded(data: bytes, encoding: str | None = None) -> tuple[str, Guess]:
    """Text of a file and its encoding.

    Raises InputError: the bytes are no text in the given encoding, or not in any: a binary file; the message follows
    the file's name.
    """
    if encoding is not None:
        try:
            return data.decode(encoding).removeprefix("\ufeff"), Guess("encoding", encoding, "as given")
        except LookupError:
            raise InputError(
                f"encoding {encoding!r} is not known; allowed: utf-8, utf-16, cp1252, latin-1 ..."
            ) from None
        except UnicodeError as fault:
            raise InputError(f"not text in {encoding} ({fault})") from None
    for mark, name in _MARKS:
        if data.startswith(mark):
            return _decoded(data, name), Guess("encoding", name.removesuffix("-sig"), "byte-order mark")
    for name, first in (("utf-16-le", 1), ("utf-16-be", 0)):
        zeros, others = data[first:200:2], data[1 - first : 200 : 2]
        if len(zeros) > 1 and zeros.count(0) > 0.9 * len(zeros) and not others.count(0):
            return _decoded(data, name), Guess("encoding", name, "every second byte is zero")
    if data[:10_000].count(0):
        raise InputError("not a text: it holds bytes of zero")
    try:
        return data.decode("utf-8"), Guess("encoding", "utf-8", "valid UTF-8")
    except UnicodeDecodeError:
        return _of_one_byte(data)


def _decoded(data: bytes, encoding: str) -> str:
    try:
        return data.decode(encoding).removeprefix("\ufeff")
    except UnicodeError as fault:
        raise InputError(f"begins as text in {encoding}, but is none ({fault})") from None


def _of_one_byte(data: bytes) -> tuple[str, Guess]:
    """The encoding in which most of the characters beyond ASCII are those that names and units of columns have."""
    beyond = Counter(byte for byte in data if byte > 127)
    best, likeness = ENCODINGS[0], -1.0
    for name in ENCODINGS:
        try:
            data.decode(name)
        except UnicodeDecodeError:
            continue
        score = sum(number * _USUAL.get(bytes([byte]).decode(name), 0.0) for byte, number in beyond.items())
        if score > likeness + 1e-9:
            best, likeness = name, score
    return data.decode(best), Guess(
        "encoding", best, "not UTF-8; its letters and signs are usual ones in this encoding"
    )


def split_line(line: str, separator: str) -> list[str]:
    """Cells of a line, quotes taken off."""
    if separator == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error as error:
        raise InputError(f"no table: {error}") from None


def dialect_of(text: str, encoding: Guess, separator: str | None = None) -> Dialect:
    """Dialect of a text; raises InputError where two separators fit equally, the message names them."""
    lines = text.split("\n", _SAMPLE + 1)[:_SAMPLE]
    skip = 0
    declared = re.fullmatch(r'"?sep=(.)"?\s*', lines[0], flags=re.IGNORECASE) if lines else None
    if declared is not None:
        skip, lines = 1, lines[1:]
    rows = [line.rstrip("\r") for line in lines if line.strip() and not line.lstrip().startswith(COMMENT)]
    if separator is not None:
        chosen = Guess("separator", separator, "as given")
    elif declared is not None:
        chosen = Guess("separator", declared[1], f"the line sep={declared[1]}")
    else:
        chosen = _separator(rows)
    if chosen.value not in SEPARATORS:
        raise InputError(f"separator {chosen.value!r}; allowed: {', '.join(SEPARATORS.values())}")
    cells = [cell for row in rows for cell in split_line(row, chosen.value)]
    return Dialect(encoding, chosen, decimal_marks(cells)[0], skip)


def _separator(rows: Sequence[str]) -> Guess:
    """The separator by which most rows have as many cells as each other, and most of these are numbers or names."""
    scores = {mark: _likeness(rows, mark) for mark in SEPARATORS}
    best = max(scores.values(), default=0.0)
    if best <= 0.0:
        return Guess("separator", ",", "a single column")
    fitting = [mark for mark, score in scores.items() if score > best - 1e-9]
    # Among equals the one that the first line has: names seldom hold one.
    if len(fitting) > 1:
        heads = [mark for mark in fitting if len(split_line(rows[0], mark)) > 1]
        fitting = heads or fitting
    if len(fitting) > 1 and " " in fitting and len({len(split_line(rows[0], mark)) for mark in fitting}) == 1:
        fitting = [mark for mark in fitting if mark != " "]
    if len(fitting) > 1 and any(map(str.isdigit, "".join(rows))):
        names = " and ".join(SEPARATORS[mark] for mark in fitting)
        raise InputError(f"{names} divide its rows equally well; say which: --separator")
    count = len(split_line(rows[-1], fitting[0]))
    return Guess("separator", fitting[0], f"divides the rows into {count} cells of numbers or names")


def _likeness(rows: Sequence[str], mark: str) -> float:
    """Fraction of rows with the commonest number of cells (two or more), times that of clean cells in these."""
    parts = [split_line(row, mark) for row in rows]
    count, rows_alike = Counter(len(cells) for cells in parts).most_common(1)[0] if parts else (0, 0)
    if count < 2:
        return 0.0
    cells = [cell for cells in parts if len(cells) == count for cell in cells]
    numbers = sum(_NUMBER.fullmatch(cell) is not None for cell in cells)
    clean = sum(not any(other in cell for other in ";\t|") for cell in cells if not _NUMBER.fullmatch(cell))
    return rows_alike / len(parts) * (numbers + 0.5 * clean) / len(cells)


def decimal_marks(cells: Iterable[str]) -> tuple[str, dict[str, str]]:
    """Decimal sign of cells, and for "point" and "comma" the first cell that shows it.

    "1.5", "0,125", "1.234,5" and "1,234,567" show it; "1.234" does not: 1.234, or 1234 with a mark between thousands.
    """
    shown: dict[str, str] = {}
    either = False
    for cell in cells:
        bare = cell.strip().lstrip("-+−")
        if not _NUMBER.fullmatch(bare) or not ("." in bare or "," in bare):
            continue
        mark = _shown_decimal(bare)
        if mark:
            shown.setdefault(mark, cell)
        else:
            either = True
    if len(shown) == 2:
        return "both", shown
    return next(iter(shown), "either" if either else ""), shown


def _shown_decimal(number: str) -> str:
    digits = re.split(r"[eE]", number)[0]
    for space in (*_SPACES, " ", "'", "’"):
        digits = digits.replace(space, "")
    other = {".": "comma", ",": "point"}
    name = {".": "point", ",": "comma"}
    last = max(digits.rfind("."), digits.rfind(","))
    mark = digits[last]
    if digits.count(".") and digits.count(","):
        return name[mark]
    if digits.count(mark) > 1:
        return other[mark]
    before, after = digits[:last], digits[last + 1 :]
    may_be_thousands = len(after) == 3 and 1 <= len(before) <= 3 and not before.startswith("0")
    return "" if may_be_thousands and "e" not in number.lower() else name[mark]


SEPARATOR_NAMES = {name: mark for mark, name in SEPARATORS.items()}


def read_text_file(path: Path, encoding: str | None = None, separator: str | None = None) -> Sheet:
    """Read a text file as rows of cells.

    Raises InputError: no such file, not a text, too large, or nothing in it; `QuestionError` where two separators fit
    equally well.
    """
    data = read_bytes(path, InputError, most=MOST_BYTES)
    try:
        text, found = decoded(data, encoding)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    mark = _mark(path, separator)
    try:
        dialect = dialect_of(text, found, mark)
    except InputError as error:
        what = str(error).split(";")[0]
        if "--separator" not in str(error):
            raise InputError(f"{path}: {what}") from None
        raise QuestionError(f"{path}: {what}", "separator", list(SEPARATOR_NAMES)) from None
    guesses = [found, Guess("separator", SEPARATORS[dialect.separator.value], dialect.separator.reason)]
    rows, comments = _rows(path, text, dialect.separator.value, dialect.skip)
    if not rows:
        raise InputError(f"{path}: no table in it, only {'comments' if comments else 'empty lines'}")
    return Sheet(path, "", rows, guesses, comments, dialect.decimal)


def _mark(path: Path, separator: str | None) -> str | None:
    if separator is None or separator in SEPARATORS:
        return separator
    if separator in SEPARATOR_NAMES:
        return SEPARATOR_NAMES[separator]
    raise InputError(f"{path}: separator {separator!r}{names_allowed(separator, SEPARATOR_NAMES)}")


def _rows(path: Path, text: str, separator: str, skip: int) -> tuple[list[Row], list[str]]:
    rows: list[Row] = []
    comments: list[str] = []
    number = 0
    for line, cells in _split(path, text, separator):
        if line <= skip or not any(cells):
            continue
        if cells[0].startswith(COMMENT):
            comments.append(separator.join(cells).lstrip("#%/ ").rstrip(f"{separator} "))
            continue
        if len(cells) > MOST_COLUMNS:
            checked_size(path, 1, len(cells))
        number += len(cells)
        rows.append(Row(line, [_cell(cell) for cell in cells]))
        if number > MOST_COLUMNS:
            checked_size(path, 1 + number // MOST_COLUMNS, MOST_COLUMNS)
    return rows, comments


def _split(path: Path, text: str, separator: str) -> list[tuple[int, list[str]]]:
    """Lines and cells; a quoted cell may go over several lines."""
    if separator == " ":
        return [(number, line.split()) for number, line in enumerate(text.split("\n"), 1)]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    found: list[tuple[int, list[str]]] = []
    try:
        line = 1
        for cells in reader:
            found.append((line, [str(stripped(cell)) for cell in cells]))
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num}: {error}") from None
    return found


def _cell(text: str) -> Cell:
    if text and DATE.fullmatch(text):
        return Refused(text, "a date, what a spreadsheet makes of entries such as 3.5 or 5-10: the number is lost")
    return text
