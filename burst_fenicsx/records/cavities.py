"""The cavities that casings close around their charges, and which places lie within them."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.kernels.geometry.faces import FACES
from burst_fenicsx.kernels.geometry.winding import add_windings
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh

__all__ = ["Cavities"]


class Cavities:
    """The surfaces around the charges of all rounds: the casings' side of them, the charges' own where they are bare.

    Products that burst through a torn casing lie outside of its cavity: metal of another round among them has passed
    through nothing.

    Parameters
    ----------
    mesh : the whole mesh. fields : this rank's share of it.
    """

    def __init__(self, mesh: HexahedralMesh, fields: BurstFields) -> None:
        self._fields, own = fields, fields.mesh
        cell, part, neighbours = own.cell, mesh.part, mesh.neighbours[own.cell]
        charge, behind = part[cell] == Part.CHARGE, np.where(neighbours >= 0, part[neighbours], -1)
        bare, side = np.nonzero(charge[:, None] & (neighbours < 0))
        wall, towards = np.nonzero(~charge[:, None] & (behind == Part.CHARGE))
        faces = np.concatenate(
            [mesh.cells[cell[bare, None], FACES[side]], mesh.cells[cell[wall, None], FACES[towards][:, ::-1]]]
        )
        rounds = np.concatenate([mesh.round[cell[bare]], mesh.round[cell[wall]]])
        local = own.local_node(faces.ravel()).reshape(-1, 4).astype(np.int32)
        self._faces = {index: local[rounds == index] for index in range(int(mesh.round.max(initial=0)) + 1)}
        self._images = {index: _images(mesh, index) for index in self._faces}

    def hold(self, places: np.ndarray, rounds: np.ndarray) -> np.ndarray:
        """Whether `places` (n, 3) in m, the same on all ranks, lie in the cavities of `rounds` (n,); collective."""
        windings = np.zeros(len(places))
        for index in np.unique(rounds).tolist():
            chosen = np.flatnonzero(rounds == index)
            windings[chosen] = self._windings(places[chosen], index)
        if self._fields.mesh.comm.size > 1:
            self._fields.mesh.comm.Allreduce(MPI.IN_PLACE, windings)
        # Where a cavity is turned inside out, it winds backwards.
        within: np.ndarray = np.abs(windings) > 0.5
        return within

    def _windings(self, places: np.ndarray, index: int) -> np.ndarray:
        """How often this rank's part of a round's surface, with its images, winds around places (n, 3)."""
        windings, position = np.zeros(len(places)), self._fields.nodes.position
        for matrix, offset in self._images[index]:
            add_windings(places @ matrix + offset, position, self._faces[index], windings)
        return windings


def _images(mesh: HexahedralMesh, index: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Matrices (3, 3), by which places are multiplied from the right, and offsets (3,) m of a round's images.

    A round that planes of symmetry cut has an image behind each of them, and one behind both where there are two. An
    image's surface seen from a place takes up the angle of the surface itself seen from the place's image.
    """
    reflections = []
    if mesh.held is not None:
        of_round = np.unique(mesh.cells[mesh.round == index])
        for bit, normal in mesh.held_normals:
            in_plane = of_round[(mesh.held[of_round] >> bit & 1).astype(bool)]
            if len(in_plane):
                unit = np.asarray(normal)
                reflections.append((unit, float(mesh.nodes[in_plane[0]] @ unit)))
    images = []
    for count in range(len(reflections) + 1):
        for some in combinations(reflections, count):
            matrix, offset = np.eye(3), np.zeros(3)
            for unit, height in some:
                mirror = np.eye(3) - 2.0 * np.outer(unit, unit)
                matrix, offset = matrix @ mirror, offset @ mirror + 2.0 * height * unit
            images.append((matrix, offset))
    return images
