"""Keys of the case file as forms show them."""

from __future__ import annotations

import math
from functools import cache

from pydantic import BaseModel

from fragfield.case import CaseTable
from fragfield.case.changes import read_value
from fragfield.case.keys import Key, keys_of, kind_of, tables_at
from fragfield.case.write import toml_value


@cache
def fields_of(path: tuple[str, ...], kind: str = "") -> tuple[Key, ...]:
    """Keys of a table by its place in the case file, without numbers of entries: ("round", "ignition").

    An empty `path` is the whole file; `kind` is one of several kinds of tables: "road" of ("exposed",). Raises KeyError
    where there is no such table.
    """
    tables = tables_at(path, CaseTable)
    chosen = next((one for one in tables if kind and kind_of(one) == kind), tables[0])
    return keys_of(chosen, ".".join(path) + (f"[{kind}]" if kind else ""))


def kinds_of(path: tuple[str, ...]) -> tuple[str, ...]:
    """Kinds of the tables at a place, such as person, road, area and building."""
    return tuple(kind for one in tables_at(path, CaseTable) if (kind := kind_of(one)))


def default_of(entry: Key) -> str:
    """A default as a field shows it, in the unit of the example; empty where there is none."""
    value = entry.default
    if value in (None, "", ()) or isinstance(value, BaseModel) or value == []:
        return ""
    written = entry.written(value)
    if isinstance(written, float) and math.isfinite(written):
        return f"{written:.10g}"
    return written if isinstance(written, str) else toml_value(written)


def shown(value: object) -> str:
    """A value of the file as a field shows it: texts without quotes."""
    return "" if value is None else value if isinstance(value, str) else toml_value(value)


def read_field(entry: Key, text: str) -> object:
    """What is typed into a field as the file has it; None for an empty one, which takes the default."""
    if not text.strip():
        return None
    if entry.form in ("text", "choice"):
        return text
    value = read_value(text.strip())
    return text if isinstance(value, str) else value


_LABELS = {
    "ignition": "ignition points", "initiation": "initiation by shock", "break_up": "break-up",
    "witness": "witness surfaces", "convergence": "grid convergence", "layer_gap": "gap of layers",
    "bearing": "bearing of x", "map": "map of heights",
}  # fmt: skip
"""Those that say more than the key itself."""


def label_of(key: str) -> str:
    """Label of a field by its key, as `Key.path` has it."""
    name = key.rpartition(".")[2]
    return _LABELS.get(name, name.replace("_", " "))


def help_of(entry: Key) -> str:
    """Everything that is known of a field, in sentences."""
    parts = [" ".join(entry.meaning.split())]
    if entry.allowed:
        parts.append(f"Allowed: {entry.allowed}.")
    if entry.bounds:
        parts.append(f"Bounds: {entry.bounds.words(entry.unit)} ({entry.bounds.why}).")
    return " ".join(part for part in parts if part)
