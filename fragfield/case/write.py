"""A case as TOML: what it says, every default spelled out, in SI; reading it gives the same case."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.case.schema import Case

__all__ = ["plain", "to_toml"]

_BARE_KEY = re.compile(r"^[A-Za-z0-9_-]+$")


def plain(case: Case, *, units: bool = False) -> dict[str, Any]:
    """A case as nested dicts and lists: floats in SI, or with `units` strings as the case file has them."""
    return case.model_dump(mode="json", exclude_none=True, context={"units": units})


def to_toml(case: Case) -> str:
    """A case as the text of a TOML file."""
    return "\n".join(_table((), plain(case, units=True))).lstrip("\n") + "\n"


def _is_table_list(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(entry, dict) for entry in value)


def _table(path: tuple[str, ...], table: Mapping[str, Any]) -> Iterator[str]:
    # TOML wants a table's own values before its sub-tables.
    for key, value in table.items():
        if not isinstance(value, dict) and not _is_table_list(value):
            yield f"{_key(key)} = {_value(value)}"
    for key, value in table.items():
        name = ".".join(_key(step) for step in (*path, key))
        if isinstance(value, dict):
            yield f"\n[{name}]"
            yield from _table((*path, key), value)
        elif _is_table_list(value):
            for entry in value:
                yield f"\n[[{name}]]"
                yield from _table((*path, key), entry)


def _key(name: str) -> str:
    return name if _BARE_KEY.match(name) else json.dumps(name)


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON's escapes are TOML's, but for DEL, which TOML wants escaped.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(entry) for entry in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_value(entry)}" for key, entry in value.items()) + "}"
    message = f"a case holds no {type(value).__name__}"
    raise TypeError(message)
