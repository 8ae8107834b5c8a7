"""Columns of a sheet as quantities in our units: by their names, or as the caller says."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flight.files.text_tables import converted
from fragfield.errors import InputError
from fragfield.importing.sheet import Cell, Guess, QuestionError, Refused, Row, Sheet, letter
from fragfield_base.errors import names_allowed
from fragfield_base.units import UnitError, read_measure

Array = NDArray[np.float64]


class Quantity(NamedTuple):
    """A quantity of our tables: its SI unit, empty of a number, and what columns that hold it are called."""

    unit: str
    names: tuple[str, ...]


QUANTITIES = {
    name: Quantity(unit, (name.replace("_", " "), *names.split(", ")))
    for name, unit, names in (
        ("zone_from", "rad", "from, angle from, polar angle from, theta from, zone lower, lower angle"),
        ("zone_to", "rad", "to, angle to, polar angle to, theta to, zone upper, upper angle"),
        ("zone", "rad", "polar zone, polar angle, angle, theta, zone centre, zone center"),
        ("mass_from", "kg", "m from, m min, mass min, min mass, lower mass, weight from"),
        ("mass_to", "kg", "m to, m max, mass max, max mass, upper mass, weight to"),
        ("mass_group", "kg", "mass class, mass range, mass interval, weight group, class, group"),
        ("mass_above", "kg", "m >, mass >, heavier than, m above"),
        ("number", "", "n, count, number of fragments, fragments, pieces, number of pieces, number above"),
        ("mean_mass", "kg", "average mass, mass mean, m mean, mean weight, average weight"),
        ("total_mass", "kg", "mass total, sum of masses, m total, total weight, recovered mass"),
        ("mass", "kg", "m, weight, fragment mass, piece mass, fragment weight"),
        ("mean_speed", "m/s", "speed, velocity, v, v0, v mean, mean velocity, average speed, average velocity"),
        ("max_speed", "m/s", "v max, vmax, max velocity, maximum speed, maximum velocity, largest speed"),
    )
}  # fmt: skip
"""Quantities that columns may hold, by the names of `--column`."""
GROUPS = {"kg": "mass", "m/s": "speed", "rad": "angle"}
"""What `--unit GROUP=...` calls all quantities of one dimension."""
_LIKELY = {"kg": ("g", "kg", "grain"), "m/s": ("m/s", "ft/s"), "rad": ("deg", "rad")}
_ASKED = {"gr": ("g", "grain"), "mgr": ("mg", "g")}
_SIGNS = {"point": (r"\.", ","), "comma": (",", r"\.")}  # before decimals, between thousands
_NUMBER = {
    sign: re.compile(
        rf"[-+]?(?=[.,]?\d)(?:\d+|[1-9]\d{{0,2}}(?:{other}\d{{3}})+)?(?:{mark}\d*)?(?:e[-+]?\d+)?", re.IGNORECASE
    )
    for sign, (mark, other) in _SIGNS.items()
}
_TOKEN = r"\d[\d.,]*|[.,]\d+"
_LONE = re.compile(rf"[-+]?(?:{_TOKEN})(?:e[-+]?\d+)?", re.IGNORECASE)
_RANGE = re.compile(rf"({_TOKEN})\s*(?:-|\.\.|to\s)\s*({_TOKEN})|(<=?)\s*({_TOKEN})|>=?\s*({_TOKEN})", re.IGNORECASE)
_PART = re.compile(r"%|‰|percent|fraction", re.IGNORECASE)


class NotANumberError(ValueError):
    """A cell is not a number; the message follows the cell's place."""


def _bare(cell: str) -> str:
    """A cell with plain signs, without spaces and apostrophes between thousands."""
    text = re.sub(r"(?<=\d)[ \xa0\u202f\u2009'’](?=\d{3}(?!\d))", "", cell.strip())
    return re.sub("[−–—]", "-", text).replace("≤", "<").replace("≥", ">")


def _parts(cell: Cell) -> list[str]:
    """The numbers of a cell: itself, or those of a range; empty of any other text."""
    text = _bare(cell) if isinstance(cell, str) else ""
    if _LONE.fullmatch(text):
        return [text]
    match = _RANGE.fullmatch(text)
    return [one for one in match.group(1, 2, 4, 5) if one] if match else []


def number_of(cell: Cell, decimal: str) -> float:
    """A cell as a number; raises NotANumberError."""
    if isinstance(cell, Refused):
        raise NotANumberError(f"{cell.text!r} is {cell.reason}")
    if isinstance(cell, str):
        text = _bare(cell)
        if not _NUMBER[decimal].fullmatch(text):
            raise NotANumberError(
                f"{cell!r} is not a number{f' with a decimal {decimal}' if _LONE.fullmatch(text) else ''}"
            )
        cell = float(text.replace(".", "").replace(",", ".") if decimal == "comma" else text.replace(",", ""))
    if not math.isfinite(cell):
        raise NotANumberError(f"{cell} is not finite")
    return cell


def _range_of(cell: Cell, decimal: str) -> tuple[float, float] | None:
    """A range such as "0-5", "0.1 to 0.5", "< 1" or "> 50"; None of anything else."""
    match = _RANGE.fullmatch(_bare(cell)) if isinstance(cell, str) else None
    if match is None:
        return None
    numbers = [number_of(one, decimal) for one in _parts(cell)]
    return (0.0, numbers[0]) if match[3] else (numbers[0], numbers[1] if match[2] else math.inf)


def decimal_of(sheet: Sheet, rows: Sequence[Row], decimal: str | None) -> tuple[str, list[Guess]]:
    """Decimal sign of the rows of a table, and why.

    Raises InputError: cells contradict each other; `QuestionError` where none shows whether a mark stands before
    decimals or between thousands, as in 1.234.
    """
    if decimal is not None:
        if decimal not in _SIGNS:
            raise InputError(f"{sheet.path}: decimal {decimal!r}; allowed: point or comma")
        return decimal, [Guess("decimal sign", decimal, "as given")]
    found = [(row.line, one) for row in rows for cell in row.cells for one in _parts(cell) if "." in one or "," in one]
    shown: dict[str, tuple[int, str]] = {}
    for line, text in found:
        signs = [sign for sign, pattern in _NUMBER.items() if pattern.fullmatch(text)]
        if len(signs) == 1:
            shown.setdefault(signs[0], (line, text))
    if len(shown) == 2:
        words = " and ".join(
            f"{text!r} in line {line} (decimal {sign})" for sign, (line, text) in sorted(shown.items())
        )
        raise InputError(f"{sheet.path}: decimal signs contradict each other: {words}; write all numbers alike")
    if found and not shown:
        line, text = found[0]
        raise QuestionError(
            f"{sheet.place(line)}: {text!r} is {re.sub('[.,]', '.', text)} or {re.sub('[.,]', '', text)}, and no cell "
            "of the table shows which", "decimal", ("point", "comma"),
        )  # fmt: skip
    return next(
        ((sign, [Guess("decimal sign", sign, f"{text!r} shows it")]) for sign, (_, text) in shown.items()),
        ("point", []),
    )


def _measure(unit: str, dimension: str) -> float | None:
    try:
        found = read_measure(f"1 {'deg' if unit == '°' else unit}")
    except UnitError:
        return None
    return found.value if dimension and found.is_of(dimension) else None


def factor_of(unit: str, dimension: str, place: str) -> float:
    """Factor from a unit to SI.

    Raises InputError: it is none of the dimension; `QuestionError` where it has two meanings: "gr" is gram or grain,
    "Mg" of a header megagram or mg.
    """
    group = GROUPS[dimension]
    exact, lower = _measure(unit, dimension), _measure(unit.lower(), dimension)
    choices = _ASKED.get(unit.casefold(), ())
    if unit.startswith("M") and exact is not None and lower is not None and exact != lower:
        choices = (unit.lower(), "t" if unit == "Mg" else unit)
    if choices and dimension == "kg":
        raise QuestionError(
            f"{place}: the unit {unit!r} is {' or '.join(choices)}", "unit", [f"{group}={one}" for one in choices]
        )
    found = exact if exact is not None else lower
    if found is None:
        raise InputError(
            f"{place}: found the unit {unit!r}; allowed: one of {group}, such as {', '.join(_LIKELY[dimension])}"
        )
    return found


def _head(title: str) -> tuple[str, str]:
    """Plain name and unit of a column: of "Mass [g]" and "mass_g" these are "mass" and "g"."""

    def plain(text: str) -> str:
        return " ".join(re.sub(r"[^a-z0-9<>]+", " ", text.casefold().replace("θ", "theta")).split())

    def is_unit(text: str) -> bool:
        return text.casefold() in _ASKED or any(
            _measure(case, dimension) is not None for dimension in GROUPS for case in (text, text.lower())
        )

    if match := re.fullmatch(r"(.*?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]\s*(.*)", title):
        return plain(f"{match[1]} {match[3]}"), match[2] if is_unit(match[2]) else ""
    words = title.split("_")
    for count in (2, 1):
        if len(words) > count and is_unit("/".join(words[-count:])):
            return plain(" ".join(words[:-count])), "/".join(words[-count:])
    return plain(title), ""


class Columns:
    """The table of a sheet: rows of numbers below their names, and the columns that hold wanted quantities (`index`).

    `chosen` are columns (name or number from 1) by quantity, `units` by quantity or group (`GROUPS`), `decimal` is
    "point" or "comma", `lines` are those of the file that hold the table with its names, as "3:18".
    Raises InputError without a row of numbers, or for a column that is not there; `QuestionError` where two columns may
    be meant.
    """

    def __init__(
        self,
        sheet: Sheet,
        *,
        chosen: Mapping[str, str],
        units: Mapping[str, str],
        decimal: str | None,
        lines: str | None,
    ) -> None:
        self.sheet, self.chosen, self.units, self.are_given = sheet, chosen, units, lines is not None
        kept = _of_lines(sheet, lines)
        width = max(len(row.cells) for row in kept)
        first = next((at for at, row in enumerate(kept) if _is_data(row, width)), None)
        if first is None:
            raise InputError(f"{sheet.path}: no row of numbers in it; its first row is {_words(kept[0])!r}")
        self.rows = [Row(row.line, [*row.cells, *[""] * (width - len(row.cells))]) for row in kept[first:]]
        head = kept[first - 1].cells if first else []
        self.names = [
            str(cell.text if isinstance(cell, Refused) else cell) for cell in [*head, *[""] * (width - len(head))]
        ]
        if head and width > len(head):
            row = next(row for row in kept[first:] if len(row.cells) > len(head))
            raise InputError(
                f"{sheet.place(row.line)}: {len(row.cells)} cells below {len(head)} names; name every column, and say "
                "--separator semicolon where decimals have commas"
            )
        self.decimal, words = decimal_of(sheet, self.rows, decimal)
        self.above = [*sheet.comments, *(_words(row) for row in kept[: max(first - 1, 0)])]
        self.guesses = [*sheet.guesses, *words]
        if self.above:
            self.guesses.append(Guess("above the table", "; ".join(map(repr, self.above[:6])), "not read"))
        self.guesses.append(
            Guess("rows", f"{len(self.rows)}, from line {self.rows[0].line}", "from the first of numbers")
        )
        self.index: dict[str, int] = {}

    def meanings(self) -> list[str | None]:
        """The quantity that each column's name means; parts of a whole and numbers "per degree" mean none."""
        heads = [_head(title)[0] for title in self.names]
        named = [next((name for name, one in QUANTITIES.items() if head in one.names), None) for head in heads]
        return [
            None if name and (_PART.search(title) or ("/" in title and not QUANTITIES[name].unit)) else name
            for name, title in zip(named, self.names, strict=True)
        ]

    def find(self, wanted: Sequence[str]) -> None:
        """Fill `index` with the columns of the wanted quantities."""
        self.index = {name: self._column(name, text) for name, text in self.chosen.items() if name in wanted}
        taken = set(self.index.values())
        for at, name in enumerate(self.meanings()):
            if name is None or name not in wanted or name in self.chosen or at in taken:
                continue
            if name in self.index:
                other = self.index[name]
                raise QuestionError(
                    f"{self.sheet.path}: {name} may be {self.names[at]!r} or {self.names[other]!r} "
                    f"(columns {at + 1} and {other + 1})", "column", [f"{name}={other + 1}", f"{name}={at + 1}"],
                )  # fmt: skip
            self.index[name] = at
        self.guesses += [
            Guess(f"column {name}", repr(self._title(at)), "as given" if name in self.chosen else "by its name")
            for name, at in self.index.items()
        ]

    def _column(self, name: str, text: str) -> int:
        same = [at for at, title in enumerate(self.names) if title and title.casefold() == text.strip().casefold()]
        if len(same) > 1:
            choices = [f"{name}={at + 1}" for at in same]
            raise QuestionError(f"{self.sheet.path}: {len(same)} columns are called {text!r}", "column", choices)
        if same:
            return same[0]
        if text.isdigit() and 1 <= int(text) <= len(self.names):
            return int(text) - 1
        numbers = [str(at + 1) for at in range(len(self.names))]
        raise InputError(
            f"{self.sheet.path}: column {name}={text}{names_allowed(text, list(filter(None, self.names)) or numbers)}"
        )

    def __contains__(self, name: str) -> bool:
        return name in self.index

    def _title(self, at: int) -> str:
        return self.names[at] or f"column {letter(at) if self.sheet.name else at + 1}"

    def unused(self) -> list[str]:
        """The columns that mean nothing here, in words."""
        return [f"column {name!r}" for at, name in enumerate(self.names) if name and at not in self.index.values()]

    def place(self, row: int, name: str) -> str:
        """Where a cell stands."""
        at = self.index[name]
        return f"{self.sheet.place(self.rows[row].line, at)} ({self._title(at)})"

    def require(self, *names: str) -> None:
        """Refuse a table that lacks quantities; the message has all its columns and how to name one."""
        missing = [name for name in names if name not in self]
        if missing:
            titles = [repr(one) for one in self.names if one]
            have = f"found the columns {', '.join(titles)}" if titles else "found no names of columns"
            options = " ".join(f'--column {name}="{"NAME" if titles else 1}"' for name in missing)
            raise InputError(f"{self.sheet.path}: {', '.join(missing)} missing; {have}; say which: {options}")

    def values(self, name: str) -> Array:
        """A quantity in its SI unit, angles in degrees; NaN in empty cells.

        Raises InputError: a cell is not a number; `QuestionError` where its unit is not known.
        """
        array = np.full(len(self.rows), math.nan)
        for at, row in enumerate(self.rows):
            if (cell := row.cells[self.index[name]]) != "":
                try:
                    array[at] = number_of(cell, self.decimal)
                except NotANumberError as error:
                    raise InputError(f"{self.place(at, name)}: {error}; give the lines without it: --rows") from None
        return self._converted(name, array)

    def ranges(self, name: str) -> tuple[Array, Array] | None:
        """Lower and upper ends of ranges in the units of `values`, NaN in empty cells; None where there is no range."""
        found = np.full((len(self.rows), 2), math.nan)
        cells = [row.cells[self.index[name]] for row in self.rows]
        is_range = [_range_of(cell, self.decimal) for cell in cells]
        if not any(is_range):
            return None
        for at, (cell, one) in enumerate(zip(cells, is_range, strict=True)):
            if one is not None:
                found[at] = one
            elif cell != "":
                reason = (
                    f" is {cell.reason}"
                    if isinstance(cell, Refused)
                    else f" is no range of {name}; allowed: from and to, as 5-10"
                )
                raise InputError(
                    f"{self.place(at, name)}: {cell.text if isinstance(cell, Refused) else cell!r}{reason}"
                )
        low, high = self._converted(name, found.ravel()).reshape(-1, 2).T
        return low, high

    def whole(self, name: str, held: NDArray[np.bool_] | None = None) -> Array:
        """As `values`; raises InputError where a cell is empty in the rows that hold something."""
        values = self.values(name)
        bad = np.isnan(values) & (True if held is None else held)
        if bad.any():
            which = "every row" if held is None else "every row with fragments"
            raise InputError(f"{self.place(int(np.argmax(bad)), name)}: empty; needed: {name} in {which}")
        return values

    def refuse_sum(self, number: Array) -> None:
        """Refuse a last row that counts as many as all others together: it adds them up, without saying so."""
        if (
            not self.are_given
            and len(number) > 2
            and number[-1] > 0.0
            and abs(number[:-1].sum() / number[-1] - 1) < 1e-9
        ):
            raise QuestionError(
                f"{self.place(len(number) - 1, 'number')}: {number[-1]:g} is the sum of all rows above it, as in a row "
                "of sums; give the lines that count", "rows", [f"{max(self.rows[0].line - 1, 1)}:{self.rows[-2].line}"],
            )  # fmt: skip

    def _converted(self, name: str, values: Array) -> Array:
        quantity = QUANTITIES[name]
        if not quantity.unit:
            return values
        place, group = f"{self.sheet.path}: {name} ({self._title(self.index[name])})", GROUPS[quantity.unit]
        given = self.units.get(name) or self.units.get(group)
        text, reason = given or _head(self.names[self.index[name]])[1], "as given" if given else "in the column's name"
        if not text and group == "angle" and self._largest_angle() > 6.3:
            text, reason = "deg", "no angle in radians is as large"
        if not text:
            raise QuestionError(
                f"{place}: its unit is not said", "unit", [f"{group}={one}" for one in _LIKELY[quantity.unit]]
            )
        factor = factor_of(text, quantity.unit, place)
        guess = Guess(f"unit of {name}", text, reason)
        self.guesses += [guess] if guess not in self.guesses else []
        if group == "angle":
            factor = 1.0 if abs(math.degrees(factor) - 1.0) < 1e-12 else math.degrees(factor)
        return converted(values, factor)

    def _largest_angle(self) -> float:
        """Of all columns of angles, which have one unit where none is said."""
        columns = [at for name, at in self.index.items() if QUANTITIES[name].unit == "rad"]
        numbers = (one for row in self.rows for at in columns for one in _parts(row.cells[at]))
        floats = [cell for row in self.rows for at in columns if isinstance(cell := row.cells[at], float)]
        return max([*(number_of(one, self.decimal) for one in numbers), *floats], default=0.0)


def _words(row: Row) -> str:
    text = " | ".join(
        cell.text if isinstance(cell, Refused) else f"{cell:g}" if isinstance(cell, float) else cell
        for cell in row.cells
        if cell != ""
    )
    return text if len(text) <= 60 else f"{text[:57]}..."


def _of_lines(sheet: Sheet, lines: str | None) -> list[Row]:
    if lines is None:
        return sheet.rows
    wanted: set[int] = set()
    for part in lines.split(","):
        match = re.fullmatch(r"\s*(\d{1,7})\s*(?::\s*(\d{1,7}))?\s*", part)
        if match is None or int(match[2] or match[1]) < int(match[1]):
            raise InputError(f"{sheet.path}: rows {lines!r}; allowed: lines of the file such as 3:18 or 3:18,22:30")
        wanted.update(range(int(match[1]), int(match[2] or match[1]) + 1))
    kept = [row for row in sheet.rows if row.line in wanted]
    if not kept:
        span = f"{sheet.rows[0].line} to {sheet.rows[-1].line}"
        raise InputError(f"{sheet.path}: rows {lines}: all empty; the file's rows are {span}")
    return kept


def _is_data(row: Row, width: int) -> bool:
    """Whether half of the columns are filled, more than half of them with numbers or ranges, one at least a number."""
    cells = [cell for cell in row.cells if cell != ""]
    held = [not isinstance(cell, str) or len(_parts(cell)) for cell in cells]
    lone = any(not isinstance(cell, str) or _LONE.fullmatch(_bare(cell)) for cell in cells)
    return 2 * len(cells) >= width and 2 * sum(map(bool, held)) > len(cells) and lone
