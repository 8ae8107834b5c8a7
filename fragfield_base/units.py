"""Units of measurement: texts such as "155 mm", "1.71 g/cm^3" or "1 / (55.7 m^2)" as numbers in SI.

    value   = [sign] product
    product = factor { ("*" | "/" | " ") factor }, from left to right
    factor  = number | unit [ ("^" | "**") exponent ] | "(" product ")"

The table of units, units.toml, is closed: a unit that is not in it is an error that names the nearest one.
"""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import NamedTuple

from fragfield_base.errors import nearest_name

MOST_CHARACTERS = 120
_MOST_DEPTH = 4

TABLE = tomllib.loads(Path(__file__).with_name("units.toml").read_text(encoding="utf-8"))
DIMENSIONS: dict[str, str] = {symbol: one["name"] for symbol, one in TABLE["dimensions"].items() if symbol}
"""What a dimension is called in a message, by its SI unit."""

Powers = tuple[int, int, int, int, int]
"""Powers of m, kg, s, rad and K."""

_BASE = ("m", "kg", "s", "rad", "K")
_NONE: Powers = (0, 0, 0, 0, 0)


class UnitError(ValueError):
    """A text is not a number with a unit; the message follows the text that was found."""


class Measure(NamedTuple):
    """A number in SI, and the powers of its unit."""

    value: float
    powers: Powers

    def is_of(self, symbol: str) -> bool:
        """Whether it has the dimension of an SI unit."""
        return self.powers == _powers_of(symbol)


def degrees(angle: float) -> float:
    """An angle of so many degrees in radians: the very float that "20 deg" is read as."""
    return _rounded(math.radians(angle))


def dimension_words(measure: Measure) -> str:
    """What a measure is, with its article: "a length"."""
    if not any(measure.powers):
        return "a number without a unit"
    name = next((name for symbol, name in DIMENSIONS.items() if measure.powers == _powers_of(symbol)), None)
    if name is None:
        unit = " ".join(f"{base}^{power}" for base, power in zip(_BASE, measure.powers, strict=True) if power)
        return f"a quantity in {unit}"
    return with_article(name)


def with_article(name: str) -> str:
    """A name with its article."""
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


def read_measure(text: str) -> Measure:
    """Read a number with its unit; raises UnitError with the reason in words that follow the text."""
    if len(text) > MOST_CHARACTERS:
        raise UnitError(f"which has {len(text)} characters, more than any value needs ({MOST_CHARACTERS})")
    if _COMMA.search(text):
        raise UnitError("which has a comma; a number has a decimal point, and no sign between thousands")
    reader = _Reader(text)
    sign = reader.sign()
    number, factor, powers = reader.product(0)
    if reader.at < len(reader.text):
        raise UnitError(
            "which is a sum; a value is one number with its unit"
            if reader.text[reader.at] in "+-"
            else "which has parentheses that do not fit"
        )
    value = sign * number
    return Measure(value if factor == 1.0 else _rounded(value * factor), powers)


def _rounded(number: float) -> float:
    """What came out of a change of units, to 15 digits: "120 us" is 1.2e-4 s, not 1.1999999999999999e-4."""
    return float(f"{number:.15g}")


_POWERS: dict[str, Powers] = {}


def _powers_of(symbol: str) -> Powers:
    if symbol not in _POWERS:
        _POWERS[symbol] = _Reader(f"1 {symbol}" if symbol[0] != "1" else symbol).product(0)[2]
    return _POWERS[symbol]


_NUMBER = re.compile(r"(?:\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})(?:[eE][-+]?\d{1,4})?(?![\d.])")
_ONE_OVER = re.compile(r"1\s*/")  # of "100 1/s"
_COMMA = re.compile(r"\d,\d")
_NAME = re.compile(r"[^\W\d]\w{0,39}|°")
_EXPONENT = re.compile(r"\s*(?:\*\*|\^)\s*([-+]?\d(?![\d.eE])|\(\s*[-+]?\d\s*\))")
_RAISED = re.compile(r"\s*(?:\*\*|\^)")
_POWER_AT_END = re.compile(r"(.*[A-Za-z])([23])")  # "kg/m3" as people write it

_Factor = tuple[float, float, Powers]
"""Number, unit in SI, and its powers."""


class _Reader:
    """Reads a text from left to right."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text.rstrip(), 0

    def _skip(self) -> str:
        """The next sign that is no space; empty at the end."""
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1
        return self.text[self.at : self.at + 1]

    def sign(self) -> float:
        if (found := self._skip()) and found in "+-":
            self.at += 1
        return -1.0 if found == "-" else 1.0

    def product(self, depth: int) -> _Factor:
        number, factor, powers = self._factor(depth)
        while (sign := self._skip()) and sign not in ")+-":
            if sign in "*/":
                self.at += 1
            elif _NUMBER.match(self.text, self.at) and not _ONE_OVER.match(self.text, self.at):
                # of "1 500 kg" the product would be 500 kg
                raise UnitError("which has two numbers side by side; a number has no space between thousands")
            one = self._factor(depth)
            power = -1 if sign == "/" else 1
            try:
                number, factor = number * one[0] ** power, factor * one[1] ** power
            except ZeroDivisionError:
                raise UnitError("which divides by zero") from None
            powers = _product(powers, one[2], power)
        return number, factor, powers

    def _factor(self, depth: int) -> _Factor:
        if self._skip() == "(":
            if depth == _MOST_DEPTH:
                raise UnitError("which has parentheses that do not fit")
            self.at += 1
            found = self.product(depth + 1)
            if self._skip() != ")":
                raise UnitError("which has parentheses that do not fit")
            self.at += 1
        elif (match := _NUMBER.match(self.text, self.at)) is not None:
            self.at = match.end()
            found = float(match[0]), 1.0, _NONE
        elif (match := _NAME.match(self.text, self.at)) is not None:
            self.at = match.end()
            return self._unit(match[0])
        else:
            raise UnitError("which is not a number with a unit")
        if _RAISED.match(self.text, self.at):
            raise UnitError("which takes a power of a number; only units have powers")
        return found

    def _unit(self, name: str) -> _Factor:
        power = 1
        if (match := _POWER_AT_END.fullmatch(name)) is not None and name not in UNITS:
            name, power = match[1], int(match[2])
        elif _RAISED.match(self.text, self.at):
            raised = _EXPONENT.match(self.text, self.at)
            if raised is None:
                raise UnitError("which has a unit with a power that is no whole number from -9 to 9")
            self.at, power = raised.end(), int(raised[1].strip("() "))
        found = UNITS.get(name) or UNITS.get(name.removesuffix("s") if len(name) > 3 else "")  # "meters"
        if found is None:
            close = nearest_name(name, [*UNITS, *(f"{prefix}meter" for prefix in ("micro", "kilo"))], likeness=0.6)
            hint = f' (did you mean "{close}"?)' if close is not None else ""
            raise UnitError(f'with the unknown unit "{name}"{hint}')
        return 1.0, found[0] ** power, _product(_NONE, found[1], power)


def _product(one: Powers, other: Powers, power: int) -> Powers:
    a, b, c, d, e = (mine + power * yours for mine, yours in zip(one, other, strict=True))
    return (a, b, c, d, e)


def _known_units() -> dict[str, tuple[float, Powers]]:
    known: dict[str, tuple[float, Powers]] = {}
    for dimension, units in TABLE["with_prefix"].items():
        for name, factor in units.items():
            known |= {
                f"{prefix}{name}": (float(f"{scale * factor:.15g}"), _powers_of(dimension))
                for prefix, scale in TABLE["prefixes"].items()
                if (len(prefix) > 2) == (len(name) > 3) or name == "bar"  # "kilometre" and "km", no "kmetre"
            }
            known[name] = factor, _powers_of(dimension)
    known["kilogram"] = known["kg"]
    for dimension, units in TABLE["alone"].items():
        known |= {name: (factor, _powers_of(dimension)) for name, factor in units.items()}
    return known


UNITS: dict[str, tuple[float, Powers]] = {
    "m": (1.0, (1, 0, 0, 0, 0)),
    "kg": (1.0, (0, 1, 0, 0, 0)),
    "s": (1.0, (0, 0, 1, 0, 0)),
    "rad": (1.0, (0, 0, 0, 1, 0)),
    "K": (1.0, (0, 0, 0, 0, 1)),
}
UNITS |= _known_units()
"""By name: the unit in SI, and its powers of m, kg, s, rad and K."""
