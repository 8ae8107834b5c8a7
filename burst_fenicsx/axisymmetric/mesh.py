"""The meridian of a round as quadrilaterals, layer by layer from nose to base, columns from the axis outwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.axisymmetric.rings import areas, ring_volumes
from burst_fenicsx.errors import InputError
from burst_fenicsx.meshing.mesh import CellMesh, across_edges
from burst_fenicsx.meshing.quality import MeshQuality, check_quality, quadrilateral_quality
from burst_fenicsx.meshing.sizing import FEWEST_WALL_CELLS, check_cell_size, layer_stations
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile

__all__ = [
    "LARGEST_MESH",
    "MeridianMesh",
    "check_meridian_size",
    "edge_neighbours",
    "meridian_quality",
    "mesh_meridian",
    "outer_edges",
]

LARGEST_MESH = 5_000_000  # quadrilaterals
_FEWEST_CORE_CELLS = 2


@dataclass(frozen=True)
class MeridianMesh(CellMesh):
    """Bilinear quadrilaterals of one round's half plane, see `CellMesh`: nodes (r, 0, z) in m, z from the base.

    The nodes of a cell, (m, 4), are counter-clockwise in (r, z).
    """

    @property
    def volumes(self) -> NDArray[np.float64]:
        """Volumes of the rings (m,) in m3."""
        return ring_volumes(self.nodes, self.cells)

    @property
    def mean_edge(self) -> float:
        """Edge of the mean quadrilateral (m)."""
        return float(np.sqrt(areas(self.nodes, self.cells).mean()))

    @property
    def shortest_edge(self) -> float:
        """Shortest edge (m)."""
        corner = self.nodes[self.cells]
        return float(np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2).min())


def mesh_meridian(profile: Profile, cell_size: float) -> MeridianMesh:
    """Mesh the meridian of a profile.

    Columns run from the axis to the cavity's contour and on to the outer contour. In a solid end the boundary between
    them runs on from the cavity's end to the fraction of the radius at which all columns are equally wide.

    Parameters
    ----------
    profile : Profile
        The round.
    cell_size : float
        Edge of the mean quadrilateral (m). The wall has three cells at least.

    Raises
    ------
    InputError
        The cell size is not allowed, or the shape makes cells below a scaled Jacobian of 0.2 or a mass that is off by
        more than 2 %.
    """
    check_meridian_size(profile, cell_size)
    stations = layer_stations(profile, cell_size)
    core, wall = _columns(profile, cell_size)
    r = _radii(profile, stations, core, wall)
    z = np.repeat((profile.length - stations)[:, None], core + wall + 1, axis=1)
    number = np.arange(r.size).reshape(r.shape)
    # Layer k lies between the stations k (upper) and k + 1 (lower).
    low, high = number[1:], number[:-1]
    cells = np.stack([low[:, :-1], low[:, 1:], high[:, 1:], high[:, :-1]], axis=-1).reshape(-1, 4)
    part, segment, station = _names(profile, stations, core, core + wall)
    filled = part >= 0
    used = np.zeros(r.size, dtype=bool)
    used[cells[filled]] = True
    nodes = np.stack([r.ravel(), np.zeros(r.size), z.ravel()], axis=1)[used]
    mesh = MeridianMesh(
        nodes=nodes,
        cells=(np.cumsum(used) - 1)[cells[filled]],
        part=part[filled],
        round=np.zeros(int(filled.sum()), dtype=np.int32),
        segment=segment[filled],
        station=station[filled],
        segments=(profile.segments,),
        lengths=(profile.length,),
    )
    check_quality(meridian_quality(mesh, profile), mesh.station, profile, cell_size)
    return mesh


def check_meridian_size(profile: Profile, cell_size: float) -> None:
    """Refuse a cell size (m) that is larger than the round, or makes too many cells in its meridian."""
    check_cell_size(profile, cell_size)
    expected = profile.length * profile.max_radius / cell_size**2
    if expected > LARGEST_MESH:
        smallest = np.sqrt(profile.length * profile.max_radius / LARGEST_MESH)
        raise InputError(
            f"cell_size = {cell_size * 1e3:g} mm makes {expected:.3g} cells in the meridian; at most "
            f"{LARGEST_MESH:.1g} are allowed ({profile.name}: at least {smallest * 1e3:.2g} mm)"
        )


def _columns(profile: Profile, cell_size: float) -> tuple[int, int]:
    """Columns within the cavity's contour and through the wall, by their mean widths along the charge."""
    section = profile.section(np.linspace(profile.charge_front, profile.cavity.end, 201))
    wall = max(FEWEST_WALL_CELLS, round(float(np.mean(section.wall)) / cell_size))
    core = max(_FEWEST_CORE_CELLS, round(float(np.sqrt(np.mean(section.inner_radius**2))) / cell_size))
    return core, wall


def _radii(profile: Profile, stations: NDArray[np.float64], core: int, wall: int) -> NDArray[np.float64]:
    """Radius of every node (stations, core + wall + 1) in m."""
    cavity, outer = profile.cavity, profile.outer.radius(stations)
    inner = cavity.radius(np.clip(stations, cavity.start, cavity.end))
    for end, solid in ((cavity.start, stations < cavity.start), (cavity.end, stations > cavity.end)):
        if solid.any():
            fraction = float(cavity.radius(end) / profile.outer.radius(end))
            reach = np.clip(np.abs(stations[solid] - end) / profile.max_radius, 0.0, 1.0)
            blend = reach**2 * (3.0 - 2.0 * reach)
            inner[solid] = outer[solid] * (fraction + blend * (core / (core + wall) - fraction))
    within, beyond = np.arange(core + 1) / core, np.arange(1, wall + 1) / wall
    return np.concatenate([inner[:, None] * within, inner[:, None] + (outer - inner)[:, None] * beyond], axis=1)


def _names(
    profile: Profile, stations: NDArray[np.float64], core: int, columns: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
    """Part (-1: void), segment and station of every cell, (layers * columns,)."""
    centre = 0.5 * (stations[1:] + stations[:-1])
    content = np.full(len(centre), Part.CASING, dtype=np.int32)
    content[(centre > profile.cavity.start) & (centre < profile.cavity.end)] = Part.CHARGE
    front = (centre > profile.cavity.start) & (centre < profile.charge_front)
    content[front] = Part.FUZE if profile.fuze is not None and profile.fuze.fill == "inert" else -1
    within = np.arange(columns) < core
    part = np.where(within[None, :], content[:, None], np.int32(Part.CASING)).astype(np.int32).ravel()
    ends = np.array([segment.end for segment in profile.segments[:-1]])
    of_layer = np.repeat(np.searchsorted(ends, centre), columns)
    segment = np.where(part == Part.CASING, of_layer, -1).astype(np.int32)
    return part, segment, np.repeat(centre, columns)


def meridian_quality(mesh: MeridianMesh, profile: Profile) -> MeshQuality:
    """Scaled Jacobian, aspect ratio and edges of the quadrilaterals, and the errors of the parts' volumes."""
    corner = mesh.nodes[mesh.cells][..., [0, 2]]
    volumes, exact = mesh.volumes, profile.volumes()
    wanted = {Part.CASING: exact.casing, Part.CHARGE: exact.charge, Part.FUZE: exact.fuze}
    errors = {
        part: float(volumes[mesh.part == part].sum()) / volume - 1.0 for part, volume in wanted.items() if volume > 0.0
    }
    return quadrilateral_quality(corner, len(mesh.nodes), errors)


def outer_edges(mesh: MeridianMesh, group: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges behind which lies no cell of the same group, in the order of the cells.

    Parameters
    ----------
    mesh : the mesh; coincident nodes on both sides of a split are one place.
    group : (cells,) number of each cell's group; cells of a negative group have no edges.

    Returns
    -------
    Nodes (edges, 2), their own cell to the left of their direction; that cell; and the one behind each edge or -1.
    Edges on the axis are left out.
    """
    ends = np.stack([mesh.cells, np.roll(mesh.cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    cell = np.repeat(np.arange(len(mesh.cells)), 4)
    behind = edge_neighbours(mesh).ravel()
    outside = (group[cell] >= 0) & ((behind < 0) | (group[behind] != group[cell]))
    outside &= (mesh.nodes[ends, 0] > 0.0).any(axis=1)
    return ends[outside], cell[outside], behind[outside]


def edge_neighbours(mesh: MeridianMesh) -> np.ndarray:
    """The cell behind each edge, from a cell's corner k to the next one (cells, 4), across splits too; -1 for none."""
    return across_edges(mesh.places[mesh.cells])
