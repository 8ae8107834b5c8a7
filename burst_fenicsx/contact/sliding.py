"""Contact of charge and casing in three dimensions: the charge's nodes on the casing's faces, on all ranks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact.charge_contacts import ChargeContacts, slide_law
from burst_fenicsx.contact.exchange import CONTACT_FORCES, Fetched, Given, Halo
from burst_fenicsx.contact.slide_surface import faces_of, interface_faces, make_contacts, smooth_surface, widened
from burst_fenicsx.kernels.cells.layout import CHARGE_PARAMETERS
from burst_fenicsx.kernels.contact.sliding import NodeMotion, add_slide_forces, attached_state, find_slide_forces
from burst_fenicsx.kernels.contact.springs import take_reactions
from burst_fenicsx.kernels.geometry.smooth_faces import face_vectors, group_vectors
from burst_fenicsx.kernels.vectors.exact import rounding_constant
from burst_fenicsx.kernels.vectors.rows import clear_rows, copy_motion, hold_rows
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.kernels.contact.sliding import SlideContacts
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import ContactSettings

__all__ = ["SlidingInterface"]

_RINGS = 4  # faces around those in contact that a rank keeps up to date ...
_MARGIN = 2  # ... until a contact has come this close to others
_LARGEST_PRESSURE = 2.0**40  # Pa; bounds how finely sums over the cells of a node are rounded
_MOST_CELLS = 2.0**6


class SlidingInterface(ChargeContacts):
    """Contact between the charges and what encloses them.

    The rank that owns a charge's node computes its contacts. It follows them over the casing's faces, of which it
    keeps those near by up to date, and gives the reactions to the ranks that own the faces' nodes.

    Parameters
    ----------
    mesh : the whole mesh, its charges split from their casings.
    fields : this rank's fields.
    settings : strength and friction of unreacted explosive on the casing.

    Attributes
    ----------
    numbers : in the whole mesh, of all nodes that may get a force.
    surface : of the kernels.
    """

    contacts: SlideContacts

    def __init__(self, mesh: HexahedralMesh, fields: BurstFields, settings: ContactSettings) -> None:
        self.settings = settings
        self._comm = comm = fields.mesh.comm
        pairs, owned = len(mesh.interface_pairs), fields.mesh.owned_nodes
        faces, cell, covered = interface_faces(mesh)
        # Rows: the pairs of coincident nodes, then the casing's other nodes on which the charge may come to lie.
        solid_nodes = np.concatenate([mesh.interface_pairs[:, 1], np.setdiff1d(faces, mesh.interface_pairs[:, 1])])
        self._rows = rows = len(solid_nodes)
        row = np.full(len(mesh.nodes), -1, dtype=np.int32)
        row[solid_nodes] = np.arange(rows, dtype=np.int32)
        faces = row[faces]
        self.surface, group_row = smooth_surface(mesh.nodes[solid_nodes], faces)

        solid = fields.mesh.local_node(solid_nodes)
        # The charge's node at each row: the twin, or the node itself at the rim of a fuze, where it belongs to both.
        charge = np.where(np.isin(solid_nodes, mesh.cells[mesh.part == Part.CHARGE]), solid, -1).astype(np.int32)
        charge[:pairs] = fields.mesh.local_node(mesh.interface_pairs[:, 0])
        self.numbers = np.concatenate([mesh.interface_pairs[:, 0], solid_nodes])
        self._master_rows, self._masters = _own(solid, owned)
        slave_rows, _ = _own(charge[:pairs], owned)
        own = np.zeros(rows, dtype=bool)
        own[slave_rows] = True
        slave = np.where(own[group_row], charge[group_row], -1).astype(np.int32)
        # In the order of the contacts' own arrays, of which there are many; nodes are fetched ahead.
        mine = np.flatnonzero(slave >= 0).astype(np.int32)
        held = np.zeros(0, dtype=np.uint8) if mesh.held is None else mesh.held[solid_nodes[group_row]]
        self._in_planes = [(np.flatnonzero(held >> bit & 1), np.array(normal)) for bit, normal in mesh.held_normals]
        of_round = np.zeros(len(mesh.nodes), dtype=np.int32)
        of_round[mesh.cells] = mesh.round[:, None]
        material = len(Part) * of_round[solid_nodes[group_row]] + Part.CHARGE
        strength = fields.charge.parameters[material, CHARGE_PARAMETERS.index("unreacted_strength")]
        self._charge_faces = charge[faces].astype(np.int32)
        beside = np.zeros(len(faces), dtype=bool)
        beside[faces_of(self.surface, mine)] = True
        self._beside = np.flatnonzero(beside[:covered]).astype(np.int32)
        if (self._charge_faces[self._beside] < 0).any():
            raise RuntimeError("a rank lacks a charge's face beside one of its nodes")
        self._charge_vectors = np.zeros((len(faces), 3))
        self._vectors = np.zeros((len(faces), 3))

        row[:] = -1
        row[mesh.interface_pairs[:, 0]] = np.arange(pairs, dtype=np.int32)
        around, cell_rows = _attached(fields, row)
        self._cells, members = np.unique(around, return_inverse=True)
        self._around = members.astype(np.int32)
        self._cell_rows, first = np.unique(cell_rows, return_index=True)
        self._first_cell = np.append(first, len(cell_rows)).astype(np.int32)
        in_charge = row[mesh.cells[mesh.part == Part.CHARGE]]
        cells = np.bincount(in_charge[in_charge >= 0], minlength=rows)[group_row]
        self.contacts = make_contacts(self.surface, group_row, slave, mine, strength, cells.astype(float), rows)
        self._attached = np.zeros((rows, 3))
        self._attached_rounding = rounding_constant(_MOST_CELLS), rounding_constant(_LARGEST_PRESSURE)
        self._load_rounding = rounding_constant(_MOST_CELLS)
        self._slave_halo = Halo(comm, slave_rows, rows)
        self._slave_halo.need(self._cell_rows)
        self._master_halo = Halo(comm, self._master_rows, rows)

        self._casing = NodeMotion(np.zeros((rows, 3)), np.zeros((rows, 3)), np.zeros(rows))
        self._casing.mass[self._master_rows] = fields.mass[self._masters]
        if comm.size > 1:
            comm.Allreduce(MPI.IN_PLACE, self._casing.mass)
        self._sums = np.zeros((rows, 4))
        self._near_faces = np.arange(len(faces), dtype=np.int32)
        self._near_groups = np.arange(len(group_row), dtype=np.int32)
        self._border = np.zeros(len(faces), dtype=bool)
        local = fields.mesh.local_node(self.numbers)
        super().__init__(fields, np.unique(local[local >= 0]).astype(np.int32), mine, cell)
        self.look_around()

    def look_around(self) -> None:
        """Choose the faces that this rank keeps up to date; collective."""
        if self._comm.size == 1:
            return
        surface = self.surface
        near = np.zeros(len(surface.faces), dtype=bool)
        near[self.contacts.face[self.contacts.contact]] = True
        inner = near
        for ring in range(_RINGS):
            near = widened(surface.faces, near, self._rows)
            if ring == _RINGS - _MARGIN - 1:
                inner = near
        surface.known[:] = near
        self._border = near & ~inner
        groups = np.unique(surface.corner[near])
        around = np.zeros(len(near), dtype=bool)
        around[faces_of(surface, groups)] = True
        self._near_faces = np.flatnonzero(around).astype(np.int32)
        self._near_groups = groups.astype(np.int32)
        self._master_halo.need(np.unique(surface.faces[around]).astype(np.int32))

    @property
    def comes_to_border(self) -> bool:
        """Whether a contact has come close to faces that are not kept up to date: ranks then look around."""
        contacts = self.contacts
        return self._comm.size > 1 and bool(self._border[contacts.face[contacts.contact]].any())

    def bring(self, velocity: np.ndarray) -> tuple[list[Fetched], list[Given]]:
        """What ranks exchange before the forces: the casing's motion and load, sums over the charge's cells."""
        casing = self._casing
        copy_motion(
            self._fields.nodes.position, velocity, self._masters, self._master_rows, casing.position, casing.velocity
        )
        self._sum_charge_state()
        fetched = self._master_halo, (casing.position, casing.velocity, self.contacts.load[:, None])
        return [fetched], [(self._slave_halo, self._attached)]

    def find_forces(
        self, max_squared_frequency: float, step: float, velocity: np.ndarray, force: np.ndarray
    ) -> list[Given]:
        """Add the forces on this rank's own nodes of the charge to `force` (nodes, 3) in N.

        `max_squared_frequency` bounds that of the springs (1/s2); `step` is the step (s) that led here and `velocity`
        (nodes, 3) the mean one over it (m/s). Returned is what ranks exchange before `take_reactions`.
        """
        fields, surface, contacts, rows = self._fields, self.surface, self.contacts, self._master_rows
        nodes = fields.nodes
        face_vectors(self._casing.position, surface.faces, self._near_faces, self._vectors)
        group_vectors(surface.first_face, surface.face, self._near_groups, self._vectors, surface.vector)
        self._add_images(surface.vector, 2.0)
        face_vectors(nodes.position, self._charge_faces, self._beside, self._charge_vectors)
        group_vectors(surface.first_face, surface.face, contacts.contact, self._charge_vectors, contacts.area)
        self._add_images(contacts.area, 1.0)
        law = slide_law(self.settings, max_squared_frequency, step)
        charge = NodeMotion(nodes.position, velocity, fields.mass)
        find_slide_forces(law, surface, contacts, self._attached, self._casing, charge)
        clear_rows(self._sums, rows)
        clear_rows(self._sums, self._master_halo.needed)
        rounding = CONTACT_FORCES * nodes.rounding
        add_slide_forces(surface, contacts, rounding, self._load_rounding, self._sums, force)
        return [(self._master_halo, self._sums)]

    def take_reactions(self, force: np.ndarray) -> None:
        """Add the reactions on this rank's own nodes of the casing to `force` (nodes, 3) in N."""
        take_reactions(self._sums, self._master_rows, self._masters, self.contacts.load, force)

    def _add_images(self, vectors: np.ndarray, sides: float) -> None:
        """Complete sums of area vectors (groups, 3) over the faces of one side of planes in which their nodes lie.

        With the image's faces the sum lies in the plane, and is twice as long where both sides count: that is the
        surface's normal (`sides` 2). What presses on a node of half the mass is one side (`sides` 1).
        """
        for groups, normal in self._in_planes:
            hold_rows(vectors, normal.reshape(1, 3), np.array([0, len(groups)]), groups)
            if sides != 1.0:
                vectors[groups] *= sides

    def _sum_charge_state(self) -> None:
        """What the charge's cells around each contact's node are and how they press, of this rank, see the kernel."""
        total, fields = self._attached, self._fields
        total[:] = 0.0
        attached_state(
            self._first_cell, self._around, self._cells, self._cell_rows, fields.charge, fields.solid.eroded,
            fields.blocks.slot_of_cell, self._attached_rounding, total,
        )  # fmt: skip


def _own(local: np.ndarray, owned: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the nodes that this rank owns, and these nodes."""
    rows = np.flatnonzero((local >= 0) & (local < owned)).astype(np.int32)
    return rows, local[rows].astype(np.int32)


def _attached(fields: BurstFields, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Charge cells of this rank at the interface, and a row of their nodes there: one entry for each such node.

    In the order of the rows.
    """
    mesh = fields.mesh
    cells = np.flatnonzero(mesh.part == Part.CHARGE)
    rows = row[mesh.node[mesh.dofmap[cells]]]
    which, corner = np.nonzero(rows >= 0)
    found = rows[which, corner]
    order = np.argsort(found, kind="stable")
    return cells[which[order]].astype(np.int32), found[order].astype(np.int32)
