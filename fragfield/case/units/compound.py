"""Fields of a case that are vectors with a unit, or a number or a word."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic_core import PydanticCustomError, core_schema

from fragfield.case.units.dimensions import DIMENSIONS, with_article
from fragfield.case.units.quantities import Measured, Quantity, quantity_fault, show
from fragfield.errors import nearest

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic.json_schema import JsonSchemaValue

__all__ = ["NumberOrWord", "QuantityOrFile", "Vector"]


@dataclass(frozen=True)
class QuantityOrFile(Quantity):
    """Marks a float of the schema as a value with a dimension, one of some words, or the name of a file.

    Attributes
    ----------
    ending : str
        By which the name of a file is known.
    holds : str
        What the file holds, for messages.
    """

    ending: str = ".csv"
    holds: str = "values"

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return f"{super().allowed}, or a {self.ending} file of {self.holds}"

    def parse(self, value: object) -> float | str:
        """Read a value, a word or the name of a file; raises PydanticCustomError for anything else."""
        return value if isinstance(value, str) and self.is_file(value) else super().parse(value)

    def is_file(self, value: object) -> bool:
        """Whether a value is the name of a file."""
        return isinstance(value, str) and value.lower().endswith(self.ending)


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
        raise quantity_fault(f"found {show(value)}{hint}; allowed: {self.allowed}")

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
        each = (
            f"each {with_article(DIMENSIONS[self.component.symbol])} with its unit"
            if self.component
            else "without unit"
        )
        return f"a list of {self.size} components, {each}, for example {self.example}"

    def parse(self, value: object) -> tuple[float, ...]:
        """Read a list of components; raises PydanticCustomError naming the component at fault."""
        if not isinstance(value, (list, tuple)) or len(value) != self.size:
            raise quantity_fault(f"found {show(value)}; allowed: {self.allowed}")
        numbers = []
        for i, entry in enumerate(value, start=1):
            try:
                numbers.append(self._one(entry))
            except PydanticCustomError as error:
                raise quantity_fault(f"component {i}: {error.message()}") from None
        return tuple(numbers)

    def _one(self, entry: object) -> float:
        if self.component is not None:
            number = self.component.parse(entry)
            assert isinstance(number, float)  # a component has no words
            return number
        if isinstance(entry, bool) or not isinstance(entry, (int, float)) or not math.isfinite(entry):
            raise quantity_fault(f"found {show(entry)}; allowed: {self.allowed}")
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
