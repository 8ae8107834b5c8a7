"""Values with a dimension: strings with their unit in the case file, floats in SI in the program."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticCustomError, core_schema

from fragfield.case.units.dimensions import DIMENSIONS, dimension_of, fault_of, is_angle, registry, with_article
from fragfield.case.units.everyday import plain_value
from fragfield.case.units.grammar import grammar_fault
from fragfield.errors import nearest

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic.json_schema import JsonSchemaValue

__all__ = ["Measured", "Quantity", "degrees", "quantity_fault", "show", "with_unit"]

_LARGEST = 1e4  # numbers in the unit of an example; beyond, the SI unit reads better
_EXPONENT = re.compile(r"(?<=[A-Za-z])([23])\b")  # "kg/m3" as people write it
_STARTS_AS_NUMBER = re.compile(r"^[\s(]*[-+]?\.?\d")
_NUMBER = re.compile(r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*$")


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


def quantity_fault(message: str) -> PydanticCustomError:
    """A fault of a value with a unit, as pydantic reports it."""
    return PydanticCustomError("quantity", message)


class Measured:
    """A value of a case with its SI unit, for tables: what `case.write.measured` puts instead of bare floats."""

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
        Words that stand for a choice instead of a value.
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
        name = DIMENSIONS[self.symbol]
        article = "an" if name[0] in "aeiou" else "a"
        words = "".join(f'"{word}" or ' for word in self.words)
        return f'{words}{article} {name} with its unit as a string, for example "{self.example}"{self._bounds()}'

    def _bounds(self) -> str:
        shown = (("greater than", self.above), ("at least", self.minimum), ("at most", self.maximum))
        limits = [f"{text} {self._limit(limit)}" for text, limit in shown if limit is not None]
        return ", " + " and ".join(limits) if limits else ""

    def _limit(self, value: float) -> str:
        """A bound as a message shows it: angles in whole degrees where they are, as in the examples."""
        whole = round(math.degrees(value)) if self.symbol == "rad" else None
        if whole is not None and math.isclose(degrees(whole), value, rel_tol=1e-9):
            return f"{whole} deg"
        return f"{value:g} {self.symbol}"

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
            raise quantity_fault(f"found {show(value)}; allowed: {self.allowed}")
        if not isinstance(value, str):
            raise quantity_fault(f"found the bare number {value!r} without a unit; allowed: {self.allowed}")
        if value in self.words:
            return value
        return self._convert(value)

    def _convert(self, text: str) -> float:
        if _NUMBER.match(text):
            raise quantity_fault(f"found {show(text)} without a unit; allowed: {self.allowed}")
        if not _STARTS_AS_NUMBER.match(text) or "{" in text:  # pint reads "mm" as 1 mm and drops braces
            hint = nearest(text, self.words)
            raise quantity_fault(
                f"found {show(text)}, which is not a number with a unit{hint}; allowed: {self.allowed}"
            )
        if fault := grammar_fault(text):
            raise quantity_fault(f"found {show(text)}, which {fault}; allowed: {self.allowed}")
        plain = plain_value(text, self.symbol)
        if plain is not None:
            self._check_bounds(plain, text)
            return plain
        units = registry()
        try:
            quantity: Any = units.Quantity(_EXPONENT.sub(r"^\1", text))
            number = float(quantity.magnitude)
        except Exception as error:  # noqa: BLE001 - pint raises whatever its tokenizer and evaluator run into
            raise quantity_fault(f"found {show(text)}, {fault_of(error)}; allowed: {self.allowed}") from None
        target = units.parse_units(self.symbol)
        if quantity.dimensionality != target.dimensionality or (self.symbol == "rad") != is_angle(quantity):
            found = dimension_of(quantity.units) if not quantity.unitless else "a number without a unit"
            raise quantity_fault(f"found {show(text)}, which is {with_article(found)}; allowed: {self.allowed}")
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
            raise quantity_fault(f"found {show(text)}; allowed: {self.allowed}")

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
