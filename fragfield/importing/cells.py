"""Cells of tables of tests: names of columns, units, numbers, ranges, decimal signs."""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from fragfield.errors import InputError
from fragfield.importing.sheet import Guess, QuestionError, Refused
from fragfield_base.units import Measure, UnitError, read_measure

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from fragfield.importing.sheet import Cell, Row, Sheet


GROUPS = {"kg": "mass", "m/s": "speed", "rad": "angle"}
"""What `--unit GROUP=...` calls all quantities of one dimension."""
_LIKELY = {"kg": ("g", "kg", "grain"), "m/s": ("m/s", "ft/s"), "rad": ("deg", "rad")}


class Quantity(NamedTuple):
    """A quantity of our tables: its SI unit, empty of a number, and what columns that hold it are called."""

    unit: str
    names: tuple[str, ...]

    @property
    def likely(self) -> tuple[str, ...]:
        """Units to choose from in a question."""
        return _LIKELY.get(self.unit, (self.unit,))


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

_UNIT_WORDS = {"°": "deg", "gr": "gr?", "mgr": "mg?", "grs": "grain", "ftps": "ft/s", "m s-1": "m/s", "lbm": "lb"}
"""Units as units.py does not have them; those with a question mark have the meanings of `_ASKED`."""
_ASKED = {"gr?": ("g", "grain"), "mg?": ("mg", "g")}


@lru_cache(maxsize=4096)
def plain(text: str) -> str:
    """A name in lower case without signs and double spaces: "Mean mass / Zone" is "mean mass zone"."""
    return " ".join(re.sub(r"[^a-z0-9<>]+", " ", text.casefold().replace("θ", "theta")).split())


@lru_cache(maxsize=4096)
def _measure(unit: str) -> Measure | None:
    try:
        found = read_measure(f"1 {unit}")
    except UnitError:
        return None
    return found if any(found.powers) else None


def is_unit(text: str) -> bool:
    """Whether a text is a unit as a header may have it, ambiguous ones included."""
    return bool(text) and (
        text.casefold() in _UNIT_WORDS or _measure(text) is not None or _measure(text.lower()) is not None
    )


def unit_of(text: str, quantity: Quantity, place: str, name: str) -> float | None:
    """Factor from a unit to SI for a quantity; None where it is of another dimension.

    Raises QuestionError: the unit has two meanings: "gr" is gram or grain, "Mg" of a header megagram or mg.
    """
    word = _UNIT_WORDS.get(text.casefold(), text)
    if word in _ASKED:
        choices = _ASKED[word]
        if quantity.unit != "kg":
            return None
        raise QuestionError(
            f"{place}: the unit {text!r} is {' or '.join(choices)}", "unit", [f"{name}={one}" for one in choices]
        )
    exact, lower = _measure(word), _measure(word.lower())
    found = exact if exact is not None else lower
    if found is None or not quantity.unit or not found.is_of(quantity.unit):
        return None
    if word.startswith("M") and exact is not None and lower is not None and lower != exact:
        raise QuestionError(
            f"{place}: the unit {text!r} is 10^6 or 10^-3 of its base", "unit",
            [f"{name}={text.lower()}", f"{name}={'t' if text == 'Mg' else text}"],
        )  # fmt: skip
    return found.value


class Head(NamedTuple):
    """A way to read a column's name: the plain name, and the unit that stands in it."""

    name: str
    unit: str


def read_head(text: str) -> list[Head]:
    """Ways to read a column's name, the surest first: "Mass [g]", "v in m/s", "mass_g", "m/kg", "Mass"."""
    heads: list[Head] = []
    text = text.strip()
    if match := re.fullmatch(r"(.*?)\s*[\[({<]\s*([^\[\]{}<>]*?)\s*[\])}>]\s*(.*)", text):
        rest = f"{match[1]} {match[3]}".strip()
        if is_unit(match[2]):
            heads.append(Head(plain(rest), match[2]))
            heads += [Head(one.name, match[2]) for one in read_head(rest) if not one.unit]
        heads.append(Head(plain(rest), ""))
        heads += [one for one in read_head(rest) if rest]
    for pattern in (r"(.+?)\s+in\s+(\S.*)", r"(.+?)\s*,\s*(\S.*)", r"(.+?)\s*/\s*(\S.*)", r"(.+?)\s+(\S+)"):
        match = re.fullmatch(pattern, text)
        if match and is_unit(match[2].strip("()[]")):
            heads.append(Head(plain(match[1]), match[2].strip("()[]")))
    words = text.split("_")
    for count in (2, 1):
        unit = "/".join(words[-count:])
        if len(words) > count and is_unit(unit):
            heads.append(Head(plain(" ".join(words[:-count])), unit))
    heads.append(Head(plain(text), ""))
    return heads


_SPACES = re.compile(r"(?<=\d)[ \xa0\u202f\u2009'’](?=\d{3}(?!\d))")
_PLAIN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_WITH_UNIT = re.compile(r"([-+−]?[\d.,'’ \xa0\u202f\u2009]*\d[.,]?(?:[eE][-+−]?\d+)?)\s*([^\d\s.,].*)")
_TO = r"(?:\s*(?:\.\.+|…|–|—|-|:|;)\s*|\s+(?:to|and)\s+)"
_SIDE = r"[\[(]?\s*(?P<{0}>[\d.,'’\xa0\u202f]*\d[.,]?)\s*(?P<{0}unit>[^\W\d_]+|°|µ\w+)?\s*[\])]?"
_RANGE = re.compile(_SIDE.format("low") + _TO + _SIDE.format("high"), re.IGNORECASE)
_BELOW = re.compile(r"(?:<=?|≤|up to|under|below|less than)\s*" + _SIDE.format("high"), re.IGNORECASE)
_ABOVE = re.compile(
    r"(?:>=?|≥|over|above|more than)\s*" + _SIDE.format("low") + "|" + _SIDE.format("more") + r"\s*(?:\+|and over)",
    re.IGNORECASE,
)


class NotANumberError(ValueError):
    """A cell is not a number; the message follows the cell's place."""


class Interval(NamedTuple):
    """A range of a quantity, and the unit that stands in it."""

    low: float
    high: float
    unit: str


class Numbers:
    """Reads cells with one decimal sign, "point" or "comma"."""

    def __init__(self, decimal: str) -> None:
        self.decimal = decimal

    def value(self, cell: Cell) -> float:
        """A cell as a number; raises NotANumberError."""
        if isinstance(cell, Refused):
            raise NotANumberError(f"{cell.text!r} is {cell.reason}")
        if isinstance(cell, float):
            if not math.isfinite(cell):
                raise NotANumberError(f"{cell} is not finite")
            return cell
        text = _SPACES.sub("", cell.strip()).replace("−", "-")
        mark, other = (",", ".") if self.decimal == "comma" else (".", ",")
        if other in text:
            groups = text.lstrip("+-").split(mark)[0].split(other)
            if (
                not (1 <= len(groups[0]) <= 3 and all(len(one) == 3 for one in groups[1:]))
                or other in text.partition(mark)[2]
            ):
                raise NotANumberError(f"{cell!r} is not a number with a decimal {self.decimal}")
            text = text.replace(other, "")
        text = text.replace(mark, ".")
        if not _PLAIN.fullmatch(text):
            raise NotANumberError(f"{cell!r} is not a number")
        return float(text)

    def is_number(self, cell: Cell) -> bool:
        """Whether a cell is a number, or one with a unit behind it."""
        try:
            self.with_unit(cell)
        except NotANumberError:
            return False
        return True

    def has_unit(self, cell: Cell) -> bool:
        """Whether a cell is a number with something behind it."""
        return self.is_number(cell) and bool(self.with_unit(cell)[1])

    def or_zero(self, cell: Cell) -> float:
        """A cell as a number, zero of what is none."""
        return self.with_unit(cell)[0] if self.is_number(cell) else 0.0

    def with_unit(self, cell: Cell) -> tuple[float, str]:
        """A number and the unit behind it, as in "12.5 g"; raises NotANumberError."""
        if isinstance(cell, str) and (match := _WITH_UNIT.fullmatch(cell.strip())) and is_unit(match[2].strip()):
            return self.value(match[1]), match[2].strip()
        return self.value(cell), ""

    def interval(self, cell: Cell, *, bare: str = "") -> Interval | None:
        """A range such as "0-5", "0.1 to 0.5 g", "< 1" or "> 50 g"; None of anything else."""
        if not isinstance(cell, str):
            return None
        text = cell.strip()
        if match := _RANGE.fullmatch(text):
            low, high = self.value(match["low"]), self.value(match["high"])
            return Interval(low, high, match["highunit"] or match["lowunit"] or bare)
        if match := _BELOW.fullmatch(text):
            return Interval(0.0, self.value(match["high"]), match["highunit"] or bare)
        if match := _ABOVE.fullmatch(text):
            name = "low" if match["low"] else "more"
            return Interval(self.value(match[name]), math.inf, match[f"{name}unit"] or bare)
        return None


_NUMBER = re.compile(r"[-+−]?(?:\d[\d.,'’ \xa0\u202f\u2009]*|[.,]\d+)(?:[eE][-+−]?\d+)?")
_THIN_SPACES = "\xa0\u202f\u2009"  # that stand between thousands


def _decimal_marks(cells: Iterable[str]) -> tuple[str, dict[str, str]]:
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
    for space in (*_THIN_SPACES, " ", "'", "’"):
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


def decimal_of(sheet: Sheet, rows: Sequence[Row], decimal: str | None) -> tuple[str, Guess | None]:
    """Decimal sign of the rows of a table, and why.

    Raises InputError: cells contradict each other; `QuestionError` where none shows whether a mark stands before
    decimals or between thousands, as in 1.234.
    """
    if decimal is not None:
        if decimal not in ("point", "comma"):
            raise InputError(f"{sheet.path}: decimal {decimal!r}; allowed: point or comma")
        return decimal, Guess("decimal sign", decimal, "as given")
    cells = [(row.line, part) for row in rows for cell in row.cells if isinstance(cell, str) for part in _parts(cell)]
    found, shown = _decimal_marks(part for _, part in cells)
    if found == "both":
        lines = {name: next(line for line, part in cells if part == cell) for name, cell in shown.items()}
        words = " and ".join(f"{shown[name]!r} in line {lines[name]} (decimal {name})" for name in sorted(shown))
        raise InputError(f"{sheet.path}: decimal signs contradict each other: {words}; write all numbers alike")
    if found == "either":
        line, cell = next((line, part) for line, part in cells if "." in part or "," in part)
        mark = "." if "." in cell else ","
        raise QuestionError(
            f"{sheet.place(line)}: {cell!r} is {cell.replace(mark, '.')} or {cell.replace(mark, '')}, and no cell of "
            "the table shows which",
            "decimal", ("point", "comma"),
        )  # fmt: skip
    if not found:
        return "point", None
    return found, Guess("decimal sign", found, f"{shown[found]!r} shows it")


def _parts(cell: str) -> list[str]:
    """The numbers of a cell: of a range both, of a number with a unit the number."""
    return re.findall(r"\d[\d.,'’ \xa0\u202f\u2009]*\d(?:[eE][-+]?\d+)?|\d", cell)
