"""`fragfield new`: a commented case file to start from; its comments are the meanings of the keys."""

from __future__ import annotations

import math
import textwrap
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from burst_fenicsx.geometry.files import load_profile, profile_names
from burst_fenicsx.materials.library import burst_explosive_names, casing_names
from fragfield.case.keys import Key, keys_of, kind_of
from fragfield.case.schema import CaseTable
from fragfield.case.tables.burst import BurstTable
from fragfield.case.tables.flight import HazardTable
from fragfield.case.tables.round import RoundTable, StackTable
from fragfield.case.write import toml_value
from fragfield.errors import InputError, nearest
from fragfield_base.inputs import Quantity, Vector
from fragfield_base.substances import Kind, substance_key
from fragfield_base.writing import write_text

_USUAL_CASING = "steel_paper"
_WIDTH = 118
_EXAMPLE = " Left out by default; for example:"
_HEAD = """\
# A case for fragfield. Values with a dimension are strings with their unit: "155 mm", "1.71 g/cm^3", "25 ft".
# A line that begins with # and a key shows a default: take the # away to change it.
#
#     fragfield check {name}          reads it, with masses, speeds, cost and warnings
#     fragfield run {name}            runs it, into runs/{stem}

"""


def write_new_case(
    path: Path,
    profile: str,
    explosive: str,
    *,
    casing: str | None = None,
    stack: str | None = None,
    lying: bool = False,
) -> Path:
    """Write a case of one round, or of a stack of it, with every key explained; returns the file.

    `path`: ".toml" is added where it is missing; `profile`, `explosive`, `casing`: built-in names, the casing left out:
    the one made for the profile, else the paper's steel; `stack`: arrangement of copies of the round; `lying`: the
    round lies on the ground, its axis along y, so that a row of them stands side by side along x. Raises InputError: a
    name is unknown, or there is such a file, or it cannot be written.
    """
    path = path if path.suffix.lower() == ".toml" else path.with_name(f"{path.name}.toml")
    if path.exists() or path.is_symlink():
        raise InputError(f"{path}: is there already; nothing was written, choose another name")
    chosen = _chosen(profile, explosive, casing, stack, lying=lying)
    text = _HEAD.format(name=path.name, stem=path.stem) + commented_case(chosen)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None
    return write_text(path, text, InputError)


def _chosen(
    profile: str, explosive: str, casing: str | None, stack: str | None, *, lying: bool = False
) -> dict[str, Any]:
    _require("--round", profile, profile_names())
    explosive = _built_in("--explosive", explosive, "explosive", burst_explosive_names())
    words = set(profile.split("_"))  # "steel_m107" is that of "m107"
    casing = casing or next((one for one in casing_names() if words & set(one.split("_"))), _USUAL_CASING)
    casing = _built_in("--casing", casing, "casing", casing_names())
    chosen: dict[str, Any] = {
        "title": f"{profile}, {explosive}" + (f", {stack}" if stack else ""),
        "seed": 1,
        "burst": {"cell_size": _value(BurstTable, "cell_size")},
        "round": [
            {
                "name": "round",
                "profile": profile,
                "explosive": explosive,
                "casing": casing,
                "attitude": "upright",
                "position": _value(RoundTable, "position"),
            }
        ],
        "break_up": {"realisations": 20},
        "flight": {},
        "witness": [{"name": "ring", "kind": "cylinder", "radius": "25 ft"}],
        "hazard": {name: _value(HazardTable, name) for name in ("energy", "density")},
    }
    if lying:
        chosen["title"] += ", lying"
        chosen["round"][0] |= _lying(profile)
    if stack is not None:
        _require("--stack", stack, get_args(StackTable.model_fields["arrangement"].annotation))
        number = {"counts": [2, 2, 1]} if stack == "pallet" else {"count": 2}
        chosen["stack"] = {"arrangement": stack, **number, "gap": _value(StackTable, "gap")}
    return chosen


def _lying(profile: str) -> dict[str, Any]:
    found = load_profile(profile)
    height = math.ceil(1e3 * found.max_radius - 1e-6)  # whole millimetres, not into the ground
    return {
        "position": ["0 m", f"{-500.0 * found.length:.10g} mm", f"{height} mm"],
        "attitude": "lying",
        "azimuth": "90 deg",
    }


def _built_in(option: str, name: str, kind: Kind, allowed: Sequence[str]) -> str:
    key = substance_key(name, kind)
    _require(option, key if key in allowed else name, allowed)
    return key


def _require(option: str, name: str, allowed: Iterable[str]) -> None:
    names = list(allowed)
    if name not in names:
        raise InputError(f'{option}: found "{name}"{nearest(name, names)}; allowed: {", ".join(names)}')


def _value(model: type[BaseModel], name: str) -> object:
    (key,) = (one for one in keys_of(model) if one.name == name)
    return tomllib.loads(f"value = {_example(key)}")["value"]


def commented_case(chosen: Mapping[str, Any]) -> str:
    """A case file (TOML) with comments, in which the keys of `chosen`, tables as a file has them, are set.

    The others stand with their defaults behind a `#` without a space, in the units of their examples.
    """
    lines: list[str] = []
    further = []
    for key in keys_of(CaseTable):
        value = chosen.get(key.name)
        if not key.tables:
            lines += _entry(key, chosen)
        elif value is None:
            head = f"[[{key.name}]]" if key.listed else f"[{key.name}]"
            further += _comment(f"{head}  {key.meaning or _first_line(key.tables[0])}")
        else:
            for entry in value if isinstance(value, list) else [value]:
                table = next((one for one in key.tables if kind_of(one) == entry.get("kind", "")), key.tables[0])
                head = f"[[{key.name}]]" if key.listed else f"[{key.name}]"
                lines += ["", *_table(table, entry, head, key.meaning)]
    if further:
        lines += ["", "# Further tables, as the user guide has them:", *further]
    return "\n".join(lines) + "\n"


def _table(model: type[BaseModel], chosen: Mapping[str, Any], head: str, meaning: str = "") -> Iterator[str]:
    yield from _comment(meaning or _first_line(model))
    yield head
    below = []
    for key in keys_of(model):
        is_table = isinstance(key.default, BaseModel) or (len(key.types) == 1 and key.tables and not key.listed)
        if not is_table or _extra(key, "inline") or isinstance(chosen.get(key.name), str):
            yield from _entry(key, chosen)
        else:
            below.append((key, type(key.default) if isinstance(key.default, BaseModel) else key.tables[0]))
    for key, table in below:
        path = f"[{head.strip('[]')}.{key.name}]"
        if key.name in chosen:
            yield from ["", *_table(table, chosen[key.name], path)]
        else:
            yield from _comment(f"{path}  {key.meaning or _first_line(table)}")


def _first_line(model: type[BaseModel]) -> str:
    return (model.__doc__ or "").strip().partition("\n")[0]


def _entry(key: Key, chosen: Mapping[str, Any]) -> Iterator[str]:
    words = [toml_value(word) for word in key.choices or getattr(key.parsed, "words", ())]
    words += ["a value"] if key.parsed and words else []
    meaning = f"{key.meaning} One of {', '.join(words)}." if len(words) > 1 else key.meaning
    if key.name in chosen:
        yield from _comment(meaning)
        yield f"{key.name} = {toml_value(chosen[key.name])}"
    elif key.default not in (None, "") and _extra(key, "instead_of") not in chosen:  # which excludes this key
        yield from _comment(meaning)
        default = "{}" if isinstance(key.default, BaseModel) else toml_value(key.written(key.default))
        yield f"#{key.name} = {default}"  # of a table: with all of its keys left out
    elif example := _example(key):
        yield from _comment(meaning + _EXAMPLE)
        yield f"#{key.name} = {example}"
    else:
        yield from _comment(f"{key.name}: {meaning}")


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text.strip(), _WIDTH, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False)


def _extra(key: Key, name: str) -> str:
    extra = key.field.json_schema_extra
    return str(extra.get(name, "")) if isinstance(extra, dict) else ""


def _example(key: Key) -> str:
    if key.listed or not isinstance(key.parsed, (Quantity, Vector)):
        return _extra(key, "inline")
    return key.example if isinstance(key.parsed, Vector) else toml_value(key.example)
