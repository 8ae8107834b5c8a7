"""Formatting of numbers: in practical units, and words for missing values."""

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
}


@dataclass(frozen=True)
class Row:
    """A line of a table: what it is, and its value for reading."""

    name: str
    value: str
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


def with_unit(value: float, unit: str, digits: int = 4) -> str:
    """A value in SI with its unit, or a practical one; "%" shows a fraction in per cent."""
    if not unit or math.isnan(value):
        return number(value, digits)
    factor = 0.01 if unit == "%" else 1.0
    for practical, name in _LADDERS.get(unit, ()):
        factor, unit = practical, name
        if abs(value) >= (2.0 if name == "min" else 1.0) * practical * (1 - 1e-12):  # 90 s reads better than 1.5 min
            break
    return f"{number(value / factor, digits)}{SPACE}{unit}"
