"""Formatting of numbers: a practical value beside the SI value, and words for missing values."""

from __future__ import annotations

import math
from dataclasses import dataclass

UNKNOWN = "not computed"
SPACE, NARROW_SPACE = "\u00a0", "\u202f"
"""No-break spaces: a value and its unit stay on one line."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

# SI unit -> (largest factor first) practical units; a value takes the first in which it is at least 1.
_LADDERS: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm")),
    "s": ((60.0, "min"), (1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")),
    "kg": ((1.0, "kg"), (1e-3, "g"), (1e-6, "mg")),
    "Pa": ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa")),
    "J": ((1e6, "MJ"), (1e3, "kJ"), (1.0, "J")),
    "J/kg": ((1e6, "MJ/kg"), (1e3, "kJ/kg"), (1.0, "J/kg")),
    "J/m^2": ((1e6, "MJ/m²"), (1e3, "kJ/m²"), (1.0, "J/m²")),
    "J/m^3": ((1e9, "GJ/m³"), (1e6, "MJ/m³"), (1.0, "J/m³")),
    "byte": ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"), (1.0, "B")),
    "rad": ((math.pi / 180.0, "°"),),
}


@dataclass(frozen=True)
class Row:
    """A line of a table: what it is, the value for reading and the same in SI."""

    name: str
    value: str
    si: str = ""
    note: str = ""


def number(value: float | int | None, digits: int = 4) -> str:
    """A number with `digits` significant digits and separated thousands; words for None and NaN."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return UNKNOWN
    if value == 0:
        return "0"
    if math.isinf(value):
        return "infinite"
    if isinstance(value, int) or (float(value).is_integer() and abs(value) < 1e6):
        return _minus(f"{int(value):,}")
    size = math.floor(math.log10(abs(value)))
    if size >= 6 or size < -4:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{_minus(mantissa)}{NARROW_SPACE}×{NARROW_SPACE}10{str(int(exponent)).translate(_RAISED)}"
    return _minus(f"{value:,.{max(0, digits - 1 - size)}f}")


def _minus(text: str) -> str:
    return text.replace("-", "−")


def row(
    name: str,
    value: float | int | str | None,
    unit: str = "",
    note: str = "",
    digits: int = 4,
) -> Row:
    """Table row of a value in SI.

    Parameters
    ----------
    name : str
        What the value is.
    value : float, int, str or None
        In SI; a string is shown as it is.
    unit : str
        SI unit; empty for a pure number. "%" shows a fraction in per cent.
    note : str
        Remark beside the value.
    digits : int
        Significant digits.
    """
    if isinstance(value, str) or value is None or (isinstance(value, float) and math.isnan(value)):
        return Row(name, UNKNOWN if value is None or isinstance(value, float) else value, "", note)
    if not unit:
        return Row(name, number(value, digits), "", note)
    if unit == "%":
        return Row(name, f"{number(100.0 * value, digits)}{SPACE}%", number(value, digits), note)
    shown, practical = _practical(float(value), unit) if unit in _LADDERS else (value, unit)
    joint = "" if practical == "°" else SPACE
    si = f"{number(value, digits)}{SPACE}{'B' if unit == 'byte' else unit}"
    return Row(name, _powers(f"{number(shown, digits)}{joint}{practical}"), _powers(si), note)


def _powers(text: str) -> str:
    return text.replace("^", "").replace("m2", "m²").replace("m3", "m³")


def _practical(value: float, unit: str) -> tuple[float, str]:
    ladder = _LADDERS[unit]
    if value == 0:
        return 0.0, ladder[0][1] if unit != "s" else "s"
    for factor, name in ladder:
        minimum = 2.0 if name == "min" else 1.0  # 90 s reads better than 1.5 min
        if abs(value) >= minimum * factor * (1 - 1e-12):
            return value / factor, name
    factor, name = ladder[-1]
    return value / factor, name
