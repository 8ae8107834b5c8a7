"""`fragfield new`: a commented case file to start from; its comments are the meanings of the keys."""

from __future__ import annotations

import math
import textwrap
import tomllib
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from fragfield.case.messages import mark_of, marks_of, tables_in
from fragfield.case.schema import CaseTable
from fragfield.case.tables.burst import BurstTable
from fragfield.case.tables.flight import HazardTable
from fragfield.case.tables.round import RoundTable, StackTable
from fragfield.case.write import toml_value
from fragfield.errors import InputError, nearest
from fragfield_base.inputs import NumberOrWord, Quantity, Vector
from fragfield_base.substances import substance_key
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from pydantic.fields import FieldInfo

    from fragfield_base.substances import Kind


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
    """Write a case of one round, or of a stack of it, with every key explained.

    Parameters
    ----------
    path : Path
        File to write; ".toml" is added where it is missing.
    profile, explosive, casing : str
        Built-in names; the casing left out: the one made for the profile, else the paper's steel.
    stack : str, optional
        Arrangement of copies of the round, as `stack.arrangement`.
    lying : bool
        The round lies on the ground, its axis along y, so that a row of them stands side by side along x.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        A name is unknown, or there is such a file, or it cannot be written.
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
    """The keys that are set, with the schema's own examples as values."""
    from burst_fenicsx.geometry.files import profile_names
    from burst_fenicsx.materials.library import burst_explosive_names, casing_names

    _require("--round", profile, profile_names())
    explosive = _built_in("--explosive", explosive, "explosive", burst_explosive_names())
    casing = casing or _casing_for(profile, casing_names())
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
    """Position and attitude of a round that lies on the ground along y, its length halved by the plane y = 0."""
    from burst_fenicsx.geometry.files import load_profile

    found = load_profile(profile)
    height = math.ceil(1e3 * found.max_radius - 1e-6)  # whole millimetres, not into the ground
    return {
        "position": ["0 m", f"{-500.0 * found.length:.10g} mm", f"{height} mm"],
        "attitude": "lying",
        "azimuth": "90 deg",
    }


def _built_in(option: str, name: str, kind: Kind, allowed: Sequence[str]) -> str:
    """The built-in name of a substance, however it is written."""
    key = substance_key(name, kind)
    _require(option, key if key in allowed else name, allowed)
    return key


def _require(option: str, name: str, allowed: Iterable[str]) -> None:
    names = list(allowed)
    if name not in names:
        raise InputError(f'{option}: found "{name}"{nearest(name, names)}; allowed: {", ".join(names)}')


def _casing_for(profile: str, casings: Iterable[str]) -> str:
    """The casing that shares a word with the profile's name ("steel_m107" with "m107"), else the paper's steel."""
    words = set(profile.split("_"))
    return next((casing for casing in casings if words & set(casing.split("_"))), _USUAL_CASING)


def _value(model: type[BaseModel], name: str) -> object:
    """The example that the schema gives for a field."""
    return tomllib.loads(f"value = {_example(model.model_fields[name])}")["value"]


def commented_case(chosen: Mapping[str, Any]) -> str:
    """A case file (TOML) with comments, in which the keys of `chosen`, tables as a file has them, are set.

    The others stand with their defaults behind a `#` without a space, in the units of their examples.
    """
    lines: list[str] = []
    further = []
    for name, field in CaseTable.model_fields.items():
        value = chosen.get(name)
        models = [model for _, model in tables_in(field.annotation)]
        if not models:
            lines += _entry(name, field, chosen)
        elif isinstance(value, list):
            for entry in value:
                model = next((one for one in models if _is_kind(one, entry)), models[0])
                lines += ["", *_table(model, (name,), entry, field, head=f"[[{name}]]")]
        elif isinstance(value, dict):
            lines += ["", *_table(models[0], (name,), value, field)]
        else:
            head = f"[[{name}]]" if get_origin(field.annotation) is list else f"[{name}]"
            further += _comment(f"{head}  {field.description or _first_line(models[0])}")
    if further:
        lines += ["", "# Further tables, as the user guide has them:", *further]
    return "\n".join(lines) + "\n"


def _is_kind(model: type[BaseModel], entry: Mapping[str, Any]) -> bool:
    kind = model.model_fields.get("kind")
    return kind is None or "kind" not in entry or entry["kind"] in get_args(kind.annotation)


def _table(
    model: type[BaseModel],
    path: tuple[str, ...],
    chosen: Mapping[str, Any],
    field: FieldInfo | None,
    head: str = "",
) -> Iterator[str]:
    """A table with its own keys and then its sub-tables."""
    yield from _comment((field.description if field else None) or _first_line(model))
    yield head or f"[{'.'.join(path)}]"
    tables = {}
    for name, entry in model.model_fields.items():
        table = _sub_table(entry)
        if table is None or _inline(entry) is not None or isinstance(chosen.get(name), str):
            yield from _entry(name, entry, chosen)
        else:
            tables[name] = (table, entry)
    for name, (table, entry) in tables.items():
        if name in chosen:
            yield from ["", *_table(table, (*path, name), chosen[name], None)]
        else:
            yield from _comment(f"[{'.'.join((*path, name))}]  {entry.description or _first_line(table)}")


def _sub_table(field: FieldInfo) -> type[BaseModel] | None:
    """Model of a field that is a table by default or can only be one; None where it is a value."""
    if isinstance(field.default, BaseModel):
        return type(field.default)
    choices = [one for one in (get_args(field.annotation) or (field.annotation,)) if one is not type(None)]
    only = choices[0] if len(choices) == 1 else None
    return only if isinstance(only, type) and issubclass(only, BaseModel) else None


def _first_line(model: type[BaseModel]) -> str:
    return (model.__doc__ or "").strip().partition("\n")[0]


def _entry(name: str, field: FieldInfo, chosen: Mapping[str, Any]) -> Iterator[str]:
    """Comment and line of a key: chosen, its default, an example, or the comment alone."""
    words = [field.description or "", *_choices(field)]
    if name in chosen:
        yield from _comment(" ".join(words))
        yield f"{name} = {toml_value(chosen[name])}"
        return
    default = field.get_default(call_default_factory=True)
    extra = field.json_schema_extra
    another = isinstance(extra, dict) and extra.get("instead_of") in chosen  # which excludes this key
    if default is not None and default is not PydanticUndefined and default != "" and not another:
        yield from _comment(" ".join(words))
        yield f"#{name} = {_default(default, field)}"
    elif (example := _example(field)) is not None:
        yield from _comment(" ".join(words) + _EXAMPLE)
        yield f"#{name} = {example}"
    else:
        yield from _comment(f"{name}: {' '.join(words)}")


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text.strip(), _WIDTH, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False)


def _choices(field: FieldInfo) -> list[str]:
    """The words or numbers that a field may be, as one sentence."""
    choices = [part for part in (field.annotation, *get_args(field.annotation)) if get_origin(part) is Literal]
    words = [toml_value(word) for part in choices for word in get_args(part)]
    for mark in marks_of(field):
        if isinstance(mark, (Quantity, NumberOrWord)) and mark.words:
            words = [*(toml_value(word) for word in mark.words), "a value"]
    return [f"One of {', '.join(words)}."] if len(words) > 1 else []


def _default(default: object, field: FieldInfo) -> str:
    """A default as the file has it, values with a dimension in the unit of the field's example."""
    vector = mark_of(field, Vector)
    if vector is not None and vector.component is not None and isinstance(default, tuple):
        return toml_value([f"{component:g} {vector.component.symbol}" for component in default])
    quantity = mark_of(field, Quantity)
    if isinstance(default, BaseModel):
        return "{}"  # the table, with all of its keys left out
    if quantity is None or not isinstance(default, float):
        return toml_value(default)
    return toml_value(quantity.in_unit_of_example(default))


def _inline(field: FieldInfo) -> str | None:
    """A small table as it stands in one line, of a field that is written so."""
    extra = field.json_schema_extra
    return str(extra["inline"]) if isinstance(extra, dict) and "inline" in extra else None


def _example(field: FieldInfo) -> str | None:
    """An example as the file has it, None where the schema has none."""
    if (inline := _inline(field)) is not None:
        return inline
    quantity = mark_of(field, Quantity)
    if quantity is not None and get_origin(field.annotation) is not list:
        plain = not any(get_origin(part) is list for part in get_args(field.annotation))
        return toml_value(quantity.example) if plain else None
    vector = mark_of(field, Vector)
    return vector.example if vector is not None else None
