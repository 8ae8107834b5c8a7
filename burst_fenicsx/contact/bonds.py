"""Face-face contact of charge and casing: the split faces, their springs, and what they book (Eqs. 12-15)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.bonds import BondLaw, Bonds, face_vectors, group_faces, join_twins
from burst_fenicsx.meshing.faces import outer_faces
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import Contact

__all__ = ["BondedFaces", "interface_faces"]

_SMOOTH = np.cos(np.radians(45.0))  # faces around a node whose normals differ by less act as one surface
_RELEASE = 0.5  # a broken pair that has slid by half an edge is left to the contact of colliding surfaces


def interface_faces(mesh: HexahedralMesh) -> np.ndarray:
    """Faces at which charge and casing or fuze were parted: the casing's nodes (faces, 4), outward from the casing."""
    faces, _, behind = outer_faces(mesh, np.where(mesh.part == Part.CHARGE, -1, 0))
    return faces[behind >= 0]


class BondedFaces:
    """The springs between charge and casing on one rank.

    Every rank computes the pairs of which it owns a node, so that no force needs to be sent.

    Parameters
    ----------
    mesh : the whole mesh, its charges parted.
    state : this rank's fields.
    settings : strength and friction of the bond.
    release : whether pairs that slide far are released to the contact of colliding surfaces.

    Attributes
    ----------
    bonds : the kernels' arrays.
    node_pairs : (pairs,) int64, row of the pair in `mesh.twins`.
    counted : (pairs,) 1.0 for the pairs that this rank counts in sums over ranks, 0.0 for the others.
    """

    def __init__(self, mesh: HexahedralMesh, state: BurstFields, settings: Contact, *, release: bool) -> None:
        self.settings = settings
        self._release = _RELEASE if release else np.inf
        local = state.mesh.local_node(np.arange(len(mesh.nodes)))
        owned = state.mesh.owned_nodes
        faces = interface_faces(mesh)
        charge, solid = local[mesh.twins[:, 0]], local[mesh.twins[:, 1]]
        mine = ((charge >= 0) & (charge < owned)) | ((solid >= 0) & (solid < owned))
        pairs = np.flatnonzero(mine)
        # In the order of the nodes, so that pairs that follow each other find theirs in cache.
        self.node_pairs = pairs[np.argsort(charge[pairs], kind="stable")]
        twins = mesh.twins[self.node_pairs, 1]
        charge, solid = charge[self.node_pairs], solid[self.node_pairs]
        self.counted = (charge < owned).astype(float)
        wanted = np.zeros(len(mesh.nodes), dtype=bool)
        wanted[twins] = True
        faces = faces[wanted[faces].any(axis=1)]
        first, first_face, face = _springs(mesh.nodes, faces, twins)
        self.faces = local[faces].astype(np.int32)
        if (self.faces < 0).any() or (charge < 0).any() or (solid < 0).any():
            raise RuntimeError("a rank lacks a side of a split face")
        springs = len(first_face) - 1
        masses = state.mass[charge], state.mass[solid]
        self.bonds = Bonds(
            charge=charge.astype(np.int32),
            solid=solid.astype(np.int32),
            reduced=masses[0] * masses[1] / (masses[0] + masses[1]),
            first=first,
            first_face=first_face,
            face=face,
            normal=np.zeros((springs, 4)),
            bonded=np.ones(springs, dtype=np.int8),
            slip=np.zeros((springs, 3)),
            gap=np.zeros(springs),
            held=np.zeros(springs),
            released=np.zeros(len(charge), dtype=np.int8),
            booked=np.zeros((len(charge), 4)),
        )
        self._vectors = np.zeros((len(self.faces), 3))
        self._state = state

    def add_forces(self, stiffness: float, step: float, velocity: np.ndarray, force: np.ndarray) -> None:
        """Add the forces on this rank's nodes to `force` (nodes, 3) in N.

        `stiffness` is a pair's over its reduced mass (1/s2), `step` the step (s) that led here, and `velocity`
        (nodes, 3) the mean one over it (m/s).
        """
        nodes = self._state.nodes
        settings = self.settings
        law = BondLaw(
            stiffness,
            step,
            settings.tensile_strength,
            settings.cohesion,
            float(np.tan(np.radians(settings.friction_angle))),
            self._release,
        )
        face_vectors(nodes.position, self.faces, self._vectors)
        join_twins(law, self.bonds, self._vectors, nodes.position, velocity, force)

    def release(self) -> tuple[np.ndarray, np.ndarray]:
        """Leave the pairs that have slid far to the colliding surfaces.

        Returns their rows in the whole mesh's twins, and how deep (m) each pressed in the last step.
        """
        released = self.bonds.released
        now = np.flatnonzero(released == 1)
        released[now] = 2
        return self.node_pairs[now], self.bonds.booked[now, 3]

    @property
    def booked(self) -> np.ndarray:
        """Spring energy now, friction and work of the stiffness in the last step (J), on the pairs counted here."""
        total: np.ndarray = self.counted @ self.bonds.booked[:, :3]
        return total

    @property
    def deepest(self) -> float:
        """Largest penetration in the last step (m) on this rank."""
        return float(self.bonds.booked[:, 3].max(initial=0.0))

    def counts(self) -> np.ndarray:
        """Pairs wholly bonded, broken and released, of those counted here."""
        bonds = self.bonds
        springs = np.add.reduceat(bonds.bonded, bonds.first[:-1]) if len(bonds.charge) else np.zeros(0)
        whole = springs == np.diff(bonds.first)
        gone = bonds.released == 2
        counts: np.ndarray = np.stack([whole & ~gone, ~whole & ~gone, gone]) @ self.counted
        return counts


def _springs(nodes: np.ndarray, faces: np.ndarray, solid: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Springs of the pairs of nodes `solid`, grouped from their faces: see `group_faces`."""
    corner = nodes[faces]
    normal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    row = np.full(len(nodes), -1, dtype=np.int32)
    row[solid] = np.arange(len(solid), dtype=np.int32)
    first, first_face, face = group_faces(faces, normal, row, len(solid), _SMOOTH)
    return first, first_face, face
