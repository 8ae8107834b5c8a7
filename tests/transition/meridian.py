"""Axisymmetric snapshots made by hand: a meridian of quadrilaterals, with a velocity field of radius and height."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import h5py
import numpy as np

from fragfield_base.burst_snapshot import FORMAT, FORMAT_VERSION
from tests.transition.synthetic import STEEL, TNT, CasedTube
from transition.cells import ring_volumes

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def radial(r: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Wall speed of 1000 m/s outwards, with some of it along the axis."""
    return np.column_stack([np.full(r.shape, 1000.0), 200.0 * (z / 0.3 - 0.5)])


@dataclass(kw_only=True)
class Meridian(CasedTube):
    """Meridian of the tube; with `inner` = 0 the casing is solid down to the axis."""

    velocity: Callable[[np.ndarray, np.ndarray], np.ndarray] = radial
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    outward: tuple[float, float, float] = (1.0, 0.0, 0.0)
    reshape: Callable[[np.ndarray], np.ndarray] = lambda flat: flat
    names: tuple[str, ...] = field(default=("round 0",))

    def write(self, path: Path, **attributes: str) -> Path:
        """Write the snapshot."""
        radii = np.linspace(self.inner, self.outer, self.radial_cells + 1)
        if self.inner > 0.0:
            radii = np.concatenate([[0.0, 0.5 * self.inner], radii])
        columns = len(radii) - 1
        height = np.linspace(0.0, self.length, self.axial + 1)
        flat = np.stack(np.meshgrid(radii, height), axis=-1)  # (layer, column, 2)
        number = np.arange(flat[..., 0].size).reshape(flat.shape[:2])
        cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
        charge = 2 if self.inner > 0.0 else 0
        part = np.tile(np.where(np.arange(columns) < charge, 1, 0), self.axial)
        flat = self.reshape(flat.reshape(-1, 2))
        station = self.length - flat[cells][..., 1].mean(axis=1)
        segment = np.where(part == 0, np.searchsorted(self.ends, station), -1)
        mass = ring_volumes(flat[cells]) * np.where(part == 0, STEEL, TNT)
        now = flat * [self.stretch, 1.0]
        velocity = self.velocity(*now.T)
        velocity[now[:, 0] == 0.0, 0] = 0.0
        unit = np.asarray(self.axis) / np.linalg.norm(self.axis)
        plane = np.stack([np.asarray(self.outward, dtype=float), unit])
        speed = np.linalg.norm(velocity[cells].mean(axis=1), axis=1)
        with h5py.File(path, "w") as file:
            file.attrs.update(
                {"format": FORMAT, "format_version": FORMAT_VERSION, "time": 1.2e-4, "geometry": "axisymmetric"}
                | attributes
            )
            file["nodes/reference"] = flat @ plane + self.position
            file["nodes/position"], file["nodes/velocity"] = now @ plane + self.position, velocity @ plane
            file["cells/nodes"], file["cells/part"] = cells, part.astype(np.uint8)
            file["cells/round"], file["cells/segment"] = np.zeros(len(cells), np.int32), segment.astype(np.int32)
            file["cells/station"], file["cells/mass"] = station, mass
            for index, name in enumerate(self.names):
                group = file.create_group(f"rounds/{index}")
                group.attrs.update(
                    {
                        "name": name, "length": self.length, "casing_density": STEEL, "explosive": "TNT",
                        "explosive_density": TNT, "detonation_velocity": 6940.0, "position": np.asarray(self.position),
                        "axis": np.asarray(self.axis, dtype=float),
                    }
                )  # fmt: skip
                self.segments(group, True, part, segment, station, mass, speed)
        return path
