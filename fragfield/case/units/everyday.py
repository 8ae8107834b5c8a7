"""Numbers with everyday units, read without loading the units library, which takes longer than reading a case.

What this table does not have, and whatever is wrong, goes to the library; a test reads every entry by both.
"""

from __future__ import annotations

import math
import re

__all__ = ["PLAIN_UNITS", "plain_value"]

PLAIN_UNITS: dict[str, dict[str, float]] = {
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "um": 1e-6, "ft": 0.3048, "in": 0.0254, "inch": 0.0254},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9},
    "kg": {"kg": 1.0, "g": 1e-3, "mg": 1e-6},
    "m/s": {"m/s": 1.0, "km/s": 1e3, "mm/us": 1e3},
    "kg/m^3": {"kg/m^3": 1.0, "kg/m3": 1.0, "g/cm^3": 1e3, "g/cm3": 1e3},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "J": {"J": 1.0, "kJ": 1e3},
    "rad": {"rad": 1.0, "deg": math.pi / 180.0},
    "K": {"K": 1.0},
}
"""By the SI unit, what each unit is in it."""

_NUMBER = r"\s*([-+]?(?:\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})(?:[eE][-+]?\d{1,4})?)"
_VALUE = re.compile(_NUMBER + r"\s*([^\W\d]\S*)\s*")
_PER_AREA = re.compile(r"\s*1\s*/\s*\(" + _NUMBER + r"\s*m\^?2\s*\)\s*")


def plain_value(text: str, symbol: str) -> float | None:
    """A number with its unit in the SI unit `symbol`; None where the units library has to say."""
    if symbol == "1/m^2" and (found := _PER_AREA.fullmatch(text)):
        return 1.0 / float(found[1]) if float(found[1]) != 0.0 else None
    found = _VALUE.fullmatch(text)
    factor = PLAIN_UNITS.get(symbol, {}).get(found[2]) if found is not None else None
    if found is None or factor is None:
        return None
    number = float(found[1])
    return number if factor == 1.0 else float(f"{number * factor:.15g}")
