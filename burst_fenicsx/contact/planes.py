"""Rigid planes: ground, deck, barricade, and the planes of symmetry behind which mirrored rounds stand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.contact.planes import PlaneLaw, PlaneState, nodes_near, plane_sums, push_from_plane
from burst_fenicsx.kernels.vectors.exact import quantum, rounding_constant
from burst_fenicsx.kernels.vectors.rows import largest_speed
from burst_fenicsx.meshing.mesh import outer_faces
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.contact.surfaces import ContactSurfaces
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import Mirror, RigidPlane

__all__ = ["PlaneContact", "held_in_plane", "nodes_at_planes"]

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


class PlaneContact:
    """One rigid plane against the given nodes of this rank.

    Parameters
    ----------
    plane : the plane.
    fields : this rank's fields.
    nodes : local nodes of this rank's own that may meet it.
    on_surface : how many of them, the first, lie on a surface; the others are interior ones.
    reach : distance (m) from the plane within which nodes are looked after; beyond, none can meet it before one looks
        again.

    Attributes
    ----------
    near : (k,) int32, the nodes of the state that are looked after. pushed : (k,) int32, their local numbers.
    given : (3,) N, force that the plane gives now to this rank's nodes, an exact sum.
    energies : (2,) J, spring energy now and friction in the last step, exact, on this rank's nodes.
    deepest, deepest_interior : largest penetration now (m), of this rank's nodes and of the interior ones.
    """

    def __init__(
        self,
        plane: RigidPlane | Mirror,
        fields: BurstFields,
        nodes: np.ndarray,
        on_surface: int,
        reach: float,
    ) -> None:
        self._on_surface = on_surface
        self._fields = fields
        nodes_of_all = int(fields.mesh.domain.geometry.index_map().size_global)
        self._rounding = rounding_constant(0.25 * nodes_of_all * _LARGEST_FORCE * quantum(fields.nodes.rounding))
        self._reach = reach
        normal = np.asarray(plane.normal, dtype=float)
        self._normal = normal / np.linalg.norm(normal)
        self._level = float(self._normal @ np.asarray(plane.point, dtype=float))
        self._friction = math.tan(math.radians(plane.friction_angle))
        count = len(nodes)
        self.state: PlaneState = PlaneState(
            node=np.asarray(nodes, dtype=np.int32),
            slip=np.zeros((count, 3)),
            penetration=np.zeros(count),
            stiffness=np.zeros(count),
            energies=np.zeros((count, 2)),
        )
        self.look_again()

    def look_again(self) -> None:
        """Have the near nodes found again at the next step."""
        self.near = self.pushed = np.zeros(0, dtype=np.int32)
        self._fastest, self._travel = 0.0, np.inf
        self.given, self.energies = np.zeros(3), np.zeros(2)
        self.deepest = self.deepest_interior = 0.0

    def _find_near(self, step: float) -> None:
        """Find the near nodes again where others may have met the plane in this step (s)."""
        self._travel += step * self._fastest
        if self._travel <= self._reach:
            return
        nodes, node = self._fields.nodes, self.state.node
        self.near = nodes_near(self._normal, self._level + self._reach, self.state, nodes.position)
        self.pushed = node[self.near]
        self._fastest, self._travel = max(_FASTEST, _GROWTH * largest_speed(nodes.velocity, node)), 0.0

    def add_forces(self, max_squared_frequency: float, step: float, velocity: np.ndarray, force: np.ndarray) -> None:
        """Add the plane's forces to `force` (nodes, 3) in N.

        `max_squared_frequency` is its stiffness over a node's mass (1/s2), `step` the step (s) that led here,
        and `velocity` (nodes, 3) the mean one over it (m/s).
        """
        self._find_near(step)
        law = PlaneLaw(self._normal, self._level, max_squared_frequency, step, self._friction)
        state, fields = self.state, self._fields
        push_from_plane(law, self.near, state, fields.mass, fields.nodes.position, velocity, force)
        self.energies, self.given, self.deepest, self.deepest_interior = plane_sums(
            self._normal, self._on_surface, self.near, state, fields.grid.rounding, self._rounding
        )
