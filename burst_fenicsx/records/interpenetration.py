"""Casing metal that has passed through a plane or into another round: found by geometry, independently of contact."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact.search import in_balls
from burst_fenicsx.contact.surfaces import outward_sides, sides_beside
from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.constants import LARGEST_PASSED_FRACTION
from burst_fenicsx.problem import Mirror, Part
from burst_fenicsx.records.within_rounds import CasingRadii, hold

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import BurstSettings, Round

_BEHIND_PLANE = 0.01  # of the cell size: a node less deep than this behind a plane is in contact with it, not beyond
# Of the cell size: a node less deep than this in a cell of another round is in contact with it. In stacks 99 % of all
# contacts are less deep than 0.11, and the deepest is 0.18.
_OVERLAP = 0.15

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class PassedThrough:
    """Casing metal beyond planes and within other rounds at one time; a node carries an eighth of each cell around it.

    Attributes
    ----------
    time : s.
    beyond_planes, in_rounds, together : (rounds,) kg of each round's casing (with its fuze): behind a plane, that finds
        no room within another round, and either.
    deepest : m, the farthest that a node of a casing lies behind a plane.
    centre : (rounds, 3) m, centre of mass of what has passed; NaN where nothing has.
    """

    time: float
    beyond_planes: np.ndarray
    in_rounds: np.ndarray
    together: np.ndarray
    deepest: float
    centre: np.ndarray


class InterpenetrationCheck:
    """Finds casing nodes behind planes and within cells of other rounds.

    At a plane of symmetry metal overlaps its image by twice its depth: it counts from the overlap at which it does
    within another round.

    Torn metal is mostly void, and thin products give way: a cell fills no more of its space than its initial volume.
    Metal that fills a share a of its own space finds no room where the cell that holds it fills more than 1 - a: of its
    mass (a + b - 1) / a counts, b being the cell's share. Metal that meets no void, or dense products, counts in full.

    Cells of the charge count as well, so that metal which has passed right through a wall is found, but only nearer to
    the round's axis than its casing is there: products that have come out of a torn casing flow around metal. Folded
    cells do not count. Sums are taken in the order of the nodes: they are the same on any number of ranks.

    Parameters
    ----------
    mesh : the whole mesh. fields : this rank's part of it.
    rounds : in order. settings : of the burst. Without contact of surfaces, other rounds are left out.
    images : how many times the arrangement is the computed part of it; the summary's masses are those of the whole.
    multiplicity : (rounds,) how many times a round is the computed part of it; messages name masses of whole rounds.
    eroded : (cells of the whole mesh,) bool, eroded cells, kept up to date by contact: the sides of cells towards them
        look outward.

    Attributes
    ----------
    casing_mass : (rounds,) kg, with the fuze.
    largest : (4,) largest so far over all rounds together: kg beyond planes, kg in other rounds, kg of either, and m of
        the deepest node behind a plane.
    last : what the last look found.
    """

    def __init__(
        self,
        mesh: HexahedralMesh,
        fields: BurstFields,
        rounds: Sequence[Round],
        settings: BurstSettings,
        *,
        images: int = 1,
        multiplicity: np.ndarray | None = None,
        eroded: np.ndarray | None = None,
    ) -> None:
        self._fields, self._comm = fields, fields.mesh.comm
        self._names = [item.name for item in rounds]
        self._eroded = np.zeros(len(mesh.cells), dtype=bool) if eroded is None else eroded
        self._count = len(rounds)
        self._images = images
        self._multiplicity = np.ones(self._count) if multiplicity is None else multiplicity
        self._overlap = _OVERLAP * settings.cell_size
        self._planes = [
            (
                np.asarray(plane.point, dtype=float),
                np.asarray(plane.normal) / np.linalg.norm(plane.normal),
                0.5 * self._overlap if isinstance(plane, Mirror) else _BEHIND_PLANE * settings.cell_size,
            )
            for plane in settings.planes
        ]
        self._among_rounds = settings.contact.surfaces and len(rounds) > 1
        self.largest = np.zeros(4)
        self._warned = False
        self.last: PassedThrough | None = None
        self.casing_mass = np.zeros(self._count)
        if not self.needed:
            return
        own = fields.mesh
        self._casing = casing = np.flatnonzero(mesh.part != Part.CHARGE)
        self._cells, self._initial_volume = mesh.cells, mesh.volumes
        cell_mass = own.all_cells(fields.cell_mass)
        self._node_mass = np.zeros(len(mesh.nodes))
        self._node_round = np.full(len(mesh.nodes), -1, dtype=np.int32)
        for corner in range(8):
            nodes = mesh.cells[casing, corner]
            np.add.at(self._node_mass, nodes, cell_mass[casing] / 8)
            self._node_round[nodes] = mesh.round[casing]
        of_round = np.bincount(mesh.round[casing], weights=cell_mass[casing], minlength=self._count)
        self.casing_mass = np.asarray(of_round, dtype=float)
        rounds_of_own = self._node_round[own.node[: own.owned_nodes]]
        self._local = np.flatnonzero(rounds_of_own >= 0)  # this rank's own nodes of casings
        self._number = own.node[self._local]
        if self._among_rounds:
            self._outward = outward_sides(mesh)[own.cell]
            self._neighbours = mesh.neighbours[own.cell]
            self._charge = mesh.part[own.cell] == Part.CHARGE
            self._casings = CasingRadii(mesh, rounds, settings.cell_size)

    @property
    def needed(self) -> bool:
        """Whether there is a plane or another round into which metal might pass."""
        return bool(self._planes) or self._among_rounds

    def look(self, time: float) -> PassedThrough:
        """Find what has passed through at `time` (s); collective."""
        position = self._fields.nodes.position[self._local]
        beyond, deepest = np.zeros(len(position), dtype=bool), 0.0
        for point, normal, skin in self._planes:
            depth = (point - position) @ normal
            beyond |= depth > skin
            deepest = max(deepest, float(depth.max(initial=0.0)))
        numbers, positions = self._number[beyond], position[beyond]
        several = self._comm.size > 1
        if several:
            deepest = self._comm.allreduce(deepest, op=MPI.MAX)
            pieces = self._comm.allgather((numbers, positions))
            numbers, positions = (np.concatenate(column) for column in zip(*pieces, strict=True))
        inside, within, without_room = self._inside_others(position)
        every, chosen = np.unique(np.concatenate([numbers, inside]), return_index=True)  # of both, the first
        share = np.concatenate([np.ones(len(numbers)), without_room])[chosen]
        centre = np.full((self._count, 3), np.nan)
        together = self._mass_by_round(every, share)
        if len(every):
            moments = (share * self._node_mass[every])[:, None] * np.concatenate([positions, within])[chosen]
            for index in np.flatnonzero(together > 0.0):
                centre[index] = moments[self._node_round[every] == index].sum(axis=0) / together[index]
        found = PassedThrough(
            time,
            self._mass_by_round(np.unique(numbers), 1.0),
            self._mass_by_round(inside, without_room),
            together,
            deepest,
            centre,
        )
        totals = [found.beyond_planes.sum(), found.in_rounds.sum(), found.together.sum(), deepest]
        self.largest = np.maximum(self.largest, totals)
        self.last = found
        return found

    def _mass_by_round(self, numbers: np.ndarray, share: np.ndarray | float) -> np.ndarray:
        """A share of the mass (rounds,) in kg of nodes of the whole mesh, each named once, in ascending order."""
        return np.bincount(self._node_round[numbers], weights=share * self._node_mass[numbers], minlength=self._count)

    def _filled(self) -> np.ndarray:
        """Share of the space around the nodes of the whole mesh (nodes,) that metal fills; collective.

        By the whole cells of casings around each; around others metal that is eroded is taken as solid.
        """
        volume = self._fields.mesh.all_cells(np.maximum(self._fields.volumes(), 0.0))
        cells = self._casing[~self._eroded[self._casing]]
        nodes = self._cells[cells].ravel()
        before, now = (
            np.bincount(nodes, weights=np.repeat(volumes[cells], 8), minlength=len(self._node_mass))
            for volumes in (self._initial_volume, volume)
        )
        return np.where(before < now, before / np.where(now > 0.0, now, 1.0), 1.0)

    def _inside_others(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Casing nodes of all ranks in cells of other rounds: numbers, ascending, positions, shares without room.

        `position` of own.
        """
        nothing = np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros(0)
        if not self._among_rounds:
            return nothing
        of_round = self._fields.mesh.round
        boxes = self._cell_boxes()
        low, high = np.full((self._count, 3), np.inf), np.full((self._count, 3), -np.inf)
        for index in range(self._count):
            low[index] = boxes[of_round == index, :3].min(axis=0, initial=np.inf)
            high[index] = boxes[of_round == index, 3:].max(axis=0, initial=-np.inf)
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, low, op=MPI.MIN)
            self._comm.Allreduce(MPI.IN_PLACE, high, op=MPI.MAX)
        rounds, near = self._node_round[self._number], np.zeros(len(position), dtype=bool)
        for index in range(self._count):
            near |= (rounds != index) & ((position >= low[index]) & (position <= high[index])).all(axis=1)
        radii = self._casings.largest(position, rounds)
        numbers, points = self._number[near], position[near]
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, radii, op=MPI.MAX)
            pieces = self._comm.allgather((numbers, points))
            numbers, points = (np.concatenate(column) for column in zip(*pieces, strict=True))
        order = np.argsort(numbers)
        numbers, points = numbers[order], points[order]
        taken = self._taken(points, self._node_round[numbers], boxes, self._casings.enclose(points, radii))
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, taken, op=MPI.MAX)
        filled = self._filled()[numbers]
        share = (filled + taken - 1.0) / filled
        inside = share > 0.0
        return numbers[inside], points[inside], share[inside]

    def _cell_boxes(self) -> np.ndarray:
        """Boxes (own cells, 6) around this rank's cells: low, then high corner (m)."""
        dofmap, position = self._fields.mesh.dofmap, self._fields.nodes.position
        boxes = np.concatenate([position[dofmap[:, 0]]] * 2, axis=1)
        for corner in range(1, 8):
            at = position[dofmap[:, corner]]
            np.minimum(boxes[:, :3], at, out=boxes[:, :3])
            np.maximum(boxes[:, 3:], at, out=boxes[:, 3:])
        return boxes

    def _taken(self, points: np.ndarray, rounds: np.ndarray, boxes: np.ndarray, enclosed: np.ndarray) -> np.ndarray:
        """Share of the space that is taken at points (n, 3) by this rank's cells of other `rounds` (n,), see `hold`.

        `enclosed` (n, rounds) says of which rounds the charges' cells count as well; `boxes` are those of own cells.
        """
        taken = np.zeros(len(points))
        fields, position = self._fields, self._fields.nodes.position
        reached = (boxes[:, :3] <= points.max(axis=0, initial=-np.inf)).all(axis=1)
        reached &= (boxes[:, 3:] >= points.min(axis=0, initial=np.inf)).all(axis=1)
        rows = np.flatnonzero(reached & ~fields.eroded & ~fields.folded())
        if not len(rows):
            return taken
        filled = np.ones(len(fields.eroded))
        volume = np.maximum(fields.volumes()[rows], 1e-300)
        filled[rows] = np.minimum(self._initial_volume[fields.mesh.cell[rows]] / volume, 1.0)
        corners = position[fields.mesh.dofmap[rows]]
        centre = corners.mean(axis=1)
        radius = np.sqrt(((corners - centre[:, None]) ** 2).sum(axis=2).max(axis=1))
        outward = self._outward | sides_beside(self._neighbours, self._eroded)
        point, cell = in_balls(points, centre, radius)
        cell = rows[cell]
        counts = ~self._charge[cell] | enclosed[point, fields.mesh.round[cell]]
        counts &= fields.mesh.round[cell] != rounds[point]
        point, cell = point[counts], cell[counts]
        held = hold(position[fields.mesh.dofmap[cell]], points[point], outward[cell], self._overlap)
        np.maximum.at(taken, point[held], filled[cell[held]])
        return taken

    def check(self, time: float) -> None:
        """Look at `time` (s); collective.

        Raises
        ------
        NumericalStop
            More than `LARGEST_PASSED_FRACTION` of a round's casing has passed through.
        """
        if not self.needed:
            return
        found = self.look(time)
        fraction = found.together / np.where(self.casing_mass > 0.0, self.casing_mass, 1.0)
        worst = int(np.argmax(fraction))
        if fraction[worst] > 0.1 * LARGEST_PASSED_FRACTION and self._comm.rank == 0:
            # Once: what follows is in the log, and the largest in the summary.
            say = _log.info if self._warned else _log.warning
            say("%s (at %.2f us)", self._words(found, worst), 1e6 * time, extra={"code": "passed_through"})
            self._warned = True
        if fraction[worst] > LARGEST_PASSED_FRACTION:
            raise NumericalStop(
                f"{self._words(found, worst)}; allowed {100 * LARGEST_PASSED_FRACTION:g} %. Contact has failed there: "
                "repeat with other cells",
                time,
            )

    def _words(self, found: PassedThrough, index: int) -> str:
        """What of a round has passed through, and where."""
        times = self._multiplicity[index]
        mass, whole = times * found.together[index], times * self.casing_mass[index]
        where = ", ".join(f"{1e3 * value:.1f}" for value in found.centre[index])
        behind = f", up to {1e3 * found.deepest:.2g} mm" if found.beyond_planes[index] > 0.0 else ""
        return (
            f"{mass:.3g} of {whole:.4g} kg ({100 * mass / whole:.2g} %) of the casing of round '{self._names[index]}' "
            f"have passed through: {times * found.beyond_planes[index]:.3g} kg behind a plane{behind}, "
            f"{times * found.in_rounds[index]:.3g} kg within other rounds, around ({where}) mm"
        )

    def log_result(self, contact: Mapping[str, Any], folded: float) -> None:
        """Log what has passed through, with the deepest interior nodes by `contact`'s summary; `folded` mass in kg."""
        if not self.needed or self._comm.rank != 0:
            return
        planes, rounds = self._images * self.largest[:2]
        depths = [1e3 * contact[f"max_interior_{kind}_penetration"] for kind in ("plane", "collision")]
        _log.info(
            "casings: at most %.3g kg beyond planes and %.3g kg within other rounds; interior nodes up to %.3g mm "
            "behind planes and %.3g mm behind other rounds' faces; %.3g kg folded at the end",
            planes,
            rounds,
            *depths,
            folded,
        )

    def summary(self) -> dict[str, Any]:
        """The part of the summary: at the last look, and the largest so far."""
        last = self.last
        deepest = float(self.largest[3])
        planes, rounds, together = (float(value) for value in self._images * self.largest[:3])
        return {
            "beyond_planes": self._images * float(last.beyond_planes.sum()) if last else 0.0,
            "in_other_rounds": self._images * float(last.in_rounds.sum()) if last else 0.0,
            "largest_beyond_planes": planes,
            "largest_in_other_rounds": rounds,
            "largest_together": together,
            "deepest_beyond_plane": deepest,
        }
