"""Faces that open where torn metal is released: through its cells, other rounds' metal meets what lies behind them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.contact.surfaces import outward_sides
from burst_fenicsx.kernels.geometry.faces import FACES, area_vectors
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.contact.surfaces import ContactSurfaces
    from burst_fenicsx.meshing import HexahedralMesh

__all__ = ["TornFaces", "sides_beside"]


class TornFaces:
    """Adds to the surfaces of several rounds the faces that lie open once cells of their casings are torn metal.

    These are the sides of whole cells towards released ones that are on no surface yet, and, where a released cell lay
    on the charge, the face between both, whose nodes still carry the metal's mass. Like the faces between layers, they
    are met by other rounds' nodes alone.

    Parameters
    ----------
    mesh : the whole mesh.
    surfaces : before any metal is torn.
    """

    def __init__(self, mesh: HexahedralMesh, surfaces: ContactSurfaces) -> None:
        self._mesh, self._surfaces = mesh, surfaces
        self._solid = mesh.part != Part.CHARGE
        self._known = outward_sides(mesh) & self._solid[:, None]
        self._row = np.full(len(mesh.nodes), -1, dtype=np.int32)
        self._row[surfaces.node] = np.arange(len(surfaces.node), dtype=np.int32)

    def opened(self, torn: np.ndarray) -> ContactSurfaces:
        """The surfaces with the open faces behind all others, whichever cells (cells,) are `torn`."""
        mesh, known = self._mesh, self._known
        beside = sides_beside(mesh.neighbours, torn)
        cell, side = np.nonzero(beside & self._solid[:, None] & ~known & ~torn[:, None])
        nodes = mesh.cells[cell[:, None], FACES[side]]
        charge = ~self._solid & (beside.any(axis=1))
        of_charge, towards = np.nonzero(beside & charge[:, None])
        behind = mesh.neighbours[of_charge, towards]
        back = np.argmax(mesh.neighbours[behind] == of_charge[:, None], axis=1)
        nodes = np.concatenate([nodes, mesh.cells[behind[:, None], FACES[back][:, ::-1]]])
        cell = np.concatenate([cell, of_charge])
        at = mesh.nodes[nodes]
        area = np.linalg.norm(area_vectors(at), axis=1)
        before = self._surfaces
        return replace(
            before,
            faces=np.concatenate([before.faces, self._row[nodes]]),
            face_body=np.concatenate([before.face_body, (2 * mesh.round[cell]).astype(np.int32)]),
            cell=np.concatenate([before.cell, cell]),
            edge=np.concatenate([before.edge, np.sqrt(area)]),
        )


def sides_beside(neighbours: np.ndarray, torn: np.ndarray) -> np.ndarray:
    """Sides of cells (cells, sides), bool, behind which lies a `torn` cell (cells,)."""
    beside: np.ndarray = (neighbours >= 0) & torn[np.maximum(neighbours, 0)]
    return beside
