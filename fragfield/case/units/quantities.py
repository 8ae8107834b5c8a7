"""Values with a dimension: strings with their unit in the case file, floats in SI in the program."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic_core import PydanticCustomError, core_schema

from fragfield.case.units.everyday import plain_value
from fragfield.case.units.grammar import grammar_fault
from fragfield.errors import nearest

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pint import Quantity as PintQuantity
    from pint import Unit, UnitRegistry
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic.json_schema import JsonSchemaValue

__all__ = [
    "Angle",
    "ArealDensity",
    "Density",
    "Direction",
    "Energy",
    "EnergyRange",
    "EnergyPerArea",
    "EnergyPerMass",
    "FrictionAngle",
    "Length",
    "Mass",
    "Measured",
    "NumberOrWord",
    "Offset",
    "Place",
    "PositiveLength",
    "Pressure",
    "Quantity",
    "Speed",
    "Time",
    "Vector",
    "Velocity",
    "degrees",
    "show",
    "with_unit",
]

_LARGEST = 1e4  # numbers in the unit of an example; beyond, the SI unit reads better

# How a dimension is called in a message, by its SI unit.
_NAMES = {
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
_EXPONENT = re.compile(r"(?<=[A-Za-z])([23])\b")  # "kg/m3" as people write it
_STARTS_AS_NUMBER = re.compile(r"^[\s(]*[-+]?\.?\d")
_NUMBER = re.compile(r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*$")


@cache
def _registry() -> UnitRegistry[Any]:
    import pint

    registry: UnitRegistry[Any] = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    return registry


def show(value: object) -> str:
    """A found value as a message shows it, shortened."""
    try:
        text = f'"{value}"' if isinstance(value, str) else repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits
        text = "something too large to print"
    return text if len(text) <= 60 else text[:57] + "..."


def with_unit(value: float, symbol: str) -> str:
    """A value as the case file writes it; reading it gives back the same float."""
    return f"{float(value)!r} {symbol}"


def degrees(angle: float) -> float:
    """An angle of so many degrees in radians: the very float that the case file's "20 deg" is read as."""
    return _converted(math.radians(angle))


def _converted(number: float) -> float:
    """What came out of a change of units, to 15 digits: "120 us" is 1.2e-4 s, not 1.1999999999999999e-4."""
    return float(f"{number:.15g}")


def _dimension_of(unit: Unit) -> str:
    registry = _registry()
    for symbol, name in _NAMES.items():
        if unit.dimensionality == registry.parse_units(symbol).dimensionality:
            return name
    return f"dimension {unit.dimensionality}"


def _fault(message: str) -> PydanticCustomError:
    return PydanticCustomError("quantity", message)


class Measured:
    """A value of a case with its SI unit, for tables: what `case.write.measured` puts in place of bare floats."""

    __slots__ = ("unit", "value")

    def __init__(self, value: float, unit: str) -> None:
        self.value = value
        self.unit = unit

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Measured) and (self.value, self.unit) == (other.value, other.unit)

    def __hash__(self) -> int:
        return hash((self.value, self.unit))

    def __repr__(self) -> str:
        return f"Measured({self.value!r}, {self.unit!r})"


@dataclass(frozen=True)
class Quantity:
    """Marks a float of the schema as a value with a dimension.

    Parameters
    ----------
    symbol : str
        SI unit, as messages and resolved cases write it.
    example : str
        A value as a user may write it.
    above, minimum, maximum : float, optional
        Bounds in SI: greater than `above`, at least `minimum`, at most `maximum`.
    words : tuple of str
        Words that stand for a choice in place of a value.
    """

    symbol: str
    example: str
    above: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    words: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        name = _NAMES[self.symbol]
        article = "an" if name[0] in "aeiou" else "a"
        words = "".join(f'"{word}" or ' for word in self.words)
        return f'{words}{article} {name} with its unit as a string, for example "{self.example}"{self._bounds()}'

    def _bounds(self) -> str:
        shown = (("greater than", self.above), ("at least", self.minimum), ("at most", self.maximum))
        limits = [f"{text} {limit:g} {self.symbol}" for text, limit in shown if limit is not None]
        return ", " + " and ".join(limits) if limits else ""

    def parse(self, value: object) -> float | str:
        """Read a value of the case file.

        Parameters
        ----------
        value : object
            What stands in the file.

        Returns
        -------
        float or str
            The value in SI, or one of `words`.

        Raises
        ------
        PydanticCustomError
            The value has no unit, another dimension, or lies outside the bounds.
        """
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise _fault(f"found {show(value)}; allowed: {self.allowed}")
        if not isinstance(value, str):
            raise _fault(f"found the bare number {value!r} without a unit; allowed: {self.allowed}")
        if value in self.words:
            return value
        return self._convert(value)

    def _convert(self, text: str) -> float:
        if _NUMBER.match(text):
            raise _fault(f"found {show(text)} without a unit; allowed: {self.allowed}")
        if not _STARTS_AS_NUMBER.match(text) or "{" in text:  # pint reads "mm" as 1 mm and drops braces
            hint = nearest(text, self.words)
            raise _fault(f"found {show(text)}, which is not a number with a unit{hint}; allowed: {self.allowed}")
        if fault := grammar_fault(text):
            raise _fault(f"found {show(text)}, which {fault}; allowed: {self.allowed}")
        plain = plain_value(text, self.symbol)
        if plain is not None:
            self._check_bounds(plain, text)
            return plain
        registry = _registry()
        try:
            quantity: Any = registry.Quantity(_EXPONENT.sub(r"^\1", text))
            number = float(quantity.magnitude)
        except Exception as error:  # noqa: BLE001 - pint raises whatever its tokenizer and evaluator run into
            raise _fault(f"found {show(text)}, {_why(error)}; allowed: {self.allowed}") from None
        target = registry.parse_units(self.symbol)
        if quantity.dimensionality != target.dimensionality or (self.symbol == "rad") != _is_angle(quantity):
            found = _dimension_of(quantity.units) if not quantity.unitless else "a number without a unit"
            raise _fault(f"found {show(text)}, which is {_article(found)}; allowed: {self.allowed}")
        if quantity.units != target:
            number = _converted(float(quantity.to(target).magnitude))
        self._check_bounds(number, text)
        return number

    def written(self, value: float, context: Mapping[str, Any] | None) -> float | str | Measured:
        """A value (SI) in the form that the context of a serialisation asks for by its key "units".

        "si": with the SI unit, all digits; "readable": in the unit of the example; "measured": as `Measured`.
        """
        form = (context or {}).get("units")
        if form == "si":
            return with_unit(value, self.symbol)
        if form == "readable":
            # A round is measured in millimetres, what stands around it in metres.
            in_metres = self.symbol == "m" and (value == 0.0 or abs(value) >= 1.0)
            return f"{value:.10g} m" if in_metres else self.in_unit_of_example(value)
        return Measured(value, self.symbol) if form == "measured" else value

    def in_unit_of_example(self, value: float) -> str:
        """A value (SI) in the unit in which the schema's example stands, ten digits."""
        unit = self.example.partition(" ")[2]
        one = self.example if not unit or unit.startswith("/") else f"1 {unit}"
        if math.isclose(value, float(self.parse(self.example)), rel_tol=1e-12):
            return self.example
        if one == self.example:
            return f"{value:.10g} {self.symbol}"
        number = value / float(Quantity(self.symbol, one).parse(one))
        if abs(number) >= _LARGEST:
            return f"{value:.10g} {self.symbol}"
        return f"{number:.10g} {unit}"

    def _check_bounds(self, number: float, text: str) -> None:
        inside = (
            math.isfinite(number)
            and (self.above is None or number > self.above)
            and (self.minimum is None or number >= self.minimum)
            and (self.maximum is None or number <= self.maximum)
        )
        if not inside:
            raise _fault(f"found {show(text)}; allowed: {self.allowed}")

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """Validate by `parse`; write with the unit where the context asks for units."""

        def write(value: float | str | None, info: core_schema.SerializationInfo) -> float | str | Measured | None:
            return value if value is None or isinstance(value, str) else self.written(value, info.context)

        return core_schema.no_info_plain_validator_function(
            self.parse, serialization=core_schema.plain_serializer_function_ser_schema(write, info_arg=True)
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Describe the field in the generated reference."""
        return {"type": "string", "unit": self.symbol, "allowed": self.allowed, "examples": [self.example]}


@dataclass(frozen=True)
class NumberOrWord:
    """Marks a field as a positive pure number or one of some words."""

    words: tuple[str, ...]
    example: float

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        words = " or ".join(f'"{word}"' for word in self.words)
        return f"{words} or a number greater than 0 without unit, for example {self.example:g}"

    def parse(self, value: object) -> float | str:
        """Read a number or a word; raises PydanticCustomError for anything else."""
        if isinstance(value, str) and value in self.words:
            return value
        if isinstance(value, (int, float)) and not isinstance(value, bool) and 0.0 < value < math.inf:
            return float(value)
        hint = nearest(value, self.words) if isinstance(value, str) else ""
        raise _fault(f"found {show(value)}{hint}; allowed: {self.allowed}")

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """Validate by `parse`."""
        return core_schema.no_info_plain_validator_function(self.parse)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Describe the field in the generated reference."""
        return {"allowed": self.allowed, "examples": [self.example, *self.words]}


@dataclass(frozen=True)
class Vector:
    """Marks a tuple of floats as components, each with a unit (`component`) or, without one, as pure numbers."""

    size: int
    component: Quantity | None
    example: str

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        each = f"each {_article(_NAMES[self.component.symbol])} with its unit" if self.component else "without unit"
        return f"a list of {self.size} components, {each}, for example {self.example}"

    def parse(self, value: object) -> tuple[float, ...]:
        """Read a list of components; raises PydanticCustomError naming the component at fault."""
        if not isinstance(value, (list, tuple)) or len(value) != self.size:
            raise _fault(f"found {show(value)}; allowed: {self.allowed}")
        numbers = []
        for i, entry in enumerate(value, start=1):
            try:
                numbers.append(self._one(entry))
            except PydanticCustomError as error:
                raise _fault(f"component {i}: {error.message()}") from None
        return tuple(numbers)

    def _one(self, entry: object) -> float:
        if self.component is not None:
            number = self.component.parse(entry)
            assert isinstance(number, float)  # a component has no words
            return number
        if isinstance(entry, bool) or not isinstance(entry, (int, float)) or not math.isfinite(entry):
            raise _fault(f"found {show(entry)}; allowed: {self.allowed}")
        return float(entry)

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """Validate by `parse`; write with units where the context asks for them."""

        def write(value: tuple[float, ...], info: core_schema.SerializationInfo) -> list[float | str | Measured]:
            component = self.component
            return [entry if component is None else component.written(entry, info.context) for entry in value]

        return core_schema.no_info_plain_validator_function(
            self.parse, serialization=core_schema.plain_serializer_function_ser_schema(write, info_arg=True)
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Describe the field in the generated reference."""
        unit = self.component.symbol if self.component else "1"
        return {"type": "array", "unit": unit, "allowed": self.allowed, "examples": [self.example]}


def _is_angle(quantity: PintQuantity[Any]) -> bool:
    return quantity.dimensionless and not quantity.unitless


def _article(name: str) -> str:
    if name.startswith("a "):
        return name
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


def _why(error: Exception) -> str:
    unknown = getattr(error, "unit_names", None)
    if unknown:
        name = unknown if isinstance(unknown, str) else ", ".join(unknown)
        return f'with the unknown unit "{name}"{nearest(name, _common_units())}'
    return "which is not a number with a unit"


def _common_units() -> list[str]:
    prefixes = ("", "n", "u", "m", "c", "k", "M", "G")
    metric = [prefix + unit for unit in ("m", "g", "s", "Pa", "J") for prefix in prefixes]
    return [*metric, "inch", "feet", "foot", "ft", "pound", "lb", "grain", "metre", "meter", "degree", "deg", "radian"]


Length = Annotated[float, Quantity("m", "155 mm")]
PositiveLength = Annotated[float, Quantity("m", "6 mm", above=0.0)]
Time = Annotated[float, Quantity("s", "120 us", above=0.0)]
Mass = Annotated[float, Quantity("kg", "0.1 g", above=0.0)]
Speed = Annotated[float, Quantity("m/s", "6940 m/s", above=0.0)]
Density = Annotated[float, Quantity("kg/m^3", "1.63 g/cm^3", above=0.0)]
Pressure = Annotated[float, Quantity("Pa", "800 MPa", minimum=0.0)]
Energy = Annotated[float, Quantity("J", "79 J", above=0.0)]
EnergyPerMass = Annotated[float, Quantity("J/kg", "4.52 MJ/kg", above=0.0)]
EnergyPerArea = Annotated[float, Quantity("J/m^2", "14.7e4 J/m^2", above=0.0)]
EnergyRange = Annotated[
    tuple[float, float], Vector(2, Quantity("J/m^2", "1.4 MJ/m^2", above=0.0), '["1.4 MJ/m^2", "1.8 MJ/m^2"]')
]
ArealDensity = Annotated[float, Quantity("1/m^2", "1 / (55.7 m^2)", above=0.0)]
Angle = Annotated[float, Quantity("rad", "5 deg")]
FrictionAngle = Annotated[float, Quantity("rad", "20 deg", minimum=0.0, maximum=1.5)]
Place = Annotated[tuple[float, float, float], Vector(3, Quantity("m", "0 mm"), '["0 mm", "0 mm", "1 m"]')]
Offset = Annotated[tuple[float, float], Vector(2, Quantity("m", "0 mm"), '["0 mm", "5 mm"]')]
Velocity = Annotated[tuple[float, float, float], Vector(3, Quantity("m/s", "0 m/s"), '["5 m/s", "0 m/s", "0 m/s"]')]
Direction = Annotated[tuple[float, float, float], Vector(3, None, "[0, 0, 1]")]
