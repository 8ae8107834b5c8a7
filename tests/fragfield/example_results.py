"""Parts of the summary for tests: what is not given is that of a run without findings, example_summary.json."""

from __future__ import annotations

import json
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_origin

from fragfield.results.part import Part, outputs, to_json
from fragfield.results.summary import Summary

AnyPart = TypeVar("AnyPart", bound=Part)

_RUN = json.loads((Path(__file__).parent / "example_summary.json").read_text(encoding="utf-8"))


def example(part: type[AnyPart], **values: Any) -> AnyPart:
    """A part of the summary; lists that are not given are empty, parts that a run need not have are left out."""
    return part.read(complete(part, values))


def complete(part: type[Part], values: dict[str, Any]) -> dict[str, Any]:
    """The values of a part as summary.json has them, with those that are missing."""
    return _completed(part, to_json(values), _RUN if part is Summary else _find(part, Summary, _RUN))


def _completed(part: type[Part], values: dict[str, Any], run: dict[str, Any]) -> dict[str, Any]:
    found = dict(values)
    optional = {one.name for one in fields(part) if one.default is not MISSING or one.default_factory is not MISSING}
    for key, _, kind in outputs(part):
        inner, own = _part(kind), run.get(key)
        own = (own[0] if own else None) if isinstance(own, list) and inner else own
        if inner is not None and key in values and values[key] is not None:
            other = own if isinstance(own, dict) else _find(inner, Summary, _RUN)
            if isinstance(values[key], list):
                found[key] = [_completed(inner, one, other) for one in values[key]]
            elif "dict[" in str(kind):
                found[key] = {
                    name: _completed(inner, one, next(iter(own.values()))) for name, one in values[key].items()
                }
            else:
                found[key] = _completed(inner, values[key], other)
        elif key not in values and key not in optional:
            known = run.get(key, _empty(kind))
            found[key] = [] if inner and isinstance(known, list) else known
    return found


def _empty(kind: Any) -> Any:
    origin, inner = get_origin(kind), get_args(kind)
    if type(None) in inner:
        return None
    if origin is Literal:
        return inner[0]
    if origin is tuple:
        return [] if Ellipsis in inner else [_empty(one) for one in inner]
    if isinstance(kind, type) and issubclass(kind, Part):
        return complete(kind, {})
    return {} if origin is dict else kind()


def _find(part: type[Part], within: type[Part], run: Any) -> dict[str, Any]:
    """The values of the first such part of the run; of one that it has not, none."""
    for key, _, kind in outputs(within):
        inner, value = _part(kind), run.get(key)
        value = value[0] if isinstance(value, list) and value else value
        if inner is None or not isinstance(value, dict):
            continue
        value = next(iter(value.values())) if "dict[" in str(kind) else value
        if inner is part:
            return value
        if found := _find(part, inner, value):
            return found
    return {}


def _part(kind: Any) -> type[Part] | None:
    if isinstance(kind, type) and issubclass(kind, Part):
        return kind
    return next((found for one in get_args(kind) if (found := _part(one)) is not None), None)
