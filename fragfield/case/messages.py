"""Messages for faults that pydantic found: key, what was found, what is allowed."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from pydantic import BaseModel, Tag

from fragfield.errors import nearest, nearest_name
from fragfield_base.errors import show
from fragfield_base.inputs import Parsed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pydantic import ValidationError
    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails

Mark = TypeVar("Mark")


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


def key_path(location: Sequence[int | str]) -> str:
    """Key path as messages show it, entries counted from 1: ("round", 1, "casing") is `round[2].casing`."""
    path = ""
    for step in location:
        if isinstance(step, int):
            path += f"[{step + 1}]"
        elif not step.startswith("<"):  # tags of alternatives are no keys
            path += f".{step}" if path else step
    return path


def explain(error: ValidationError, model: type[BaseModel]) -> list[str]:
    """One line per fault, `key: found ...; allowed: ...`, in the order of the schema; after many the key alone."""
    faults = error.errors(include_url=False)
    beside = {fault["loc"][:-1] for fault in faults if fault["type"] == "missing"}
    unknown = (one["loc"] for one in faults if one["type"] == "extra_forbidden" and one["loc"][:-1] in beside)
    meant = {_meant(location, model) for location in islice(unknown, _MOST_EXPLAINED)}
    shown = [fault for fault in faults if not (fault["type"] == "missing" and fault["loc"] in meant)]
    explained = [f"{key_path(fault['loc'])}: {_text(fault, model)}" for fault in shown[:_MOST_EXPLAINED]]
    return explained + [key_path(fault["loc"]) for fault in shown[_MOST_EXPLAINED:]]


def _meant(location: tuple[int | str, ...], model: type[BaseModel]) -> tuple[int | str, ...]:
    """Where a misspelt key belongs: a needed key that is missing because of it is not reported a second time."""
    close = _closest(str(location[-1]), _keys_beside(location, model))
    return location[:-1] if close is None else (*location[:-1], close)


def _closest(key: str, names: Sequence[str]) -> str | None:
    """The key that is meant by another: one of the same meaning, or of a like name."""
    same = _SAME.get(key)
    return same if same in names else nearest_name(key, names)


def join_faults(source: str, faults: Sequence[str]) -> str:
    """One message for a file: the fault itself when there is one, a list otherwise."""
    if len(faults) == 1:
        return f"{source}: {faults[0]}"
    lines = list(faults[:_MOST_FAULTS])
    if len(faults) > _MOST_FAULTS:
        lines.append(f"and {len(faults) - _MOST_FAULTS} more")
    return "\n  ".join([f"{source}: {len(faults)} faults", *lines])


def _text(fault: ErrorDetails, model: type[BaseModel]) -> str:
    kind, found, context = fault["type"], fault["input"], fault.get("ctx", {})
    if kind == "value_error":
        return str(context["error"])
    if kind == "extra_forbidden":
        names, key = sorted(_keys_beside(fault["loc"], model)), str(fault["loc"][-1])
        close = _closest(key, names)
        hint = _belongs(key, model) if close is None else f' (did you mean "{close}"?)'
        if key == "bearing":
            hint = " (directions are azimuths here, from +x counter-clockwise)"
        return f"unknown key{hint}; allowed here: {', '.join(names)}"
    if kind == "missing":
        return f"missing; needed: {_needed(fault['loc'], model)}"
    if kind == "literal_error":
        hint = nearest(found, _words(context["expected"])) if isinstance(found, str) else ""
        return f"found {show(found)}{hint}; allowed: {context['expected'].replace(chr(39), chr(34))}"
    if kind == "union_tag_invalid":
        kinds = _words(context["expected_tags"].replace("<", "").replace(">", ""))
        tag = context["tag"].strip("<>")
        return f"found kind = {show(tag)}{nearest(tag, kinds)}; allowed: {', '.join(kinds)}"
    if kind in _LIMITS:
        words, key = _LIMITS[kind]
        return f"found {show(found)}; allowed: {words} {context[key]:g}"
    if kind == "too_short":
        return f"found {show(found)}; allowed: a list of at least {context['min_length']}"
    if kind in _KINDS:
        allowed = _KINDS[kind]
        if "<name>" in fault["loc"][-1:]:
            allowed = "a name, a file, or a table"
        if "<number>" in fault["loc"][-1:]:
            allowed = "a name, a file, or a number"
        return f"found {show(found)}; allowed: {allowed}"
    return f"found {show(found)}; {fault['msg'][0].lower()}{fault['msg'][1:]}"


def _words(expected: str) -> list[str]:
    return [part for part in expected.split("'")[1::2] if part]


def tables_in(annotation: object, tag: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    """Models in a type, each with the tag by which a union knows it."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield tag, annotation
    tags = [mark.tag for mark in getattr(annotation, "__metadata__", ()) if isinstance(mark, Tag)]
    for part in get_args(annotation):
        yield from tables_in(part, *tags)


def _table_of(location: Sequence[int | str], model: type[BaseModel]) -> type[BaseModel]:
    """Model of the table in which the last key of a location stands."""
    table = model
    choices: list[tuple[str, type[BaseModel]]] = []
    for step in location[:-1]:
        if isinstance(step, str) and step in table.model_fields:
            choices = list(tables_in(table.model_fields[step].annotation))
        for tag, choice in choices:
            if tag in ("", step):
                table = choice
    return table


def _keys_beside(location: Sequence[int | str], model: type[BaseModel]) -> list[str]:
    return list(_table_of(location, model).model_fields)


def _belongs(key: str, model: type[BaseModel]) -> str:
    """Where a key stands that was put into the wrong table; empty for one that is known nowhere."""
    places = list(dict.fromkeys(path for path in _paths(model) if path.rpartition(".")[2] == key))
    return f" (a key of this name belongs to {' or '.join(places)})" if places else ""


def _paths(model: type[BaseModel], above: str = "") -> Iterator[str]:
    """Key paths of a table and of the tables in it."""
    for name, field in model.model_fields.items():
        path = f"{above}.{name}" if above else name
        yield path
        for _, table in tables_in(field.annotation):
            yield from _paths(table, path)


def _needed(location: Sequence[int | str], model: type[BaseModel]) -> str:
    field = _table_of(location, model).model_fields[str(location[-1])]
    marks = [mark.allowed for mark in marks_of(field) if isinstance(mark, Parsed)]
    description = (field.description or "a value").rstrip(".")
    return "; ".join([description, *marks])


def mark_of(field: FieldInfo, kind: type[Mark]) -> Mark | None:
    """The first mark of a kind; None where there is none."""
    return next((mark for mark in marks_of(field) if isinstance(mark, kind)), None)


def marks_of(field: FieldInfo) -> Iterator[Any]:
    """What a field is annotated with, also within an alternative."""
    yield from field.metadata
    for part in get_args(field.annotation):
        yield from getattr(part, "__metadata__", ())
