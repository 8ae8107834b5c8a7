"""Metadata of inputs, on the dataclass that takes them: unit, example, bounds with their reason, alternatives.

    interval: Annotated[float, Quantity("s", "120 us", above=0.0)] = 10e-6

The tables of a case, their reference, forms and the checks are made from it. Pydantic, where a table is one of its
models, validates and writes a field by the marks that have a `parse`; nothing here needs it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from fragfield_base.bounds import Bounds
from fragfield_base.errors import nearest_name, show
from fragfield_base.units import DIMENSIONS, UnitError, degrees, dimension_words, read_measure, with_article

_LARGEST = 1e4  # numbers in the unit of an example; beyond, the SI unit reads better
_STARTS_AS_NUMBER = re.compile(r"^[\s(]*[-+]?\.?\d")
_NUMBER = re.compile(r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*$")


class NotAllowedError(ValueError):
    """A value is not allowed; the message says what was found and what is allowed."""


def with_unit(value: float, symbol: str) -> str:
    """A value as the case file writes it; reading it gives back the same float."""
    return f"{float(value)!r} {symbol}"


def _hint(value: object, words: tuple[str, ...]) -> str:
    close = nearest_name(value, words, likeness=0.6) if isinstance(value, str) else None
    return f' (did you mean "{close}"?)' if close is not None else ""


class Parsed:
    """Marks a field that `parse` reads, which `allowed` describes."""

    allowed: Any

    def parse(self, value: object) -> Any:  # noqa: ANN401 - each mark has a type of its own
        """Read a value of the case file; raises NotAllowedError for anything else."""
        raise NotImplementedError

    def written(self, value: Any, context: Mapping[str, Any] | None) -> Any:  # noqa: ANN401
        """A value in the form that the context of a serialisation asks for."""
        del context
        return value

    def refuse(self, value: object) -> NotAllowedError:
        """The error for a value."""
        return NotAllowedError(f"found {show(value)}; allowed: {self.allowed}")

    def __get_pydantic_core_schema__(self, source: object, handler: object) -> Any:  # noqa: ANN401
        """For pydantic: validate by `parse`, write by `written`."""
        from pydantic_core import core_schema

        def write(value: object, info: core_schema.SerializationInfo) -> object:
            return self.written(value, info.context)

        return core_schema.no_info_plain_validator_function(
            self.parse, serialization=core_schema.plain_serializer_function_ser_schema(write, info_arg=True)
        )


@dataclass(frozen=True)
class Quantity(Parsed):
    """Marks a float as a value with a dimension.

    Parameters
    ----------
    symbol : str
        SI unit, as messages and resolved cases write it.
    example : str
        A value as a user may write it.
    above, minimum, maximum : float, optional
        Limits in SI: greater than `above`, at least `minimum`, at most `maximum`.
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
        words = "".join(f'"{word}" or ' for word in self.words)
        name = with_article(DIMENSIONS[self.symbol])
        return f'{words}{name} with its unit as a string, for example "{self.example}"{self._limits()}'

    def _limits(self) -> str:
        shown = (("greater than", self.above), ("at least", self.minimum), ("at most", self.maximum))
        limits = [f"{text} {self._limit(limit)}" for text, limit in shown if limit is not None]
        return ", " + " and ".join(limits) if limits else ""

    def _limit(self, value: float) -> str:
        """A limit as a message shows it: angles in whole degrees where they are, as in the examples."""
        whole = round(math.degrees(value)) if self.symbol == "rad" else None
        if whole is not None and math.isclose(degrees(whole), value, rel_tol=1e-9):
            return f"{whole} deg"
        return f"{value:g} {self.symbol}"

    def parse(self, value: object) -> float | str:
        """Read a value in SI, or one of `words`.

        Raises NotAllowedError for a value without a unit, of another dimension or beyond the limits.
        """
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise self.refuse(value)
        if not isinstance(value, str):
            raise NotAllowedError(f"found the bare number {value!r} without a unit; allowed: {self.allowed}")
        if value in self.words:
            return value
        number = self._read(value)
        inside = (
            math.isfinite(number)
            and (self.above is None or number > self.above)
            and (self.minimum is None or number >= self.minimum)
            and (self.maximum is None or number <= self.maximum)
        )
        if not inside:
            raise self.refuse(value)
        return number

    def _read(self, text: str) -> float:
        fault = ""
        if _NUMBER.match(text):
            raise NotAllowedError(f"found {show(text)} without a unit; allowed: {self.allowed}")
        if not _STARTS_AS_NUMBER.match(text):  # "mm"
            fault = f"which is not a number with a unit{_hint(text, self.words)}"
        else:
            try:
                measure = read_measure(text)
            except UnitError as error:
                fault = str(error)
            else:
                if measure.is_of(self.symbol):
                    return measure.value
                fault = f"which is {dimension_words(measure)}"
        raise NotAllowedError(f"found {show(text)}, {fault}; allowed: {self.allowed}")

    def written(self, value: Any, context: Mapping[str, Any] | None) -> Any:  # noqa: ANN401
        """A value (SI) in the form that the context of a serialisation asks for by its key "units".

        "si": with the SI unit, all digits; "readable": in the unit of the example.
        """
        form = (context or {}).get("units")
        if form is None or value is None or isinstance(value, str):
            return value
        if form == "si":
            return with_unit(value, self.symbol)
        # A round is measured in millimetres, what stands around it in metres.
        in_metres = self.symbol == "m" and (value == 0.0 or abs(value) >= 1.0)
        return f"{value:.10g} m" if in_metres else self.in_unit_of_example(value)

    def in_unit_of_example(self, value: float) -> str:
        """A value (SI) in the unit in which the example stands, ten digits."""
        unit = self.example.partition(" ")[2]
        if math.isclose(value, read_measure(self.example).value, rel_tol=1e-12):
            return self.example
        if not unit or unit.startswith("/"):
            return f"{value:.10g} {self.symbol}"
        number = value / read_measure(f"1 {unit}").value
        return f"{value:.10g} {self.symbol}" if abs(number) >= _LARGEST else f"{number:.10g} {unit}"


@dataclass(frozen=True)
class QuantityOrFile(Quantity):
    """Marks a float as a value with a dimension, one of some words, or the name of a file."""

    ending: str = ".csv"
    """By which the name of a file is known."""
    holds: str = "values"
    """What the file holds, for messages."""

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return f"{super().allowed}, or a {self.ending} file of {self.holds}"

    def parse(self, value: object) -> float | str:
        """Read a value, a word or the name of a file; raises NotAllowedError for anything else."""
        return value if isinstance(value, str) and self.is_file(value) else super().parse(value)

    def is_file(self, value: object) -> bool:
        """Whether a value is the name of a file."""
        return isinstance(value, str) and value.lower().endswith(self.ending)


@dataclass(frozen=True)
class NumberOrWord(Parsed):
    """Marks a field as a positive pure number or one of some words."""

    words: tuple[str, ...]
    example: float

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        words = " or ".join(f'"{word}"' for word in self.words)
        return f"{words} or a number greater than 0 without unit, for example {self.example:g}"

    def parse(self, value: object) -> float | str:
        """Read a number or a word; raises NotAllowedError for anything else."""
        if isinstance(value, str) and value in self.words:
            return value
        if isinstance(value, (int, float)) and not isinstance(value, bool) and 0.0 < value < math.inf:
            return float(value)
        raise NotAllowedError(f"found {show(value)}{_hint(value, self.words)}; allowed: {self.allowed}")


@dataclass(frozen=True)
class Vector(Parsed):
    """Marks a tuple of floats as components, each with a unit (`component`) or, without one, as pure numbers."""

    size: int
    component: Quantity | None
    example: str

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        unit = self.component.symbol if self.component else ""
        each = f"each {with_article(DIMENSIONS[unit])} with its unit" if unit else "without unit"
        return f"a list of {self.size} components, {each}, for example {self.example}"

    def parse(self, value: object) -> tuple[float, ...]:
        """Read a list of components; raises NotAllowedError naming the component at fault."""
        if not isinstance(value, (list, tuple)) or len(value) != self.size:
            raise self.refuse(value)
        read: Callable[[object], Any] = self._pure if self.component is None else self.component.parse
        numbers = []
        for i, entry in enumerate(value, start=1):
            try:
                numbers.append(read(entry))
            except NotAllowedError as error:
                raise NotAllowedError(f"component {i}: {error}") from None
        return tuple(numbers)

    def _pure(self, entry: object) -> float:
        if isinstance(entry, bool) or not isinstance(entry, (int, float)) or not math.isfinite(entry):
            raise self.refuse(entry)
        return float(entry)

    def written(self, value: Any, context: Mapping[str, Any] | None) -> Any:  # noqa: ANN401
        """Components, each as a quantity is written."""
        component = self.component
        return value and [entry if component is None else component.written(entry, context) for entry in value]


Length = Annotated[float, Quantity("m", "155 mm")]
PositiveLength = Annotated[float, Quantity("m", "6 mm", above=0.0)]
Time = Annotated[float, Quantity("s", "120 us", above=0.0)]
Mass = Annotated[float, Quantity("kg", "0.1 g", above=0.0)]
Speed = Annotated[float, Quantity("m/s", "6940 m/s", above=0.0)]
Density = Annotated[float, Quantity("kg/m^3", "1.63 g/cm^3", above=0.0)]
Pressure = Annotated[float, Quantity("Pa", "800 MPa", minimum=0.0)]
PositivePressure = Annotated[float, Quantity("Pa", "3.5 GPa", above=0.0)]
Energy = Annotated[float, Quantity("J", "79 J", above=0.0)]
EnergyPerArea = Annotated[float, Quantity("J/m^2", "14.7e4 J/m^2", above=0.0)]
EnergyRange = Annotated[
    tuple[float, float], Vector(2, Quantity("J/m^2", "1.4 MJ/m^2", above=0.0), '["1.4 MJ/m^2", "1.8 MJ/m^2"]')
]
ArealDensity = Annotated[float, Quantity("1/m^2", "1 / (55.7 m^2)", above=0.0)]
Angle = Annotated[float, Quantity("rad", "5 deg")]
FrictionAngle = Annotated[float, Quantity("rad", "20 deg", minimum=0.0, maximum=1.5)]
Position = Annotated[tuple[float, float, float], Vector(3, Quantity("m", "0 mm"), '["0 mm", "0 mm", "1 m"]')]
Offset = Annotated[tuple[float, float], Vector(2, Quantity("m", "0 mm"), '["0 mm", "5 mm"]')]
Direction = Annotated[tuple[float, float, float], Vector(3, None, "[0, 0, 1]"), Bounds(-1e6, 1e6, "a direction")]
