"""The reference of the case file, made from the schema that reads it."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from burst_fenicsx.data import DATA_DIRECTORY
from fragfield.case import Case

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["built_in_tables", "case_reference"]

Schema = dict[str, Any]


@dataclass(frozen=True)
class _Place:
    """Where a table stands in the file: its key path, and how it is written there."""

    path: str
    title: str
    listed: bool


def case_reference() -> str:
    """Every table of the case file, as Markdown."""
    schema = Case.model_json_schema()
    parts = [_table(schema, _Place("", "Top level", listed=False), schema["properties"], schema.get("required", []))]
    for place, table in _tables(schema["properties"], schema["$defs"]):
        parts.append(_table(table, place, table["properties"], table.get("required", [])))
    return "\n\n".join(parts)


def _tables(properties: Schema, definitions: Schema, path: str = "") -> Iterator[tuple[_Place, Schema]]:
    """Tables that the properties of another may hold, each followed by those within it."""
    for key, entry in properties.items():
        names, listed = _references(entry)
        for name in names:
            table = definitions[name]
            below = f"{path}.{key}" if path else key
            kind = table["properties"].get("kind", {}).get("const") if len(names) > 1 else None
            brackets = f"[[{below}]]" if listed else f"[{below}]"
            title = f'{brackets} with kind = "{kind}"' if kind else brackets
            yield _Place(below, title, listed), table
            yield from _tables(table["properties"], definitions, below)


def _references(entry: Schema) -> tuple[list[str], bool]:
    """Names of the tables that a value may be, and whether it is a list of them."""
    if "$ref" in entry:
        return [entry["$ref"].rpartition("/")[2]], False
    if "items" in entry:
        return _references(entry["items"])[0], True
    names: list[str] = []
    listed = False
    for choice in (*entry.get("anyOf", ()), *entry.get("oneOf", ())):
        found, is_list = _references(choice)
        names += found
        listed |= is_list
    return names, listed


def _table(table: Schema, place: _Place, properties: Schema, required: list[str]) -> str:
    lines = [f"## {place.title}" if "." not in place.path else f"### {place.title}", ""]
    lines += [_cell(table["description"]) if place.path else "Keys that stand before the first table.", ""]
    lines += ["| key | value | default | meaning |", "|---|---|---|---|"]
    for key, entry in properties.items():
        if not place.path and _references(entry)[0]:
            continue  # has a section of its own
        default = "needed" if key in required else _default(entry)
        meaning = entry.get("description") or f"See `{place.path}.{key}`."
        allowed = f"{_allowed(entry)}; {entry['bounds']}" if "bounds" in entry else _allowed(entry)
        lines.append(f"| `{key}` | {_cell(allowed)} | {_cell(default)} | {_cell(meaning)} |")
    return "\n".join(lines)


def _allowed(entry: Schema) -> str:
    """What a value may be, in words."""
    if "allowed" in entry:
        return re.sub(r' with its unit as a string, for example ("[^"]*")', r", for example `\1`", entry["allowed"])
    if "$ref" in entry:
        return "a table"
    choices = [choice for choice in (*entry.get("anyOf", ()), *entry.get("oneOf", ())) if choice.get("type") != "null"]
    if choices:
        return " or ".join(_allowed(choice) for choice in choices)
    if "const" in entry:
        return f"`{_toml(entry['const'])}`"
    if "enum" in entry:
        return ", ".join(f"`{_toml(value)}`" for value in entry["enum"])
    if entry.get("type") == "array":
        return f"a list, each {_allowed(entry['items'])}"
    words = {"integer": "a whole number", "number": "a number", "string": "text", "boolean": "`true` or `false`"}
    return words.get(entry.get("type", ""), "a table") + _bounds(entry)


def _bounds(entry: Schema) -> str:
    known = {
        "exclusiveMinimum": "greater than",
        "minimum": "at least",
        "exclusiveMaximum": "less than",
        "maximum": "at most",
    }
    limits = [f"{words} {entry[key]:g}" for key, words in known.items() if entry.get(key, math.inf) < 1e9]
    return ", " + " and ".join(limits) if limits else ""


def _default(entry: Schema) -> str:
    value = entry.get("default")
    if value is None or isinstance(value, dict):
        return "-"
    unit = entry.get("unit", "")
    if isinstance(value, (list, tuple)):
        return f"`[{', '.join(_with_unit(item, unit) for item in value)}]`"
    return f"`{_with_unit(value, unit)}`"


def _with_unit(value: Any, unit: str) -> str:  # noqa: ANN401 - whatever a schema holds
    """A default as the file would write it; angles in degrees, densities of hazard as one over an area."""
    if isinstance(value, (str, bool)) or unit in ("", "1"):
        return _toml(value)
    if unit == "rad":
        return f'"{math.degrees(value):.6g} deg"'
    if unit == "1/m^2":
        return f'"1 / ({1.0 / value:.6g} m^2)"'
    return f'"{value:.6g} {unit}"'


def _toml(value: Any) -> str:  # noqa: ANN401 - whatever a schema holds
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else f"{value:.6g}"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def built_in_tables() -> str:
    """Built-in profiles, explosives and casing materials with their sources, as Markdown."""
    lines = ["| name | what | source |", "|---|---|---|"]
    for path in sorted((DATA_DIRECTORY / "profiles").glob("*.toml")):
        values = tomllib.loads(path.read_text(encoding="utf-8"))
        lines.append(
            f"| `{path.stem}` | profile: {_cell(values.get('title', ''))} | {_cell(values.get('source', ''))} |"
        )
    for kind, name in (("explosive", "explosives.toml"), ("casing", "casings.toml")):
        values = tomllib.loads((DATA_DIRECTORY / name).read_text(encoding="utf-8"))
        lines += [f"| `{key}` | {kind} | {_cell(table.get('source', ''))} |" for key, table in values.items()]
    return "\n".join(lines)
