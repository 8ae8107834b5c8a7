"""Explosives and casings: one TOML file each in the folders beside this module, each value once, with source and grade.

A file has `name` (as text shows it), `aliases`, `composition`, perhaps `note`, and groups of values. Each group names
its `source` and its `grade`, and in `checked` what its values were compared with. Numbers are in SI. A value that is
not known is left out, and what needs it is refused. A user's file of the same form may stand beside a case.
"""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

from fragfield_base.errors import InputError, names_allowed, plain_key

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["GRADES", "GROUPS", "Group", "Kind", "Substance", "aliases", "graded", "is_substance"]
__all__ += ["read_substance", "substance", "substance_key", "substance_title", "substance_names", "substances_with"]

Kind = Literal["explosive", "casing"]

FOLDERS = {"explosive": Path(__file__).parent / "explosives", "casing": Path(__file__).parent / "casings"}
GRADES = {
    "published": "read in the source that is named",
    "second hand": "as others print it, or an independent public text confirms it; the source itself was not at hand",
    "memory": "from memory of the source that is named; no text was at hand to confirm it",
    "recalculated": "follows from other values of the file, as its source says; a test repeats it",
    "estimate": "a judgement, or the value of a related substance",
}
"""What a group's `grade` may be, the firmest first."""
GROUPS: dict[Kind, dict[str, dict[str, str]]] = {
    "explosive": {
        "charge": {"density": "kg/m3", "detonation_velocity": "m/s", "cj_pressure": "Pa"},
        "heat": {"heat_of_detonation": "J/kg"},
        "jwl": {"A": "Pa", "B": "Pa", "R1": "", "R2": "", "omega": "", "E0": "J/m3"},
        "unreacted": {"sound_speed": "m/s", "hugoniot_slope": "", "shear_modulus": "Pa", "shear_strength": "Pa"},
        "gurney": {"gurney": "m/s"},
        "tnt_equivalent": {"pressure": "", "impulse": ""},
        "critical_energy": {"critical_energy": "J/m2"},
        "fragmentation": {"explosive_constant": "kg^(1/2) m^(-7/6)"},
    },
    "casing": {
        "solid": {"density": "kg/m3", "elastic_modulus": "Pa", "poisson_ratio": ""},
        "strength": {
            "shear_strength": "Pa", "tensile_strength": "Pa", "shear_softening_strain": "",
            "tensile_softening_strain": "", "softening_length": "m",
        },
        "johnson_cook": {
            "A": "Pa", "B": "Pa", "n": "", "C": "", "m": "", "melting_temperature": "K", "heat_capacity": "J/(kg K)"
        },
        "break_up": {
            "critical_strain": "", "fracture_energy": "J/m2", "fracture_stress": "Pa", "fracture_gamma": ""
        },
    },
}  # fmt: skip
"""By kind and group: the values it may hold, with their units."""
_RANGES = ("gurney", "critical_energy")  # smallest and largest
_WORDS = ("shear_softening_strain", "tensile_softening_strain", "softening_length")  # or "none"
_TITLES = {name: "JWL" if name == "jwl" else name.capitalize() for groups in GROUPS.values() for name in groups}
_GRADED = re.compile(rf"(?:^| )({'|'.join(_TITLES.values())}) \(({'|'.join(GRADES)})\): ")
_HEAD = ("name", "aliases", "composition", "note")


@dataclass(frozen=True)
class Group:
    """Values of one source."""

    values: Mapping[str, Any]
    source: str
    grade: str
    checked: str


@dataclass(frozen=True)
class Substance:
    """An explosive or a casing: what its file holds."""

    name: str
    """What files and outputs call it: the built-in name, or that of a user's file."""
    title: str
    """Its name in text."""
    aliases: tuple[str, ...]
    """Other names of it."""
    composition: str
    note: str
    """What it is made of; what its user must know."""
    groups: Mapping[str, Group]
    """`Group` by name."""

    def value(self, group: str, key: str) -> Any:  # noqa: ANN401 - a number, a pair or a word
        """A value; None where the file has none."""
        return self.groups[group].values.get(key) if group in self.groups else None

    def sources(self, *names: str) -> str:
        """Sources of these groups, each with its grade."""
        found = [(name, self.groups[name]) for name in names if name in self.groups]
        return " ".join(f"{_TITLES[name]} ({group.grade}): {group.source}" for name, group in found)


def graded(source: str) -> str:
    """Groups and grades in a text of `Substance.sources`, in short; empty where it is another text."""
    return ", ".join(f"{name} {grade}" for name, grade in _GRADED.findall(source))


def is_substance(content: Mapping[str, Any]) -> bool:
    """Whether a document is a substance's file, and not tables of several materials by name."""
    return isinstance(content.get("name"), str)


@cache
def substance_names(kind: Kind) -> tuple[str, ...]:
    """Built-in names, in the order of the alphabet."""
    return tuple(sorted(path.stem for path in FOLDERS[kind].glob("*.toml")))


@cache
def substance(kind: Kind, name: str) -> Substance:
    """A built-in substance by its built-in name."""
    path = FOLDERS[kind] / f"{name}.toml"
    return read_substance(kind, tomllib.loads(path.read_text(encoding="utf-8")), path.name, name=name)


@cache
def aliases(kind: Kind) -> Mapping[str, str]:
    """Built-in name by the letters and digits (`names.plain_key`) of each of its names."""
    found: dict[str, str] = {}
    for name in substance_names(kind):
        one = substance(kind, name)
        for text in (name, one.title, *one.aliases):
            other = found.setdefault(plain_key(text), name)
            if other != name:
                raise ValueError(f"{kind}s {other} and {name} are both called {text!r}")
    return MappingProxyType(found)


def substance_key(name: str, kind: Kind = "explosive") -> str:
    """The built-in name of a substance, however its name is written; letters and digits of one that is not built in.

    Every look-up of an explosive or a casing by its name goes through here.
    """
    key = plain_key(name)
    return aliases(kind).get(key, key)


def substance_title(name: str, kind: Kind = "explosive") -> str:
    """Name of a substance as text shows it: of a built-in one its usual name, of others the one given."""
    key = substance_key(name, kind)
    return substance(kind, key).title if key in substance_names(kind) else name


def substances_with(kind: Kind, group: str, key: str) -> dict[str, Any]:
    """By built-in name, the value of those that have it."""
    values = {name: substance(kind, name).value(group, key) for name in substance_names(kind)}
    return {name: value for name, value in values.items() if value is not None}


def read_substance(
    kind: Kind, content: Mapping[str, Any], where: str, *, name: str | None = None, error: type[Exception] = InputError
) -> Substance:
    """What the document of a substance's file, `where`, holds; outputs call it `name`, by default the file's own.

    Raises `error` where a key is unknown, a group that the kind does not have, lacks source or grade, or a value is not
    a number; with file and key.
    """
    groups: dict[str, Group] = {}
    allowed = GROUPS[kind]
    for key, value in content.items():
        if key in _HEAD:
            texts = value if key == "aliases" and isinstance(value, list) else [value]
            if not all(isinstance(text, str) for text in texts):
                raise error(f"{where}: {key}: found {value!r}; text is needed")
        elif key not in allowed:
            raise error(f"{where}: {key!r} is unknown{names_allowed(key, (*_HEAD, *allowed))}")
        else:
            groups[key] = _group(value, allowed[key], f"{where} [{key}]", error)
    return Substance(
        name=name or content["name"],
        title=content["name"],
        aliases=tuple(content.get("aliases", ())),
        composition=content.get("composition", ""),
        note=content.get("note", ""),
        groups=MappingProxyType(groups),
    )


def _group(table: object, units: Mapping[str, str], where: str, error: type[Exception]) -> Group:
    if not isinstance(table, dict):
        raise error(f"{where}: found {table!r}; a table is needed")
    about = ("source", "grade", "checked")
    values = {key: value for key, value in table.items() if key not in about}
    for key, value in values.items():
        if key not in units:
            raise error(f"{where}: {key!r} is unknown{names_allowed(key, (*units, *about))}")
        _check(key, value, f"{where}: {key}", error)
    words = {key: table.get(key, "") for key in about}
    if not all(isinstance(text, str) for text in words.values()) or not words["source"]:
        raise error(f"{where}: source is missing or no text; every group says where its values come from")
    if words["grade"] not in GRADES:
        raise error(f"{where}: grade: found {words['grade']!r}{names_allowed(words['grade'], GRADES)}")
    return Group(MappingProxyType(values), **words)


def _check(key: str, value: object, where: str, error: type[Exception]) -> None:
    if key in _WORDS and value == "none":
        return
    numbers: list[Any] = value if key in _RANGES and isinstance(value, list) else [value]
    sound = all(isinstance(one, (int, float)) and not isinstance(one, bool) and math.isfinite(one) for one in numbers)
    if not sound or (key in _RANGES and (not isinstance(value, list) or len(numbers) != 2)):
        raise error(f"{where}: found {value!r}; needed: {'two numbers' if key in _RANGES else 'a number'} in SI")
    if key in _RANGES and not 0.0 < numbers[0] <= numbers[1]:
        raise error(f"{where}: found {value!r}; needed: two numbers above 0, the smaller first")
