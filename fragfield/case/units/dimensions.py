"""Names of dimensions, and the units library, which is loaded when it is first needed."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from fragfield.errors import nearest

if TYPE_CHECKING:
    from pint import Quantity as PintQuantity
    from pint import Unit, UnitRegistry

__all__ = ["DIMENSIONS", "dimension_of", "fault_of", "is_angle", "registry", "with_article"]

# How a dimension is called in a message, by its SI unit.
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


@cache
def registry() -> UnitRegistry[Any]:
    """The registry of the units library."""
    import pint

    made: UnitRegistry[Any] = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    return made


def dimension_of(unit: Unit) -> str:
    """Name of a unit's dimension, for messages."""
    units = registry()
    for symbol, name in DIMENSIONS.items():
        if unit.dimensionality == units.parse_units(symbol).dimensionality:
            return name
    return f"dimension {unit.dimensionality}"


def is_angle(quantity: PintQuantity[Any]) -> bool:
    """Whether a value is an angle and no pure number."""
    return quantity.dimensionless and not quantity.unitless


def with_article(name: str) -> str:
    """A name with its article."""
    if name.startswith("a "):
        return name
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


def fault_of(error: Exception) -> str:
    """Why the units library refused a text."""
    unknown = getattr(error, "unit_names", None)
    if unknown:
        name = unknown if isinstance(unknown, str) else ", ".join(unknown)
        return f'with the unknown unit "{name}"{nearest(name, _common_units())}'
    return "which is not a number with a unit"


_PREFIXES = ("", "micro", "milli", "centi", "kilo", "mega", "giga")


def _common_units() -> list[str]:
    prefixes = ("", "n", "u", "m", "c", "k", "M", "G")
    metric = [prefix + unit for unit in ("m", "g", "s", "Pa", "J") for prefix in prefixes]
    long = [prefix + unit for unit in ("meter", "metre", "gram", "second", "pascal", "joule") for prefix in _PREFIXES]
    return [*metric, *long, "inch", "feet", "foot", "ft", "pound", "lb", "grain", "degree", "deg", "radian"]
