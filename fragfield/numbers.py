"""Formatting of numbers: a practical value beside the SI value, and words for missing values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fragfield_base.inputs import Measured

if TYPE_CHECKING:
    from collections.abc import Callable


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


def _typed(value: float) -> str:
    """A number that somebody typed in: up to six digits, no end of zeros."""
    text = number(value, 6)
    head, times, power = text.partition(NARROW_SPACE)
    return (head.rstrip("0").rstrip(".") if "." in head else head) + times + power


def row(
    name: str,
    value: float | int | str | None,
    unit: str = "",
    note: str = "",
    digits: int = 4,
    write: Callable[[float], str] | None = None,
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
    write : callable, optional
        Writes the numbers instead of `number` with these digits.
    """
    write = write or (lambda amount: number(amount, digits))
    if isinstance(value, str) or value is None or (isinstance(value, float) and math.isnan(value)):
        return Row(name, UNKNOWN if value is None or isinstance(value, float) else value, "", note)
    if not unit:
        return Row(name, write(value), "", note)
    if unit == "%":
        return Row(name, f"{write(100.0 * value)}{SPACE}%", write(value), note)
    shown, practical = _practical(float(value), unit) if unit in _LADDERS else (value, unit)
    joint = "" if practical == "°" else SPACE
    si = f"{write(value)}{SPACE}{'B' if unit == 'byte' else unit}"
    return Row(name, _powers(f"{write(shown)}{joint}{practical}"), _powers(si), note)


def _powers(text: str) -> str:
    return text.replace("^2", "²").replace("^3", "³")


def of_case(name: str, value: object) -> Row:
    """Table row of a value of the resolved case (`case.write.measured`): measured, number, word or list."""
    if isinstance(value, bool):
        return Row(name, "yes" if value else "no")
    if isinstance(value, (list, tuple)):
        rows = [of_case(name, item) for item in value]
        joined = ", ".join(
            f"({one.value})" if isinstance(item, list) else one.value for one, item in zip(rows, value, strict=True)
        )
        si = ", ".join(item.si or item.value for item in rows) if any(item.si for item in rows) else ""
        return Row(name, joined, si) if len(joined) <= 400 else Row(name, f"{len(rows)} entries, see case.toml")
    if isinstance(value, Measured):
        return row(name, value.value, value.unit, write=_typed)
    if isinstance(value, (int, float)):
        return Row(name, _typed(value))
    return Row(name, str(value))


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
