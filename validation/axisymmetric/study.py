"""Single rounds in their meridian: convergence over cell sizes, and the meridian beside three dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.grid import grid_index
from validation.runs import Geometry, reference_beside

if TYPE_CHECKING:
    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "study"]

REFERENCE = reference_beside(__file__)
_QUANTITIES = (
    ("mean speed", "mean_initial_speed", 1.0, "m/s"),
    ("outer diameter", "outer_diameter", 1e3, "mm"),
)


def study(runs: Runs, rows: Rows) -> None:
    """Run every round in its meridian at every cell size, and two of them in three dimensions as well."""
    momentum = 0.0
    for name, entry in REFERENCE["rounds"].items():
        subjects = entry["subjects"]
        sizes = entry["quick_sizes" if rows.quick else "sizes"]
        bursts = [_burst(runs, name, size, "axisymmetric") for size in sizes]
        momentum = max(momentum, *(burst["momentum_error"] for burst in bursts))
        _converging(rows, name, sizes, bursts, subjects)
        if name in REFERENCE["three_dimensions"]["rounds"]:
            size = REFERENCE["three_dimensions"]["size"]
            solid, flat = _burst(runs, name, size, "3d"), bursts[sizes.index(size)]
            for words, key, factor, unit in _QUANTITIES:
                rows.compare(f"{name}, {size}: {words}, meridian beside three dimensions", factor * flat[key],
                             factor * solid[key], REFERENCE["beside"], unit, *subjects)  # fmt: skip
    rows.bound("axial momentum error, largest", momentum, (0.0, 1e-12), "conservation of momentum", "", "meridian")


def _burst(runs: Runs, name: str, size: str, geometry: Geometry) -> dict[str, Any]:
    """One burst to a given end."""
    entry = REFERENCE["rounds"][name]
    changes = {"burst.stop": "time", "burst.end_time": "120 us"}
    words = name.lower().replace(",", "").replace(" ", "_")
    return runs.burst(f"axisymmetric_{words}_{geometry}", entry["case"], size, changes, geometry)[1]


def _converging(rows: Rows, name: str, sizes: list[str], bursts: list[dict[str, Any]], subjects: list[str]) -> None:
    """The finest size with its grid convergence index: what the cells leave open."""
    for words, key, factor, unit in _QUANTITIES:
        values = [factor * burst[key] for burst in bursts]
        found = grid_index([float(size.split()[0]) for size in sizes], values)
        quantity = f"{name}: {words} at {sizes[-1]} against {sizes[0]} (index {100 * found.index:.2g} %, {found.kind})"
        rows.trend(quantity, values[-1], values[0], "Roache 1994", unit, "meridian", *subjects)
