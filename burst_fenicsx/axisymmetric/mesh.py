"""The meridian of a round as quadrilaterals, layer by layer from nose to base, columns from the axis outwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError
from burst_fenicsx.meshing.mesh import CellMesh, across_edges
from burst_fenicsx.meshing.quality import check_quality, quality
from burst_fenicsx.meshing.sizing import FEWEST_WALL_CELLS, band_radii, cell_names, check_cell_size, layer_stations

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile


LARGEST_MESH = 5_000_000  # quadrilaterals
_FEWEST_CORE_CELLS = 2
_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
_GAUSS = 1.0 / np.sqrt(3.0)


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


def mesh_meridian(profile: Profile, cell_size: float) -> MeridianMesh:
    """Mesh the meridian of a profile.

    Columns run from the axis to the cavity's contour and on to the outer contour. In a solid end the boundary between
    them runs on from the cavity's end to the fraction of the radius at which all columns are equally wide.

    Parameters
    ----------
    profile : the round.
    cell_size : edge of the mean quadrilateral (m). The wall has three cells at least.

    Raises
    ------
    InputError
        The cell size is not allowed, or the shape makes cells below a scaled Jacobian of 0.2 or a mass that is off by
        more than 2 %.
    """
    check_meridian_size(profile, cell_size)
    stations = layer_stations(profile, cell_size)
    core, wall = _columns(profile, cell_size)
    outer, inner = profile.outer.radius(stations)[:, None], band_radii(profile, stations, core / (core + wall))[:, None]
    within, beyond = np.arange(core + 1) / core, np.arange(1, wall + 1) / wall
    r = np.concatenate([inner * within, inner + (outer - inner) * beyond], axis=1)
    z = np.repeat((profile.length - stations)[:, None], core + wall + 1, axis=1)
    number = np.arange(r.size).reshape(r.shape)
    # Layer k lies between the stations k (upper) and k + 1 (lower).
    low, high = number[1:], number[:-1]
    cells = np.stack([low[:, :-1], low[:, 1:], high[:, 1:], high[:, :-1]], axis=-1).reshape(-1, 4)
    part, segment, station = cell_names(profile, stations, np.arange(core + wall) < core)
    filled = part.ravel() >= 0
    used = np.zeros(r.size, dtype=bool)
    used[cells[filled]] = True
    nodes = np.stack([r.ravel(), np.zeros(r.size), z.ravel()], axis=1)[used]
    mesh = MeridianMesh(
        nodes=nodes,
        cells=(np.cumsum(used) - 1)[cells[filled]],
        part=part.ravel()[filled],
        round=np.zeros(int(filled.sum()), dtype=np.int32),
        segment=segment.ravel()[filled],
        station=station.ravel()[filled],
        segments=(profile.segments,),
        lengths=(profile.length,),
    )
    check_quality(quality(mesh, profile), mesh.station, profile, cell_size)
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
    section = profile.section(np.linspace(profile.charge_front, profile.cavity.end, 201))
    wall = max(FEWEST_WALL_CELLS, round(float(np.mean(section.wall)) / cell_size))
    core = max(_FEWEST_CORE_CELLS, round(float(np.sqrt(np.mean(section.inner_radius**2))) / cell_size))
    return core, wall


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


def nodal_volumes(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.float64]:
    """Integral of N_a over 2 pi r dA in every cell (m, 4), m3, exact by 2 x 2 Gauss points.

    At the axis it is 1/6 and 1/3 of a cell's volume. With a quarter a plane axial wave would not pass the axis
    undisturbed. `nodes` (n, 3) are (r, 0, z).
    """
    r, z = nodes[cells, 0], nodes[cells, 2]
    found = np.zeros(r.shape)
    for xi in (-_GAUSS, _GAUSS):
        for eta in (-_GAUSS, _GAUSS):
            shape = 0.25 * (1.0 + _CORNERS[:, 0] * xi) * (1.0 + _CORNERS[:, 1] * eta)
            by_xi = 0.25 * _CORNERS[:, 0] * (1.0 + _CORNERS[:, 1] * eta)
            by_eta = 0.25 * _CORNERS[:, 1] * (1.0 + _CORNERS[:, 0] * xi)
            jacobian = (r @ by_xi) * (z @ by_eta) - (r @ by_eta) * (z @ by_xi)
            found += (2.0 * np.pi * (r @ shape) * jacobian)[:, None] * shape
    return found


def ring_volumes(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.float64]:
    """Volumes of the rings (m,) in m3."""
    volumes: NDArray[np.float64] = nodal_volumes(nodes, cells).sum(axis=1)
    return volumes


def areas(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.float64]:
    """Areas of the quadrilaterals (m,) in m2."""
    corner = nodes[cells]
    one, other = corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]
    area: NDArray[np.float64] = 0.5 * (one[:, 0] * other[:, 2] - one[:, 2] * other[:, 0])
    return area


def longest_edges(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.float64]:
    """Longest edge of every quadrilateral (m,) in m."""
    corner = nodes[cells]
    longest: NDArray[np.float64] = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2).max(axis=1)
    return longest


def folded(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether a corner of a quadrilateral is turned inside out (m,)."""
    corner = nodes[cells]
    onward, back = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    inside_out: NDArray[np.bool_] = (onward[..., 0] * back[..., 2] - onward[..., 2] * back[..., 0] <= 0.0).any(axis=1)
    return inside_out
