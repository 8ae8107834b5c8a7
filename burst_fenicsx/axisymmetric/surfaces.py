"""Lines on the outside of groups of quadrilaterals, and where radii are measured during the burst."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.contact.slide_surface import across_edges
from burst_fenicsx.problem import Part
from burst_fenicsx.records.surfaces import LATERAL, RadialSurfaces, cut_along

if TYPE_CHECKING:
    from burst_fenicsx.axisymmetric.mesh import MeridianMesh

__all__ = ["edge_neighbours", "meridian_surfaces", "outer_edges"]


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


def meridian_surfaces(mesh: MeridianMesh, parts: int, bins: int) -> RadialSurfaces:
    """Find the lateral lines of charge and casing and cut them along the axis, as `burst_fenicsx.records.surfaces`.

    Parameters
    ----------
    mesh : the meridian. parts : axial parts of the charge (Eq. 6). bins : station bins of the casing.
    """
    (length,) = mesh.lengths
    station = length - mesh.nodes[:, 2]
    charge = mesh.part == Part.CHARGE
    charge_part = np.full(len(mesh.nodes), -1, dtype=np.int32)
    cell_part = np.full(len(mesh.cells), parts, dtype=np.int32)
    if charge.any():
        along = station[mesh.cells[charge]]
        front, back = along.min(), along.max()
        cell_part[charge] = cut_along((mesh.station[charge] - front) / (back - front), parts)
        surface = _lateral(mesh, charge)
        charge_part[surface] = cut_along((station[surface] - front) / (back - front), parts)
    casing_bin = np.full(len(mesh.nodes), -1, dtype=np.int32)
    surface = np.intersect1d(_lateral(mesh, np.ones(len(charge), dtype=bool)), mesh.cells[mesh.part == Part.CASING])
    casing_bin[surface] = cut_along(station[surface] / length, bins)
    outward = np.zeros((len(mesh.nodes), 3))
    outward[:, 0] = 1.0
    return RadialSurfaces(
        charge_part=charge_part,
        cell_part=cell_part,
        parts=parts,
        casing_bin=casing_bin,
        bin_round=np.zeros(bins, dtype=np.int32),
        bin_station=(np.arange(bins) + 0.5) * length / bins,
        radius=mesh.nodes[:, 0].copy(),
        outward=outward,
    )


def _lateral(mesh: MeridianMesh, cells: np.ndarray) -> np.ndarray:
    """Nodes of the outer edges of the marked cells that look away from the axis."""
    edges, _, _ = outer_edges(mesh, np.where(cells, 0, -1))
    along = mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]]
    return np.unique(edges[along[:, 2] > LATERAL * np.linalg.norm(along, axis=1)])
