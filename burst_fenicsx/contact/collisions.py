"""Point-face contact of colliding surfaces on one rank: search, forces, and their sums over ranks (Eqs. 16-18)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact.boxes import are_inside, around_rounds, meet_others
from burst_fenicsx.contact.exchange import CONTACT_FORCES, Fetched, Given, Halo, NearFaces
from burst_fenicsx.kernels.contact.collisions import find_contacts
from burst_fenicsx.kernels.contact.search import Bodies, face_boxes, find_candidates, node_normals
from burst_fenicsx.kernels.contact.springs import CollisionLaw, Collisions, add_reactions, take_reactions
from burst_fenicsx.kernels.geometry.smooth_faces import face_vectors
from burst_fenicsx.kernels.vectors.exact import quantise, rounding_constant
from burst_fenicsx.kernels.vectors.rows import clear_rows, copy_motion, largest_speed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from burst_fenicsx.contact.surfaces import ContactSurfaces
    from burst_fenicsx.mechanics.fields import BurstFields

__all__ = ["CollidingSurfaces"]

_MARGIN = 0.5  # of an edge: how deep a node may lie and still be found
_LARGEST_LOAD = 2.0**10
_SEARCH = ("searched_at", "travel", "searches")
_SAMPLE = 1000  # boxes from which the edge of the search's grid is taken


class CollidingSurfaces:
    """Contact of every surface with every other, and of a casing with itself.

    Where the outer layer of a wall folds, inner nodes overtake it. Nodes of a casing, inner ones as well, meet
    the faces of other rounds, those between the layers of their walls as well.

    Each rank looks for the faces that its own nodes meet, among those that lie near them: other ranks send it theirs.
    Between two searches, the faces a node may meet are known, and with them the other ranks' nodes whose positions a
    rank needs and to which it gives forces; these are exchanged.

    Parameters
    ----------
    surfaces : of the whole mesh.
    state : this rank's fields.
    friction_angle : degrees.
    reach : how far two surfaces may approach each other before the next search (m).

    Attributes
    ----------
    state : the kernels' arrays.
    searches : how many have been made. near_faces : brings what they need from other ranks.
    searched_at : positions (surface nodes, 3) in m at the last search, of the nodes here; none before the first.
    travel : how far surfaces may have approached each other since (m).
    """

    def __init__(self, surfaces: ContactSurfaces, fields: BurstFields, friction_angle: float, reach: float) -> None:
        self.surfaces = surfaces
        self.searches = 0
        self._fields = fields
        self._comm = fields.mesh.comm
        self._friction = math.tan(math.radians(friction_angle))
        self._reach = reach
        self._load_rounding = rounding_constant(_LARGEST_LOAD)
        count = len(surfaces.node)
        row = np.full(int(surfaces.node.max(initial=-1)) + 1, -1, dtype=np.int64)
        row[surfaces.node] = np.arange(count)
        own = fields.mesh.node[: fields.mesh.owned_nodes]
        rows = np.where(own < len(row), row[np.minimum(own, len(row) - 1)], -1)
        every = fields.mesh.local_node(surfaces.node)
        self._known_rows = np.flatnonzero(every >= 0)  # of all nodes that are here, ghosts too ...
        self._known_local = every[self._known_rows]  # ... and these nodes
        self._local = np.flatnonzero(rows >= 0).astype(np.int32)  # this rank's own nodes on surfaces ...
        self._rows = rows[self._local].astype(np.int32)  # ... and their rows
        inner = self._rows[surfaces.inner[self._rows]]
        of_round = surfaces.node_round[inner]
        # Own inner nodes of casings by round.
        self._inner = {index: inner[of_round == index] for index in np.unique(of_round).tolist()}
        self._on_surface = 0  # so many pairs, the first, are of nodes on a surface
        self._bodies = _bodies_of(surfaces)
        self._rounds = int(self._bodies.node_round.max(initial=-1)) + 1
        self._whole = np.ones(len(surfaces.faces), dtype=bool)  # faces of cells that are not eroded
        self.near_faces = NearFaces(self._comm, surfaces, fields.mesh)
        self._halo = Halo(self._comm, self._rows, count)
        self._position, self._velocity = np.zeros((count, 3)), np.zeros((count, 3))
        self._sums = np.zeros((count, 4))
        self._mass = np.zeros(count)
        self._mass[self._rows] = fields.mass[self._local]
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, self._mass)
        self.searched_at = np.zeros((0, 3))
        self.travel = np.inf
        no_one = np.zeros(0, dtype=np.int32)
        self.state: Collisions = Collisions(
            node=no_one,
            other=no_one,
            first=np.zeros(1, dtype=np.int64),
            candidate=no_one,
            faces=surfaces.faces,
            node_round=surfaces.node_round,
            edge=surfaces.edge,
            near=no_one,
            ball=np.zeros((len(surfaces.faces), 5)),
            bound=np.zeros((len(surfaces.faces), 20)),
            outward=np.zeros((count, 3)),
            sharing=np.zeros(count),
            **_no_contact(0),
            face=no_one,
            weight=np.zeros((0, 4)),
            push=np.zeros((0, 4)),
            energies=np.zeros((0, 2)),
        )
        self._near_rows = self._near_local = np.zeros(0, dtype=np.int32)
        self._any_near = False  # on any rank

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

    def drop_faces(self, eroded: np.ndarray, opened: ContactSurfaces | None = None) -> None:
        """From the next search on, which is due now, nothing meets the faces of `eroded` cells (cells of the mesh,).

        `opened` are the surfaces with those faces that lie open now.
        """
        if opened is not None:
            self.surfaces, self._bodies = opened, _bodies_of(opened)
            self.near_faces = NearFaces(self._comm, opened, self._fields.mesh)
            count = len(opened.faces)
            self.state = self.state._replace(
                faces=opened.faces,
                edge=opened.edge,
                ball=np.zeros((count, 5)),
                bound=np.zeros((count, 20)),
            )
        self._whole = ~eroded[self.surfaces.cell]
        self.travel = np.inf

    def search(self) -> None:
        """Look for the faces that each node may meet; collective."""
        position = np.zeros((len(self.surfaces.node), 3))
        position[self._known_rows] = self._fields.nodes.position[self._known_local]
        self.search_from(position)

    def search_from(self, position: np.ndarray) -> None:
        """Search with this rank's surface nodes at `position` (surface nodes, 3) in m; collective."""
        self.searched_at = position
        self.searches += 1
        self.travel = 0.0
        surfaces, bodies = self.surfaces, self._bodies
        faces, boxes = self.near_faces.own, self._boxes(self.near_faces.own, position)
        within = self._inner_within_reach(faces, boxes, position)
        active = self._rows[surfaces.outside[self._rows]]
        on_surface = len(active)
        active = np.concatenate([active, within])
        if self._comm.size > 1:
            standing = self._whole[faces]
            received = self.near_faces.exchange(faces[standing], boxes[standing], position[active], position)
            faces = np.concatenate([faces, received])
            boxes = np.concatenate([boxes, self._boxes(received, position)])
            order = np.argsort(faces)
            faces, boxes = faces[order], boxes[order]
        normals, areas = np.empty_like(position), np.zeros((len(surfaces.faces), 3))
        face_vectors(position, surfaces.faces, faces, areas)
        outer = faces[(faces < surfaces.on_surface) & self._whole[faces]]
        node_normals(areas, surfaces.faces, outer, normals)
        self.surfaces.flatten(normals)
        normals[surfaces.inner] = 0.0  # they leave their wall by any side, and never meet their own round
        size = np.linalg.norm(normals, axis=1)
        self.state.outward[:] = normals / np.where(size > 0.0, size, 1.0)[:, None]
        some_boxes = boxes[:: max(len(boxes) // _SAMPLE, 1)]
        cell = float(np.median((some_boxes[:, 3:] - some_boxes[:, :3]).max(axis=1))) if len(boxes) else self._reach
        # Faces of surfaces are met by all nodes, those within casings by nodes of other rounds.
        bodies = self._bodies
        members = np.where(faces < surfaces.on_surface, -1, bodies.face_round[faces])
        reached = meet_others(boxes, members, position[active], bodies.node_round[active])
        reached = np.flatnonzero(reached & self._whole[faces])
        boxes, reached = boxes[reached], faces[reached]
        first, candidate = find_candidates(position, bodies.only(reached), areas[reached], active, normals, boxes, cell)
        candidate = reached[candidate]
        # A node's faces by their rounds: with each of them it makes a pair.
        slave = np.repeat(np.arange(len(active)), np.diff(first))
        key = slave * self._rounds + surfaces.face_round[candidate]
        order = np.argsort(key, kind="stable")
        candidate, key = candidate[order], key[order]
        begins = np.flatnonzero(np.diff(key, prepend=-1))
        slave, other = np.divmod(key[begins], self._rounds)
        self._on_surface = int(np.count_nonzero(slave < on_surface))
        met = np.zeros(len(surfaces.faces), dtype=bool)
        met[candidate] = True
        count = len(begins)
        slaves, other = active[slave], other.astype(np.int32)
        self.state = self.state._replace(
            node=slaves,
            other=other,
            first=np.append(begins, len(candidate)),
            candidate=candidate,
            near=np.flatnonzero(met).astype(np.int32),
            face=np.full(count, -1, dtype=np.int32),
            weight=np.zeros((count, 4)),
            push=np.zeros((count, 4)),
            energies=np.zeros((count, 2)),
            **self._kept(slaves, other),
        )
        near = np.zeros(len(surfaces.node), dtype=bool)
        near[slaves] = True
        near[surfaces.faces[met]] = True
        self._halo.need(np.flatnonzero(near))
        near[self._halo.asked] = True
        own = np.flatnonzero(near[self._rows])
        self._near_rows, self._near_local = self._rows[own], self._local[own]
        self._any_near = bool(len(own))
        if self._comm.size > 1:
            self._any_near = self._comm.allreduce(self._any_near, op=MPI.LOR)
        self.state.sharing[~near] = 0.0

    def arrays(self) -> dict[str, np.ndarray]:
        """What a checkpoint keeps: the last search, and the pairs that touch."""
        touching = np.flatnonzero(self.state.touching)
        kept = {name: getattr(self.state, name)[touching] for name in ("node", "other", *_no_contact(0))}
        return kept | {name: np.asarray(getattr(self, name)) for name in _SEARCH}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `arrays` gave; collective."""
        at, travel, searches = (arrays[name] for name in _SEARCH)
        if len(at):
            self.state = self.state._replace(**{name: arrays[name] for name in ("node", "other", *_no_contact(0))})
            self.search_from(at)
            self.travel = float(travel)
        self.searches = int(searches)

    def _boxes(self, faces: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Boxes (k, 6) m of some `faces` (k,), widened by what the search looks ahead; `position` (nodes, 3) m."""
        surfaces, boxes = self.surfaces, np.empty((len(faces), 6))
        face_boxes(position, surfaces.faces[faces], self._reach + _MARGIN * surfaces.edge[faces], boxes)
        return boxes

    def _inner_within_reach(self, faces: np.ndarray, boxes: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Own inner nodes that lie in the box around another round's faces; collective.

        `boxes` (k, 6) m are those of this rank's `faces` (k,).
        """
        nothing = np.zeros(0, dtype=np.int32)
        if not self.surfaces.inner.any():
            return nothing
        outer = faces < self.surfaces.on_surface
        around = around_rounds(self._bodies.face_round[faces[outer]], boxes[outer], self._rounds)
        if self._comm.size > 1:
            around[:, 3:] *= -1.0
            self._comm.Allreduce(MPI.IN_PLACE, around, op=MPI.MIN)
            around[:, 3:] *= -1.0
        within = [
            nodes[are_inside(position[nodes], np.delete(around, index, axis=0))] for index, nodes in self._inner.items()
        ]
        return np.concatenate([nothing, *within])

    def _kept(self, node: np.ndarray, other: np.ndarray) -> dict[str, np.ndarray]:
        """The state of contact of pairs (k,), from what it was before the search; of new ones, none."""
        kept, state = _no_contact(len(node)), self.state
        rows = np.flatnonzero(state.touching)
        before = state.node[rows].astype(np.int64) * self._rounds + state.other[rows]
        now = node.astype(np.int64) * self._rounds + other
        order = np.argsort(now)
        place = np.searchsorted(now, before, sorter=order)
        found = np.flatnonzero(now[order[np.minimum(place, len(now) - 1)]] == before) if len(now) else rows[:0]
        for name, values in kept.items():
            values[order[place[found]]] = getattr(state, name)[rows[found]]
        return kept

    def bring(self, velocity: np.ndarray) -> tuple[list[Fetched], list[Given]]:
        """What ranks exchange before the forces: positions, velocities and loads of the near nodes."""
        if not self._any_near:
            return [], []
        rows, local = self._near_rows, self._near_local
        copy_motion(self._fields.nodes.position, velocity, local, rows, self._position, self._velocity)
        return [(self._halo, (self._position, self._velocity, self.state.sharing[:, None]))], []

    def find_forces(self, max_squared_frequency: float, step: float) -> list[Given]:
        """Find the contact forces, from what `bring` has brought.

        `max_squared_frequency` bounds the springs over the nodes' masses (1/s2); `step` is the step (s) that led here.
        Returned is what ranks exchange before `take_reactions`.
        """
        if not self._any_near:
            return []
        law = CollisionLaw(max_squared_frequency, step, self._friction)
        find_contacts(law, self.state, self._position, self._velocity, self._mass)
        clear_rows(self._sums, self._near_rows)
        clear_rows(self._sums, self._halo.needed)
        rounding = CONTACT_FORCES * self._fields.nodes.rounding
        add_reactions(self.state, self._mass, rounding, self._load_rounding, self._sums)
        return [(self._halo, self._sums)]

    def take_reactions(self, force: np.ndarray) -> None:
        """Add the contact forces on this rank's own nodes to `force` (nodes, 3) in N."""
        if self._any_near:
            take_reactions(self._sums, self._near_rows, self._near_local, self.state.sharing, force)

    @property
    def energies(self) -> np.ndarray:
        """Spring energy now and friction in the last step (J), exact, on this rank's nodes."""
        total: np.ndarray = quantise(self.state.energies, self._fields.grid.rounding).sum(axis=0)
        return total

    def touching_rounds(self) -> np.ndarray:
        """Which rounds' surfaces touch each other now (rounds, rounds); collective."""
        state, touching = self.state, np.zeros((self._rounds, self._rounds), dtype=bool)
        rows = np.flatnonzero(state.touching)
        touching[state.node_round[state.node[rows]], state.other[rows]] = True
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, touching, op=MPI.LOR)
        return touching

    @property
    def pushed(self) -> np.ndarray:
        """Nodes of this rank that may be given a force till the next search (k,) int32."""
        return self._near_local

    @property
    def deepest(self) -> float:
        """Largest penetration now (m), of this rank's nodes."""
        return float(self.state.penetration.max(initial=0.0))

    @property
    def deepest_interior(self) -> float:
        """Largest penetration now (m), of this rank's inner nodes of casings."""
        return float(self.state.penetration[self._on_surface :].max(initial=0.0))


def _no_contact(pairs: int) -> dict[str, np.ndarray]:
    """What the state holds of each pair, where nothing touches."""
    return {
        "touching": np.zeros(pairs, dtype=bool),
        "normal": np.zeros((pairs, 3)),
        "slip": np.zeros((pairs, 3)),
        "penetration": np.zeros(pairs),
        "unloaded": np.zeros(pairs),
        "stiffness": np.zeros(pairs),
    }


def _bodies_of(surfaces: ContactSurfaces) -> Bodies:
    """What the search has to know of the surfaces."""
    within = np.arange(len(surfaces.faces)) >= surfaces.on_surface
    return Bodies(surfaces.faces, surfaces.face_round, surfaces.node_round, within)
