"""Replaces values of a case by their dotted keys: `--set`, sweeps and sensitivity studies."""

from __future__ import annotations

import copy
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fragfield.case.faults import CaseFaults, Fault
from fragfield.case.load import MOST_DEPTH, case_from_document, named_material, read_document
from fragfield.case.schema import CaseTable
from fragfield.errors import InputError, nearest
from fragfield.terminal.logs import visible

Settings = Sequence[str] | Mapping[str, Any]
_EXAMPLE = '--set burst.cell_size="8 mm"'
_MATERIALS = ("explosive", "casing")
_EVERY = "*"
_AS_MESSAGES = re.compile(r"\[([1-9]\d{0,5})\]")  # "round[2].casing", entries counted from 1


def load_changed_case(path: Path, changes: Mapping[str, Any]) -> CaseTable:
    """Read, check and resolve a case file with some values replaced, as `changed_document`; the title names them.

    Raises InputError as `load_case`: an unknown key with the nearest valid name, a value that is not allowed.
    """
    document = read_document(path)
    words = ", ".join(f"{key} = {value}" for key, value in changes.items())
    source = f"{path} with {words}" if words else str(path)
    changed = changed_document(document, changes, source=source, folder=path.parent)
    if changes and "title" not in changes:
        changed["title"] = f"{document.get('title', visible(path.stem))}: {words}"
    changed.setdefault("title", visible(path.stem))
    return case_from_document(changed, source=source, folder=path.parent)


def load_case(path: Path, settings: Settings = (), *, burst: bool = True) -> CaseTable:
    """Read, check and resolve a case file: every default, material, contour and ignition point spelled out, in SI.

    `path`: names of files in it are relative to its folder; `settings` of `--set`: KEY=VALUE with dotted keys, or
    values by such keys, see `changed_document`; `burst`: the case must describe one, which a flight of given fragments
    does not need. Raises InputError for any fault, with file and key, what was found and what is allowed.
    """
    document, source = set_document(path, settings)
    return case_from_document(document, source=source, folder=path.parent, burst=burst)


def set_document(path: Path, settings: Settings = ()) -> tuple[dict[str, Any], str]:
    """Tables of a case file with the values of `--set`, and what messages call them; as `load_case`."""
    try:
        changes = read_settings(settings)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    given = settings.items() if isinstance(settings, Mapping) else [text.split("=", 1) for text in settings]
    ways = " ".join(f"--set {key}={value}" for key, value in given)
    source = f"{path} with {ways}" if ways else str(path)
    document = changed_document(read_document(path), changes, source=source, folder=path.parent)
    document.setdefault("title", visible(path.stem))
    return document, source


def read_settings(settings: Settings) -> dict[str, Any]:
    """Values by dotted key, of texts KEY=VALUE or of a mapping.

    Raises InputError: a text cannot be read, or a key comes twice.
    """
    if isinstance(settings, str):
        raise InputError(f'set: found the text "{settings}"; needed: a list of KEY=VALUE, or a mapping')
    found: dict[str, Any] = {}
    if isinstance(settings, Mapping):
        found = {key: value if callable(value) else plain_tables(value) for key, value in settings.items()}
    else:
        for setting in settings:
            key, equals, text = (part.strip() for part in setting.partition("="))
            if not (key and equals and text):
                raise InputError(f"found --set {setting!r}; needed: KEY=VALUE, for example {_EXAMPLE}")
            if key in found:
                raise InputError(f"--set {key} is given twice; give one value")
            found[key] = read_value(text)
    return found


def plain_tables(value: Any) -> Any:  # noqa: ANN401 - tables, lists and values
    """Tables as TOML would give them: copies, with lists for tuples and arrays, and texts for paths."""
    if isinstance(value, Mapping):
        return {str(key): plain_tables(entry) for key, entry in value.items()}
    if hasattr(value, "magnitude") and hasattr(value, "units"):
        return _with_units(value.magnitude, value.units)
    if hasattr(value, "tolist"):
        return plain_tables(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain_tables(entry) for entry in value]
    return os.fspath(value) if isinstance(value, os.PathLike) else copy.copy(value)


def _with_units(magnitude: Any, units: object) -> Any:  # noqa: ANN401 - a number, or lists of numbers
    """A quantity of pint as the case file has it: texts with the unit's full name; pure numbers stay numbers."""
    if hasattr(magnitude, "tolist"):
        magnitude = magnitude.tolist()
    if isinstance(magnitude, (list, tuple)):
        return [_with_units(entry, units) for entry in magnitude]
    name = str(units).removeprefix("1 ")  # "1 / meter ** 2"
    return magnitude if name in ("", "dimensionless") else f"{magnitude} {name}"


def read_value(text: str) -> object:
    """A value as TOML reads it, else the text itself: `8 mm` needs no quotes of its own."""
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):  # also a number of more digits than Python reads, and lists without end
        return text
    return value if isinstance(value, (str, bool, int, float, list, dict)) else text  # no dates


def changed_document(
    document: Mapping[str, Any], changes: Mapping[str, Any], *, source: str, folder: Path
) -> dict[str, Any]:
    """Tables of a case with some values replaced. The schema is left to judge keys and values.

    `document`: tables as the case file has them, or resolved; they stay as they are. `changes`: values by dotted key,
    one with a dimension as a string with its unit. In a list, `*` stands for every entry, "[1]" for the first, as
    messages count, and a name for its own: "round.*.casing.shear_softening_strain", "round[1].explosive"; a number from
    0 is taken, too. A material's name is replaced by its table where a key goes into it. A callable is given the old
    value. `source` is named by messages; files are relative to `folder`, that of the case file. Raises InputError: a
    list has no such entry, or a key goes into a value.
    """
    changed = copy.deepcopy(dict(document))
    for key, value in changes.items():
        steps = _AS_MESSAGES.sub(lambda found: f".{int(found[1]) - 1}", key).split(".")
        if len(steps) > MOST_DEPTH:
            raise InputError(f"{source}: found a key of {len(steps)} names; allowed: at most {MOST_DEPTH}")
        if not all(steps):
            raise InputError(f"{source}: found the key {key!r}; allowed: names with single points between them")
        _replace(changed, steps, value, (source, key), folder)
    return changed


def _replace(
    node: dict[str, Any] | list[Any], steps: list[str], value: object, at: tuple[str, str], folder: Path
) -> None:
    step, *rest = steps
    if isinstance(node, list):
        chosen: list[Any] = _entries(node, step, at)
    else:
        chosen = [step]
        _make_ready(node, step, rest, value, at)
    for place in chosen:
        if not rest:
            node[place] = value(node[place]) if callable(value) else value
            continue
        if place in _MATERIALS and isinstance(node[place], str):
            table = named_material(str(place), node[place], source=at[0], key=at[1], folder=folder)
            node[place] = table.model_dump(mode="json", exclude_none=True, context={"units": "si"})
        if not isinstance(node[place], (dict, list)):
            raise _refused(at, f"{step} holds a value, it has no {rest[0]}")
        _replace(node[place], rest, value, at, folder)


def _refused(at: tuple[str, str], words: str) -> CaseFaults:
    source, key = at
    return CaseFaults(source, [Fault(key, words)])


def _entries(entries: list[Any], step: str, at: tuple[str, str]) -> list[int]:
    names = [entry.get("name") if isinstance(entry, dict) else None for entry in entries]
    chosen = [number for number, name in enumerate(names) if step in (_EVERY, str(number), name)]
    if not chosen:
        known = [str(name) for name in names if name is not None]
        last = f" to [{len(entries)}]" if len(entries) > 1 else ""
        allowed = [_EVERY, *([f"[1]{last}"] if entries else []), *known]
        raise _refused(at, f"there is no entry {step}{nearest(step, known)}; allowed: {', '.join(allowed)}")
    return chosen


def _make_ready(table: dict[str, Any], step: str, rest: list[str], value: object, at: tuple[str, str]) -> None:
    """Make the tables on the way to a key that the file leaves out; the schema refuses those that it does not know."""
    if step in table:
        return
    if callable(value):
        raise _refused(at, f"there is no {step}")
    if rest and (rest[0] == _EVERY or rest[0].isdigit()):
        raise _refused(at, f"the case has no {step}; write its entries into the case file")
    if rest:
        table[step] = {}
