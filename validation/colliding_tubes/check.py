"""Rows of the colliding tubes: shares of metal about the focus direction and the mean velocity away from the plane."""

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

__all__ = ["NAME", "REFERENCE", "Metal", "check", "check_pair", "middle_of", "reference_shares"]

NAME = "colliding_tubes"
REFERENCE = reference_beside(__file__)


@dataclass(frozen=True, eq=False)
class Metal:
    """Casing cells of the counted stations.

    Attributes
    ----------
    mass : (n,) float64
        Of each cell (kg).
    velocity : (n, 3) float64
        Mean of its nodes (m/s); x leads away from the plane.
    """

    mass: NDArray[Any]
    velocity: NDArray[Any]

    def share(self, angle: float) -> float:
        """Share of the mass that flies within `angle` (degrees) of +y or -y, seen along the axis of the tubes."""
        azimuth = np.degrees(np.arctan2(np.abs(self.velocity[:, 0]), np.abs(self.velocity[:, 1])))
        return float(self.mass[azimuth <= angle].sum() / self.mass.sum())

    @property
    def mean_velocity(self) -> float:
        """Mass-weighted mean velocity away from the plane (m/s)."""
        return float(self.velocity[:, 0] @ self.mass / self.mass.sum())


def middle_of(snapshot: Path) -> list[Metal]:
    """Read the counted metal of each tube off burst_snapshot.h5, x towards its own side.

    Raises
    ------
    StudyError
        The file is no snapshot.
    """
    low, high = REFERENCE["stations"]
    with snapshot_of(snapshot) as file:
        velocity, nodes = file["nodes/velocity"][()], file["cells/nodes"][()]
        part, station = file["cells/part"][()], file["cells/station"][()]
        mass, of_round = file["cells/mass"][()], file["cells/round"][()]
        reference = file["nodes/reference"][()]
    found = []
    for index in np.unique(of_round):
        own = np.flatnonzero((part == 0) & (of_round == index) & (station >= low) & (station <= high))
        side = np.sign(reference[nodes[own], 0].mean())
        found.append(Metal(mass[own], velocity[nodes[own]].mean(axis=1) * [side, 1.0, 1.0]))
    return found


def reference_shares(cell_size: float) -> list[float]:
    """Shares that the independent code gives with cells of about this size (m), by angle."""
    sizes = np.asarray(REFERENCE["shares"]["size"])
    shares: list[float] = REFERENCE["shares"]["share"][int(np.argmin(np.abs(np.log(sizes / cell_size))))]
    return shares


def check(label: str, metal: Metal, burst: Mapping[str, Any]) -> list[Row]:
    """Compare one tube before its plane with the independent code.

    Parameters
    ----------
    label : what the run is.
    metal : of the counted stations.
    burst : the burst's part of summary.json. The comparison is void if metal has passed through the plane.
    """
    source, allowed = REFERENCE["source"], REFERENCE["allowed"]
    passed = burst["passed_through"]["beyond_planes"] / burst["casing_mass"]
    rows = [
        within(NAME, f"{label}: mass behind the plane at the end", passed, 0.0, allowed["passed_through"], "own bound")
    ]
    if not rows[0].passed:
        return rows
    wanted = reference_shares(burst["cell_size"])
    for angle, share, tolerance in zip(REFERENCE["angles"], wanted, allowed["share"], strict=True):
        rows.append(_share_row(f"{label}: mass within {angle:g} degrees", metal.share(angle), share, tolerance, source))
    mean = REFERENCE["mean_velocity"]
    quantity = f"{label}: mean velocity away from the plane"
    rows.append(compare(NAME, quantity, metal.mean_velocity, mean, allowed["mean_velocity"], source, "m/s"))
    return rows


def check_pair(label: str, pair: list[Metal], mirrored: Metal, burst: Mapping[str, Any]) -> list[Row]:
    """Compare two whole tubes with the one before its plane, at the same cell size."""
    allowed = REFERENCE["allowed"]
    passed = burst["passed_through"]["in_other_rounds"] / burst["casing_mass"]
    rows = [
        within(
            NAME, f"{label}: mass within the neighbour at the end", passed, 0.0, allowed["passed_through"], "own bound"
        )
    ]
    source = "the tube before the plane of symmetry"
    both = Metal(*(np.concatenate(values) for values in zip(*((one.mass, one.velocity) for one in pair), strict=True)))
    for angle, tolerance in zip(REFERENCE["angles"], allowed["pair"], strict=True):
        quantity = f"{label}: mass within {angle:g} degrees"
        rows.append(_share_row(quantity, both.share(angle), mirrored.share(angle), tolerance, source))
    quantity = f"{label}: mean velocity away from the other"
    tolerance = allowed["mean_velocity"]
    rows.append(compare(NAME, quantity, both.mean_velocity, mirrored.mean_velocity, tolerance, source, "m/s"))
    return rows


def _share_row(quantity: str, ours: float, share: float, tolerance: float, source: str) -> Row:
    """A share in per cent; the tolerance is in points, so that it is shown relative to the reference."""
    return compare(NAME, quantity, 100.0 * ours, 100.0 * share, tolerance / share, source, "%")
