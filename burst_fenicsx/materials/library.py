"""Explosives and casing materials by name or from a user's file."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from burst_fenicsx.data import Table, nearest_name, read_toml
from burst_fenicsx.errors import InputError
from burst_fenicsx.problem import CasingMaterial, Explosive, JonesWilkinsLee
from fragfield_base.substances import is_substance, read_substance, substance, substance_key, substance_names

if TYPE_CHECKING:
    from fragfield_base.substances import Kind, Substance


JWL_KEYS = tuple(item.name for item in fields(JonesWilkinsLee))
EXPLOSIVE_KEYS = (*(item.name for item in fields(Explosive) if item.name != "name"), "gurney")
CASING_KEYS = tuple(item.name for item in fields(CasingMaterial) if item.name != "name")
_SOURCES = ("charge", "heat", "jwl", "unreacted", "solid", "strength")


def explosive_names() -> tuple[str, ...]:
    """Return the names of the built-in explosives."""
    return substance_names("explosive")


def burst_explosive_names() -> tuple[str, ...]:
    """Return the names of those with data for a model of the burst."""
    return tuple(name for name in explosive_names() if load_explosive(name).models)


def casing_names() -> tuple[str, ...]:
    """Return the names of the built-in casing materials."""
    return substance_names("casing")


def load_explosive(name_or_path: str | Path) -> Explosive:
    """Load an explosive.

    Parameters
    ----------
    name_or_path : A built-in name or another name of it ("comp_b", "Composition B"), or a file that ends in .toml: of
        the form of those in `fragfield_base/substances/explosives`, or tables of `EXPLOSIVE_KEYS`, of several of which
        "file.toml#name" takes one.

    Raises
    ------
    InputError
        Unknown name; unreadable file; a key that is unknown, missing, of the wrong type or out of bounds.
    """
    name, table = _entry(name_or_path, "explosive", EXPLOSIVE_KEYS)
    jwl = None
    if "jwl" in table:
        constants = table.table("jwl", JWL_KEYS)
        jwl = JonesWilkinsLee(**{key: constants.number(key, above=None if key == "B" else 0.0) for key in JWL_KEYS})
    for key in ("gurney", "critical_energy"):
        _range(table, key)
    return Explosive(
        name=name,
        density=table.number("density", above=0.0, unit="kg/m3"),
        detonation_velocity=table.number("detonation_velocity", above=0.0, unit="m/s"),
        heat_of_detonation=_optional(table, "heat_of_detonation", "J/kg"),
        sound_speed=_optional(table, "sound_speed", "m/s"),
        jwl=jwl,
        shear_modulus=table.number("shear_modulus", Explosive.shear_modulus, above=0.0, unit="Pa"),
        shear_strength=table.number("shear_strength", Explosive.shear_strength, at_least=0.0, unit="Pa"),
        source=table.text("source", ""),
        critical_energy=_range(table, "critical_energy"),
        critical_energy_source=table.text("critical_energy_source", ""),
        hugoniot_slope=table.number("hugoniot_slope", Explosive.hugoniot_slope, at_least=1.0),
    )


def load_casing(name_or_path: str | Path) -> CasingMaterial:
    """Load a casing material.

    Parameters
    ----------
    name_or_path : A built-in name or another name of it ("steel_1045", "AISI 1045"), or a file that ends in .toml: of
        the form of those in `fragfield_base/substances/casings`, or tables of `CASING_KEYS`, of several of which
        "file.toml#name" takes one.

    Raises
    ------
    InputError
        Unknown name; unreadable file; a key that is unknown, missing, of the wrong type or out of bounds.
    """
    name, table = _entry(name_or_path, "casing", CASING_KEYS)
    return CasingMaterial(
        name=name,
        density=table.number("density", above=0.0, unit="kg/m3"),
        elastic_modulus=table.number("elastic_modulus", above=0.0, unit="Pa"),
        poisson_ratio=table.number("poisson_ratio", at_least=0.0, below=0.5),
        shear_strength=table.number("shear_strength", above=0.0, unit="Pa"),
        tensile_strength=table.number("tensile_strength", above=0.0, unit="Pa"),
        shear_softening_strain=_softening(table, "shear_softening_strain"),
        tensile_softening_strain=_softening(table, "tensile_softening_strain"),
        softening_length=_softening_length(table),
        source=table.text("source", ""),
    )


def load_substance(kind: Kind, name_or_path: str | Path) -> Substance | None:
    """Return everything of a built-in substance or of a user's file of its form; None for a file of tables.

    Raises
    ------
    InputError
        Unknown name; unreadable file; a key that is unknown or a value of the wrong type.
    """
    text = str(name_or_path)
    if text.partition("#")[0].lower().endswith(".toml"):
        path = Path(text.partition("#")[0])
        content = read_toml(path)
        return read_substance(kind, content, str(path), error=InputError) if is_substance(content) else None
    name = substance_key(text, kind)
    if name not in substance_names(kind):
        known = nearest_name(text, substance_names(kind))
        raise InputError(f"{kind} '{text}' is unknown; {known}; or a path that ends in .toml")
    return substance(kind, name)


def _softening_length(table: Table) -> float | None:
    if table.values.get("softening_length", "none") == "none":
        return None
    return table.number("softening_length", above=0.0, unit="m")


def _softening(table: Table, key: str) -> float | None:
    value = table.values.get(key, 0.5)
    if isinstance(value, str):
        if value != "none":
            raise table.fault(key, 'a number above 0 or "none" is expected')
        return None
    return table.number(key, 0.5, above=0.0)


def _optional(table: Table, key: str, unit: str) -> float | None:
    return table.number(key, above=0.0, unit=unit) if key in table else None


def _range(table: Table, key: str) -> tuple[float, float] | None:
    if key not in table:
        return None
    low, high = table.numbers(key, 2)
    if not 0.0 < low <= high:
        raise table.fault(key, "two numbers above 0, the smaller first, are expected")
    return low, high


def _entry(name_or_path: str | Path, kind: Kind, keys: tuple[str, ...]) -> tuple[str, Table]:
    """Name and values of a substance, or of a table in a user's file."""
    text = str(name_or_path)
    found = load_substance(kind, text)
    if found is not None:
        file = text if text.lower().endswith(".toml") else f"{found.name}.toml"
        return found.name, Table(_flat(found, keys), file, keys)
    file, _, wanted = text.partition("#")
    content = read_toml(Path(file))
    if not wanted:
        if len(content) != 1:
            names = ", ".join(content) or "none"
            raise InputError(f"{file}: found {len(content)} tables ({names}); name one as {file}#name")
        wanted = next(iter(content))
    if wanted not in content:
        raise InputError(f"{file}: no table [{wanted}]; {nearest_name(wanted, content)}")
    return wanted, Table(content[wanted], f"{file} [{wanted}]", keys)


def _flat(found: Substance, keys: tuple[str, ...]) -> dict[str, Any]:
    table: dict[str, Any] = {"source": found.sources(*_SOURCES)}
    for name, group in found.groups.items():
        if name in keys and name not in group.values:
            table[name] = dict(group.values)  # the table jwl
        else:
            table |= {key: value for key, value in group.values.items() if key in keys}
        if f"{name}_source" in keys:
            table[f"{name}_source"] = group.source
    return table
