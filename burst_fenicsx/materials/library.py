"""Explosives and casing materials by name or from a user's file of the same form."""

from __future__ import annotations

from pathlib import Path

from burst_fenicsx.data import DATA_DIRECTORY, Table, nearest_name, read_toml
from burst_fenicsx.errors import InputError
from burst_fenicsx.problem import CasingMaterial, Explosive, JonesWilkinsLee

__all__ = ["casing_names", "explosive_names", "gurney_range", "load_casing", "load_explosive"]

EXPLOSIVES = DATA_DIRECTORY / "explosives.toml"
CASINGS = DATA_DIRECTORY / "casings.toml"
EXPLOSIVE_KEYS = (
    "density",
    "detonation_velocity",
    "heat_of_detonation",
    "sound_speed",
    "hugoniot_slope",
    "shear_modulus",
    "shear_strength",
    "gurney",
    "jwl",
    "source",
    "critical_energy",
    "critical_energy_source",
)
CASING_KEYS = (
    "density",
    "elastic_modulus",
    "poisson_ratio",
    "shear_strength",
    "tensile_strength",
    "shear_softening_strain",
    "tensile_softening_strain",
    "softening_length",
    "source",
)
JWL_KEYS = ("A", "B", "R1", "R2", "omega", "E0")


def explosive_names() -> tuple[str, ...]:
    """Return the names of the built-in explosives."""
    return tuple(sorted(read_toml(EXPLOSIVES)))


def casing_names() -> tuple[str, ...]:
    """Return the names of the built-in casing materials."""
    return tuple(sorted(read_toml(CASINGS)))


def load_explosive(name_or_path: str | Path) -> Explosive:
    """Load an explosive.

    Parameters
    ----------
    name_or_path : str or Path
        A built-in name ("tnt", "comp_b"), or a file that ends in .toml and has the form of `data/explosives.toml`;
        of a file with several tables "file.toml#name" takes one.

    Raises
    ------
    InputError
        Unknown name; unreadable file; a key that is unknown, missing, of the wrong type or out of bounds.
    """
    name, table = _entry(name_or_path, EXPLOSIVES, "explosive", EXPLOSIVE_KEYS)
    jwl = None
    if "jwl" in table:
        constants = table.table("jwl", JWL_KEYS)
        jwl = JonesWilkinsLee(**{key: constants.number(key, above=0.0) for key in JWL_KEYS})
    if "gurney" in table:
        _range(table)
    critical = None
    if "critical_energy" in table:
        low, high = table.numbers("critical_energy", 2)
        if not 0.0 < low <= high:
            raise table.fault("critical_energy", "two energies above 0 (J/m2), the smaller first, are expected")
        critical = low, high
    return Explosive(
        name=name,
        density=table.number("density", above=0.0, unit="kg/m3"),
        detonation_velocity=table.number("detonation_velocity", above=0.0, unit="m/s"),
        heat_of_detonation=table.number("heat_of_detonation", above=0.0, unit="J/kg"),
        sound_speed=table.number("sound_speed", above=0.0, unit="m/s"),
        jwl=jwl,
        shear_modulus=table.number("shear_modulus", Explosive.shear_modulus, above=0.0, unit="Pa"),
        shear_strength=table.number("shear_strength", Explosive.shear_strength, at_least=0.0, unit="Pa"),
        source=table.text("source", ""),
        critical_energy=critical,
        critical_energy_source=table.text("critical_energy_source", ""),
        hugoniot_slope=table.number("hugoniot_slope", Explosive.hugoniot_slope, at_least=1.0),
    )


def gurney_range(name_or_path: str | Path) -> tuple[float, float] | None:
    """Return the range of printed Gurney velocities sqrt(2E) (m/s) of an explosive, None where its table has none."""
    _, table = _entry(name_or_path, EXPLOSIVES, "explosive", EXPLOSIVE_KEYS)
    return _range(table) if "gurney" in table else None


def load_casing(name_or_path: str | Path) -> CasingMaterial:
    """Load a casing material.

    Parameters
    ----------
    name_or_path : str or Path
        A built-in name ("steel_paper", "steel_m107", "copper"), or a file that ends in .toml and has the form of
        `data/casings.toml`; of a file with several tables "file.toml#name" takes one.

    Raises
    ------
    InputError
        Unknown name; unreadable file; a key that is unknown, missing, of the wrong type or out of bounds.
    """
    name, table = _entry(name_or_path, CASINGS, "casing", CASING_KEYS)
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


def _range(table: Table) -> tuple[float, float]:
    low, high = table.numbers("gurney", 2)
    if not 0.0 < low <= high:
        raise table.fault("gurney", "two speeds above 0 (m/s), the smaller first, are expected")
    return low, high


def _entry(name_or_path: str | Path, library: Path, kind: str, keys: tuple[str, ...]) -> tuple[str, Table]:
    """Name and table of an entry of the library or of a user's file."""
    text = str(name_or_path)
    file, _, wanted = text.partition("#")
    if not file.lower().endswith(".toml"):
        content = read_toml(library)
        if text not in content:
            raise InputError(f"{kind} '{text}' is unknown; {nearest_name(text, content)}; or a path that ends in .toml")
        return text, Table(content[text], f"{library.name} [{text}]", keys)
    content = read_toml(Path(file))
    if not wanted:
        if len(content) != 1:
            names = ", ".join(content) or "none"
            raise InputError(f"{file}: found {len(content)} tables ({names}); name one as {file}#name")
        wanted = next(iter(content))
    if wanted not in content:
        raise InputError(f"{file}: no table [{wanted}]; {nearest_name(wanted, content)}")
    return wanted, Table(content[wanted], f"{file} [{wanted}]", keys)
