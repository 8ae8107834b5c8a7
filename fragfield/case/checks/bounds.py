"""Bounds of every number of a case: hard ones refuse a value, soft ones warn; and keys that take no part.

They stand at the inputs (`fragfield_base.bounds`). A key has the bounds of its own, else those of its unit, else those
of a pure number.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from pydantic import BaseModel

from fragfield.case.messages import mark_of, marks_of
from fragfield_base.bounds import UNIT_BOUNDS, Bounds, Entries, OnlyWith
from fragfield_base.errors import show
from fragfield_base.inputs import Parsed, Quantity, QuantityOrFile, Vector
from transition.settings import FILE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pydantic.fields import FieldInfo

    from fragfield.case.schema import CaseTable


_TEXT = 500
_DIRECTIONS = ("round.axis", "plane.normal", "witness.normal", "witness.up")
_SHORTEST = 1e-6
_SHOWN = 1e300  # larger whole numbers are no floats
_NUMBER = re.compile(r"\[\d+\]")


def quantities_of(table: BaseModel, above: str = "") -> Iterator[tuple[str, object, FieldInfo]]:
    """Every value of a case, with its key (entries counted from 1) and its field; of a list of tables the list too."""
    for name, field in type(table).model_fields.items():
        path = f"{above}.{name}" if above else name
        yield from _values(path, getattr(table, name), field)


def _values(path: str, value: object, field: FieldInfo) -> Iterator[tuple[str, object, FieldInfo]]:
    if isinstance(value, BaseModel):
        yield from quantities_of(value, path)
    elif isinstance(value, dict):
        return  # a profile, which `burst_fenicsx.geometry` reads
    elif value is not None:
        yield path, value, field
        for number, entry in enumerate(value if isinstance(value, (list, tuple)) else (), start=1):
            if isinstance(entry, BaseModel):
                yield from quantities_of(entry, f"{path}[{number}]")


def _unit(field: FieldInfo) -> str:
    for mark in marks_of(field):
        quantity = mark.component if isinstance(mark, Vector) else mark
        if isinstance(quantity, Quantity):
            return quantity.symbol
    return ""


def bounds_of(field: FieldInfo) -> Bounds:
    """Bounds of a field, should it hold numbers."""
    return mark_of(field, Bounds) or UNIT_BOUNDS[_unit(field)]


def outside_hard(case: CaseTable) -> Iterator[str]:
    """Faults: numbers, lists and texts that are impossible, as `key: found ...; allowed: ...`."""
    for path, value, field in quantities_of(case):
        key = _NUMBER.sub("", path)
        limit = mark_of(field, Entries)
        if limit is not None and isinstance(value, (list, tuple)) and len(value) > limit.most:
            yield f"{path}: found {len(value)} entries; allowed: at most {limit.most} ({limit.why})"
            continue
        if isinstance(value, str):
            if len(value) > _TEXT and key not in _LONG_TEXTS:
                yield f"{path}: found a text of {len(value)} characters; allowed: at most {_TEXT}"
            continue
        bounds, unit = bounds_of(field), _unit(field)
        for number in _numbers(value):
            if not bounds.holds(number):
                found = f"{number:g} {unit}".rstrip() if abs(number) < _SHOWN or math.isinf(number) else show(number)
                yield f"{path}: found {found}; allowed: {bounds.words(unit)} ({bounds.why})"
                break
        if key in _DIRECTIONS and 0.0 < math.hypot(*_numbers(value)) < _SHORTEST:
            yield f"{path}: found {list(_numbers(value))}; allowed: a direction, at least {_SHORTEST:g} long"


def outside_soft(case: CaseTable) -> Iterator[str]:
    """Warnings: numbers that are unusual, each with what is usual and why."""
    seen = set()
    for path, value, field in quantities_of(case):
        bounds, unit = bounds_of(field), _unit(field)
        if bounds.usual is None:
            continue
        low, high = bounds.usual
        for number in _numbers(value):
            if not low <= number <= high:
                found, usual = f"{number:g} {unit}".rstrip(), f"{low:g} to {high:g} {unit}".rstrip()
                text = f"{_NUMBER.sub('', path)} = {found}: unusual; usual: {usual} ({bounds.why})"
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
        return tuple(entry for entry in value if isinstance(entry, (int, float)))
    return (value,) if isinstance(value, (int, float)) and not isinstance(value, bool) else ()


def choice_faults(table: BaseModel, above: str = "") -> Iterator[str]:
    """Keys that are given where another key excludes them, or left out where it needs them."""
    for path, field, value, mark, choice in _choices(table, above):
        if mark.refused and not mark.holds(choice) and value != field.default:
            yield f"{path}: {mark.words(choice)}"
        elif value is None and choice in mark.needed:
            marks = [one for one in marks_of(field) if isinstance(one, Parsed)]
            words = f", for example {mark.example}" if mark.example else "".join(f": {one.allowed}" for one in marks)
            yield f"{path}: missing; {mark.key} = {show(choice)} needs it{words}"


def _choices(table: BaseModel, above: str = "") -> Iterator[tuple[str, FieldInfo, object, OnlyWith, object]]:
    """Every key that depends on another: its field and value, the mark, and the other key's value."""
    for name, field in type(table).model_fields.items():
        path, value = f"{above}.{name}" if above else name, getattr(table, name)
        for mark in marks_of(field):
            if isinstance(mark, OnlyWith):
                yield path, field, value, mark, _choice(table, mark.key)
        if isinstance(value, BaseModel):
            yield from _choices(value, path)
        for number, entry in enumerate(value if isinstance(value, (list, tuple)) else (), start=1):
            if isinstance(entry, BaseModel):
                yield from _choices(entry, f"{path}[{number}]")


def _choice(table: BaseModel, key: str) -> object:
    value, mark = getattr(table, key), mark_of(type(table).model_fields[key], QuantityOrFile)
    return FILE if mark is not None and mark.is_file(value) else value
