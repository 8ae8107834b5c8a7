"""What is known of a key, read in one place: marks, unit, bounds, tables within, and the values that a case has.

Messages, forms, the reference and `fragfield new` ask here; nothing about a key is written twice.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, Tag
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from fragfield.errors import nearest
from fragfield_base.bounds import UNIT_BOUNDS, Bounds, OnlyWith
from fragfield_base.inputs import NumberOrWord, Parsed, Quantity, Vector

Mark = TypeVar("Mark")

_ENTRY = re.compile(r"\[\d+\]")
_OWN = ("uncertainty", "seed", "title", "document", "official")


@cache  # fields live as long as their tables' classes
def marks_of(field: FieldInfo) -> tuple[Any, ...]:
    """What a field is annotated with, also within an alternative."""
    within = (getattr(part, "__metadata__", ()) for part in get_args(field.annotation))
    return (*field.metadata, *chain.from_iterable(within))


def mark_of(field: FieldInfo, kind: type[Mark]) -> Mark | None:
    """The first mark of a kind; None where there is none."""
    return next((mark for mark in marks_of(field) if isinstance(mark, kind)), None)


@cache
def unit_of(field: FieldInfo) -> str:
    """SI unit of a field or of its components; empty for pure numbers and words."""
    marks = (mark.component if isinstance(mark, Vector) else mark for mark in marks_of(field))
    return next((mark.symbol for mark in marks if isinstance(mark, Quantity)), "")


@cache
def bounds_of(field: FieldInfo) -> Bounds:
    """Bounds of a field, should it hold numbers: its own, else those of its unit."""
    return mark_of(field, Bounds) or UNIT_BOUNDS[unit_of(field)]


@dataclass(frozen=True)
class Key:
    """A key of a table."""

    name: str
    path: str
    """From the top of the file, without entries, with the table's kind: "exposed[road].width"."""
    field: FieldInfo
    meaning: str
    needed: bool
    """Whether the table must have it."""
    default: Any
    """As the stages have it (SI); None where there is none."""
    marks: tuple[Any, ...]
    """Also those of the entries of a list."""
    types: tuple[Any, ...]
    """What a value, or an entry of a list, may be: types, models of tables, choices as `Literal`."""
    listed: bool

    @property
    def tables(self) -> tuple[type[BaseModel], ...]:
        """Models of the tables that it may hold."""
        return tuple(one for one in self.types if isinstance(one, type) and issubclass(one, BaseModel))

    @property
    def parsed(self) -> Parsed | None:
        """The mark that reads a value, or each entry of a list."""
        return next((mark for mark in self.marks if isinstance(mark, Parsed)), None)

    @property
    def quantity(self) -> Quantity | None:
        """The mark of a value with a dimension, or of its components."""
        mark = self.parsed.component if isinstance(self.parsed, Vector) else self.parsed
        return mark if isinstance(mark, Quantity) else None

    @property
    def unit(self) -> str:
        """SI unit; empty for pure numbers and words."""
        return self.quantity.symbol if self.quantity else ""

    @property
    def bounds(self) -> Bounds | None:
        """Its own bounds."""
        return next((mark for mark in self.marks if isinstance(mark, Bounds)), None)

    @property
    def allowed(self) -> str:
        """What the mark says of values; empty without one."""
        return str(self.parsed.allowed) if self.parsed else ""

    @property
    def example(self) -> str:
        """As the file has it; empty where there is none."""
        if isinstance(self.parsed, NumberOrWord):
            return f"{self.parsed.example}"
        return self.parsed.example if isinstance(self.parsed, (Quantity, Vector)) else ""

    @property
    def choices(self) -> tuple[Any, ...]:
        """Words, or numbers, among which to choose."""
        if self.parsed is not None:
            return self.parsed.words if isinstance(self.parsed, Quantity) else ()
        words = [word for part in self.types if get_origin(part) is Literal for word in get_args(part)]
        return tuple(words) if len(words) > 1 else ()

    @property
    def form(self) -> str:
        """How it is edited: "text", "number", "value" (any of TOML), "choice", "switch", "table" or "tables"."""
        if self.tables and len(self.tables) == len(self.types):
            return "tables" if self.listed else "table"
        if self.listed or self.parsed is not None:
            return "text" if isinstance(self.parsed, Quantity) and not self.listed else "value"
        literal = [part for part in self.types if get_origin(part) is Literal]
        if len(literal) == len(self.types) and all(isinstance(one, str) for part in literal for one in get_args(part)):
            return "choice" if self.choices else "text"
        kinds = {bool: "switch", str: "text", float: "number", int: "number"}
        forms = {kinds.get(one, "value") for one in self.types}
        return forms.pop() if len(forms) == 1 else "value"

    def applies(self, table: Mapping[str, Any], defaults: Mapping[str, Any]) -> bool:
        """Whether it is read with what a table, else its defaults, says of the other key."""
        mark = next((mark for mark in self.marks if isinstance(mark, OnlyWith)), None)
        return mark is None or mark.holds(table.get(mark.key, defaults.get(mark.key)))

    def written(self, value: Any) -> Any:  # noqa: ANN401 - any value of TOML
        """A value (SI) as the file has it, in the unit of the example."""
        quantity = self.quantity
        if isinstance(value, (list, tuple)):
            return [f"{one:g} {self.unit}" if quantity and isinstance(one, float) else one for one in value]
        return quantity.in_unit_of_example(value) if quantity and isinstance(value, float) else value


@cache
def keys_of(table: type[BaseModel], path: str = "") -> tuple[Key, ...]:
    """Keys of a table that stands at a path."""
    return tuple(_key(name, f"{path}.{name}".removeprefix("."), field) for name, field in table.model_fields.items())


def _key(name: str, path: str, field: FieldInfo) -> Key:
    marks, types, listed = [*field.metadata], [], False
    waiting: list[Any] = [field.annotation]
    while waiting:
        part = waiting.pop(0)
        if hasattr(part, "__metadata__"):
            marks += part.__metadata__
            waiting.insert(0, get_args(part)[0])
        elif get_origin(part) in (Union, UnionType, list):
            listed = listed or get_origin(part) is list
            waiting = [*get_args(part), *waiting]
        elif part is not NoneType:
            types.append(part)
    default = field.get_default(call_default_factory=True)
    default = None if default is PydanticUndefined else default
    meaning = field.description or ""
    return Key(name, path, field, meaning, field.is_required(), default, tuple(marks), tuple(types), listed)


def kind_of(table: type[BaseModel]) -> str:
    """Kind of a table that is one of several kinds; else empty."""
    kinds = get_args(table.model_fields["kind"].annotation) if "kind" in table.model_fields else ()
    return str(kinds[0]) if len(kinds) == 1 else ""


def tables_at(path: Sequence[str], model: type[BaseModel]) -> list[type[BaseModel]]:
    """Models of the tables at a place, without numbers of entries; raises KeyError where there is none."""
    found = [model]
    for step in path:
        found = [one for table in found if step in table.model_fields
                 for _, one in tables_in(table.model_fields[step].annotation)]  # fmt: skip
        if not found:
            raise KeyError(step)
    return found


def keys_in(table: type[BaseModel]) -> list[str]:
    """Keys of a table in the order of the file."""
    return list(table.model_fields)


def tables_in(annotation: object, tag: str = "") -> Iterator[tuple[str, type[BaseModel]]]:
    """Models in a type, each with the tag by which a union knows it."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield tag, annotation
    tags = [mark.tag for mark in getattr(annotation, "__metadata__", ()) if isinstance(mark, Tag)]
    for part in get_args(annotation):
        yield from tables_in(part, *tags)


def table_at(location: Sequence[int | str], model: type[BaseModel]) -> type[BaseModel]:
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


def paths_of(model: type[BaseModel], above: str = "") -> Iterator[str]:
    """Key paths of a table and of the tables in it, without numbers of entries."""
    for name, field in model.model_fields.items():
        path = f"{above}.{name}" if above else name
        yield path
        for _, table in tables_in(field.annotation):
            yield from paths_of(table, path)


def key_path(location: Sequence[int | str]) -> str:
    """Key path as messages show it, entries counted from 1: ("round", 1, "casing") is `round[2].casing`."""
    path = ""
    for step in location:
        if isinstance(step, int):
            path += f"[{step + 1}]"
        elif not step.startswith("<"):  # tags of alternatives are no keys
            path += f".{step}" if path else step
    return path


def without_entries(path: str) -> str:
    """A key path without the numbers of entries: "round[2].casing" is "round.casing"."""
    return _ENTRY.sub("", path)


def values_in(table: BaseModel, above: str = "") -> Iterator[tuple[str, BaseModel, FieldInfo, object]]:
    """Every key of a case, entries counted from 1, with its table, field and value; those of tables within follow."""
    for name, field in type(table).model_fields.items():
        path, value = f"{above}.{name}" if above else name, getattr(table, name)
        yield path, table, field, value
        if isinstance(value, BaseModel):
            yield from values_in(value, path)
        for number, entry in enumerate(value if isinstance(value, (list, tuple)) else (), start=1):
            if isinstance(entry, BaseModel):
                yield from values_in(entry, f"{path}[{number}]")


def numbers_in(value: object) -> tuple[float, ...]:
    """The numbers of a value or of its components."""
    if isinstance(value, (list, tuple)):
        return tuple(entry for entry in value if isinstance(entry, (int, float)))
    return (value,) if isinstance(value, (int, float)) and not isinstance(value, bool) else ()


def unit_of_key(key: str, model: type[BaseModel]) -> str | None:
    """SI unit of what a dotted key of a model holds (empty: a pure number), None where it is not numeric.

    Entries of lists, by `*`, number or name, are not checked here. Raises ValueError: there is no such key, or it holds
    a table; the text is that of a message without the key.
    """
    models = [model]
    field: FieldInfo | None = None
    in_list = False
    for step in key.split("."):
        if in_list:
            in_list = False
            continue
        names = sorted({name for model in models for name in model.model_fields})
        field = next((model.model_fields[step] for model in models if step in model.model_fields), None)
        if field is None:
            if not names:
                raise ValueError(f"goes into a value: there is no {step!r} in it")
            raise ValueError(f'unknown key "{step}"{nearest(step, names)}; allowed here: {", ".join(names)}')
        models = [model for _, model in tables_in(field.annotation)]
        in_list = bool(models) and "list[" in str(field.annotation)
    assert field is not None
    if in_list or (models and "<name>" not in str(field.annotation) + str(field.metadata)):
        raise ValueError("is a table; needed: the key of a value")
    if key.partition(".")[0] in _OWN:
        raise ValueError("cannot be uncertain: it changes nothing that is computed, or chooses the random numbers")
    if mark_of(field, Vector) is not None:
        return None
    words = str(field.annotation)
    if unit_of(field) or mark_of(field, NumberOrWord) is not None:
        return unit_of(field)
    return "" if "float" in words and "tuple" not in words and "list" not in words else None
