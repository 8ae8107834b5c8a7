"""Parts of summary.json: frozen dataclasses whose fields carry what views need to know of a value.

    recommended: float | None = out("Recommended distance", "m", rounding="up", views="sweep compare")

Reading, writing, the schema, the catalogue of quantities, columns and the guide's tables are made from them. A field
with `default=None` is left out of the file where it is None; any other None is null there.
"""

from __future__ import annotations

import dataclasses
import math
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Self, dataclass_transform, get_args, get_type_hints

from fragfield.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from pydantic import TypeAdapter


@dataclasses.dataclass(frozen=True)
class Out:
    """What views need to know of a value of summary.json.

    Attributes
    ----------
    label, note : str
        What it is, and more on it.
    unit : str
        In SI; empty for a pure number.
    views : tuple of str
        Where it is listed: "terminal" (with the report), "compare", "sweep", "convergence", "uncertainty".
    name : str
        Its column in tables of studies, where the key alone would not do.
    rounding : str
        Of a distance in whole metres: "up" where larger is safer, "nearest" for others.
    digits : int
        Significant digits of any other value.
    percent : bool
        A fraction that is shown in per cent.
    error : str
        Path of its standard error.
    key : str
        Its key in the file, where that is no name.
    """

    label: str = ""
    unit: str = ""
    note: str = ""
    views: tuple[str, ...] = ()
    name: str = ""
    rounding: str = ""
    digits: int = 4
    percent: bool = False
    error: str = ""
    key: str = ""


def out(
    label: str,
    unit: str = "",
    *,
    views: str = "",
    default: Any = dataclasses.MISSING,  # noqa: ANN401
    **more: Any,
) -> Any:  # noqa: ANN401 - a field of any type
    """Field of a part; `views` as words, the rest as of `Out`."""
    mark = Out(label, unit, views=tuple(views.split()), **more)
    schema = {"title": mark.label, "json_schema_extra": {"unit": unit} if unit else {}}
    schema |= {"description": mark.note} if mark.note else {}
    schema |= {"alias": mark.key} if mark.key else {}
    value = {"default_factory": lambda: default} if isinstance(default, dict) else {"default": default}
    return dataclasses.field(**value, metadata={"out": mark, **schema})


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(out, dataclasses.field))
class Part:
    """A part of the summary; subclasses are frozen dataclasses with keyword arguments."""

    whole: ClassVar[bool] = False
    """Whether catalogue and guide list it as one value."""
    __pydantic_config__: ClassVar[Any] = {"extra": "forbid", "populate_by_name": True}

    def __init_subclass__(cls) -> None:
        dataclasses.dataclass(frozen=True, kw_only=True)(cls)

    @classmethod
    def known(cls, **values: Any) -> Self:
        """A part of which these values alone are known; others are None."""
        made = cls.__new__(cls)
        for name in marks(cls):
            object.__setattr__(made, name, values.get(name))
        return made

    @classmethod
    def of_stage(cls, values: Mapping[str, Any]) -> Self:
        """A part from what a stage or another version gives, which may hold more than a view or study uses."""
        return cls._read(_filled(cls, to_json(values), known_alone=True))

    @classmethod
    def read(cls, values: object) -> Self:
        """A part from the values of JSON; NaN and infinity are None, or NaN where a number is never None.

        Raises InputError: a key is missing, unknown, or its value is of another type.
        """
        return cls._read(_filled(cls, to_json(values)))

    @classmethod
    def _read(cls, values: object) -> Self:
        from pydantic import ValidationError

        try:
            return adapter(cls).validate_python(values)  # type: ignore[arg-type]  # a class is hashable
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(key) for key in first["loc"])
            raise InputError(f"{where}: {first['msg']}") from None


@cache
def adapter(part: type[Any]) -> TypeAdapter[Any]:
    """Pydantic's reader of a part."""
    from pydantic import TypeAdapter

    return TypeAdapter(part)


def value_at(summary: object, path: str) -> Any:  # noqa: ANN401 - a value of JSON
    """The value at a path of keys of the file, joined by dots; None where there is none."""
    found: Any = summary
    for key in path.split("."):
        name = _names(type(found)).get(key, key)  # type: ignore[arg-type]
        found = found.get(key) if isinstance(found, dict) else getattr(found, name, None)
    return found


@cache
def _names(part: type[Any]) -> dict[str, str]:
    return {mark.key: name for name, mark in marks(part).items() if mark.key} if issubclass(part, Part) else {}


def marks(part: type[Part]) -> dict[str, Out]:
    """The mark of each field."""
    return {one.name: one.metadata.get("out", Out()) for one in dataclasses.fields(part)}  # type: ignore[arg-type]


def outputs(part: type[Part]) -> Iterator[tuple[str, Out, Any]]:
    """Key, mark and type of each field."""
    types = get_type_hints(part)
    for name, mark in marks(part).items():
        yield mark.key or name, mark, types[name]


@cache
def _kinds(part: type[Part]) -> dict[str, tuple[bool, type[Part] | None]]:
    """By key whether it is a number that is never null, and the part that it holds."""
    return {key: (kind is float, part_in(kind)) for key, _, kind in outputs(part)}


def _filled(part: type[Part], values: Any, *, known_alone: bool = False) -> Any:  # noqa: ANN401 - of JSON
    """The values of a part, null as NaN in numbers that are never None; `known_alone`: without unknown keys."""
    if isinstance(values, list):
        return [_filled(part, one, known_alone=known_alone) for one in values]
    if not isinstance(values, dict):
        return values
    kinds, found = _kinds(part), {}  # type: ignore[arg-type]
    for key, value in values.items():
        number, inner = kinds.get(key, (False, None))
        if inner is not None:
            found[key] = _filled(inner, value, known_alone=known_alone)
        elif key in kinds or not known_alone:
            found[key] = math.nan if number and value is None else value
    return found


def part_in(kind: Any) -> type[Part] | None:  # noqa: ANN401 - a type
    """The part that a type holds: alone, in a tuple, or beside None."""
    if isinstance(kind, type) and issubclass(kind, Part):
        return kind
    inner = (part_in(one) for one in get_args(kind) if not str(kind).startswith("dict"))
    return next((one for one in inner if one is not None), None)


def with_texts(value: Any, change: Callable[[str], str]) -> Any:  # noqa: ANN401 - of the kind that is given
    """A part, list or table in which every text is changed."""
    if isinstance(value, str):
        return change(value)
    if isinstance(value, Part):
        names = (one.name for one in dataclasses.fields(value))  # type: ignore[arg-type]
        changed = {name: with_texts(getattr(value, name), change) for name in names}
        return dataclasses.replace(value, **changed)  # type: ignore[type-var]
    if isinstance(value, dict):
        return {key: with_texts(entry, change) for key, entry in value.items()}
    return type(value)(with_texts(one, change) for one in value) if isinstance(value, (list, tuple)) else value


def to_json(value: object) -> Any:  # noqa: ANN401 - a value of JSON
    """A part, or values of a stage, as JSON has them: what was never reached, NaN and infinity, is null."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Part):
        entries = ((one, getattr(value, one.name)) for one in dataclasses.fields(value))  # type: ignore[arg-type]
        return {
            one.metadata.get("out", Out()).key or one.name: to_json(entry)
            for one, entry in entries
            if entry is not None or one.default is not None
        }
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return to_json(vars(value))
    if isinstance(value, dict):
        return {str(key): to_json(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_json(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
