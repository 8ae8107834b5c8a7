"""Writes a case as TOML with every default, in SI; reading it gives the same case."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fragfield.case.schema import CaseTable
from fragfield_base.errors import show


def plain(case: CaseTable, *, units: bool = False) -> dict[str, Any]:
    """A case as nested dicts and lists: floats in SI, or with `units` strings as the case file has them."""
    return case.model_dump(mode="json", exclude_none=True, context={"units": "si" if units else None})


def to_toml(case: CaseTable, *, brief: bool = False) -> str:
    """A case as the text of a TOML file.

    With `brief` for reading: in everyday units, ten digits, and a round that is like another says so.
    """
    if not brief:
        return tables_to_toml(plain(case, units=True))
    import tomlkit

    tables = _ten_digits(case.model_dump(mode="json", exclude_none=True, context={"units": "readable"}))
    rounds = list(_brief(tables["round"]))
    document = tomlkit.item({**tables, "round": [entry for entry, _ in rounds]})
    for table, (_, comment) in zip(document["round"], rounds, strict=True):
        if comment:
            table.comment(comment)
    return document.as_string().strip() + "\n"


def tables_to_toml(tables: Mapping[str, Any]) -> str:
    """Nested dicts and lists as the text of a TOML file."""
    import tomlkit

    return tomlkit.item(tables).as_string().strip() + "\n"


def toml_value(value: object) -> str:
    """A value as TOML has it in a line."""
    import tomlkit

    if isinstance(value, dict):
        table = tomlkit.inline_table()
        table.update(value)
        return table.as_string()
    if isinstance(value, (list, tuple)):
        array = tomlkit.array()
        array.extend(value)
        return array.as_string()
    return tomlkit.item(value).as_string()


def _brief(rounds: list[dict[str, Any]]) -> Iterator[tuple[dict[str, Any], str]]:
    """Rounds, each with the keys in which it differs from the first one that differs in few, and a comment."""
    long = ("profile", "mesh", "explosive", "casing")
    for number, entry in enumerate(rounds):
        like = next((one for one in rounds[:number] if all(one.get(key) == entry.get(key) for key in long)), None)
        if like is None:
            yield entry, ""
        else:
            words = f"{', '.join(key for key in long if key in entry)} as of {json.dumps(like['name'])}"
            yield {key: value for key, value in entry.items() if key not in long}, words


def _ten_digits(value: Any) -> Any:  # noqa: ANN401 - any value of a table
    if isinstance(value, dict):
        return {key: _ten_digits(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_ten_digits(entry) for entry in value]
    return float(f"{value:.10g}") if isinstance(value, float) else value


_WORDS_ONLY = ("title", "notes", "source")  # change nothing that is computed
_NOT_COMPUTED = ("document.", "uncertainty.", "uncertainty[")  # tables that no run depends on


def _flat(value: object, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from _flat(entry, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        for i, entry in enumerate(value, start=1):
            yield from _flat(entry, f"{path}[{i}]")
    else:
        yield path, value


def differences(
    stored: CaseTable,
    now: CaseTable,
    within: Sequence[str] | None = None,
    *,
    words: tuple[str, str] = ("stored", "now"),
) -> list[str]:
    """Lines `key: stored 0.006 m, now 0.008 m`, one per key in which two resolved cases differ; `words` name them.

    Titles, notes and sources do not count. `within`: only keys that are one of these or lie in one of these tables.
    """
    before, after = computed(stored), computed(now)
    lines = []
    for key in dict.fromkeys([*before, *after]):
        asked = within is None or any(key == one or key.startswith((f"{one}.", f"{one}[")) for one in within)
        if asked and before.get(key) != after.get(key):
            lines.append(f"{key}: {words[0]} {_shown(before, key)}, {words[1]} {_shown(after, key)}")
    return lines


def computed(case: CaseTable) -> dict[str, Any]:
    """Values of a resolved case on which a run depends, by dotted key, with units."""
    return {
        key: value
        for key, value in _flat(plain(case, units=True))
        if key.rpartition(".")[2] not in _WORDS_ONLY and not key.startswith(_NOT_COMPUTED)
    }


def _shown(flat: dict[str, Any], key: str) -> str:
    return show(flat[key]) if key in flat else "nothing"
