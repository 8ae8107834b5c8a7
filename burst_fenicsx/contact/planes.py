"""Rigid planes: ground, deck, barricade, and the planes of symmetry behind which mirrored rounds stand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.contact.nodes import ContactPairs
from burst_fenicsx.kernels.contact.law import Law
from burst_fenicsx.kernels.contact.pairs import near_plane, no_pairs, press_on_plane
from burst_fenicsx.kernels.vectors.exact import quantum, rounding_constant
from burst_fenicsx.kernels.vectors.rows import largest_speed
from burst_fenicsx.meshing.mesh import outer_faces
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.contact.nodes import ContactNodes
    from burst_fenicsx.contact.surfaces import ContactSurfaces
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import Mirror, RigidPlane

_IN_PLANE = 1e-9  # m
_LARGEST_FORCE = 2.0**57  # of a plane on a node, in quanta of the nodal forces: 64 times the largest force of a cell
# No node is taken to be faster than this (m/s), nor than twice the fastest that was seen when one last looked which
# nodes are near: products that expand freely reach the detonation velocity.
_FASTEST = 1e4
_GROWTH = 2.0


def nodes_at_planes(mesh: HexahedralMesh, surfaces: ContactSurfaces) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the whole mesh that no plane lets pass: all of the casings, and the surfaces of the charges.

    Interior nodes of a casing overtake its surface where the outer cells fold. Within a charge, the surface holds the
    gas back.

    Returns
    -------
    Nodes (k,) int64, ascending, and whether each lies on no surface (k,).
    """
    meets, on_face = np.zeros(len(mesh.nodes), dtype=bool), np.zeros(len(mesh.nodes), dtype=bool)
    on_face[surfaces.node[~surfaces.interior]] = True
    charges, _, _ = outer_faces(mesh, np.where(mesh.part == Part.CHARGE, mesh.round, -1))
    on_face[charges] = True
    meets[mesh.cells[mesh.part != Part.CHARGE]] = True
    meets |= on_face
    nodes = np.flatnonzero(meets)
    return nodes, ~on_face[nodes]


def held_in_plane(mesh: HexahedralMesh, nodes: np.ndarray, plane: RigidPlane | Mirror) -> np.ndarray:
    """Whether each of the nodes (k,) of a cut round is held in the plane for good, and so never meets it.

    One that is held in another plane and stands on this one, such as a deck, is not.
    """
    lies = np.zeros(len(nodes), dtype=bool)
    if mesh.held is None:
        return lies
    normal = np.asarray(plane.normal) / np.linalg.norm(plane.normal)
    height = (mesh.nodes[nodes] - np.asarray(plane.point)) @ normal
    for bit, direction in mesh.held_normals:
        if np.linalg.norm(np.cross(direction, normal)) < _IN_PLANE:
            lies |= (mesh.held[nodes] >> bit & 1).astype(bool)
    return lies & (np.abs(height) < _IN_PLANE)


class PlaneContact(ContactPairs):
    """One rigid plane, a facet without mass, against the given nodes of this rank.

    Parameters
    ----------
    plane : the plane.
    fields : this rank's fields.
    nodes : contact's rows.
    row : (k,) own ones that may meet it.
    on_surface : how many of them, the first, lie on a surface; the others are interior ones.
    reach : distance (m) from the plane within which nodes are looked after; beyond, none can meet it before one looks
        again.

    Attributes
    ----------
    near : (k,) int32, pairs that are looked after.
    given : (3,) N, force that the plane gives now to this rank's nodes, an exact sum.
    """

    def __init__(
        self,
        plane: RigidPlane | Mirror,
        fields: BurstFields,
        nodes: ContactNodes,
        row: np.ndarray,
        on_surface: int,
        reach: float,
    ) -> None:
        super().__init__(fields, nodes, no_pairs(row, 0), np.zeros((1, 0), dtype=np.int32))
        self.on_surface, self._reach = on_surface, reach
        self._local = nodes.rows.local[row]
        nodes_of_all = int(fields.mesh.domain.geometry.index_map().size_global)
        self._rounding = rounding_constant(0.25 * nodes_of_all * _LARGEST_FORCE * quantum(fields.nodes.rounding))
        normal = np.asarray(plane.normal, dtype=float)
        self._normal = normal / np.linalg.norm(normal)
        self._level = float(self._normal @ np.asarray(plane.point, dtype=float))
        self._friction = math.tan(math.radians(plane.friction_angle))
        self.near = np.zeros(0, dtype=np.int32)
        self._fastest, self._travel, self.given = 0.0, np.inf, np.zeros(3)

    def look_is_due(self, step: float) -> bool:
        """Whether others may have met the plane in this step (s); the same on every rank."""
        self._travel += step * self._fastest
        return self._travel > self._reach

    @property
    def fastest(self) -> float:
        """Largest speed (m/s) of this rank's own nodes that may meet it."""
        return float(largest_speed(self._fields.nodes.velocity, self._local))

    def look(self, fastest: float) -> None:
        """Find the near nodes again; `fastest` is the largest speed (m/s) on any rank."""
        position, lowest = self._fields.nodes.position, self._level + self._reach
        self.near = near_plane(self._normal, lowest, self._local, position, self.pairs)
        self.watched = self.pairs.node[self.near]
        self._fastest, self._travel = max(_FASTEST, _GROWTH * fastest), 0.0

    def add_forces(self, max_squared_frequency: float, step: float) -> None:
        """Add the forces of springs with at most that squared frequency (1/s2) after a step (s) to the rows."""
        law = Law(max_squared_frequency, step, self._friction)
        roundings = self._nodes.roundings[0], self._rounding, self._nodes.roundings[2]
        self.friction, given, self.deepest, self.deepest_inner = press_on_plane(
            law, self._normal, self._level, self.near, self.on_surface, roundings, self.pairs, self.facets,
            self._nodes.rows,
        )  # fmt: skip
        self.given = np.array(given)
