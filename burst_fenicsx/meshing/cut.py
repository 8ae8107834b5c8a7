"""Meshes divided: cut at planes of symmetry through the axis, and with nodes of the charge's own at the casing."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from burst_fenicsx.meshing.placement import frame
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.meshing.disc import SectionGrid
    from burst_fenicsx.meshing.mesh import CellMesh, HexahedralMesh
    from burst_fenicsx.problem import Mirror


_Mesh = TypeVar("_Mesh", bound="CellMesh")

_IN_PLANE = 1e-9  # m, from a plane, up to which a node lies in it
_IN_UNIT_PLANE = 1e-9  # the same over the radius


def turn_to(cuts: Sequence[Mirror], axis: Sequence[float]) -> NDArray[np.float64]:
    """Rotation about a round's axis that puts the centre lines of its grid into the planes.

    Parameters
    ----------
    cuts : planes through the axis. axis : from base to nose.

    Returns
    -------
    (2, 2) matrix by which local coordinates across the axis, rows (x, y), are multiplied from the right; the identity
    where the planes are those of the local axes already, or where there is none.
    """
    if not cuts:
        return np.eye(2)
    x, y = frame(axis)[:2] @ np.asarray(cuts[0].normal)
    if min(abs(x), abs(y)) < 1e-9:
        return np.eye(2)
    length = np.hypot(x, y)
    return np.array([[x, y], [-y, x]]) / length


def cut_section(
    grid: SectionGrid, turn: NDArray[np.float64], axis: Sequence[float], cuts: Sequence[Mirror]
) -> SectionGrid:
    """Leave out what of a section lies behind the planes, so that it is not meshed first; its order stays.

    Parameters
    ----------
    grid : of the whole section. turn : from `turn_to`. axis : from base to nose. cuts : planes through the axis.
    """
    if not cuts:
        return grid
    places = (grid.inner + grid.outer) @ turn @ frame(axis)[:2]
    keep = np.ones(len(grid.quads), dtype=bool)
    for cut in cuts:
        keep &= (places @ np.asarray(cut.normal))[grid.quads].max(axis=1) > _IN_UNIT_PLANE
    used = np.zeros(len(places), dtype=bool)
    used[grid.quads[keep]] = True
    number = np.cumsum(used) - 1
    return replace(
        grid,
        inner=grid.inner[used],
        outer=grid.outer[used],
        quads=number[grid.quads[keep]],
        cavity_quads=int(np.count_nonzero(keep[: grid.cavity_quads])),
    )


def cut_mesh(mesh: HexahedralMesh, cuts: Sequence[Mirror]) -> HexahedralMesh:
    """Keep the cells on the sides to which the planes' normals point.

    Nodes within 1e-9 m of a plane are put into it and marked in `held`.

    Parameters
    ----------
    mesh : of one round, each of the planes a plane of its nodes. cuts : the planes.

    Raises
    ------
    RuntimeError
        A cell lies on both sides of a plane.
    """
    if not cuts:
        return mesh
    nodes = mesh.nodes.copy()
    held = np.zeros(len(nodes), dtype=np.uint8)
    keep = np.ones(len(mesh.cells), dtype=bool)
    for cut in cuts:
        normal = np.asarray(cut.normal)
        height = (nodes - np.asarray(cut.point)) @ normal
        inside = np.abs(height) < _IN_PLANE
        nodes[inside] -= height[inside, None] * normal
        height[inside] = 0.0
        held[inside] |= np.uint8(1 << cut.bit)
        of_cell = height[mesh.cells]
        if ((of_cell.min(axis=1) < 0.0) & (of_cell.max(axis=1) > 0.0)).any():
            raise RuntimeError(f"cells lie on both sides of the plane through {cut.point} with normal {cut.normal}")
        keep &= of_cell.max(axis=1) > 0.0
    used = np.zeros(len(nodes), dtype=bool)
    used[mesh.cells[keep]] = True
    number = np.cumsum(used) - 1
    return replace(
        mesh,
        nodes=nodes[used],
        cells=number[mesh.cells[keep]],
        part=mesh.part[keep],
        round=mesh.round[keep],
        segment=mesh.segment[keep],
        station=mesh.station[keep],
        held=held[used],
        held_normals=tuple(sorted((cut.bit, cut.normal) for cut in cuts)),
    )


def split_charges(mesh: _Mesh) -> _Mesh:
    """Give every charge nodes of its own where it meets the casing (the paper's Fig. 2.2).

    Not where it meets a fuze: its front does not slide on it, and a weak fuze that products press on without friction
    is drawn out into fingers, behind which the charge comes to lie. The new nodes are the charge's and come after all
    others, so that those of the casing keep their numbers.

    Parameters
    ----------
    mesh : a mesh whose parts share their nodes.

    Returns
    -------
    The same mesh with the pairs in `interface_pairs`, in the order of the casing's nodes.
    """
    charge = mesh.part == Part.CHARGE
    touches = {part: np.zeros(len(mesh.nodes), dtype=bool) for part in Part}
    for part, touched in touches.items():
        touched[mesh.cells[mesh.part == part]] = True
    shared = np.flatnonzero(touches[Part.CHARGE] & touches[Part.CASING] & ~touches[Part.FUZE])
    own = np.arange(len(mesh.nodes), dtype=np.int64)
    own[shared] = len(mesh.nodes) + np.arange(len(shared))
    cells = mesh.cells.copy()
    cells[charge] = own[cells[charge]]
    return replace(
        mesh,
        nodes=np.concatenate([mesh.nodes, mesh.nodes[shared]]),
        cells=cells,
        interface_pairs=np.stack([own[shared], shared], axis=1),
        held=None if mesh.held is None else np.concatenate([mesh.held, mesh.held[shared]]),
    )
