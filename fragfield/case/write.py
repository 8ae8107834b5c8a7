"""A case as TOML: what it says, every default spelled out, in SI; reading it gives the same case."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.case.schema import Case

__all__ = ["measured", "plain", "tables_to_toml", "to_toml", "toml_value"]

_COMMENT = "#"  # no key of a case
_BARE_KEY = re.compile(r"^[A-Za-z0-9_-]+$")


def plain(case: Case, *, units: bool = False) -> dict[str, Any]:
    """A case as nested dicts and lists: floats in SI, or with `units` strings as the case file has them."""
    return case.model_dump(mode="json", exclude_none=True, context={"units": "si" if units else None})


def measured(case: Case) -> dict[str, Any]:
    """A case as nested dicts and lists for tables: values with a dimension as `quantities.Measured`."""
    return case.model_dump(mode="python", exclude_none=True, context={"units": "measured"})


def to_toml(case: Case, *, brief: bool = False) -> str:
    """A case as the text of a TOML file.

    With `brief` for reading: in everyday units, ten digits, and a round that is like another says so.
    """
    if not brief:
        return tables_to_toml(plain(case, units=True))
    tables = case.model_dump(mode="json", exclude_none=True, context={"units": "readable"})
    tables["round"] = list(_brief(tables["round"]))
    return tables_to_toml(_ten_digits(tables))


def _ten_digits(value: Any) -> Any:  # noqa: ANN401 - any value of a table
    """Tables with every pure number to ten digits."""
    if isinstance(value, dict):
        return {key: _ten_digits(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_ten_digits(entry) for entry in value]
    return float(f"{value:.10g}") if isinstance(value, float) else value


def tables_to_toml(tables: Mapping[str, Any]) -> str:
    """Nested dicts and lists as the text of a TOML file."""
    return "\n".join(_table((), tables)).lstrip("\n") + "\n"


def _brief(rounds: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Rounds of which each keeps the keys in which it differs from the first one that differs in few."""
    long = ("profile", "mesh", "explosive", "casing")
    for number, entry in enumerate(rounds):
        like = next((one for one in rounds[:number] if all(one.get(key) == entry.get(key) for key in long)), None)
        if like is None:
            yield entry
        else:
            words = f"{', '.join(key for key in long if key in entry)} as of {json.dumps(like['name'])}"
            yield {_COMMENT: words, **{key: value for key, value in entry.items() if key not in long}}


def _is_table_list(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(entry, dict) for entry in value)


def _table(path: tuple[str, ...], table: Mapping[str, Any]) -> Iterator[str]:
    # TOML wants a table's own values before its sub-tables.
    for key, value in table.items():
        if key == _COMMENT:
            yield f"# {value}"
        elif not isinstance(value, dict) and not _is_table_list(value):
            yield f"{_key(key)} = {toml_value(value)}"
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


def toml_value(value: object) -> str:
    """A value as TOML has it in a line."""
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
        return "[" + ", ".join(toml_value(entry) for entry in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {toml_value(entry)}" for key, entry in value.items()) + "}"
    message = f"a case holds no {type(value).__name__}"
    raise TypeError(message)
