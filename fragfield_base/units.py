"""Units of measurement: texts such as "155 mm", "1.71 g/cm^3" or "1 / (55.7 m^2)" as numbers in SI.

    value   = [sign] product
    product = factor { ("*" | "/" | " ") factor }, from left to right
    factor  = number | unit [ ("^" | "**") exponent ] | "(" product ")"

The table of units is closed: a unit that is not in it is an error that names the nearest one.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from fragfield_base.names import nearest_name

__all__ = ["DIMENSIONS", "MOST_CHARACTERS", "Measure", "UnitError", "degrees", "dimension_words", "read_measure"]

MOST_CHARACTERS = 120
_MOST_DEPTH = 4

DIMENSIONS = {
    "m": "length",
    "m^2": "area",
    "m^3": "volume",
    "s": "time",
    "kg": "mass",
    "m/s": "speed",
    "m/s^2": "acceleration",
    "kg/m^3": "density",
    "kg/m^2": "mass per area",
    "Pa": "pressure",
    "J": "energy",
    "J/kg": "energy per mass",
    "J/m^2": "energy per area",
    "J/m^3": "energy per volume",
    "1/m^2": "number per area",
    "rad": "angle",
    "K": "temperature",
    "W": "power",
    "N": "force",
    "1/s": "rate",
}
"""What a dimension is called in a message, by its SI unit. Pressure comes before energy per volume, which is alike."""

Powers = tuple[int, int, int, int, int]
"""Powers of m, kg, s, rad and K."""

_BASE = ("m", "kg", "s", "rad", "K")
_NONE: Powers = (0, 0, 0, 0, 0)
_LENGTH, _MASS, _TIME = (1, 0, 0, 0, 0), (0, 1, 0, 0, 0), (0, 0, 1, 0, 0)
_ANGLE, _KELVIN = (0, 0, 0, 1, 0), (0, 0, 0, 0, 1)
_AREA, _VOLUME, _SPEED = (2, 0, 0, 0, 0), (3, 0, 0, 0, 0), (1, 0, -1, 0, 0)
_FORCE, _PRESSURE, _ENERGY, _POWER = (1, 1, -2, 0, 0), (-1, 1, -2, 0, 0), (2, 1, -2, 0, 0), (2, 1, -3, 0, 0)
_INCH, _FOOT, _POUND, _GRAVITY = 0.0254, 0.3048, 0.45359237, 9.80665

_METRIC: dict[Powers, dict[str, float]] = {
    _LENGTH: {"m": 1.0, "meter": 1.0, "metre": 1.0},
    _MASS: {"g": 1e-3, "gram": 1e-3},
    _TIME: {"s": 1.0, "sec": 1.0, "second": 1.0},
    _VOLUME: {"l": 1e-3, "L": 1e-3, "liter": 1e-3, "litre": 1e-3},
    _FORCE: {"N": 1.0, "newton": 1.0},
    _PRESSURE: {"Pa": 1.0, "pascal": 1.0, "bar": 1e5},
    _ENERGY: {"J": 1.0, "joule": 1.0, "cal": 4.184, "calorie": 4.184},
    _POWER: {"W": 1.0, "watt": 1.0},
    _ANGLE: {"rad": 1.0, "radian": 1.0},
    _KELVIN: {"K": 1.0, "kelvin": 1.0},
    (0, 0, -1, 0, 0): {"Hz": 1.0, "hertz": 1.0},
}
"""Units that take a prefix."""
_OTHER: dict[Powers, dict[str, float]] = {
    _LENGTH: {
        "in": _INCH, "inch": _INCH, "inches": _INCH, "ft": _FOOT, "foot": _FOOT, "feet": _FOOT, "yd": 0.9144,
        "yard": 0.9144, "mi": 1609.344, "mile": 1609.344, "nmi": 1852.0, "nautical_mile": 1852.0, "thou": 1e-3 * _INCH,
        "micron": 1e-6, "angstrom": 1e-10, "survey_foot": 1200.0 / 3937.0, "us_ft": 1200.0 / 3937.0,
    },
    _AREA: {"ha": 1e4, "hectare": 1e4, "acre": 4046.8726098742513},
    _VOLUME: {"cc": 1e-6, "gallon": 231.0 * _INCH**3},
    _MASS: {
        "lb": _POUND, "lbs": _POUND, "pound": _POUND, "oz": _POUND / 16.0, "ounce": _POUND / 16.0,
        "gr": _POUND / 7000.0, "grain": _POUND / 7000.0, "slug": _POUND * _GRAVITY / _FOOT, "stone": 14.0 * _POUND,
        "t": 1e3, "tonne": 1e3, "ton": 2000.0 * _POUND, "short_ton": 2000.0 * _POUND, "long_ton": 2240.0 * _POUND,
        "metric_ton": 1e3,
    },
    _TIME: {"min": 60.0, "minute": 60.0, "h": 3600.0, "hr": 3600.0, "hour": 3600.0, "day": 86400.0},
    _SPEED: {
        "mps": 1.0, "fps": _FOOT, "mph": 0.44704, "kph": 1.0 / 3.6, "kn": 1852.0 / 3600.0, "kt": 1852.0 / 3600.0,
        "knot": 1852.0 / 3600.0,
    },
    (1, 0, -2, 0, 0): {"g_0": _GRAVITY, "g_n": _GRAVITY, "gravity": _GRAVITY},
    _FORCE: {
        "lbf": _POUND * _GRAVITY, "pound_force": _POUND * _GRAVITY, "force_pound": _POUND * _GRAVITY,
        "kip": 1e3 * _POUND * _GRAVITY, "kgf": _GRAVITY,
        "dyn": 1e-5, "dyne": 1e-5,
    },
    _PRESSURE: {
        "psi": _POUND * _GRAVITY / _INCH**2, "ksi": 1e3 * _POUND * _GRAVITY / _INCH**2, "atm": 101325.0,
        "torr": 101325.0 / 760.0, "mmHg": 133.322387415,
    },
    _ENERGY: {
        "erg": 1e-7, "BTU": 1055.056, "Wh": 3.6e3, "kWh": 3.6e6, "ft_lb": _FOOT * _POUND * _GRAVITY,
        "foot_pound": _FOOT * _POUND * _GRAVITY, "ton_TNT": 4.184e9,
    },
    _POWER: {"hp": 550.0 * _FOOT * _POUND * _GRAVITY},
    _ANGLE: {
        "deg": math.pi / 180.0, "degree": math.pi / 180.0, "°": math.pi / 180.0, "arcmin": math.pi / 10800.0,
        "arcminute": math.pi / 10800.0, "arcsec": math.pi / 648000.0, "arcsecond": math.pi / 648000.0,
        "gon": math.pi / 200.0, "grad": math.pi / 200.0, "turn": 2.0 * math.pi,
        "revolution": 2.0 * math.pi,
    },
}  # fmt: skip
_PREFIXES = {
    "p": 1e-12, "pico": 1e-12, "n": 1e-9, "nano": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "micro": 1e-6, "m": 1e-3,
    "milli": 1e-3, "c": 1e-2, "centi": 1e-2, "d": 1e-1, "deci": 1e-1, "da": 10.0, "deca": 10.0, "h": 1e2, "hecto": 1e2,
    "k": 1e3, "kilo": 1e3, "M": 1e6, "mega": 1e6, "G": 1e9, "giga": 1e9, "T": 1e12, "tera": 1e12,
}  # fmt: skip


def _known_units() -> dict[str, tuple[float, Powers]]:
    metric = {name: (factor, powers) for powers, units in _METRIC.items() for name, factor in units.items()}
    known = {
        f"{prefix}{name}": (float(f"{scale * factor:.15g}"), powers)
        for name, (factor, powers) in metric.items()
        for prefix, scale in _PREFIXES.items()
        if (len(prefix) > 2) == (len(name) > 3) or name == "bar"  # "kilometre" and "km", no "kmetre"
    }
    known |= metric | {"kg": (1.0, _MASS), "kilogram": (1.0, _MASS)}
    return known | {name: (factor, powers) for powers, units in _OTHER.items() for name, factor in units.items()}


UNITS = _known_units()
"""By name: the unit in SI, and its powers of m, kg, s, rad and K."""


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
