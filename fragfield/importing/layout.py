"""Where the table of a sheet stands: names, units, rows of numbers, sums below them."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield.importing.cells import Numbers, decimal_of, is_unit, plain
from fragfield.importing.sheet import Guess, QuestionError, Refused, Row

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fragfield.importing.sheet import Cell, Sheet


_SAMPLE = 1000  # rows
_SUM = re.compile(r"(?:sub ?|grand )?totals?\b.*|sum|mean|average")
"""What a row is called that adds others up or averages them."""


@dataclass
class Layout:
    """A table: names and units of its columns, and its rows."""

    sheet: Sheet
    """What it is of."""
    names: list[str]
    """One a column, empty where there is none."""
    units: list[str]
    """From a row of units below the names, else empty."""
    rows: list[Row]
    """All of the same length."""
    numbers: Numbers
    """Reads its cells."""
    guesses: list[Guess]
    """Of the sheet and of the layout."""
    dropped: list[str]
    """What was left out, in words."""
    are_given: bool = False
    """Whether the caller has said which lines count."""
    above: list[str] = field(default_factory=list)
    """Lines above the names, and comments."""


def lay_out(sheet: Sheet, *, decimal: str | None = None, rows: str | None = None) -> Layout:
    """Find the table of a sheet.

    `decimal` is "point" or "comma", `rows` the lines of the file that hold the table with its names, as "3:18" or
    "3:18,22:30". Raises InputError without a row of numbers, `QuestionError` for several tables one under another.
    """
    kept = _of_lines(sheet, rows)
    width = max(len(row.cells) for row in kept)
    # Of two signs the one that makes numbers of more cells shows where the table stands; which is right comes after.
    some = [cell for row in kept[:_SAMPLE] for cell in row.cells]
    likely = max(("point", "comma"), key=lambda sign: sum(map(Numbers(sign).is_number, some)))
    trial = Numbers(decimal if decimal in ("point", "comma") else likely)
    first, last = _rows_of_numbers(sheet, kept, trial)
    names, units, used, guesses = _heads(kept[:first], width)
    body = kept[first : last + 1]
    between = [row for row in body if not _is_data(row, trial, 1, ranges=True)]
    dropped = [f"line {row.line}: {_shown(row)}" for row in kept[last + 1 :]]
    body, sums = _without_sums(body, trial)
    dropped += sums
    if others := [row for row in between if row in body]:
        raise QuestionError(
            f"{sheet.place(others[0].line)}: {_shown(others[0])} stands among the rows of numbers, as the names of "
            f"another table would; give the lines of one table, of which the first holds the names",
            "rows", [f"{kept[max(first - 1, 0)].line}:{others[0].line - 1}"],
        )  # fmt: skip
    if not body:
        raise InputError(f"{sheet.path}: no row of numbers but sums")
    _refuse_beyond_names(sheet, names, body)
    sign, guess = decimal_of(sheet, body, decimal)
    filled = [Row(row.line, [*row.cells, *[""] * (width - len(row.cells))]) for row in body]
    found = [*sheet.guesses, *guesses, *([guess] if guess is not None and not sheet.name else [])]
    above = [*sheet.comments, *(_words(row) for row in kept[:first] if row.line not in used)]
    if above:
        found.append(Guess("above the table", "; ".join(map(repr, above[:6])), "not read"))
    found.append(Guess("rows", f"{len(body)}, from line {body[0].line} to {body[-1].line}", "those with numbers"))
    return Layout(sheet, names, units, filled, Numbers(sign), found, dropped, rows is not None, above)


def _refuse_beyond_names(sheet: Sheet, names: Sequence[str], rows: Sequence[Row]) -> None:
    """Refuse rows with more cells than there are names: as where commas stand between cells and before decimals."""
    named = max((at + 1 for at, name in enumerate(names) if name), default=0)
    row = next((row for row in rows if any(cell != "" for cell in row.cells[named:])), None)
    if not named or row is None:
        return
    what = f"{sheet.place(row.line)}: {len(_filled(row))} cells below {named} name{'' if named == 1 else 's'}"
    if named == 1 and not sheet.name:
        raise QuestionError(f"{what}: two columns, or one with decimal commas", "separator", ("comma", "semicolon"))
    raise InputError(f"{what}; name every column, and export the table with semicolons where decimals have commas")


def _of_lines(sheet: Sheet, rows: str | None) -> list[Row]:
    if rows is None:
        return sheet.rows
    wanted: set[int] = set()
    for part in rows.split(","):
        match = re.fullmatch(r"\s*(\d{1,7})\s*(?::\s*(\d{1,7}))?\s*", part)
        if match is None or int(match[2] or match[1]) < int(match[1]):
            raise InputError(f"{sheet.path}: rows {rows!r}; allowed: lines of the file such as 3:18 or 3:18,22:30")
        wanted.update(range(int(match[1]), int(match[2] or match[1]) + 1))
    kept = [row for row in sheet.rows if row.line in wanted]
    if not kept:
        raise InputError(
            f"{sheet.path}: rows {rows}: all empty; the file's rows are {sheet.rows[0].line} to {sheet.rows[-1].line}"
        )
    return kept


def _filled(row: Row) -> list[Cell]:
    return [cell for cell in row.cells if cell != ""]


def _is_data(row: Row, numbers: Numbers, width: int, *, ranges: bool = False) -> bool:
    """Whether more than half of a row's cells are numbers, ranges or dates, and not far fewer than others have.

    One of them must be a number, unless `ranges` will do: those alone are names of columns as well.
    """
    cells = _filled(row)
    held = sum(isinstance(one, Refused) or numbers.is_number(one) or numbers.interval(one) is not None for one in cells)
    whole = 2 * len(cells) > width and 2 * held > len(cells)
    return whole and (ranges or any(numbers.is_number(one) for one in cells))


def _rows_of_numbers(sheet: Sheet, rows: Sequence[Row], numbers: Numbers) -> tuple[int, int]:
    """First and last row of numbers."""
    widths = Counter(len(_filled(row)) for row in rows if _is_data(row, numbers, 1))
    if not widths:
        raise InputError(f"{sheet.path}: no row of numbers in it; its first row is {_shown(rows[0])}")
    usual = widths.most_common(1)[0][0]
    held = [at for at, row in enumerate(rows) if _is_data(row, numbers, usual)]
    return held[0], held[-1]


def _heads(rows: Sequence[Row], width: int) -> tuple[list[str], list[str], set[int], list[Guess]]:
    """Names, units, and their lines, from the rows above those of numbers."""
    units = [""] * width
    used: set[int] = set()
    guesses: list[Guess] = []
    heads = [row for row in rows if 2 * len(_filled(row)) >= min(width, 4) or len(_filled(row)) == width]
    if heads and heads[-1] is rows[-1] and len(heads) > 1 and _are_units(heads[-1]):
        units = [_bare(cell) for cell in _padded(heads[-1], width)]
        guesses.append(Guess("units", f"line {heads[-1].line}", "the row below the names holds units alone"))
        used.add(heads[-1].line)
        heads = heads[:-1]
    if not heads:
        return [""] * width, units, used, [*guesses, Guess("names", "none", "no row of names above the numbers")]
    used.add(heads[-1].line)
    guesses.append(Guess("names", f"line {heads[-1].line}", "the row above the numbers"))
    return [_text(cell) for cell in _padded(heads[-1], width)], units, used, guesses


def _padded(row: Row, width: int) -> list[Cell]:
    return [*row.cells, *[""] * (width - len(row.cells))][:width]


def _text(cell: Cell) -> str:
    return cell.text if isinstance(cell, Refused) else f"{cell:.10g}" if isinstance(cell, float) else cell


def _bare(cell: Cell) -> str:
    return str(_text(cell)).strip(" []()-–/")


def _are_units(row: Row) -> bool:
    """Whether all cells of a row are units, or signs for none."""
    cells = [_bare(cell) for cell in _filled(row)]
    none = ("", "1", "#", "%", "n")
    return any(is_unit(cell) for cell in cells) and all(is_unit(cell) or cell in none for cell in cells)


def _without_sums(rows: list[Row], numbers: Numbers) -> tuple[list[Row], list[str]]:
    """Rows without those that add others up, known by their first text."""
    kept, dropped = [], []
    for row in rows:
        text = next((one for one in _filled(row) if isinstance(one, str) and not numbers.is_number(one)), "")
        if _SUM.fullmatch(plain(text)):
            dropped.append(f"line {row.line}: {_shown(row)} (a sum or a mean)")
        else:
            kept.append(row)
    return kept, dropped


def _words(row: Row) -> str:
    return " | ".join(str(_text(cell)) for cell in _filled(row))


def _shown(row: Row) -> str:
    text = _words(row)
    return repr(text if len(text) <= 60 else f"{text[:57]}...")
