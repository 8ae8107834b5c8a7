"""The section of a round as quadrilaterals: the O-grid of the hexahedra's layers, scaled to one station."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import log
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from burst_fenicsx.axisymmetric.mesh import LARGEST_MESH, MeridianMesh
from burst_fenicsx.axisymmetric.rings import areas
from burst_fenicsx.axisymmetric.surfaces import edge_neighbours
from burst_fenicsx.errors import InputError
from burst_fenicsx.meshing.disc import CORE_RADIUS, CORE_SIDE_RADIUS, section_grid
from burst_fenicsx.meshing.quality import MeshQuality, quadrilateral_quality
from burst_fenicsx.meshing.sizing import FEWEST_WALL_CELLS
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile

__all__ = ["SectionMesh", "mesh_section", "section_quality"]

_FEWEST_CORE_CELLS = 4


@dataclass(frozen=True)
class SectionMesh(MeridianMesh):
    """Bilinear quadrilaterals of a section across one or more rounds: nodes (u, 0, v) in m, volumes per metre.

    The nodes of a cell, (m, 4), are counter-clockwise in (u, v).
    """

    plane: ClassVar[bool] = True

    @property
    def volumes(self) -> NDArray[np.float64]:
        """Areas of the quadrilaterals (m,) in m2: volumes per metre."""
        return areas(self.nodes, self.cells)

    @cached_property
    def neighbours(self) -> NDArray[np.int64]:
        """The cell behind each of a cell's edges (cells, 4), across splits too; -1 where there is none."""
        return edge_neighbours(self)


def mesh_section(
    profile: Profile,
    station: float,
    cell_size: float,
    *,
    centre: tuple[float, float] = (0.0, 0.0),
    round_index: int = 0,
) -> SectionMesh:
    """Mesh a section of a profile: core square, rings and wall, symmetric about the directions u and v.

    Parameters
    ----------
    profile : the round.
    station : where it is cut (m from the nose end), within its charge.
    cell_size : edge of the mean quadrilateral (m). The wall has three cells at least.
    centre : place (u, v) of the round's axis (m).
    round_index : index to write into the mesh.

    Raises
    ------
    InputError
        The cell size is not allowed.
    """
    radii = profile.section(station)
    inner, outer = float(radii.inner_radius), float(radii.outer_radius)
    core, rings, wall = _counts(profile.name, inner, outer, cell_size)
    grid = section_grid(core, rings, wall)
    across = grid.nodes(inner, outer) + np.asarray(centre)
    cells = len(grid.quads)
    part = np.where(np.arange(cells) < grid.cavity_quads, Part.CHARGE, Part.CASING).astype(np.int32)
    ends = np.array([segment.end for segment in profile.segments[:-1]])
    segment = int(np.searchsorted(ends, station))
    return SectionMesh(
        nodes=np.stack([across[:, 0], np.zeros(len(across)), across[:, 1]], axis=1),
        cells=grid.quads,
        part=part,
        round=np.full(cells, round_index, dtype=np.int32),
        segment=np.where(part == Part.CASING, segment, -1).astype(np.int32),
        station=np.full(cells, station),
        segments=(profile.segments,),
        lengths=(profile.length,),
    )


def _counts(name: str, inner: float, outer: float, cell_size: float) -> tuple[int, int, int]:
    """Cells along the core's side (even), rings around it, cells through the wall.

    As `meshing.sizing.grid_counts`: those of the smallest misfit of the number of cells to the area over the cell's,
    and of core, ring and wall cells to each other.
    """
    if not cell_size > 0.0 or not np.isfinite(cell_size):
        raise InputError(f"cell_size = {cell_size!r} m; a positive length is expected")
    if cell_size > inner:
        raise InputError(
            f"cell_size = {1e3 * cell_size:g} mm; at most the charge's radius in the section is allowed "
            f"({name}: {1e3 * inner:.4g} mm)"
        )
    target = np.pi * outer**2 / cell_size**2
    if target > LARGEST_MESH:
        smallest = outer * np.sqrt(np.pi / LARGEST_MESH)
        raise InputError(
            f"cell_size = {1e3 * cell_size:g} mm makes {target:.3g} cells in the section of a round; at most "
            f"{LARGEST_MESH:.1g} are allowed ({name}: at least {1e3 * smallest:.2g} mm)"
        )
    wall = max(FEWEST_WALL_CELLS, round((outer - inner) / cell_size))
    ring_depth = inner * (1.0 - 0.5 * (CORE_RADIUS + CORE_SIDE_RADIUS))
    most = max(_FEWEST_CORE_CELLS + 2, int(np.pi * inner / cell_size))
    best = (np.inf, _FEWEST_CORE_CELLS, 1)
    for core in range(_FEWEST_CORE_CELLS, most, 2):
        core_cell = 0.5 * np.pi * 0.5 * (CORE_RADIUS + CORE_SIDE_RADIUS) * inner / core
        ring_width = 2.0 * np.pi * (inner - 0.5 * ring_depth) / (4 * core)
        wall_width = np.pi * (inner + outer) / (4 * core)
        for rings in range(max(1, round(0.7 * ring_depth / ring_width)), 3 + round(1.4 * ring_depth / ring_width)):
            cells = core**2 + 4 * core * (rings + wall)
            misfit = (
                20.0 * log(cells / target) ** 2
                + log(ring_depth / rings / ring_width) ** 2
                + 0.5 * log(core_cell / cell_size) ** 2
                + 0.5 * log(wall_width / cell_size) ** 2
            )
            best = min(best, (misfit, core, rings))
    return best[1], best[2], wall


def section_quality(mesh: SectionMesh) -> MeshQuality:
    """Scaled Jacobian, aspect ratio and edges of the quadrilaterals; areas are those of the circles by construction."""
    return quadrilateral_quality(mesh.nodes[mesh.cells][..., [0, 2]], len(mesh.nodes), {})
