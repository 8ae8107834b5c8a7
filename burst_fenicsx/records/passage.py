"""Casing metal that has passed through a plane or into another round: found by geometry, independently of contact."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact.surfaces import outward_sides
from burst_fenicsx.contact.torn_faces import sides_beside
from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.contact.search import Bodies, face_boxes, find_candidates
from burst_fenicsx.kernels.geometry.inside import points_inside
from burst_fenicsx.kernels.geometry.shapes import folded_cells
from burst_fenicsx.problem import Part
from burst_fenicsx.records.cavities import Cavities

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import BurstSettings, Round

__all__ = ["LARGEST_SHARE", "Passage", "PassedThrough"]

LARGEST_SHARE = 0.01
"""Share of a casing's mass that may have passed through planes or into other rounds before the run stops."""

_SKIN = 0.01  # of the cell size: a node less deep than this behind a plane is in contact with it, not beyond
_SIDES = [5, 3, 2, 4, 0, 1]  # sides -x, +x, -y, +y, -z, +z of a cell among `kernels.geometry.faces.FACES`
_OVERLAP = 0.05  # of the cell size: a node less deep than this in a cell of another round is in contact with it
_BOXES = 1000  # of cells from which the edge of the search's grid is taken

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class PassedThrough:
    """Casing metal beyond planes and within other rounds at one time; a node carries an eighth of each cell around it.

    Attributes
    ----------
    time : s.
    beyond_planes, in_rounds, together : (rounds,) kg of each round's casing (with its fuze): behind a plane, within
        the casing of another round, and either.
    deepest : m, the farthest that a node of a casing lies behind a plane.
    centre : (rounds, 3) m, centre of mass of what has passed; NaN where nothing has.
    """

    time: float
    beyond_planes: np.ndarray
    in_rounds: np.ndarray
    together: np.ndarray
    deepest: float
    centre: np.ndarray


class Passage:
    """Finds casing nodes behind planes and within cells of other rounds.

    A cell of another round holds a node where the inverse trilinear mapping says so. Cells of the charge count as well,
    so that metal which has passed right through a wall is found, but only within the casing's cavity: products that
    have come out of a torn casing flow around metal. Folded cells do not count, their mapping is not unique. Sums are
    taken in the order of the nodes: they are the same on any number of ranks.

    Parameters
    ----------
    mesh : the whole mesh. fields : this rank's share of it.
    rounds : in order. settings : of the burst. Without contact of surfaces, other rounds are left out.
    images : how many times the arrangement is the computed part of it; the summary's masses are those of the whole.
    multiplicity : (rounds,) how many times a round is the computed part of it; messages name masses of whole rounds.
    mirrors : how many of the planes, the last, the program has put between rounds and their images: there metal
        overlaps its image by twice its depth, and counts from the overlap at which it does within another round.
    torn : (cells of the whole mesh,) bool, cells that are torn metal, kept up to date by contact: the sides of cells
        towards them look outward.

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
        mirrors: int = 0,
        torn: np.ndarray | None = None,
    ) -> None:
        self._fields, self._comm = fields, fields.mesh.comm
        self._torn = np.zeros(len(mesh.cells), dtype=bool) if torn is None else torn
        self._names = [item.name for item in rounds]
        self._count = len(rounds)
        self._images = images
        self._multiplicity = np.ones(self._count) if multiplicity is None else multiplicity
        self._skin, self._overlap = _SKIN * settings.cell_size, _OVERLAP * settings.cell_size
        given = len(settings.planes) - mirrors
        self._planes = [
            (
                np.asarray(plane.point, dtype=float),
                np.asarray(plane.normal) / np.linalg.norm(plane.normal),
                self._skin if index < given else 0.5 * self._overlap,
            )
            for index, plane in enumerate(settings.planes)
        ]
        self._among_rounds = settings.contact.surfaces and len(rounds) > 1
        self.largest = np.zeros(4)
        self._warned = False
        self.last: PassedThrough | None = None
        self.casing_mass = np.zeros(self._count)
        if not self.needed:
            return
        own = fields.mesh
        casing = np.flatnonzero(mesh.part != Part.CHARGE)
        cell_mass = np.zeros(len(mesh.cells))
        cell_mass[own.cell] = fields.cell_mass
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, cell_mass)
        self._node_mass = np.zeros(len(mesh.nodes))
        self._node_round = np.full(len(mesh.nodes), -1, dtype=np.int32)
        corners = mesh.cells.shape[1]
        for corner in range(corners):
            nodes = mesh.cells[casing, corner]
            np.add.at(self._node_mass, nodes, cell_mass[casing] / corners)
            self._node_round[nodes] = mesh.round[casing]
        of_round = np.bincount(mesh.round[casing], weights=cell_mass[casing], minlength=self._count)
        self.casing_mass = np.asarray(of_round, dtype=float)
        rounds_of_own = self._node_round[own.node[: own.owned_nodes]]
        self._local = np.flatnonzero(rounds_of_own >= 0)  # this rank's own nodes of casings
        self._number = own.node[self._local]
        if self._among_rounds:
            self._outward = self._outward_sides(outward_sides(mesh)[own.cell])
            self._neighbours = mesh.neighbours[own.cell]
            self._charge = mesh.part[own.cell] == Part.CHARGE
            self._cavities = self._make_cavities(mesh)

    def _make_cavities(self, mesh: HexahedralMesh) -> Cavities:
        return Cavities(mesh, self._fields)

    @staticmethod
    def _outward_sides(sides: np.ndarray) -> np.ndarray:
        """Sides that look outward (own cells, sides), bool, in the order in which `points_inside` needs them."""
        return np.ascontiguousarray(sides[:, _SIDES])

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
        numbers, places = self._number[beyond], position[beyond]
        several = self._comm.size > 1
        if several:
            deepest = self._comm.allreduce(deepest, op=MPI.MAX)
            pieces = self._comm.allgather((numbers, places))
            numbers, places = (np.concatenate(column) for column in zip(*pieces, strict=True))
        inside, within = self._inside_others(position)
        every, chosen = np.unique(np.concatenate([numbers, inside]), return_index=True)
        centre = np.full((self._count, 3), np.nan)
        together = self._mass_by_round(every)
        if len(every):
            moments = self._node_mass[every, None] * np.concatenate([places, within])[chosen]
            for index in np.flatnonzero(together > 0.0):
                centre[index] = moments[self._node_round[every] == index].sum(axis=0) / together[index]
        found = PassedThrough(
            time,
            self._mass_by_round(np.unique(numbers)),
            self._mass_by_round(inside),
            together,
            deepest,
            centre,
        )
        totals = [found.beyond_planes.sum(), found.in_rounds.sum(), found.together.sum(), deepest]
        self.largest = np.maximum(self.largest, totals)
        self.last = found
        return found

    def _mass_by_round(self, numbers: np.ndarray) -> np.ndarray:
        """Mass (rounds,) in kg of nodes of the whole mesh, each named once, in ascending order."""
        return np.bincount(self._node_round[numbers], weights=self._node_mass[numbers], minlength=self._count)

    def _inside_others(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Casing nodes of all ranks in cells of other rounds: numbers, ascending, and places; `position` of own."""
        nothing = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        if not self._among_rounds:
            return nothing
        fields = self._fields
        mesh, boxes = fields.mesh, self._cell_boxes()
        low, high = np.full((self._count, 3), np.inf), np.full((self._count, 3), -np.inf)
        for index in range(self._count):
            own = boxes[mesh.round == index]
            if len(own):
                low[index], high[index] = own[:, :3].min(axis=0), own[:, 3:].max(axis=0)
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, low, op=MPI.MIN)
            self._comm.Allreduce(MPI.IN_PLACE, high, op=MPI.MAX)
        rounds, near = self._node_round[self._number], np.zeros(len(position), dtype=bool)
        for index in range(self._count):
            near |= (rounds != index) & ((position >= low[index]) & (position <= high[index])).all(axis=1)
        numbers, places = self._number[near], position[near]
        if self._comm.size > 1:
            pieces = self._comm.allgather((numbers, places))
            numbers, places = (np.concatenate(column) for column in zip(*pieces, strict=True))
            order = np.argsort(numbers)
            numbers, places = numbers[order], places[order]
        inside = np.zeros(len(numbers), dtype=bool)
        if len(numbers):
            inside = self._round_around(places, self._node_round[numbers], boxes, ~self._charge) >= 0
            around = self._round_around(places, self._node_round[numbers], boxes, self._charge)
            among_products = np.flatnonzero((around >= 0) & ~inside)
            inside[among_products] = self._cavities.hold(places[among_products], around[among_products])
        chosen = np.flatnonzero(inside)
        chosen = chosen[np.argsort(numbers[chosen])]
        return numbers[chosen], places[chosen]

    def _round_around(self, places: np.ndarray, rounds: np.ndarray, boxes: np.ndarray, among: np.ndarray) -> np.ndarray:
        """The other round (n,) int32 whose cells hold each place (n, 3) of a node of `rounds` (n,), or -1; collective.

        `boxes` (own cells, 6) m are those of this rank's cells; looked for is `among` (own cells,) bool.
        """
        cell = self._own_cell_around(places, rounds, boxes, among)
        around = np.where(cell >= 0, self._fields.mesh.round[cell], -1).astype(np.int32)
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, around, op=MPI.MAX)
        return around

    def _cell_boxes(self) -> np.ndarray:
        """Boxes (own cells, 6) around this rank's cells: low, then high corner (m)."""
        mesh, position = self._fields.mesh, self._fields.nodes.position
        nothing = np.zeros(mesh.cells)
        halves = [np.empty((mesh.cells, 6)), np.empty((mesh.cells, 6))]
        for half, corners in zip(halves, (mesh.dofmap[:, :4], mesh.dofmap[:, 4:]), strict=True):
            face_boxes(position, np.ascontiguousarray(corners), nothing, half)
        low, high = (np.concatenate([half[:, part] for half in halves]) for part in (slice(0, 3), slice(3, 6)))
        low, high = low.reshape(2, -1, 3).min(axis=0), high.reshape(2, -1, 3).max(axis=0)
        return np.concatenate([low, high], axis=1)

    def _own_cell_around(
        self, places: np.ndarray, rounds: np.ndarray, boxes: np.ndarray, among: np.ndarray
    ) -> np.ndarray:
        """An own cell (n,) of another round, `among` some, that holds each place (n, 3) of `rounds` (n,), or -1."""
        mesh, count = self._fields.mesh, len(places)
        reached = (boxes[:, :3] <= places.max(axis=0)).all(axis=1) & (boxes[:, 3:] >= places.min(axis=0)).all(axis=1)
        rows = np.flatnonzero(reached & among & ~self._fields.eroded)
        # The mapping of a folded cell reaches out of its own faces; those cells are counted by themselves.
        position = self._fields.nodes.position
        rows = rows[~folded_cells(position, np.ascontiguousarray(mesh.dofmap[rows]))]
        if not len(rows):
            return np.full(count, -1)
        first, candidate = self._cells_near(places, rounds, rows, boxes[rows], max(len(rows) // _BOXES, 1))
        outward = self._outward | self._outward_sides(sides_beside(self._neighbours, self._torn))
        found = np.empty(count, dtype=np.int32)
        points_inside(
            places,
            first,
            candidate,
            position,
            np.ascontiguousarray(mesh.dofmap[rows]),
            self._overlap,
            outward[rows],
            found,
        )
        cell: np.ndarray = np.where(found >= 0, rows[found], -1)
        return cell

    def _cells_near(
        self, places: np.ndarray, rounds: np.ndarray, rows: np.ndarray, boxes: np.ndarray, stride: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Cells, of `rows`, of other rounds in whose boxes places (n, 3) of `rounds` (n,) lie.

        Returns
        -------
        For every place the first of its own among what was found (n + 1,), and that as indices into `rows`. Every
        `stride`-th of the boxes (rows, 6) gives the edge of the search's grid.
        """
        count, some = len(places), boxes[::stride]
        of_cell, of_node = self._fields.mesh.round[rows].astype(np.int32), rounds.astype(np.int32)
        bodies = Bodies(np.zeros((len(rows), 4), dtype=np.int32), 2 * of_cell, 2 * of_node, of_cell, of_node)
        first, candidate = find_candidates(
            np.ascontiguousarray(places),
            bodies,
            np.arange(count, dtype=np.int32),
            np.zeros((count, 3)),  # without normals, nothing is found in a node's own round
            np.ascontiguousarray(boxes),
            float(np.median((some[:, 3:] - some[:, :3]).max(axis=1))),
        )
        return first, candidate

    def check(self, time: float) -> None:
        """Look at `time` (s); collective.

        Raises
        ------
        NumericalStop
            More than `LARGEST_SHARE` of a round's casing has passed through.
        """
        if not self.needed:
            return
        found = self.look(time)
        share = found.together / np.where(self.casing_mass > 0.0, self.casing_mass, 1.0)
        worst = int(np.argmax(share))
        if share[worst] > 0.1 * LARGEST_SHARE and self._comm.rank == 0:
            # Once: what follows is in the log, and the largest in the summary.
            say = _log.info if self._warned else _log.warning
            say("%s (at %.2f us)", self._words(found, worst), 1e6 * time, extra={"code": "passed_through"})
            self._warned = True
        if share[worst] > LARGEST_SHARE:
            raise NumericalStop(
                f"{self._words(found, worst)}; allowed {100 * LARGEST_SHARE:g} %. Contact has failed there: "
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
        """The passage's part of the summary: at the last look, and the largest so far."""
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
