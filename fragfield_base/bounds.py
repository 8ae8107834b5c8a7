"""What inputs may be, as marks on the fields of dataclasses, and the check of a stage's dataclass against them.

radius_ratio: Annotated[float, Bounds(1.0, 20.0, "published radii are 1.59 to about 2.0", usual=(1.59, 2.1))] = 1.75
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from types import UnionType
from typing import Literal, Union, get_args, get_origin, get_type_hints

from fragfield_base.errors import names_allowed, show
from fragfield_base.units import TABLE


@dataclass(frozen=True)
class Bounds:
    """What a number may be, `low` to `high` in SI, what is `usual`, and why.

    Beyond `low` and `high` the number is a slip of the pen or of a unit, or the program cannot compute it: it is
    refused. What is not usual is computed, with a warning.
    """

    low: float
    high: float
    why: str
    usual: tuple[float, float] | None = None
    above: bool = False
    below: bool = False

    def holds(self, number: float) -> bool:
        """Whether a number is allowed: with `above` the lower bound itself is not, with `below` the upper."""
        if (self.above and number == self.low) or (self.below and number == self.high):
            return False
        return self.low <= number <= self.high

    def words(self, unit: str = "") -> str:
        """What is allowed, in words."""
        end = f"{self.high:g} {unit}".rstrip()
        return f"{'above ' if self.above else ''}{self.low:g} {'and below' if self.below else 'to'} {end}"


@dataclass(frozen=True)
class Entries:
    """How many entries a list may have at most, and why."""

    most: int
    why: str


@dataclass(frozen=True)
class OnlyWith:
    """The input is read only where another key of its table is one of `values`, or none of `without`.

    With `refused` it is an error to give it elsewhere; otherwise it then takes no part. With the values of the other
    key that are `needed` it cannot be left out; the message then shows an `example`.
    """

    key: str
    values: tuple[object, ...] = ()
    without: tuple[object, ...] = ()
    refused: bool = False
    needed: tuple[object, ...] = ()
    example: str = ""

    def holds(self, value: object) -> bool:
        """Whether the input is read with this value of the other key."""
        return value in self.values if self.values else value not in self.without

    def words(self, value: object) -> str:
        """What was found and what is allowed, in words, with a value with which the input is not read."""
        found = f"without a {self.key}" if value is None else f"with {self.key} = {show(value)}"
        if self.values:
            return f"found {found}; allowed: only with {self.key} = {' or '.join(show(one) for one in self.values)}"
        return f"found {found}; allowed: only with {'' if None in self.without else 'another '}{self.key}"


UNIT_BOUNDS = {unit: Bounds(one["low"], one["high"], one["why"]) for unit, one in TABLE["dimensions"].items()}
"""Bounds of a value that has none of its own, by its SI unit; every unit has some. Empty: a pure number."""


def check_inputs(settings: object, where: str, error: type[Exception]) -> None:
    """Refuse values of a stage's dataclass that its fields do not allow.

    Raises `error` with `where.NAME: found ...; allowed: ...` for a word or a switch that is none of the choices, for
    what is not a number where one is needed, and for a number beyond its bounds.
    """
    for name, limits in _limits_of(type(settings)).items():  # type: ignore[arg-type]
        value = getattr(settings, name)
        if fault := limits.fault(value):
            raise error(f"{where}.{name}: found {fault}")


@dataclass(frozen=True)
class _Limits:
    """What a field of a dataclass may be."""

    choices: tuple[object, ...]
    is_number: bool
    others: tuple[type, ...]
    bounds: Bounds
    unit: str

    def fault(self, value: object) -> str:
        """What was found and what is allowed; empty where the value is allowed."""
        if isinstance(value, self.others) or any(type(value) is type(one) and value == one for one in self.choices):
            return ""
        if not self.is_number or (isinstance(value, str) and self.choices):
            number = " or a number" if self.is_number else ""
            return f"{value!r}{names_allowed(value, [str(one) for one in self.choices])}{number}"
        if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
            return f"{value!r}; a number is needed"
        if self.bounds.holds(value):
            return ""
        return f"{value:g}; allowed: {self.bounds.words(self.unit)} ({self.bounds.why})"


@cache
def _limits_of(stage: type) -> dict[str, _Limits]:
    """Limits of the fields of a dataclass that take numbers, words and switches."""
    made = {}
    for name, hint in get_type_hints(stage, include_extras=True).items():
        marks = getattr(hint, "__metadata__", ())
        bare = get_args(hint)[0] if marks else hint
        parts = get_args(bare) if get_origin(bare) in (Union, UnionType) else (bare,)
        choices = [choice for part in parts if get_origin(part) is Literal for choice in get_args(part)]
        choices += [True, False] if bool in parts else []
        number = float in parts or int in parts
        if not (choices or number):
            continue
        unit = next((mark.symbol for mark in marks if hasattr(mark, "symbol")), "")
        bounds = next((mark for mark in marks if isinstance(mark, Bounds)), UNIT_BOUNDS[unit])
        others = tuple(part for part in parts if isinstance(part, type) and part not in (bool, float, int, str))
        made[name] = _Limits(tuple(choices), number, others, bounds, unit)
    return made
