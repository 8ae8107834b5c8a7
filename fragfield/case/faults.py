"""What is wrong in a case: faults as objects until they are printed, what pydantic finds, and bounds of single values.

Bounds stand at the inputs (`fragfield_base.bounds`): hard ones refuse a value, soft ones warn. A key has those of its
own, else those of its unit, else those of a pure number.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import NamedTuple, Self

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from fragfield.case.keys import (
    bounds_of,
    key_path,
    keys_in,
    mark_of,
    marks_of,
    numbers_in,
    paths_of,
    table_at,
    unit_of,
    values_in,
    without_entries,
)
from fragfield.errors import InputError, nearest, nearest_name
from fragfield_base import errors
from fragfield_base.bounds import Entries, OnlyWith
from fragfield_base.errors import show
from fragfield_base.inputs import Parsed, QuantityOrFile
from transition.settings import FILE

_MOST_FAULTS = 12
_MOST_EXPLAINED = 100  # to look for the nearest name takes a millisecond
_KINDS = {
    "float_type": "a number without unit",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_parsing_size": "a whole number of at most 19 digits",
    "bool_type": "true or false",
    "string_type": "a string",
    "list_type": "a list",
    "model_type": "a table",
    "dict_type": "a table",
    "string_too_short": "a string that is not empty",
}
_SAME = {"centre": "position", "center": "position", "position": "centre"}
"""Keys that other tables have for the same."""
_LIMITS = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}


class Fault(NamedTuple):
    """What is wrong at a key, entries counted from 1 ("round[2].casing"): what was found, and what is allowed."""

    key: str
    words: str

    def __str__(self) -> str:
        """As a message has it; words that begin with a space go on where the key ends, ` [outer]: ...`."""
        return f"{self.key}{'' if not self.key or self.words[:1] in ('', ' ') else ': '}{self.words}"


class Doubt(str):
    """A warning: its text begins with the key that it is about."""

    __slots__ = ("key",)
    key: str

    def __new__(cls, key: str, words: str = "") -> Self:
        """The text is the key and, without a space between them, the words; of a copy the text alone is given."""
        made = super().__new__(cls, f"{key}{words}")
        made.key = key
        return made


class CaseFaults(InputError):  # noqa: N818 - faults of the user's case
    """A case is refused.

    Attributes
    ----------
    faults : list of Fault
        All that were found; the message shows the first twelve.
    """

    def __init__(self, source: str, faults: Iterable[Fault]) -> None:
        self.faults = list(dict.fromkeys(faults))
        lines = [str(fault) for fault in self.faults[:_MOST_FAULTS]]
        if len(self.faults) > _MOST_FAULTS:
            lines.append(f"and {len(self.faults) - _MOST_FAULTS} more")
        head = source if len(self.faults) == 1 else f"{source}: {len(self.faults)} faults"
        super().__init__(f"{head}: {lines[0]}" if len(lines) == 1 else "\n  ".join([head, *lines]))


def refuse(source: str, faults: Iterable[Fault]) -> None:
    """Raise CaseFaults where there are any."""
    if found := list(faults):
        raise CaseFaults(source, found)


@contextmanager
def faults_at(source: str, key: str, said: str = ": ") -> Iterator[None]:
    """Put file and key before whatever a stage or a reader refuses within, in place of what it says itself."""
    try:
        yield
    except CaseFaults:
        raise
    except errors.InputError as error:
        raise CaseFaults(source, [Fault(key, str(error).removeprefix(said))]) from None


def explain(error: ValidationError, model: type[BaseModel]) -> list[Fault]:
    """Faults in the order of the schema; after many without the reason."""
    found = error.errors(include_url=False)
    beside = {fault["loc"][:-1] for fault in found if fault["type"] == "missing"}
    unknown = (one["loc"] for one in found if one["type"] == "extra_forbidden" and one["loc"][:-1] in beside)
    meant = {_meant(location, model) for location in islice(unknown, _MOST_EXPLAINED)}
    shown = [fault for fault in found if not (fault["type"] == "missing" and fault["loc"] in meant)]
    explained = [Fault(key_path(fault["loc"]), _words(fault, model)) for fault in shown[:_MOST_EXPLAINED]]
    rest = "not allowed; the reason is given when there are fewer faults"
    return explained + [Fault(key_path(fault["loc"]), rest) for fault in shown[_MOST_EXPLAINED:]]


def _meant(location: tuple[int | str, ...], model: type[BaseModel]) -> tuple[int | str, ...]:
    """Where a misspelt key belongs: a needed key that is missing because of it is not reported a second time."""
    close = _closest(str(location[-1]), keys_in(table_at(location, model)))
    return location[:-1] if close is None else (*location[:-1], close)


def _closest(key: str, names: Sequence[str]) -> str | None:
    same = _SAME.get(key)
    return same if same in names else nearest_name(key, names)


def _words(fault: ErrorDetails, model: type[BaseModel]) -> str:
    kind, found, context, table = fault["type"], fault["input"], fault.get("ctx", {}), table_at(fault["loc"], model)
    if kind == "value_error":
        return str(context["error"])
    if kind == "extra_forbidden":
        names, key = sorted(keys_in(table)), str(fault["loc"][-1])
        close = _closest(key, names)
        hint = f' (did you mean "{close}"?)' if close is not None else ""
        if close is None and (places := [path for path in paths_of(model) if path.rpartition(".")[2] == key]):
            hint = f" (a key of this name belongs to {' or '.join(dict.fromkeys(places))})"
        if key == "bearing":
            hint = " (directions are azimuths here, from +x counter-clockwise)"
        return f"unknown key{hint}; allowed here: {', '.join(names)}"
    if kind == "missing":
        field = table.model_fields[str(fault["loc"][-1])]
        marks = [mark.allowed for mark in marks_of(field) if isinstance(mark, Parsed)]
        return f"missing; needed: {'; '.join([(field.description or 'a value').rstrip('.'), *marks])}"
    if kind == "literal_error":
        hint = nearest(found, context["expected"].split("'")[1::2]) if isinstance(found, str) else ""
        return f"found {show(found)}{hint}; allowed: {context['expected'].replace(chr(39), chr(34))}"
    if kind == "union_tag_invalid":
        kinds = context["expected_tags"].replace("<", "").replace(">", "").split("'")[1::2]
        tag = context["tag"].strip("<>")
        return f"found kind = {show(tag)}{nearest(tag, kinds)}; allowed: {', '.join(kinds)}"
    if kind in _LIMITS:
        words, key = _LIMITS[kind]
        return f"found {show(found)}; allowed: {words} {context[key]:g}"
    if kind == "too_short":
        return f"found {show(found)}; allowed: a list of at least {context['min_length']}"
    if kind in _KINDS:
        last = str(fault["loc"][-1])
        allowed = {"<name>": "a name, a file, or a table", "<number>": "a name, a file, or a number"}
        return f"found {show(found)}; allowed: {allowed.get(last, _KINDS[kind])}"
    return f"found {show(found)}; {fault['msg'][0].lower()}{fault['msg'][1:]}"


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
        elif numbers:
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
