"""Fields of the case file as forms need them, from `CaseTable.model_json_schema()`: nothing is written twice."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from fragfield.case import CaseTable
from fragfield.case.changes import read_value
from fragfield.case.write import toml_value
from fragfield_base.inputs import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@dataclass(frozen=True)
class Field:
    """A key of a table."""

    name: str
    key: str
    """The key in its table, and from the top of the file, with the table's kind: "exposed[road].width"."""
    kind: str
    """"text", "number", "value" (any TOML value), "choice", "switch", "table" or "tables" (a list of tables)."""
    meaning: str = ""
    allowed: str = ""
    why: str = ""
    bounds: str = ""
    unit: str = ""
    example: str = ""
    """As the inputs' metadata has them; empty where they say nothing."""
    choices: tuple[str, ...] = ()
    """Words among which to choose; of a "value" or a "text" suggestions."""
    default: str = ""
    """As the case file would have it; empty where there is none."""
    needed: bool = False
    """Whether the table must have it."""
    only_with: Mapping[str, Any] | None = field(default=None, hash=False)
    """Another key of the table, and its `values`, or `without`, with which it is read."""

    def applies(self, table: Mapping[str, Any], defaults: Mapping[str, str]) -> bool:
        """Whether it is read with what the table says of the other key."""
        if self.only_with is None:
            return True
        key, values, without = (self.only_with[name] for name in ("key", "values", "without"))
        found = table.get(key)
        if found is None and defaults.get(key):
            found = read_value(defaults[key])
        return found in values if values else found not in without


@cache
def _schema() -> dict[str, Any]:
    return CaseTable.model_json_schema()


@cache
def fields_of(path: tuple[str, ...], kind: str = "") -> tuple[Field, ...]:
    """Fields of a table by its place in the case file, without numbers of entries: ("round", "ignition").

    An empty `path` is the whole file; `kind` is one of several kinds of tables: "road" of ("exposed",). Raises KeyError
    where there is no such table.
    """
    table = _tables(path)
    chosen = next((one for one in table if kind and _kind(one) == kind), table[0])
    needed, place = chosen.get("required", []), ".".join(path) + (f"[{kind}]" if kind else "")
    return tuple(
        _field(name, f"{place}.{name}".removeprefix("."), entry, needed=name in needed)
        for name, entry in chosen["properties"].items()
    )


def kinds_of(path: tuple[str, ...]) -> tuple[str, ...]:
    """Kinds of the tables at a place, such as person, road, area and building."""
    return tuple(kind for one in _tables(path) if (kind := _kind(one)))


def _kind(table: Mapping[str, Any]) -> str:
    return str(table["properties"].get("kind", {}).get("const", ""))


def _tables(path: Sequence[str]) -> list[dict[str, Any]]:
    """Schemas of the tables at a place: several where it takes several kinds."""
    found = [_schema()]
    for step in path:
        entries = [table["properties"][step] for table in found if step in table["properties"]]
        found = [table for entry in entries for table in _choices(entry) if "properties" in table]
        if not found:
            raise KeyError(step)
    return found


def _choices(entry: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The schemas that an entry may be, references and lists of tables followed, null left out."""
    if "$ref" in entry:
        return _choices(_schema()["$defs"][entry["$ref"].rpartition("/")[2]])
    if entry.get("type") == "array" and "items" in entry:
        return _choices(entry["items"])
    for union in ("anyOf", "oneOf"):
        if union in entry:
            return [one for part in entry[union] for one in _choices(part)]
    return [] if entry.get("type") == "null" else [dict(entry)]


def _field(name: str, key: str, entry: Mapping[str, Any], *, needed: bool) -> Field:
    parts = _choices(entry)
    known: dict[str, Any] = {}
    for part in parts:  # what an alternative says, then the field itself
        known |= part if "properties" not in part else {}
    known |= {key: value for key, value in entry.items() if key not in ("anyOf", "oneOf")}
    words = [*known.get("words", []), *(str(word) for part in parts for word in part.get("enum", []))]
    return Field(
        name,
        key,
        _sort(entry, parts, words),
        meaning=" ".join(str(entry.get("description", "")).split()),
        allowed=str(known.get("allowed", "")),
        why=str(known.get("why") or ""),
        bounds=str(known.get("bounds") or ""),
        unit=str(known.get("unit", "")).removeprefix("1"),
        example=str((known.get("examples") or [""])[0]),
        choices=tuple(words),
        default=_default(entry.get("default"), known),
        needed=needed,
        only_with=known.get("only_with"),
    )


def _sort(entry: Mapping[str, Any], parts: Sequence[Mapping[str, Any]], words: Sequence[str]) -> str:
    """Kind of a field."""
    types = {str(part.get("type", "")) for part in parts}
    tables = [part for part in parts if "properties" in part]
    if tables and len(tables) == len(parts):
        whole = [entry, *entry.get("anyOf", [])]
        return "tables" if any(one.get("type") == "array" for one in whole) else "table"
    if entry.get("type") == "array" or any(one.get("type") == "array" for one in entry.get("anyOf", [])):
        return "value"
    if types == {"boolean"}:
        return "switch"
    if words and types <= {"string"} and not any("unit" in part for part in parts):
        return "choice"
    if types == {"string"}:
        return "text"
    return "number" if types and types <= {"number", "integer"} else "value"


def _default(value: object, known: Mapping[str, Any]) -> str:
    """A default as the case file would have it: in the unit of the example."""
    if value is None or value == "" or isinstance(value, dict):
        return ""
    unit, examples = known.get("unit"), known.get("examples")
    if unit not in (None, "", "1") and examples and isinstance(value, float) and known.get("type") == "string":
        return Quantity(str(unit), str(examples[0])).in_unit_of_example(value)
    if isinstance(value, list) and unit not in (None, "", "1") and all(isinstance(one, float) for one in value):
        return toml_value([f"{one:g} {unit}" for one in value])
    if isinstance(value, float) and math.isfinite(value):
        return f"{value:.10g}"
    return value if isinstance(value, str) else toml_value(value)


def shown(value: object) -> str:
    """A value of the file as a field shows it: texts without quotes."""
    return "" if value is None else value if isinstance(value, str) else toml_value(value)


def read_field(entry: Field, text: str) -> object:
    """What is typed into a field as the file has it; None for an empty one, which takes the default."""
    if not text.strip():
        return None
    if entry.kind in ("text", "choice"):
        return text
    value = read_value(text.strip())
    return text if isinstance(value, str) else value


class Texts:
    """Texts of the pages by group and name; words for the fields are those of the inputs' metadata."""

    def __init__(self) -> None:
        groups = tomllib.loads((resources.files("fragfield.app") / "texts.toml").read_text(encoding="utf-8"))
        self._texts = {f"{group}.{name}": words for group, table in groups.items() for name, words in table.items()}

    def __call__(self, name: str, /, **values: object) -> str:
        """A text with its places filled in; raises KeyError where there is none of that name."""
        return self._texts[name].format(**values) if values else self._texts[name]

    def label(self, key: str) -> str:
        """Label of a field by its key, as `Field.key` has it."""
        name = key.rpartition(".")[2]
        return self._texts.get(f"key.{name}", name.replace("_", " "))

    def help(self, entry: Field) -> str:
        """Everything that is known of a field, in sentences."""
        parts = [entry.meaning]
        if entry.allowed:
            parts.append(f"{self('form.allowed')}: {entry.allowed}.")
        if entry.bounds:
            why = f" ({entry.why})" if entry.why else ""
            parts.append(f"{self('form.bounds')}: {entry.bounds}{why}.")
        return " ".join(part for part in parts if part)


@cache
def page_texts() -> Texts:
    """Those of the package, read once."""
    return Texts()
