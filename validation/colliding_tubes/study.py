"""Two steel tubes that burst side by side: how much metal flies along the plane between them, against another code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.runs import reference_beside, snapshot_of

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "Metal", "counted_metal", "reference_shares", "study"]

REFERENCE = reference_beside(__file__)


def study(runs: Runs, rows: Rows) -> None:
    """Burst one tube before a plane at every cell size, and two tubes without a plane at one of them."""
    source, angles = REFERENCE["source"], REFERENCE["angles"]
    tubes: dict[str, Metal] = {}
    for size in REFERENCE["quick_sizes" if rows.quick else "sizes"]:
        folder, burst = runs.burst("colliding_tubes", REFERENCE["case"], size, geometry="3d")
        (tubes[size],) = counted_metal(folder / "burst_snapshot.h5")
        _passed(rows, f"{size}: metal behind the plane at the end", burst, "beyond_planes")
        for angle, share in zip(angles, reference_shares(burst["cell_size"]), strict=True):
            rows.compare(f"{size}: mass within {angle:g} degrees", 100.0 * tubes[size].share(angle), 100.0 * share,
                         source, "%")  # fmt: skip
        rows.compare(f"{size}: mean velocity away from the plane", tubes[size].mean_velocity,
                     REFERENCE["mean_velocity"], source, "m/s")  # fmt: skip
    size = REFERENCE["pair_size"]
    folder, burst = runs.burst("colliding_tubes_pair", REFERENCE["pair"], size, geometry="3d")
    both, before = Metal.together(counted_metal(folder / "burst_snapshot.h5")), "the tube before the plane"
    _passed(rows, f"two tubes, {size}: metal within the neighbour at the end", burst, "in_other_rounds")
    for angle, points in zip(angles, REFERENCE["pair_shares"], strict=True):
        share = tubes[size].share(angle)
        rows.verify(f"two tubes, {size}: mass within {angle:g} degrees", 100.0 * both.share(angle), 100.0 * share,
                    points / share, before, "%")  # fmt: skip
    rows.verify(f"two tubes, {size}: mean velocity away from the other", both.mean_velocity, tubes[size].mean_velocity,
                REFERENCE["pair_velocity"], before, "m/s")  # fmt: skip


def _passed(rows: Rows, quantity: str, burst: dict[str, Any], key: str) -> None:
    """Metal that went through what should have stopped it, a fraction of the casing's mass."""
    fraction = burst["passed_through"][key] / burst["casing_mass"]
    rows.bound(quantity, fraction, (0.0, REFERENCE["passed_through"]), "contact lets nothing pass")


@dataclass(frozen=True, eq=False)
class Metal:
    """Casing cells of the counted stations: mass (n,) in kg, mean velocity (n, 3) in m/s, x away from the plane."""

    mass: NDArray[Any]
    velocity: NDArray[Any]

    @classmethod
    def together(cls, tubes: list[Metal]) -> Metal:
        """The metal of several tubes."""
        return cls(np.concatenate([one.mass for one in tubes]), np.concatenate([one.velocity for one in tubes]))

    def share(self, angle: float) -> float:
        """Fraction of the mass that flies within `angle` (degrees) of +y or -y, seen along the axis of the tubes."""
        azimuth = np.degrees(np.arctan2(np.abs(self.velocity[:, 0]), np.abs(self.velocity[:, 1])))
        return float(self.mass[azimuth <= angle].sum() / self.mass.sum())

    @property
    def mean_velocity(self) -> float:
        """Mass-weighted mean velocity away from the plane (m/s)."""
        return float(self.velocity[:, 0] @ self.mass / self.mass.sum())


def counted_metal(snapshot: Path) -> list[Metal]:
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
    tubes = []
    for index in np.unique(of_round):
        own = np.flatnonzero((part == 0) & (of_round == index) & (station >= low) & (station <= high))
        side = np.sign(reference[nodes[own], 0].mean())
        tubes.append(Metal(mass[own], velocity[nodes[own]].mean(axis=1) * [side, 1.0, 1.0]))
    return tubes


def reference_shares(cell_size: float) -> list[float]:
    """Fractions that the independent code gives with cells of about this size (m), by angle."""
    sizes = np.asarray(REFERENCE["shares"]["size"])
    shares: list[float] = REFERENCE["shares"]["share"][int(np.argmin(np.abs(np.log(sizes / cell_size))))]
    return shares
