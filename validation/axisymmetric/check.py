"""Rows of single rounds in their meridian: convergence over cell sizes, and the meridian beside hexahedra."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.files import reference_beside, snapshot_of
from validation.grid import grid_index
from validation.rows import Row, compare, markdown_table, within
from validation.runs import StudyError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["NAME", "REFERENCE", "beside", "convergence_table", "converging", "speeds_along"]

NAME = "axisymmetric"
REFERENCE = reference_beside(__file__)
_QUANTITIES = (
    ("mean speed", "mean_initial_speed", 1.0, "m/s"),
    ("largest speed", "max_initial_speed", 1.0, "m/s"),
    ("outer diameter", "outer_diameter", 1e3, "mm"),
)


def converging(name: str, bursts: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """Rows of one round over its cell sizes, coarse to fine: `bursts` are the "burst" parts of the summaries."""
    rows: list[Row] = []
    for size, burst in bursts.items():
        bounds = REFERENCE["bounds"]
        rows += [
            within(NAME, f"{name}, {size}: axial momentum error", burst["momentum_error"], 0.0,
                   bounds["momentum_error"],
                   REFERENCE["source"]),
            within(NAME, f"{name}, {size}: energy error at the outputs", burst["energy_error_at_outputs"], 0.0,
                   bounds["energy_error"], REFERENCE["source"]),
            within(NAME, f"{name}, {size}: lost cells", float(burst["lost_cells"]), 0.0, 0.0, REFERENCE["source"]),
        ]  # fmt: skip
    if len(bursts) < 3:
        return rows
    sizes = [_metres(size) for size in bursts]
    for words, key, factor, unit in _QUANTITIES:
        values = [factor * burst[key] for burst in bursts.values()]
        found = grid_index(sizes, values)
        bound = REFERENCE["bounds"]["index"] if key == "mean_initial_speed" else None
        quantity = f"{name}: {words}, grid convergence index at the finest size ({found.kind})"
        source = REFERENCE["source"]
        if bound is None:
            rows.append(Row(NAME, quantity, found.index, None, None, None, None, source))
        else:
            rows.append(within(NAME, quantity, found.index, 0.0, bound, source))
        if found.limit is not None:
            rows.append(compare(NAME, f"{name}: {words}, finest against the limit", values[-1], found.limit, None,
                                source, unit))  # fmt: skip
    return rows


def convergence_table(bursts: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """Values by round and size, with observed order and limit, for the README."""
    body = []
    for name, found in bursts.items():
        sizes = [_metres(size) for size in found]
        for size, burst in found.items():
            values = [factor * burst[key] for _, key, factor, _ in _QUANTITIES]
            quantile = burst.get("speed_quantiles", {}).get("99")
            body.append(
                (name, size, f"{burst['cells']:,}", *(f"{value:.1f}" for value in values),
                 "-" if quantile is None else f"{quantile:.0f}", f"{burst['stepping_seconds']:.1f} s")
            )  # fmt: skip
        if len(sizes) < 3:
            continue
        limits = []
        for _, key, factor, _ in _QUANTITIES:
            index = grid_index(sizes, [factor * burst[key] for burst in found.values()])
            if index.limit is None:
                limits.append(f"{index.kind}, ± {100 * index.index:.1f} %")
            else:
                limits.append(f"{index.limit:.1f} (order {index.order:.1f}, ± {100 * index.index:.1f} %)")
        body.append((name, "limit", "", *limits, "", ""))
    head = (
        "round",
        "cells of",
        "cells",
        "mean speed (m/s)",
        "largest (m/s)",
        "diameter (mm)",
        "99 % of the mass below (m/s)",
        "stepping",
    )
    return markdown_table(head, body)


def beside(name: str, size: str, allowed: float, pair: tuple[Path, Path], bursts: tuple[Any, Any]) -> list[Row]:
    """Rows of a burst in the meridian against the one in three dimensions: folders and "burst" parts of both."""
    ours, other = bursts
    rows = []
    for words, key, factor, unit in _QUANTITIES:
        rows.append(compare(NAME, f"{name}, {size}: {words}, meridian against three dimensions", factor * ours[key],
                            factor * other[key], allowed, REFERENCE["beside"], unit))  # fmt: skip
    parts = REFERENCE["three_dimensions"]["parts"]
    one, two = (speeds_along(folder / "burst_snapshot.h5", parts) for folder in pair)
    first = REFERENCE["three_dimensions"]["compared_from"]
    worst = first + int(np.abs(one[first:] / two[first:] - 1.0).argmax())
    rows.append(compare(NAME, f"{name}, {size}: mean speed of tenth {worst + 1} of the length, the farthest apart",
                        float(one[worst]), float(two[worst]), allowed, REFERENCE["beside"], "m/s"))  # fmt: skip
    return rows


def speeds_along(snapshot: Path, parts: int) -> NDArray[np.float64]:
    """Mass-weighted mean speed (m/s) of equal parts of the casing's length, from the nose.

    Raises
    ------
    StudyError
        The file is no snapshot.
    """
    with snapshot_of(snapshot) as file:
        table, length = file["rounds/0/along"][()], float(file["rounds/0"].attrs["length"])
    where = np.minimum((table["station"] / length * parts).astype(int), parts - 1)
    mass = np.bincount(where, table["casing_mass"], minlength=parts)
    return np.asarray(np.bincount(where, table["casing_mass"] * table["mean_speed"], minlength=parts) / mass)


def _metres(size: str) -> float:
    number, unit = size.split()
    if unit != "mm":
        raise StudyError(f"{NAME}: size {size!r}; millimetres are expected")
    return 1e-3 * float(number)
