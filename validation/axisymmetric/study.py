"""Single rounds in their meridian: convergence over cell sizes, and the meridian beside three dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from validation.grid import grid_index
from validation.runs import Geometry, reference_beside, snapshot_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "speeds_along", "study", "wall_jump"]

REFERENCE = reference_beside(__file__)
_QUANTITIES = (
    ("mean speed", "mean_initial_speed", 1.0, "m/s"),
    ("outer diameter", "outer_diameter", 1e3, "mm"),
)
_NEW_LAYER = 0.3  # of the cells' thickness: cells whose radii differ by more lie in different layers


def study(runs: Runs, rows: Rows) -> None:
    """Run every round in its meridian at every cell size, and two of them in three dimensions as well."""
    made: list[dict[str, Any]] = []
    for name, entry in REFERENCE["rounds"].items():
        subjects = entry["subjects"]
        sizes = entry["quick_sizes" if rows.quick else "sizes"]
        folders, bursts = zip(*(_burst(runs, name, size) for size in sizes), strict=True)
        made += bursts
        _converging(rows, name, sizes, list(bursts), subjects)
        if name == REFERENCE["wall"]["round"]:
            quantity = f"{name}, {sizes[-1]}: axial speed, largest step between layers of the wall"
            rows.bound(quantity, wall_jump(folders[-1] / "burst_snapshot.h5"), (0.0, REFERENCE["wall"]["jump"]),
                       REFERENCE["wall"]["source"], "m/s", "meridian", *subjects)  # fmt: skip
        size = REFERENCE["three_dimensions"]["size"]
        if name in REFERENCE["three_dimensions"]["rounds"]:
            folder, solid = _burst(runs, name, size, "3d")
            place = sizes.index(size)
            _beside(rows, f"{name}, {size}", (folders[place], folder), (bursts[place], solid), subjects)
            for words, change in entry.get("numerics", {}).items():
                ours = _burst(runs, name, size, "3d", change["changes"])[1]["mean_initial_speed"]
                rows.verify(f"{name}, {size}, three dimensions: mean speed with {words}", ours,
                            solid["mean_initial_speed"], change["allowed"], "the defaults", "m/s",
                            *subjects)  # fmt: skip
    momentum, energy = (max(burst[one] for burst in made) for one in ("momentum_error", "energy_error_at_checks"))
    rows.bound("axial momentum error, largest", momentum, (0.0, 1e-12), "conservation of momentum", "", "meridian")
    rows.bound("energy error at the outputs, largest", energy, (0.0, REFERENCE["energy_error"]),
               "conservation of energy", "", "meridian")  # fmt: skip


def _burst(
    runs: Runs, name: str, size: str, geometry: Geometry = "axisymmetric", changes: Mapping[str, Any] | None = None
) -> tuple[Path, dict[str, Any]]:
    """One burst to a given end: its directory and the part "burst" of its summary; `changes` are factors or values."""
    entry = REFERENCE["rounds"][name]
    words = [*name.lower().replace(",", "").split(), geometry, *(key.split(".")[1] for key in list(changes or {})[:1])]
    wanted: dict[str, Any] = {"burst.stop": "time", "burst.end_time": "120 us"}
    wanted |= {key: value if isinstance(value, str) else _times(value) for key, value in (changes or {}).items()}
    return runs.burst(f"axisymmetric_{'_'.join(words)}", entry["case"], size, wanted, geometry)


def _times(factor: float) -> Callable[[float], float]:
    return lambda old: factor * old


def _beside(rows: Rows, label: str, folders: tuple[Path, Path], bursts: tuple[Any, Any], subjects: list[str]) -> None:
    """The meridian against hexahedra of the same size: the whole, the fastest cell and the tenth farthest off.

    The whole must be the same. The metal beside the fuze has not converged in either with such cells, and a largest
    value never does: these are compared alone.
    """
    plan, (flat, solid) = REFERENCE["three_dimensions"], bursts
    for words, key, factor, unit in _QUANTITIES:
        rows.verify(f"{label}: {words}, meridian against three dimensions", factor * flat[key], factor * solid[key],
                    plan["allowed"], REFERENCE["beside"], unit, *subjects)  # fmt: skip
    rows.compare(f"{label}: largest speed, meridian against three dimensions", flat["max_initial_speed"],
                 solid["max_initial_speed"], REFERENCE["coarse"], "m/s", *subjects)  # fmt: skip
    first = plan["compared_from"]
    one, two = (speeds_along(folder / "burst_snapshot.h5", plan["parts"]) for folder in folders)
    worst = first + int(np.abs(one[first:] / two[first:] - 1.0).argmax())
    rows.compare(f"{label}: mean speed of tenth {worst + 1} of the length, the farthest apart", float(one[worst]),
                 float(two[worst]), REFERENCE["coarse"], "m/s", *subjects)  # fmt: skip


def speeds_along(snapshot: Path, parts: int) -> NDArray[np.float64]:
    """Mass-weighted mean speed (m/s) of equal parts of the casing's length, from the nose."""
    with snapshot_of(snapshot) as file:
        table, length = file["rounds/0/along"][()], float(file["rounds/0"].attrs["length"])
    where = np.minimum((table["station"] / length * parts).astype(int), parts - 1)
    mass = np.bincount(where, table["casing_mass"], minlength=parts)
    return np.asarray(np.bincount(where, table["casing_mass"] * table["mean_speed"], minlength=parts) / mass)


def wall_jump(snapshot: Path) -> float:
    """Largest difference of the mean axial velocity (m/s) between neighbouring layers of cells of an upright casing."""
    low, high = REFERENCE["wall"]["stations"]
    with snapshot_of(snapshot) as file:
        start, velocity = file["nodes/reference"][()], file["nodes/velocity"][()]
        cells, mass = file["cells/nodes"][()], file["cells/mass"][()]
        part, station = file["cells/part"][()], file["cells/station"][()]
    own = np.flatnonzero((part == 0) & (station > low) & (station < high))
    corners = np.hypot(start[cells[own], 0], start[cells[own], 1])
    radius, axial = corners.mean(axis=1), velocity[cells[own]].mean(axis=1)[:, 2]
    order = np.argsort(radius, kind="stable")
    thickness = float(np.median(np.ptp(corners, axis=1)))
    layer = np.zeros(len(own), dtype=np.int64)
    layer[order] = np.cumsum(np.diff(radius[order], prepend=radius[order[0]]) > _NEW_LAYER * thickness)
    speed = np.bincount(layer, mass[own] * axial) / np.bincount(layer, mass[own])
    return float(np.abs(np.diff(speed)).max(initial=0.0))


def _converging(rows: Rows, name: str, sizes: list[str], bursts: list[dict[str, Any]], subjects: list[str]) -> None:
    """The finest size with its grid convergence index: what the cells leave open."""
    for words, key, factor, unit in _QUANTITIES:
        values = [factor * burst[key] for burst in bursts]
        found = grid_index([float(size.split()[0]) for size in sizes], values)
        quantity = f"{name}: {words} at {sizes[-1]} against {sizes[0]} (index {100 * found.index:.2g} %, {found.kind})"
        rows.trend(quantity, values[-1], values[0], "Roache 1994", unit, "meridian", *subjects)
