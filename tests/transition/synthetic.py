"""A burst casing made by hand: a tube of hexahedra with a velocity field, as the burst stage would write it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import h5py
import numpy as np

from fragfield_base.burst_snapshot import FORMAT, FORMAT_VERSION, SEGMENTS
from fragfield_base.hdf5_files import _seal_of
from transition.placing import Clusters
from transition.points import MaterialPoints
from transition.snapshot import Snapshot

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

STEEL, TNT = 7850.0, 1630.0


def sealed(path: Path, act: Callable[[h5py.File], object] = lambda file: None) -> Path:
    """The file, after what `act` changes in it, with the seal of the burst stage: no process looks through it first."""
    with h5py.File(path, "a") as file:
        act(file)
    content = path.read_bytes()
    path.write_bytes(content + _seal_of(content))
    return path


def fill(name: str, index: object, value: object) -> Callable[[h5py.File], object]:
    """A change for `sealed`: the value in place of some of a data set's."""
    return lambda file: file[name].__setitem__(index, value)


def radial(places: np.ndarray) -> np.ndarray:
    """Wall speed of 1000 m/s outwards, with some of it along the axis."""
    radius = np.linalg.norm(places[:, :2], axis=1)
    outwards = places[:, :2] / np.maximum(radius, 1e-12)[:, None]
    return np.column_stack([1000.0 * outwards, 200.0 * (places[:, 2] / 0.3 - 0.5)])


@dataclass(kw_only=True)
class CasedTube:
    """A tube around a charge, cut into segments; the defaults are of a 155 mm round."""

    inner: float = 0.0595
    outer: float = 0.0775
    length: float = 0.3
    radial_cells: int = 3
    axial: int = 30
    ends: tuple[float, ...] = (0.03, 0.15, 0.27)
    kinds: tuple[str, ...] = ("nose", "wall", "wall", "base")
    stretch: float = 1.9

    def write(self, path: Path, **attributes: str) -> Path:
        """Write the snapshot."""
        raise NotImplementedError

    def read(self, path: Path) -> Snapshot:
        """Write, and read back."""
        return Snapshot.read(sealed(self.write(path)))

    def segments(self, group, mine, part, segment, station, mass, speed) -> None:
        """Write the table of a round's segments, whose cells are `mine`, into its group."""
        table = np.empty(len(self.kinds), dtype=SEGMENTS)
        edges = [0.0, *self.ends, self.length]
        for index, kind in enumerate(self.kinds):
            steel = mine & (part == 0) & (segment == index)
            charge = mine & (part == 1) & (station >= edges[index]) & (station < edges[index + 1])
            table[index] = (
                f"{kind} {index}",
                kind,
                edges[index],
                edges[index + 1],
                self.outer,
                self.outer - self.inner,
                self.inner,
                mass[steel].sum(),
                mass[charge].sum(),
                mass[steel] @ speed[steel] / mass[steel].sum(),
            )
        group["segments"] = table


@dataclass(kw_only=True)
class Tube(CasedTube):
    """The tube as hexahedra, axis along z, the nose end on top."""

    around: int = 48
    velocity: Callable[[np.ndarray], np.ndarray] = radial
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    places: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    explosive: str = "TNT"
    reshape: Callable[[np.ndarray], np.ndarray] = lambda nodes: nodes

    def write(self, path: Path, **attributes: str) -> Path:
        """Write the snapshot of one tube, or of several side by side."""
        reference, cells, part, owner, station = [], [], [], [], []
        for index, place in enumerate(self.places):
            for kind, inner, outer, layers in (
                (0, self.inner, self.outer, self.radial_cells),
                (1, 0.01, self.inner, 2),
            ):
                nodes, own = self._ring(inner, outer, layers)
                cells.append(own + sum(len(nodes) for nodes in reference))
                reference.append(nodes + np.asarray(place))
                station.append(self.length - nodes[own].mean(axis=1)[:, 2])
                part.append(np.full(len(own), kind))
                owner.append(np.full(len(own), index))
        part, owner, station, cells = (np.concatenate(x) for x in (part, owner, station, cells))
        reference = self.reshape(np.concatenate(reference))
        segment = np.where(part == 0, np.searchsorted(self.ends, station), -1)
        mass = volumes(reference[cells]) * np.where(part == 0, STEEL, TNT)
        position = reference * [self.stretch, self.stretch, 1.0] @ self.rotation.T
        velocity = self.velocity(position @ self.rotation) @ self.rotation.T
        with h5py.File(path, "w") as file:
            file.attrs.update({"format": FORMAT, "format_version": FORMAT_VERSION, "time": 1.2e-4, **attributes})
            for name, data in (("reference", reference), ("position", position), ("velocity", velocity)):
                file[f"nodes/{name}"] = data
            file["cells/nodes"] = cells
            file["cells/part"] = part.astype(np.uint8)
            file["cells/round"] = owner.astype(np.int32)
            file["cells/segment"] = segment.astype(np.int32)
            file["cells/station"], file["cells/mass"] = station, mass
            speed = np.linalg.norm(velocity[cells].mean(axis=1), axis=1)
            for index, place in enumerate(self.places):
                group = file.create_group(f"rounds/{index}")
                group.attrs.update(
                    {
                        "name": f"round {index}",
                        "length": self.length,
                        "casing_density": STEEL,
                        "explosive": self.explosive,
                        "explosive_density": TNT,
                        "detonation_velocity": 6940.0,
                        "gurney_velocity": 2440.0,
                        "position": np.asarray(place),
                        "axis": np.array([0.0, 0.0, 1.0]),
                    }
                )
                self.segments(group, owner == index, part, segment, station, mass, speed)
        return path

    def _ring(self, inner: float, outer: float, layers: int) -> tuple[np.ndarray, np.ndarray]:
        radius = np.linspace(inner, outer, layers + 1)
        angle = 2.0 * np.pi * np.arange(self.around) / self.around
        height = np.linspace(0.0, self.length, self.axial + 1)
        r, a, z = np.meshgrid(radius, angle, height, indexing="ij")
        nodes = np.column_stack([(r * np.cos(a)).ravel(), (r * np.sin(a)).ravel(), z.ravel()])

        def number(i, j, k):
            return (i * self.around + j % self.around) * (self.axial + 1) + k

        i, j, k = (x.ravel() for x in np.meshgrid(range(layers), range(self.around), range(self.axial), indexing="ij"))
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        return nodes, np.column_stack([number(i + a, j + b, k + c) for a, b, c in corners])


def volumes(corners: np.ndarray) -> np.ndarray:
    """Volumes of trilinear hexahedra (m, 8, 3) in VTK order by 2x2x2 Gauss points, which is exact."""
    signs = np.array(
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
    )
    total = np.zeros(len(corners))
    for point in signs / np.sqrt(3.0):
        factor = 1.0 + signs * point
        slope = np.stack([signs[:, a] * factor[:, (a + 1) % 3] * factor[:, (a + 2) % 3] / 8.0 for a in range(3)])
        total += np.linalg.det(np.einsum("ak,mkb->mab", slope, corners))
    return total


def polar_difference(found):
    """Largest difference of the shares of fragments and cells below any polar angle."""
    return float(np.abs(np.cumsum(found.polar_fragments - found.polar_cells)).max())


def azimuth_difference(found):
    """Largest difference of them in any sector of the horizon (Kuiper's statistic)."""
    return float(np.ptp(np.cumsum(found.azimuth_fragments - found.azimuth_cells)))


def joined(result):
    """Material points and clusters of all segments of a realisation, one after the other."""
    points, clusters = ([getattr(one, name) for one in result.segments] for name in ("points", "clusters"))
    first = np.cumsum([0, *(len(one) for one in points[:-1])])
    heaviest = np.cumsum([0, *(one.mass.size for one in clusters[:-1])])
    whole = {f.name: np.concatenate([getattr(one, f.name) for one in clusters]) for f in fields(Clusters)}
    whole["fragment"] += np.repeat(heaviest, [one.fragment.size for one in clusters])
    for name in ("point", "chosen"):
        whole[name] += np.repeat(first, [getattr(one, name).size for one in clusters])
    values = (np.concatenate([getattr(one, f.name) for one in points]) for f in fields(MaterialPoints))
    return MaterialPoints(*values), Clusters(**whole)
