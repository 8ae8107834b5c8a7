"""All contact of a burst: bonds, colliding surfaces and planes, their forces and their energies (F^c of Eq. 2)."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact.collisions import CollidingSurfaces
from burst_fenicsx.contact.nodes import ContactNodes, ContactPairs
from burst_fenicsx.contact.planes import PlaneContact, held_in_plane, nodes_at_planes
from burst_fenicsx.contact.sliding import SlidingInterface, interface_faces
from burst_fenicsx.contact.surfaces import OpenFaces, contact_surfaces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.contact.charge_contacts import ChargeContacts
    from burst_fenicsx.kernels.axisymmetric.slide_line import LineContact
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import BurstSettings, TimeStep

_SAFETY = 0.9  # fraction taken of the stability that the cells leave to contact
_FIXED_STEP_CFL = 0.9  # a fixed step is taken to be this fraction of the stable one
_PLANE_FRACTION = 0.4  # of the squared frequency, where planes are; the rest is the surfaces'
_REACH = 1.0  # of the cell size: how far surfaces may approach between two searches
_PLANE_REACH = 2.0  # of the cell size: distance from a plane within which nodes are looked after


@dataclass
class Penetrations:
    """Largest penetrations so far (m), on this rank."""

    interface_at_front: float = 0.0
    interface_after: float = 0.0
    collision: float = 0.0
    plane: float = 0.0
    interior_collision: float = 0.0  # of interior nodes of a casing behind another round's faces
    interior_plane: float = 0.0

    def at_interface(self, depth: float, *, front_is_active: bool) -> None:
        """Note a depth (m) of the charge in its casing, while a front runs or after it."""
        name = "interface_at_front" if front_is_active else "interface_after"
        setattr(self, name, max(getattr(self, name), depth))

    def over(self, comm: MPI.Comm) -> Penetrations:
        """The largest over all ranks."""
        own = astuple(self)
        return Penetrations(*(comm.allreduce(value, op=MPI.MAX) for value in own)) if comm.size > 1 else self

    @property
    def largest(self) -> float:
        """The largest of all."""
        return max(self.interface_at_front, self.interface_after, self.collision, self.plane)


def max_squared_phase(step: TimeStep) -> float:
    """Bound on (omega dt)^2 that the cells' steps leave to the springs of contact.

    With the cells at a fraction c of their stable step, their frequencies satisfy (omega dt)^2 <= 4 c^2; those of cells
    and springs add up to no more than their sum, so springs may have (omega dt)^2 up to 4 (1 - c^2) without shortening
    the step.
    """
    fraction = step.cfl if step.fixed is None else _FIXED_STEP_CFL
    return _SAFETY * 4.0 * (1.0 - fraction**2)


class ContactForces:
    """Contact forces of a burst on one rank: pairs of a node and a facet of several kinds, summed over one set of rows.

    Parameters
    ----------
    fields : this rank's fields.
    time_step : from which the stiffness of every spring is taken, see `max_squared_phase`.
    cells : number of cells of the whole mesh.
    nodes : the rows; none where nothing may touch.
    interface, collisions, planes : the kinds. open_faces : of several rounds, see `OpenFaces`.

    Attributes
    ----------
    touched : (nodes,) bool, whether contact may give a force to the node.
    friction, work : J so far, on this rank: heat of friction, and work of all contact forces on the nodes, action and
        reaction, from these forces and the nodes' own motion.
    plane_force, impulse : (3,) N and N s, of the planes on the nodes of all ranks: now, and so far.
    penetrations : the largest so far.
    eroded : (cells of the whole mesh,) bool, eroded cells of casings, whose faces nothing meets any more.
    """

    def __init__(
        self,
        fields: BurstFields,
        time_step: TimeStep,
        cells: int,
        nodes: ContactNodes,
        *,
        interface: ChargeContacts | None = None,
        collisions: CollidingSurfaces | None = None,
        planes: Sequence[PlaneContact] = (),
        open_faces: OpenFaces | None = None,
    ) -> None:
        self._max_squared_phase = max_squared_phase(time_step)
        self._fields = fields
        self.comm = fields.mesh.comm
        self.nodes = nodes
        local = nodes.rows.local
        self.touched = np.zeros(len(fields.mass), dtype=bool)
        self.touched[local[local >= 0]] = True
        self.interface, self.collisions, self.planes = interface, collisions, list(planes)
        self._sliding = interface if isinstance(interface, SlidingInterface) else None
        self._open_faces = open_faces
        self.friction = 0.0
        self.work = 0.0
        self.plane_force, self.impulse = np.zeros(3), np.zeros(3)
        self.penetrations = Penetrations()
        self.eroded = np.zeros(cells, dtype=bool)
        self._fraction = 1.0  # contact's step over the longest one
        self._watch()

    @classmethod
    def of_mesh(cls, mesh: HexahedralMesh, fields: BurstFields, settings: BurstSettings) -> ContactForces:
        """All kinds that a burst in three dimensions has; `mesh` is the whole mesh."""
        contact, size = settings.contact, settings.cell_size
        surfaces = contact_surfaces(mesh) if contact.surfaces or settings.planes else None
        touched = [np.zeros(0, dtype=np.int64)]
        if surfaces is not None:
            touched.append(surfaces.node)
            at_planes, interior = nodes_at_planes(mesh, surfaces)
            touched += [at_planes] if settings.planes else []
        if len(mesh.interface_pairs):
            touched += [mesh.interface_pairs.ravel(), interface_faces(mesh)[0].ravel()]
        nodes = ContactNodes(fields, np.unique(np.concatenate(touched)))
        interface, collisions, open_faces = None, None, None
        if len(mesh.interface_pairs):
            interface = SlidingInterface(mesh, fields, nodes, contact)
        if contact.surfaces and surfaces is not None:
            collisions = CollidingSurfaces(surfaces, fields, nodes, contact.surface_friction_angle, _REACH * size)
            open_faces = OpenFaces(mesh, surfaces) if len(np.unique(mesh.round)) > 1 else None
        planes: list[PlaneContact] = []
        for plane in settings.planes:
            row = nodes.rows_of(at_planes)
            may = np.isin(row, nodes.own) & ~held_in_plane(mesh, at_planes, plane)
            row = np.concatenate([row[may & ~interior], row[may & interior]])
            outer = int(np.count_nonzero(may & ~interior))
            planes.append(PlaneContact(plane, fields, nodes, row, outer, _PLANE_REACH * size))
        return cls(
            fields, settings.time_step, len(mesh.cells), nodes,
            interface=interface, collisions=collisions, planes=planes, open_faces=open_faces,
        )  # fmt: skip

    @property
    def force(self) -> np.ndarray:
        """Contact's forces (nodes, 3) in N, on this rank's own nodes."""
        return self.nodes.force

    def _watch(self) -> None:
        """Take over which rows the kinds need; collective."""
        parts = [part.watched for part in (self.interface, self.collisions, *self.planes) if part is not None]
        self.nodes.watch(np.concatenate([np.zeros(0, dtype=np.int32), *parts]))

    def look_again(self) -> None:
        """Go on from forces and contacts that a checkpoint has put in place; collective."""
        if self._sliding is not None:
            self._sliding.look_around()
        for plane in self.planes:
            plane.look(self._largest(plane.fastest))
        sums = self.nodes.rows.sums.copy()
        self._watch()
        self.nodes.rows.sums[:] = sums
        self.nodes.place()

    def _largest(self, value: float) -> float:
        return self.comm.allreduce(value, op=MPI.MAX) if self.comm.size > 1 else value

    @property
    def exists(self) -> bool:
        """Whether there is anything that may touch."""
        return self.interface is not None or self.collisions is not None or bool(self.planes)

    def drop_faces(self, eroded: np.ndarray) -> None:
        """Let nothing meet the faces of this rank's `eroded` cells (cells,) bool any more; collective."""
        numbers = self._fields.mesh.cell[np.flatnonzero(eroded)]
        found = not self.eroded[numbers].all()
        if self.comm.size > 1:
            found = self.comm.allreduce(found, op=MPI.LOR)
        if found:
            for some in self.comm.allgather(numbers) if self.comm.size > 1 else [numbers]:
                self.eroded[some] = True
            self.restore_eroded(self.eroded)
        # Not when a burst is resumed: between two looks nodes may have come to lie on their faces.
        if self.interface is not None and self.eroded.any():
            self.interface.leave_eroded(self.eroded)

    def restore_eroded(self, eroded: np.ndarray) -> None:
        """Take over which cells of the whole mesh are eroded."""
        self.eroded[:] = eroded
        if self.collisions is not None and self.eroded.any():
            surfaces = self.collisions.surfaces if self._open_faces is None else self._open_faces.opened(self.eroded)
            self.collisions.take(surfaces, self.eroded)

    @property
    def acts_in_substeps(self) -> bool:
        """Whether the kernels take contact along through the substeps, in place of `add_forces`."""
        return False

    def in_substeps(self, stable_for: float, step: float, level: int, front_until: float) -> LineContact:
        """Contact as the kernels take it along, its steps of a level.

        `stable_for` and `step` are those of `add_forces` times 2^`level`; until the time `front_until` (s) a front is
        active.
        """
        raise NotImplementedError

    def take_sums(self) -> None:
        """Take over what the kernels have added up in the substeps."""

    def add_forces(self, stable_for: float, step: float, *, front_is_active: bool) -> None:
        """Add the forces on this rank's own nodes to the resultant, times the fraction of contact's step; collective.

        Parameters
        ----------
        stable_for : the step (s) for which the springs must be stable; 0 before the first step: no force.
        step : the step (s) that led here.
        front_is_active : whether a detonation front runs or is being reflected, for the record of penetrations.
        """
        if not self.exists or stable_for <= 0.0:
            return
        max_squared_frequency = self._max_squared_phase / stable_for**2
        self.work += self.nodes.gather(step)
        self._look(step)
        given = [] if self._sliding is None else [self._sliding.sum_attached()]
        rows = self.nodes.rows
        self.nodes.exchange([rows.position, rows.velocity, rows.load[:, None]], given)
        for part in self._parts:
            part.add_forces(self._share(part) * max_squared_frequency, step)
            self.friction += part.friction
        self._note(step, front_is_active=front_is_active)
        self.nodes.exchange([], [rows.sums])
        self.work += self.nodes.give(step, self._fraction)

    def _share(self, part: ContactPairs) -> float:
        """Fraction of the squared frequency that a kind may take up: planes and surfaces may push one node."""
        if isinstance(part, PlaneContact):
            return _PLANE_FRACTION
        return 1.0 - _PLANE_FRACTION if part is self.collisions and self.planes else 1.0

    def _look(self, step: float) -> None:
        """Search, and look around on slide surfaces, where that is due after this step (s) on any rank; collective."""
        sliding, collisions = self._sliding, self.collisions
        ahead = np.zeros(2)
        if sliding is not None and self.comm.size > 1:
            ahead[0] = sliding.comes_to_border
        if collisions is not None:
            ahead[1] = collisions.fastest
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, ahead, op=MPI.MAX)
        looked = False
        if sliding is not None and ahead[0]:
            sliding.look_around()
            looked = True
        if collisions is not None and collisions.search_is_due(step, float(ahead[1])):
            collisions.search()
            looked = True
        for plane in self.planes:
            if plane.look_is_due(step):
                plane.look(self._largest(plane.fastest))
                looked = True
        if looked:
            self._watch()

    def _note(self, step: float, *, front_is_active: bool) -> None:
        """Note penetrations, and the impulse that planes have given, by the trapezoidal rule; collective."""
        deepest, sliding, collisions = self.penetrations, self._sliding, self.collisions
        if sliding is not None:
            deepest.at_interface(sliding.deepest, front_is_active=front_is_active)
        if collisions is not None:
            deepest.collision = max(deepest.collision, collisions.deepest)
            deepest.interior_collision = max(deepest.interior_collision, collisions.deepest_inner)
        if not self.planes:
            return
        now = np.zeros(3)
        for plane in self.planes:
            now += plane.given
            deepest.plane = max(deepest.plane, plane.deepest)
            deepest.interior_plane = max(deepest.interior_plane, plane.deepest_inner)
        now = self.comm.allreduce(now) if self.comm.size > 1 else now
        self.impulse += 0.5 * step * (self.plane_force + now)
        self.plane_force = now

    def set_level(self, level: int) -> None:
        """Contact takes 2^`level` steps in a longest one from now on."""
        self._fraction = 1.0 / 2**level
        self.nodes.set_level(level)

    @property
    def _parts(self) -> list[Any]:
        return [part for part in (self._sliding, self.collisions, *self.planes) if part is not None]

    @property
    def spring_energy(self) -> float:
        """Energy now in the springs (J), on this rank."""
        parts = (self.interface, self.collisions, *self.planes)
        return float(sum(part.spring_energy for part in parts if part is not None))

    @property
    def energy(self) -> float:
        """What contact holds and has turned to heat (J), on this rank: springs and friction."""
        return self.spring_energy + self.friction

    @property
    def gain(self) -> float:
        """What contact has given to the nodes, to its springs and to friction, in all (J), on this rank.

        Nothing physical supplies it: it is energy from nothing, or lost where it is negative. Springs that get stiffer
        under load give it, and so does the products' own pressure on a gap that opens wider than it closes.
        """
        return self.work + self.energy

    def summary(self) -> dict[str, Any]:
        """Contact's part of the summary; collective."""
        comm = self.comm
        counts = self.interface.counts() if self.interface else np.zeros(3)
        local = np.array([*counts, self.spring_energy, self.friction, self.work, self.gain])
        total = comm.allreduce(local) if comm.size > 1 else local
        deepest = self.penetrations.over(comm)
        return {
            "bonded": int(total[0]),
            "touching": int(total[1]),
            "off_surface": int(total[2]),
            "spring_energy": float(total[3]),
            "friction_heat": float(total[4]),
            "work": float(total[5]),
            "gain": float(total[6]),
            "max_penetration": deepest.largest if self.exists else None,
            "max_interface_penetration_at_front": deepest.interface_at_front,
            "max_interface_penetration": deepest.interface_after,
            "max_collision_penetration": deepest.collision,
            "max_plane_penetration": deepest.plane,
            "max_interior_collision_penetration": deepest.interior_collision,
            "max_interior_plane_penetration": deepest.interior_plane,
            "searches": self.collisions.searches if self.collisions else 0,
        }
