"""Rows of the M107 over cell sizes: distances against the finest one, axial speeds through the wall."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.files import reference_beside, snapshot_of
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["NAME", "REFERENCE", "WallProfile", "check_distances", "check_wall", "wall_profile"]

NAME = "m107_convergence"
REFERENCE = reference_beside(__file__)
_NEW_LAYER = 0.3  # of the cells' thickness: cells whose radii differ by more lie in different layers


@dataclass(frozen=True, eq=False)
class WallProfile:
    """Layers of casing cells from the inside outward.

    Attributes
    ----------
    depth : (n,) float64
        Mean distance of each layer's centres from the inner side before the burst (m).
    speed : (n,) float64
        Mass-weighted mean axial velocity of each layer (m/s), towards the nose.
    """

    depth: NDArray[Any]
    speed: NDArray[Any]

    @property
    def jump(self) -> float:
        """Largest difference between neighbouring layers (m/s)."""
        return float(np.abs(np.diff(self.speed)).max(initial=0.0))

    def at(self, depth: float) -> float:
        """Axial speed at a depth (m), linear between the layers' centres."""
        return float(np.interp(depth, self.depth, self.speed))


def wall_profile(snapshot: Path) -> WallProfile:
    """Read the profile through the wall at the reference's stations off burst_snapshot.h5; the round stands upright.

    Raises
    ------
    StudyError
        The file is no snapshot.
    """
    low, high = REFERENCE["wall"]["stations"]
    with snapshot_of(snapshot) as file:
        start, velocity = file["nodes/reference"][()], file["nodes/velocity"][()]
        cells, mass = file["cells/nodes"][()], file["cells/mass"][()]
        part, station = file["cells/part"][()], file["cells/station"][()]
    own = np.flatnonzero((part == 0) & (station > low) & (station < high))
    corners = start[cells[own]]
    inside = float(np.hypot(corners[..., 0], corners[..., 1]).min())
    centre, axial, weight = corners.mean(axis=1), velocity[cells[own]].mean(axis=1)[:, 2], mass[own]
    radius = np.hypot(centre[:, 0], centre[:, 1])
    order = np.argsort(radius, kind="stable")
    thickness = float(np.median(np.ptp(np.hypot(corners[..., 0], corners[..., 1]), axis=1)))
    layer = np.zeros(len(own), dtype=np.int64)
    layer[order] = np.cumsum(np.diff(radius[order], prepend=radius[order[0]]) > _NEW_LAYER * thickness)
    total = np.bincount(layer, weights=weight)
    return WallProfile(
        np.bincount(layer, weights=weight * radius) / total - inside,
        np.bincount(layer, weights=weight * axial) / total,
    )


def check_wall(profiles: Mapping[str, WallProfile]) -> list[Row]:
    """No jump between layers of the finest mesh, and the same speeds at the same depth for all sizes.

    `profiles` by cell size, the finest last.
    """
    wall, source = REFERENCE["wall"], REFERENCE["source"]
    finest = list(profiles)[-1]
    quantity = f"{wall['case']}, {finest}: axial speed, largest step between layers of the wall"
    rows = [within(NAME, quantity, profiles[finest].jump, 0.0, wall["jump"], source, "m/s")]
    for depth in wall["depths"]:
        speeds = [profile.at(depth) for profile in profiles.values()]
        quantity = (
            f"{wall['case']}: axial speed at {1e3 * depth:g} mm in the wall, spread over {len(speeds)} cell sizes"
        )
        rows.append(within(NAME, quantity, max(speeds) - min(speeds), 0.0, wall["spread"], source, "m/s"))
    return rows


def check_distances(fill: str, hazards: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """Distances of every size against the finest one; `hazards` are the summaries' parts by size, the finest last."""
    allowed, source = REFERENCE["distance"]["allowed"], REFERENCE["source"]
    sizes = list(hazards)
    finest, rows = sizes[-1], []
    best = hazards[finest]
    for size, hazard in hazards.items():
        quantity = f"{fill}, {size}: distance against that of {finest}"
        tolerance = allowed.get(size) if size != finest else None
        rows.append(compare(NAME, quantity, hazard["expected"], best["expected"], tolerance, source, "m"))
        quantity = f"{fill}, {size}: upper bound of the distance against that of {finest}"
        rows.append(compare(NAME, quantity, hazard["upper"], best["upper"], None, source, "m"))
    if len(sizes) > 1:
        before = hazards[sizes[-2]]
        error = float(np.hypot(best["standard_error"], before["standard_error"]))
        apart = abs(before["expected"] - best["expected"]) / error
        quantity = f"{fill}: distances of {sizes[-2]} and {finest}, apart in standard errors"
        rows.append(within(NAME, quantity, apart, 0.0, REFERENCE["distance"]["standard_errors"], source))
    return rows
