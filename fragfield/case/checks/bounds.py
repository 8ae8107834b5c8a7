"""Bounds of every number of a case: hard ones refuse a value, soft ones warn; and keys that take no part.

They stand at the inputs (`fragfield_base.bounds`). A key has the bounds of its own, else those of its unit, else those
of a pure number.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from pydantic import BaseModel

from fragfield.case.faults import Doubt, Fault
from fragfield.case.keys import bounds_of, mark_of, marks_of, numbers_in, unit_of, values_in, without_entries
from fragfield_base.bounds import Entries, OnlyWith
from fragfield_base.errors import show
from fragfield_base.inputs import Parsed, QuantityOrFile
from transition.settings import FILE

_TEXT = 500
_LONG_TEXTS = (
    "round.explosive.source", "round.casing.source", "round.mesh", "flight.drag", "flight.ground.map",
    "uncertainty.input.source",
)  # fmt: skip
_DIRECTIONS = ("round.axis", "plane.normal", "witness.normal", "witness.up")
_SHORTEST = 1e-6
_SHOWN = 1e300  # larger whole numbers are no floats


def outside_hard(case: BaseModel) -> Iterator[Fault]:
    """Numbers, lists and texts that are impossible."""
    for path, _, field, value in values_in(case):
        limit, numbers = mark_of(field, Entries), numbers_in(value)
        if limit is not None and isinstance(value, (list, tuple)) and len(value) > limit.most:
            yield Fault(path, f"found {len(value)} entries; allowed: at most {limit.most} ({limit.why})")
        elif isinstance(value, str):
            if len(value) > _TEXT and without_entries(path) not in _LONG_TEXTS:
                yield Fault(path, f"found a text of {len(value)} characters; allowed: at most {_TEXT}")
        else:
            bounds, unit = bounds_of(field), unit_of(field)
            number = next((one for one in numbers if not bounds.holds(one)), None)
            if number is not None:
                found = f"{number:g} {unit}".rstrip() if abs(number) < _SHOWN or math.isinf(number) else show(number)
                yield Fault(path, f"found {found}; allowed: {bounds.words(unit)} ({bounds.why})")
            if without_entries(path) in _DIRECTIONS and 0.0 < math.hypot(*numbers) < _SHORTEST:
                yield Fault(path, f"found {list(numbers)}; allowed: a direction, at least {_SHORTEST:g} long")


def outside_soft(case: BaseModel) -> list[Doubt]:
    """Warnings: numbers that are unusual, each with what is usual and why."""
    found = []
    for path, _, field, value in values_in(case):
        bounds, unit = bounds_of(field), unit_of(field)
        if bounds.usual is None:
            continue
        low, high = bounds.usual
        number = next((one for one in numbers_in(value) if not low <= one <= high), None)
        if number is not None:
            usual = f"{low:g} to {high:g} {unit}".rstrip()
            value = f"{number:g} {unit}".rstrip()
            found.append(Doubt(without_entries(path), f" = {value}: unusual; usual: {usual} ({bounds.why})"))
    return list(dict.fromkeys(found))


def choice_faults(table: BaseModel, above: str = "") -> Iterator[Fault]:
    """Keys that are given where another key excludes them, or left out where it needs them."""
    for path, owner, field, value in values_in(table, above):
        for mark in marks_of(field):
            if not isinstance(mark, OnlyWith):
                continue
            choice = getattr(owner, mark.key)
            file = mark_of(type(owner).model_fields[mark.key], QuantityOrFile)
            choice = FILE if file is not None and file.is_file(choice) else choice
            if mark.refused and not mark.holds(choice) and value != field.default:
                yield Fault(path, mark.words(choice))
            elif value is None and choice in mark.needed:
                marks = [one for one in marks_of(field) if isinstance(one, Parsed)]
                words = (
                    f", for example {mark.example}" if mark.example else "".join(f": {one.allowed}" for one in marks)
                )
                yield Fault(path, f"missing; {mark.key} = {show(choice)} needs it{words}")
