"""Tables of pit tests, of fragments one by one, of drag coefficients and of walls."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.drag import Drag
from flight.errors import InputError as FlightInputError
from flight.fragments import Fragments
from fragfield.errors import InputError
from fragfield_base.inputs import with_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fragfield.importing.columns import Columns


WANTED = {
    "pit": ("mass_above", "mass_from", "mass_to", "mass_group", "number", "total_mass", "mass"),
    "fragments": (
        "mass", "vx", "vy", "vz", "mean_speed", "azimuth", "elevation", "x", "y", "z", "shape_factor", "round",
        "segment",
    ),
    "drag": ("mach", "cd"),
    "walls": ("name", "start_x", "start_y", "end_x", "end_y", "height", "thickness"),
}  # fmt: skip
"""Quantities of each kind of table, as `arena.WANTED` of an arena table."""


def pit_columns(columns: Columns) -> dict[str, NDArray[np.float64]]:
    """Columns of a file that `break_up.mean_mass` names: groups of mass, numbers above masses, or pieces."""
    if "mass_above" in columns:
        columns.require("number")
        return {"mass_above_kg": columns.whole("mass_above"), "number": columns.whole("number")}
    if "mass_group" in columns or "mass_from" in columns:
        low, high = _groups(columns)
        columns.require("number")
        number = np.nan_to_num(columns.values("number"))
        columns.refuse_sum(number)
        found = {"mass_from_kg": low, "mass_to_kg": high, "number": number}
        for name in ("total_mass", "mass"):
            if name in columns and "mass_kg" not in found:
                found["mass_kg"] = np.nan_to_num(columns.values(name))
        return found
    columns.require("mass")
    found = {"mass_kg": columns.whole("mass")}
    return found | ({"number": columns.whole("number")} if "number" in columns else {})


def _groups(columns: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    if "mass_group" not in columns:
        columns.require("mass_from", "mass_to")
        high = columns.values("mass_to")
        high[-1] = math.inf if np.isnan(high[-1]) else high[-1]
        if np.isnan(high).any():
            columns.whole("mass_to")
        return columns.whole("mass_from"), high
    ranges = columns.intervals("mass_group", "kg")
    for row, one in zip(columns.layout.rows, ranges, strict=True):
        if one is None:
            raise InputError(f"{columns.place(row, 'mass_group')}: not a range; allowed: from and to, as 5-10 or > 50")
    return np.array([one.low for one in ranges if one]), np.array([one.high for one in ranges if one])


def fragment_table(columns: Columns) -> Fragments:
    """Fragments one by one; their velocity as components, or as speed, azimuth from +x and elevation."""
    columns.require("mass")
    if {"vx", "vy", "vz"} & set(columns.index):
        columns.require("vx", "vy", "vz")
        velocity = np.column_stack([columns.whole(name) for name in ("vx", "vy", "vz")])
    else:
        columns.require("mean_speed", "azimuth", "elevation")
        speed, turn, rise = (columns.whole(name) for name in ("mean_speed", "azimuth", "elevation"))
        velocity = speed[:, None] * np.column_stack(
            [np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)]
        )
    zero = np.zeros(len(columns))
    position = np.column_stack([columns.whole(name) if name in columns else zero for name in ("x", "y", "z")])
    more: dict[str, Any] = {
        name: columns.whole(name) for name in ("shape_factor", "round", "segment") if name in columns
    }
    try:
        return Fragments(columns.whole("mass"), position, velocity, **more)
    except FlightInputError as error:
        raise InputError(f"{columns.layout.sheet.path}: {error}") from None


def drag_table(columns: Columns) -> Drag:
    """Drag coefficient over Mach number."""
    columns.require("mach", "cd")
    try:
        return Drag(columns.whole("mach"), columns.whole("cd"), columns.layout.sheet.path.name)
    except FlightInputError as error:
        raise InputError(f"{columns.layout.sheet.path}: {error}") from None


def walls_text(columns: Columns) -> tuple[str, Sequence[str]]:
    """Tables [[obstacle]] of a case file for upright walls, and their names."""
    import tomlkit

    columns.require("start_x", "start_y", "end_x", "end_y", "height", "thickness")
    values = {name: columns.whole(name) for name in WANTED["walls"] if name != "name"}
    names = columns.texts("name") if "name" in columns else [f"wall {at + 1}" for at in range(len(columns))]
    document, tables = tomlkit.document(), tomlkit.aot()
    for at, name in enumerate(names):
        table = tomlkit.table()
        table["name"], table["kind"] = name, "wall"
        for end in ("start", "end"):
            table[end] = [with_unit(float(values[f"{end}_{axis}"][at]), "m") for axis in "xy"]
        for size in ("height", "thickness"):
            table[size] = with_unit(float(values[size][at]), "m")
        tables.append(table)
    document["obstacle"] = tables
    return tomlkit.dumps(document), names
