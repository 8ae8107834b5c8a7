"""Parts of the summary with plausible values for whatever a test does not say."""

from __future__ import annotations

import types
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

from fragfield.results.part import Part, marks, outputs, plain

AnyPart = TypeVar("AnyPart", bound=Part)


def example(part: type[AnyPart], **values: Any) -> AnyPart:
    """A part of the summary; what is not given is zero, empty, or None where that is allowed."""
    return part.read(complete(part, values))


def complete(part: type[Part], values: dict[str, Any]) -> dict[str, Any]:
    """The values of a part as summary.json has them, with those that are missing."""
    optional = {mark.key or name for name, mark in marks(part).items() if hasattr(part, name)}
    known = {key: kind for key, _, kind in outputs(part)}
    given = {key: _completed(known[key], value) if key in known else value for key, value in plain(values).items()}
    return given | {key: _value(kind) for key, kind in known.items() if key not in given and key not in optional}


def _part(kind: Any) -> type[Part] | None:
    if isinstance(kind, type) and issubclass(kind, Part):
        return kind
    return next((found for one in get_args(kind) if (found := _part(one)) is not None), None)


def _completed(kind: Any, value: Any) -> Any:
    part = _part(kind)
    if part is None or value is None:
        return value
    if isinstance(value, list):
        return [complete(part, one) for one in value]
    if "dict[" in str(kind):
        return {key: complete(part, one) for key, one in value.items()}
    return complete(part, value)


def _value(kind: Any) -> Any:
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (types.UnionType, Union) and type(None) in inner:
        return None
    if origin is Literal:
        return inner[0]
    if origin is tuple:
        return [] if Ellipsis in inner else [_value(one) for one in inner]
    if isinstance(kind, type) and issubclass(kind, Part):
        return complete(kind, {})
    return {} if origin is dict else kind()
