"""Colliding surfaces on one rank: which facets each node may meet, and their forces (Eqs. 16-18)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact.nodes import ContactPairs
from burst_fenicsx.contact.search import box_around, meet
from burst_fenicsx.kernels.contact.collisions import Candidates, collide
from burst_fenicsx.kernels.contact.law import Law
from burst_fenicsx.kernels.contact.pairs import no_pairs
from burst_fenicsx.kernels.contact.search import Bodies, face_shapes, find_candidates
from burst_fenicsx.kernels.vectors.rows import largest_speed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from burst_fenicsx.contact.nodes import ContactNodes
    from burst_fenicsx.contact.surfaces import ContactSurfaces
    from burst_fenicsx.mechanics.fields import BurstFields

_MARGIN = 0.5  # of an edge: how deep a node may lie and still be found
_SAMPLE = 1000  # boxes from which the edge of the search's grid is taken
_KEPT = ("facet", "normal", "gap", "stiffness", "slip", "energies")
_SEARCH = ("searched_at", "travel", "searches")


class CollidingSurfaces(ContactPairs):
    """Contact of every surface with every other, and of a casing with itself.

    Where the outer layer of a wall folds, inner nodes overtake it. Nodes of a casing, inner ones as well, meet
    the faces of other rounds, those between the layers of their walls as well.

    Each rank looks for the faces that its own nodes meet, among those that lie near them: other ranks send it theirs.
    Between two searches, the faces a node may meet are known, and with them the other ranks' nodes whose positions a
    rank needs and to which it gives forces.

    Parameters
    ----------
    surfaces : of the whole mesh. fields : this rank's fields. nodes : contact's rows.
    friction_angle : degrees.
    reach : how far two surfaces may approach each other before the next search (m).

    Attributes
    ----------
    seen : the facets of each pair, which is one of a node and a round. searches : how many have been made.
    received : how many surface nodes the last search brought from other ranks.
    searched_at : positions (surface nodes, 3) in m at the last search, of the nodes here; none before the first.
    travel : how far surfaces may have approached each other since (m).
    """

    def __init__(
        self,
        surfaces: ContactSurfaces,
        fields: BurstFields,
        nodes: ContactNodes,
        friction_angle: float,
        reach: float,
    ) -> None:
        nothing = np.zeros(0, dtype=np.int32)
        super().__init__(fields, nodes, no_pairs(nothing, 4), np.zeros((0, 4), dtype=np.int32))
        self._comm = fields.mesh.comm
        self._friction = math.tan(math.radians(friction_angle))
        self._reach = reach
        self._row = nodes.rows_of(surfaces.node)
        local = nodes.rows.local[self._row]
        self._known = np.flatnonzero(local >= 0)  # of the surface nodes, ghosts too
        self._own = np.flatnonzero((local >= 0) & (local < fields.mesh.owned_nodes))
        self._local = local[self._own]
        self._rounds = int(surfaces.node_round.max(initial=-1)) + 1
        self.searched_at, self.travel, self.searches, self.received = np.zeros((0, 3)), np.inf, 0, 0
        self.take(surfaces, None)
        self.seen = self._candidates(nothing, nothing, np.zeros((len(self._row), 3)), nothing, nothing)

    def take(self, surfaces: ContactSurfaces, eroded: np.ndarray | None) -> None:
        """From the next search on, which is due now, nothing meets but the `surfaces` without `eroded` cells' faces."""
        self.surfaces = surfaces
        self.facets = self._row[surfaces.faces]
        whole = np.ones(len(surfaces.faces), dtype=bool) if eroded is None else ~eroded[surfaces.cell]
        here = np.ones_like(whole)
        if self._comm.size > 1:
            mesh = self._fields.mesh
            cells = np.zeros(int(surfaces.cell.max(initial=-1)) + 1, dtype=bool)
            cells[mesh.cell[mesh.cell < len(cells)]] = True
            here = cells[surfaces.cell]
        self._standing = np.flatnonzero(whole & here)  # of this rank's cells
        self.travel = np.inf

    @property
    def fastest(self) -> float:
        """Largest speed (m/s) of this rank's own nodes on surfaces."""
        return float(largest_speed(self._fields.nodes.velocity, self._local))

    def search_is_due(self, step: float, speed: float) -> bool:
        """Whether surfaces may have come closer than the last search looked; once a step of `step` s.

        `speed` is `fastest` of all ranks (m/s).
        """
        self.travel += 2.0 * step * speed
        return self.travel > self._reach

    def search(self) -> None:
        """Look for the faces that each node may meet; collective."""
        position = np.zeros((len(self._row), 3))
        position[self._known] = self._fields.nodes.position[self._nodes.rows.local[self._row[self._known]]]
        self.search_from(position)

    def search_from(self, position: np.ndarray) -> None:
        """Search with this rank's surface nodes at `position` (surface nodes, 3) in m; collective."""
        surfaces = self.surfaces
        self.searched_at, self.travel = position, 0.0
        self.searches += 1
        faces = self._standing
        inner = self._own[surfaces.inner[self._own]]
        outer = self._own[surfaces.outside[self._own]]
        inner = inner[self._within_reach(inner, faces, position)]
        active = np.concatenate([outer, inner])
        faces = self._with_others(faces, position, active)
        boxes, areas, normals = self._shapes(faces, position)
        on_surface = faces < surfaces.on_surface
        surfaces.flatten(normals)
        normals[surfaces.inner] = 0.0  # they leave their wall by any side, and never meet their own round
        # Faces of surfaces are met by all nodes, those within casings by nodes of other rounds.
        members, reached = np.where(on_surface, -1, surfaces.face_round[faces]), np.zeros(len(faces), dtype=bool)
        for index in np.unique(members):
            own, others = members == index, position[active[surfaces.node_round[active] != index]]
            reached[own] = meet(boxes[own], box_around(others, others))
        faces, boxes, areas = faces[reached], boxes[reached], areas[reached]
        bodies = Bodies(surfaces.faces[faces], surfaces.face_round[faces], surfaces.node_round, ~on_surface[reached])
        some = boxes[:: max(len(boxes) // _SAMPLE, 1)]
        cell = float(np.median((some[:, 3:] - some[:, :3]).max(axis=1))) if len(some) else self._reach
        first, candidate = find_candidates(position, bodies, areas, active.astype(np.int32), normals, boxes, cell)
        self._make_pairs(np.repeat(active, np.diff(first)), faces[candidate], normals)

    def _shapes(self, faces: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `face_shapes`, of `faces` (k,) widened by what the search looks ahead."""
        surfaces = self.surfaces
        reach = self._reach + _MARGIN * surfaces.edge[faces]
        shapes: tuple[np.ndarray, np.ndarray, np.ndarray] = face_shapes(
            position, surfaces.faces, faces, reach, surfaces.on_surface
        )
        return shapes

    def _within_reach(self, inner: np.ndarray, faces: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Whether own `inner` surface nodes lie in the box around another round's faces (k,) bool; collective.

        `faces` are this rank's.
        """
        surfaces, found = self.surfaces, np.zeros(len(inner), dtype=bool)
        if not surfaces.inner.any():
            return found
        faces = faces[faces < surfaces.on_surface]
        boxes, of_round = self._shapes(faces, position)[0], surfaces.face_round[faces]
        around = np.array([box_around(*np.hsplit(boxes[of_round == index], 2)) for index in range(self._rounds)])
        if self._comm.size > 1:
            around[:, 3:] *= -1.0
            self._comm.Allreduce(MPI.IN_PLACE, around, op=MPI.MIN)
            around[:, 3:] *= -1.0
        for index, box in enumerate(around):
            others = surfaces.node_round[inner] != index
            at = position[inner]
            found |= others & meet(np.hstack([at, at]), box)
        return found

    def _with_others(self, faces: np.ndarray, position: np.ndarray, active: np.ndarray) -> np.ndarray:
        """Own `faces` and those of other ranks that meet the box around the `active` nodes, ascending; collective.

        Every rank sends those of its own cells that another one's nodes may meet: what a rank receives goes with the
        surface near it. `position` (surface nodes, 3) is set for the corners of the faces received.
        """
        comm = self._comm
        if comm.size == 1:
            return faces
        everyone = np.array(comm.allgather(box_around(position[active], position[active])))
        boxes, _, _ = self._shapes(faces, position)
        messages: list[tuple[np.ndarray, np.ndarray] | None] = [None] * comm.size
        for rank, box in enumerate(everyone):
            chosen = faces[meet(boxes, box)]
            if rank != comm.rank and len(chosen):
                messages[rank] = chosen, position[np.unique(self.surfaces.faces[chosen])]
        pieces = [piece for piece in comm.alltoall(messages) if piece is not None]
        self.received = 0
        for chosen, corners in pieces:
            position[np.unique(self.surfaces.faces[chosen])] = corners
            self.received += len(corners)
        return np.sort(np.concatenate([faces, *(chosen for chosen, _ in pieces)]))

    def _make_pairs(self, node: np.ndarray, face: np.ndarray, normals: np.ndarray) -> None:
        """Make a pair of every node and round by the faces that nodes may meet (k,), and keep what touches."""
        surfaces = self.surfaces
        # Those of inner nodes last; a node's faces by their rounds.
        key = (surfaces.inner[node] * len(self._row) + node) * self._rounds + surfaces.face_round[face]
        order = np.argsort(key, kind="stable")  # which leaves the faces of each in ascending order
        node, face, key = node[order], face[order], key[order]
        begins = np.flatnonzero(np.diff(key, prepend=-1))
        node, other = node[begins], surfaces.face_round[face[begins]]
        self.on_surface = int(np.count_nonzero(~surfaces.inner[node]))
        before, pairs = self.pairs, no_pairs(self._row[node], 4)
        touching = np.flatnonzero(before.facet >= 0)
        then = before.node[touching].astype(np.int64) * self._rounds + self.seen.other[touching]
        now = pairs.node.astype(np.int64) * self._rounds + other
        _, kept, rows = np.intersect1d(now, then, assume_unique=True, return_indices=True)
        for name in _KEPT:
            getattr(pairs, name)[kept] = getattr(before, name)[touching[rows]]
        unloaded = np.zeros(len(node))
        unloaded[kept] = self.seen.unloaded[touching[rows]]
        self.pairs = pairs
        first = np.append(begins, len(face))
        self.seen = self._candidates(other, node, normals, first, face)._replace(unloaded=unloaded)
        self.watched = np.concatenate([pairs.node, self.facets[self.seen.near].ravel()])

    def _candidates(
        self, other: np.ndarray, node: np.ndarray, normals: np.ndarray, first: np.ndarray, face: np.ndarray
    ) -> Candidates:
        """Candidates of pairs of surface nodes (pairs,) and rounds."""
        surfaces, outward = self.surfaces, normals[node]
        near = np.zeros(len(self.facets), dtype=bool)
        near[face] = True
        return Candidates(
            other=other.astype(np.int32),
            same=surfaces.node_round[node] == other,
            outward=outward / np.maximum(np.linalg.norm(outward, axis=1), 1e-300)[:, None],
            unloaded=np.zeros(len(node)),
            first=first.astype(np.int64),
            candidate=face.astype(np.int32),
            facets=self.facets,
            edge=surfaces.edge,
            near=np.flatnonzero(near).astype(np.int32),
            ball=np.zeros((len(self.facets), 5)),
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """What a checkpoint keeps: the last search, and the pairs that touch."""
        touching = self.pairs.facet >= 0
        kept = {name: getattr(self.pairs, name)[touching] for name in ("node", *_KEPT)}
        kept |= {name: getattr(self.seen, name)[touching] for name in ("other", "unloaded")}
        return kept | {name: np.asarray(getattr(self, name)) for name in _SEARCH}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `arrays` gave; collective."""
        at, travel, searches = (arrays[name] for name in _SEARCH)
        if len(at):
            self.pairs = no_pairs(arrays["node"], 4)._replace(**{name: arrays[name] for name in _KEPT})
            self.seen = self.seen._replace(other=arrays["other"], unloaded=arrays["unloaded"])
            self.search_from(at)
            self.travel = float(travel)
        self.searches = int(searches)

    def add_forces(self, max_squared_frequency: float, step: float) -> None:
        """Add the forces of springs with at most that squared frequency (1/s2) after a step (s) to the rows."""
        collide(Law(max_squared_frequency, step, self._friction), self.pairs, self.seen, self._nodes.rows)
        self.add()

    def touching_rounds(self) -> np.ndarray:
        """Which rounds' surfaces touch each other now (rounds, rounds); collective."""
        touching, met = np.zeros((self._rounds, self._rounds), dtype=bool), self.pairs.facet >= 0
        own = self.surfaces.node_round[np.searchsorted(self._row, self.pairs.node[met])]
        touching[own, self.seen.other[met]] = True
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, touching, op=MPI.LOR)
        return touching
