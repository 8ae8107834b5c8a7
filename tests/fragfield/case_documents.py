"""Case files for the tests: one that uses every table, and the shortest one, with what a test changes in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["CASE", "FULL", "changed_burst", "changed", "a_round", "flat", "write_case"]

FULL = """
title = 'All of it: "quotes", \\ and \u00b5'
seed = 7
[burst]
cell_size = "9 mm"
quadrature = "full"
products = "jwl"
burn = "time"
acceleration_left = 0.05
time_step = { cfl = 0.7, fixed = "10 ns" }
leakage = { enabled = false }
viscosity = { linear = 0.1 }
hourglass = { casing_stiffness = 0.05 }
output = { interval = "5 us", nodal_stress = true }
[[round]]
name = "left"
profile = "tube"
explosive = "comp_b"
casing = "copper"
position = ["-100 mm", "0 mm", "0.5 m"]
ignition = [{ station = "middle", offset = ["5 mm", "0 mm"] }, { station = "base", delay = "3 us" }]
[[round]]
name = "right"
profile = "m107"
explosive = "tnt"
casing = "steel_m107"
position = ["100 mm", "0 mm", "0.5 m"]
axis = [0, 0.1, 1]
[break_up]
dimension = "mixed"
mixed_fraction = 0.3
mean_mass = "14.9 g"
prefactor = "paper"
sampler = "graded"
graded_m0 = "0.05 g"
segments = ["10 cm", "20 cm"]
[flight]
drag = 1.2
wind = { model = "profile", heights = ["0 m", "100 m"], speeds = ["1 m/s", "9 m/s"], directions = ["10 deg", "30 deg"] }
air = { model = "constant", density = "0.9 kg/m3" }
integrator = { method = "fixed", step = "0.1 ms" }
[[witness]]
name = "ring"
radius = "25 ft"
top = "3 m"
[[witness]]
name = "wall"
kind = "panel"
centre = ["10 m", "0 m", "1 m"]
normal = [-1, 0, 0]
width = "4 m"
height = "2 m"
[[witness]]
name = "roof"
kind = "polygon"
corners = [["8 m", "-1 m", "3 m"], ["10 m", "-1 m", "3 m"], ["9 m", "1 m", "3 m"]]
[hazard]
energy = "58 ft*lbf"
"""

CASE = {
    "burst": {"cell_size": "9 mm"},
    "round": [{"name": "a", "profile": "tube", "explosive": "tnt", "casing": "copper"}],
}


def write_case(folder: Path, text: str) -> Path:
    """A case file of this text."""
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


def changed(**changes: Any) -> dict[str, Any]:
    """The shortest case with other tables."""
    return {**CASE, **changes}


def a_round(**changes: Any) -> dict[str, Any]:
    """Its round with other keys."""
    return {**CASE["round"][0], **changes}


def changed_burst(changes: dict[str, Any]) -> dict[str, Any]:
    """The shortest case with other keys in [burst]."""
    return {**CASE, "burst": {**CASE["burst"], **changes}}


def flat(tables: Any, key: tuple[object, ...] = ()) -> dict[tuple[object, ...], Any]:
    """Values by their keys, from the outermost table on."""
    if not isinstance(tables, dict | list):
        return {key: tables}
    pairs = tables.items() if isinstance(tables, dict) else enumerate(tables)
    return {path: entry for name, value in pairs for path, entry in flat(value, (*key, name)).items()}
