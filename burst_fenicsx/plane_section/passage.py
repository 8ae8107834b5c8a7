"""Casing metal of a section that has passed through a plane or into another round, by geometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.axisymmetric.rings import folded
from burst_fenicsx.problem import Part
from burst_fenicsx.records.cavities import Cavities
from burst_fenicsx.records.passage import Passage

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.axisymmetric.fields import RingFields
    from burst_fenicsx.plane_section.mesh import SectionMesh
    from burst_fenicsx.problem import BurstSettings, Round

__all__ = ["SectionCavities", "SectionPassage"]

_DEEP = 1e-3  # m, half of the depth that boxes are given along the axis
_HELD = 0.25  # of the cell size: contact holds a node up to half a cell deep; walls that meet load it to a sixth
_HELD_BY_PLANE = 0.125  # of the cell size; half as much, since a plane of symmetry stands for a wall that is as deep
_THICKEST_SKIN = 0.25  # of a cell's width


class SectionPassage(Passage):
    """As `Passage`, of quadrilaterals; masses are those per metre.

    Walls that meet at some 2.5 km/s load the springs of contact until their nodes lie a sixth of a cell deep, at any
    cell size, and in a section they meet over their whole length at once. So what counts as passed through lies deeper:
    a quarter of a cell. Parameters and attributes as for `Passage`.
    """

    def __init__(
        self,
        mesh: SectionMesh,
        fields: RingFields,
        rounds: Sequence[Round],
        settings: BurstSettings,
        *,
        images: int = 1,
    ) -> None:
        super().__init__(mesh, fields, rounds, settings, images=images)  # type: ignore[arg-type]
        self._overlap = _HELD * settings.cell_size
        self._planes = [(point, normal, _HELD_BY_PLANE * settings.cell_size) for point, normal, _ in self._planes]

    @staticmethod
    def _outward_sides(sides: np.ndarray) -> np.ndarray:
        """Edges that look outward (cells, 4), bool, from each corner to the next."""
        return np.ascontiguousarray(sides)

    def _cell_boxes(self) -> np.ndarray:
        """Boxes (cells, 6) around the cells: low, then high corner (m)."""
        corner = self._fields.nodes.position[self._fields.mesh.dofmap]
        deep = np.array([0.0, _DEEP, 0.0])
        return np.concatenate([corner.min(axis=1) - deep, corner.max(axis=1) + deep], axis=1)

    def _make_cavities(self, mesh: SectionMesh) -> SectionCavities:  # type: ignore[override]
        return SectionCavities(mesh, self._fields)  # type: ignore[arg-type]

    def _own_cell_around(
        self, places: np.ndarray, rounds: np.ndarray, boxes: np.ndarray, among: np.ndarray
    ) -> np.ndarray:
        """A cell (n,) of another round, `among` some, that holds each place (n, 3) of `rounds` (n,), or -1."""
        mesh, position, count = self._fields.mesh, self._fields.nodes.position, len(places)
        found = np.full(count, -1)
        reached = (boxes[:, :3] <= places.max(axis=0)).all(axis=1) & (boxes[:, 3:] >= places.min(axis=0)).all(axis=1)
        rows = np.flatnonzero(reached & among & ~folded(position, mesh.dofmap) & ~self._fields.eroded)
        if not len(rows):
            return found
        first, candidate = self._cells_near(places, rounds, rows, boxes[rows], 1)
        node = np.repeat(np.arange(count), np.diff(first))
        cell = rows[candidate]
        holds = self._holds(places[node], cell)
        found[node[holds]] = cell[holds]
        return found

    def _holds(self, places: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """Whether each cell (k,) holds its place (k, 3), not nearer than the overlap to an edge that looks outward.

        A quadrilateral that is not folded is convex: it holds what lies to the left of all its edges.
        """
        corner = self._fields.nodes.position[self._fields.mesh.dofmap[cell]][..., [0, 2]]
        along = np.roll(corner, -1, axis=1) - corner
        length = np.maximum(np.linalg.norm(along, axis=2), 1e-300)
        away = places[:, None, [0, 2]] - corner
        height = (along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0]) / length
        area = 0.5 * np.abs(
            (corner[:, 2, 0] - corner[:, 0, 0]) * (corner[:, 3, 1] - corner[:, 1, 1])
            - (corner[:, 3, 0] - corner[:, 1, 0]) * (corner[:, 2, 1] - corner[:, 0, 1])
        )
        skin = np.minimum(self._overlap, _THICKEST_SKIN * area[:, None] / length)
        needed = np.where(self._outward[cell], skin, 0.0)
        holds: np.ndarray = (height >= needed).all(axis=1)
        return holds


class SectionCavities(Cavities):
    """As `Cavities`, of the edges around the charges of a section. Parameters as for `Cavities`."""

    def __init__(self, mesh: SectionMesh, fields: RingFields) -> None:
        self._fields = fields
        charge = mesh.part == Part.CHARGE
        behind = np.where(mesh.neighbours >= 0, mesh.part[mesh.neighbours], -1)
        bare, side = np.nonzero(charge[:, None] & (mesh.neighbours < 0))
        wall, towards = np.nonzero(~charge[:, None] & (behind == Part.CHARGE))
        ends = np.stack([mesh.cells, np.roll(mesh.cells, -1, axis=1)], axis=-1)
        edges = np.concatenate([ends[bare, side], ends[wall, towards, ::-1]])
        rounds = np.concatenate([mesh.round[bare], mesh.round[wall]])
        self._edges = {index: edges[rounds == index] for index in np.unique(mesh.round).tolist()}

    def _windings(self, places: np.ndarray, index: int) -> np.ndarray:
        """How often the edges around a round's charge wind around places (n, 3)."""
        at = self._fields.nodes.position[self._edges[index]][..., [0, 2]]
        away = at[None] - places[:, None, None, [0, 2]]
        here, there = away[:, :, 0], away[:, :, 1]
        turned = np.arctan2(here[..., 0] * there[..., 1] - here[..., 1] * there[..., 0], (here * there).sum(axis=-1))
        windings: np.ndarray = turned.sum(axis=1) / (2.0 * np.pi)
        return windings
