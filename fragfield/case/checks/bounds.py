"""Physical bounds of every number of a case, with reasons: hard bounds refuse a value, soft ones warn.

They stand in bounds.toml. A key has the bounds of its own, else those of its unit, else those of a pure number. Hard
bounds are wide: beyond them the number is a slip of the pen or of a unit, or the program cannot compute it. Soft bounds
are what is usual; what lies outside is computed and said in log, `check` and report.
"""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import BaseModel

from fragfield.case.messages import marks_of
from fragfield.case.units.compound import Vector
from fragfield.case.units.quantities import Quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pydantic.fields import FieldInfo

    from fragfield.case.schema import Case

__all__ = ["COUNTS", "KEYS", "UNITS", "Bounds", "bounds_of", "outside_hard", "outside_soft", "quantities_of"]


@dataclass(frozen=True)
class Bounds:
    """What is possible (`low` to `high`) and what is usual (`usual`), in SI, with the reason."""

    low: float
    high: float
    why: str
    usual: tuple[float, float] | None = None


_TABLES = tomllib.loads((Path(__file__).parent / "bounds.toml").read_text(encoding="utf-8"))


def _bounds(table: str) -> dict[str, Bounds]:
    return {
        name: Bounds(found["low"], found["high"], found["why"], tuple(found["usual"]) if "usual" in found else None)
        for name, found in _TABLES[table].items()
    }


UNITS = _bounds("units")
"""By the SI unit of a quantity; every unit of the schema stands here."""
KEYS = _bounds("keys")
"""By key, without the numbers of list entries."""
COUNTS: dict[str, tuple[int, str]] = {name: (found["most"], found["why"]) for name, found in _TABLES["counts"].items()}
"""Entries that a list may have."""

_NO_PURE = Bounds(-1e9, 1e9, "larger pure numbers have no meaning here")
_TEXT = 500
_DIRECTIONS = ("round.axis", "plane.normal", "witness.normal", "witness.up")
_SHORTEST = 1e-6
_NUMBER = re.compile(r"\[\d+\]")


def quantities_of(table: BaseModel, above: str = "") -> Iterator[tuple[str, object, FieldInfo | None]]:
    """Every value of a case that is no table, with its key (entries counted from 1) and its field."""
    for name, field in type(table).model_fields.items():
        path = f"{above}.{name}" if above else name
        yield from _values(path, getattr(table, name), field)


def _values(path: str, value: object, field: FieldInfo) -> Iterator[tuple[str, object, FieldInfo | None]]:
    if isinstance(value, BaseModel):
        yield from quantities_of(value, path)
    elif isinstance(value, dict):
        return  # a profile, which `burst_fenicsx.geometry` reads
    elif isinstance(value, (list, tuple)) and any(isinstance(entry, BaseModel) for entry in value):
        yield path, len(value), None
        for number, entry in enumerate(value, start=1):
            yield from _values(f"{path}[{number}]", entry, field)
    elif value is not None:
        yield path, value, field


def bounds_of(path: str, field: FieldInfo) -> Bounds | None:
    """Bounds of a key; None where it is not numeric."""
    key = _NUMBER.sub("", path)
    if key in KEYS:
        return KEYS[key]
    for mark in marks_of(field):
        if isinstance(mark, Quantity):
            return UNITS[mark.symbol]
        if isinstance(mark, Vector):
            return UNITS[mark.component.symbol] if mark.component is not None else _NO_PURE
    return _NO_PURE


def outside_hard(case: Case) -> Iterator[str]:
    """Faults: numbers, lists and texts that are impossible, as `key: found ...; allowed: ...`."""
    for path, value, field in quantities_of(case):
        key = _NUMBER.sub("", path)
        entries = value if field is None else len(value) if isinstance(value, (list, tuple)) else 0
        if key in COUNTS and isinstance(entries, int) and entries > COUNTS[key][0]:
            most, why = COUNTS[key]
            yield f"{path}: found {entries} entries; allowed: at most {most} ({why})"
            continue
        if field is None:
            continue
        if isinstance(value, str):
            if len(value) > _TEXT and key not in _LONG_TEXTS:
                yield f"{path}: found a text of {len(value)} characters; allowed: at most {_TEXT}"
            continue
        if (bounds := bounds_of(path, field)) is None:
            continue
        for number in _numbers(value):
            if not bounds.low <= number <= bounds.high:
                yield f"{path}: found {_shown(number, field)}; allowed: {_range(bounds, field)} ({bounds.why})"
                break
        if key in _DIRECTIONS and 0.0 < math.hypot(*_numbers(value)) < _SHORTEST:
            yield f"{path}: found {list(_numbers(value))}; allowed: a direction, at least {_SHORTEST:g} long"


def outside_soft(case: Case) -> Iterator[str]:
    """Warnings: numbers that are unusual, each with what is usual and why."""
    seen = set()
    for path, value, field in quantities_of(case):
        if field is None or isinstance(value, str):
            continue
        bounds = bounds_of(path, field)
        if bounds is None or bounds.usual is None:
            continue
        low, high = bounds.usual
        for number in _numbers(value):
            if not low <= number <= high:
                usual = f"{low:g} to {_shown(high, field)}"
                text = f"{_NUMBER.sub('', path)} = {_shown(number, field)}: unusual; usual: {usual} ({bounds.why})"
                if text not in seen:
                    seen.add(text)
                    yield text
                break


_LONG_TEXTS = (
    "round.explosive.source", "round.casing.source", "round.mesh", "flight.drag", "flight.ground.map",
    "uncertainty.input.source",
)  # fmt: skip


def _numbers(value: object) -> tuple[float, ...]:
    if isinstance(value, (list, tuple)):
        return tuple(float(entry) for entry in value if isinstance(entry, (int, float)))
    return (float(value),) if isinstance(value, (int, float)) and not isinstance(value, bool) else ()


def _unit(field: FieldInfo) -> str:
    for mark in marks_of(field):
        if isinstance(mark, Quantity):
            return f" {mark.symbol}"
        if isinstance(mark, Vector) and mark.component is not None:
            return f" {mark.component.symbol}"
    return ""


def _shown(number: float, field: FieldInfo) -> str:
    return f"{number:g}{_unit(field)}"


def _range(bounds: Bounds, field: FieldInfo) -> str:
    return f"{bounds.low:g} to {_shown(bounds.high, field)}"
