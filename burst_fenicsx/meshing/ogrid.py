"""All-hexahedral O-grid of a whole round: one section, scaled and stacked layer by layer from nose to base.

Layers are planes across the axis: parts and segments end exactly on them, and a contour's slope only shears its cells
(a slope of 30 degrees costs 13 % of the scaled Jacobian), so tilted layers would gain little and lose that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.errors import InputError
from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.meshing.cut import cut_mesh, cut_section, turn_to
from burst_fenicsx.meshing.disc import CORE_RADIUS, CORE_SIDE_RADIUS, section_grid
from burst_fenicsx.meshing.gmsh_import import read_gmsh
from burst_fenicsx.meshing.mesh import HexahedralMesh
from burst_fenicsx.meshing.placement import place
from burst_fenicsx.meshing.quality import check_quality, quality
from burst_fenicsx.meshing.sizing import band_radii, cell_names, grid_counts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.problem import Mirror, Round


SMALLEST_END = 0.1  # radius of nose or base end over the largest: below, the cells at a tip would rule the time step


def mesh_round(
    cased_round: Round, cell_size: float, round_index: int = 0, cuts: Sequence[Mirror] = ()
) -> HexahedralMesh:
    """Mesh a round, or read its mesh file, and place it in the world.

    Parameters
    ----------
    cased_round : with a profile (meshed with `cell_size`) or a mesh file (see `read_gmsh`; in its `mesh_unit`, base at
        its lowest z).
    cell_size : edge of the mean cell (m); of no concern to a mesh file.
    round_index : index to write into the mesh.
    cuts : planes of symmetry through the axis of a round with a profile; the side of their normals is kept.

    Raises
    ------
    InputError
        The round has neither or both of profile and mesh file, or its shape or mesh is not sound.
    """
    where = f"round '{cased_round.name}'"
    place_and_index: dict[str, Any] = {
        "position": cased_round.position,
        "axis": cased_round.axis,
        "round_index": round_index,
    }
    if cased_round.profile is not None and cased_round.mesh_file is None:
        return mesh_profile(cased_round.profile, cell_size, **place_and_index, cuts=cuts)
    if cased_round.mesh_file is not None and cased_round.profile is None:
        return read_gmsh(cased_round.mesh_file, unit=cased_round.mesh_unit, **place_and_index)
    found = "both" if cased_round.profile is not None else "neither"
    raise InputError(f"{where}: found {found} of profile and mesh file; exactly one is expected")


def mesh_profile(
    profile: Profile,
    cell_size: float,
    *,
    position: Sequence[float] = (0.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    round_index: int = 0,
    cuts: Sequence[Mirror] = (),
) -> HexahedralMesh:
    """Mesh a profile: core square, rings and wall, over all its length; solid ends are casing through and through.

    Radii are enlarged by the equal-area factor of the polygon, so that the volumes are those of the circles.

    Parameters
    ----------
    profile : the round.
    cell_size : edge of the mean cell (m): the number of cells is about volume / cell_size^3.
    position, axis : centre of the base plane (m) and direction from base to nose.
    round_index : index to write into the mesh.
    cuts : planes of symmetry through the axis, at right angles to each other: the grid is turned so that they are
        planes of nodes, and the side of their normals is kept.

    Returns
    -------
    HexahedralMesh
        In world coordinates.

    Raises
    ------
    InputError
        The cell size is not allowed, an end of the round is a tip, or the shape makes cells below a scaled
        Jacobian of 0.2 (the message says where) or is too fine for the cells (a mass off by more than 2 %).
    """
    _check_ends(profile)
    counts = grid_counts(profile, cell_size)
    turn = turn_to(cuts, axis)
    grid = cut_section(section_grid(counts.core, counts.rings, counts.wall), turn, axis, cuts)
    stations = counts.stations
    outer = profile.outer.radius(stations)
    # In solid ends wall cells are as deep as the smallest within.
    smallest = min((1.0 - CORE_RADIUS) / counts.rings, 0.5 * np.pi * CORE_SIDE_RADIUS / counts.core)
    inner = band_radii(profile, stations, 1.0 / (1.0 + counts.wall * smallest))

    across = grid.inner[None] * inner[:, None, None] + grid.outer[None] * outer[:, None, None]
    local = np.empty((*across.shape[:2], 3))
    local[..., :2] = across @ turn
    local[..., 2] = (profile.length - stations)[:, None]

    layers = len(stations) - 1
    section_nodes = len(grid.inner)
    # The layer behind (nearer to the base) holds the cell's lower face, the layer before its upper face.
    front = grid.quads[None] + section_nodes * np.arange(layers)[:, None, None]
    cells = reordered(np.concatenate([front + section_nodes, front], axis=2).reshape(-1, 8))
    part, segment, station = cell_names(profile, stations, np.arange(len(grid.quads)) < grid.cavity_quads)

    filled = part.ravel() >= 0
    nodes, used_cells = _used(local.reshape(-1, 3), cells[filled])
    mesh = HexahedralMesh(
        nodes=place(nodes, position, axis),
        cells=used_cells,
        part=part.ravel()[filled],
        round=np.full(len(used_cells), round_index, dtype=np.int32),
        segment=segment.ravel()[filled],
        station=station.ravel()[filled],
        segments=(profile.segments,),
        lengths=(profile.length,),
    )
    check_quality(quality(mesh, profile, fraction=0.5 ** len(cuts)), mesh.station, profile, cell_size)
    return cut_mesh(mesh, cuts)


def _check_ends(profile: Profile) -> None:
    minimum = SMALLEST_END * profile.max_radius
    for contour in (profile.outer, profile.cavity):
        for station, radius in ((contour.start, contour.radii[0]), (contour.end, contour.radii[-1])):
            if radius < minimum:
                raise InputError(
                    f"{contour.name}: radius {radius * 1e3:.4g} mm at its end, station {station * 1e3:.6g} mm; "
                    f"an O-grid needs a flat end of at least {SMALLEST_END:g} of the largest radius "
                    f"({minimum * 1e3:.4g} mm): cut the tip off"
                )


def _used(nodes: NDArray[np.float64], cells: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    used = np.zeros(len(nodes), dtype=bool)
    used[cells.ravel()] = True
    if used.all():
        return nodes, cells
    return nodes[used], (np.cumsum(used) - 1)[cells]
