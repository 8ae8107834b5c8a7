"""All contact of a burst: bonds, colliding surfaces and planes, their forces and their energies (F^c of Eq. 2)."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact.collisions import CollidingSurfaces
from burst_fenicsx.contact.exchange import Fetched, Given, exchange_rows
from burst_fenicsx.contact.planes import PlaneContact, held_in_plane, nodes_at_planes
from burst_fenicsx.contact.sliding import SlidingInterface
from burst_fenicsx.contact.surfaces import OpenFaces, contact_surfaces
from burst_fenicsx.kernels.vectors.rows import acting_rows, place_rows, take_means, work_on_rows

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from burst_fenicsx.contact.charge_contacts import ChargeContacts
    from burst_fenicsx.kernels.axisymmetric.slide_line import LineContact
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import BurstSettings, TimeStep

__all__ = ["ContactForces", "Penetrations", "max_squared_phase"]

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
    """Contact forces of a burst on one rank, summed from their parts.

    Parameters
    ----------
    fields : this rank's fields.
    time_step : from which the stiffness of every spring is taken, see `max_squared_phase`.
    cells : number of cells of the whole mesh.
    touched : (nodes,) bool, whether contact may give a force to the node.
    interface, collisions, planes : the parts. open_faces : of several rounds, see `OpenFaces`.

    Attributes
    ----------
    force : (nodes, 3) N, on this rank's nodes.
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
        touched: np.ndarray,
        *,
        interface: ChargeContacts | None = None,
        collisions: CollidingSurfaces | None = None,
        planes: Sequence[PlaneContact] = (),
        open_faces: OpenFaces | None = None,
    ) -> None:
        self._max_squared_phase = max_squared_phase(time_step)
        self._fields = fields
        self.comm = fields.mesh.comm
        self.touched = touched
        self.interface, self.collisions, self.planes = interface, collisions, list(planes)
        self._sliding = interface if isinstance(interface, SlidingInterface) else None
        self._open_faces = open_faces
        self.force = np.zeros_like(fields.nodes.force)
        self.friction = 0.0
        self.work = 0.0
        self.plane_force, self.impulse = np.zeros(3), np.zeros(3)
        self.penetrations = Penetrations()
        self.eroded = np.zeros(cells, dtype=bool)
        self._nodes = np.flatnonzero(touched).astype(np.int32)
        self._always = interface.nodes if interface is not None else np.zeros(0, dtype=np.int32)
        self._met: list[np.ndarray] = []  # nodes that planes and surfaces may push till one looks again
        self._pushed = self._always  # these and those of bonds
        self._acting = np.zeros(0, dtype=np.int32)  # those of them that have a force
        self._fraction = 1.0  # contact's step over the longest one
        # Nodes that take several steps in one of contact, where they were at the last one of that (m), and room for
        # their velocities (m/s) while the means stand there.
        self._faster = np.zeros(0, dtype=np.int32)
        self._last_position = self._own_velocity = np.zeros((0, 3))

    @classmethod
    def of_mesh(cls, mesh: HexahedralMesh, fields: BurstFields, settings: BurstSettings) -> ContactForces:
        """All parts that a burst in three dimensions has; `mesh` is the whole mesh."""
        own, contact, size = fields.mesh, settings.contact, settings.cell_size
        surfaces = contact_surfaces(mesh) if contact.surfaces or settings.planes else None
        touched = [surfaces.node] if surfaces is not None else []
        interface, collisions, open_faces = None, None, None
        if len(mesh.interface_pairs):
            interface = SlidingInterface(mesh, fields, contact)
            touched.append(interface.numbers)
        if contact.surfaces and surfaces is not None:
            collisions = CollidingSurfaces(surfaces, fields, contact.surface_friction_angle, _REACH * size)
            open_faces = OpenFaces(mesh, surfaces) if len(np.unique(mesh.round)) > 1 else None
        planes: list[PlaneContact] = []
        if settings.planes and surfaces is not None:
            nodes, interior = nodes_at_planes(mesh, surfaces)
            touched.append(nodes)
            for plane in settings.planes:
                free = ~held_in_plane(mesh, nodes, plane)
                local = own.local_node(nodes[free])
                rows = np.flatnonzero((local >= 0) & (local < own.owned_nodes))
                rows = rows[np.argsort(interior[free][rows], kind="stable")]
                outer = int(np.count_nonzero(~interior[free][rows]))
                planes.append(PlaneContact(plane, fields, local[rows], outer, _PLANE_REACH * size))
        may_touch = np.zeros(len(own.node), dtype=bool)
        for numbers in touched:
            local = own.local_node(numbers)
            may_touch[local[local >= 0]] = True
        return cls(
            fields, settings.time_step, len(mesh.cells), may_touch,
            interface=interface, collisions=collisions, planes=planes, open_faces=open_faces,
        )  # fmt: skip

    def _find_pushed(self) -> None:
        """Find the nodes that may have a force of contact, where those near a plane or another surface have changed."""
        near = [plane.pushed for plane in self.planes]
        if self.collisions is not None:
            near.append(self.collisions.pushed)
        if len(near) != len(self._met) or any(now is not before for now, before in zip(near, self._met, strict=True)):
            self._met = near
            self._pushed = self._any_of(self._always, *near)

    def _any_of(self, *groups: np.ndarray) -> np.ndarray:
        """Nodes (k,) int32 that are in any of the groups, each once, in order; quicker than to sort them."""
        found = np.zeros(len(self.force), dtype=bool)
        for nodes in groups:
            found[nodes] = True
        return np.flatnonzero(found).astype(np.int32)

    def look_again(self) -> None:
        """Go on from forces and contacts that a checkpoint has put in place; collective."""
        self._acting = np.flatnonzero(self.force.any(axis=1)).astype(np.int32)
        self._pushed = self._any_of(self._always, self._acting)
        if self.interface is not None:
            self.interface.look_around()
        for plane in self.planes:
            plane.look_again()

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
            opened = self._open_faces.opened(self.eroded) if self._open_faces is not None else None
            self.collisions.drop_faces(self.eroded, opened)

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
        with self._mean_velocities(step) as velocity:
            self._accumulate_work(step, velocity)  # and clear the forces
            self._look(step)
            self._push_surfaces(max_squared_frequency, step, velocity, front_is_active=front_is_active)
            self._push_from_planes(max_squared_frequency, step, velocity)
            self._find_pushed()
            self._acting = acting_rows(self.force, self._pushed)
            self._accumulate_work(step, velocity, self._fields.nodes.force)
        for part in self._parts:
            self.friction += part.energies[1]

    def _accumulate_work(self, step: float, velocity: np.ndarray, resultant: np.ndarray | None = None) -> None:
        """Add the work of the forces as they are now in half of a step (s) at the mean velocities (nodes, 3) in it.

        The forces are added to the `resultant` (nodes, 3) in N, or cleared for those to come.
        """
        rounding = self._fields.grid.rounding
        self.work += work_on_rows(0.5 * step, self.force, self._acting, velocity, rounding, self._fraction, resultant)

    def _look(self, step: float) -> None:
        """Search, and look around on slide surfaces, where that is due after this step (s) on any rank; collective."""
        interface, collisions = self._sliding, self.collisions
        ahead = np.zeros(2)
        if interface is not None:
            ahead[0] = interface.comes_to_border
        if collisions is not None:
            ahead[1] = collisions.fastest
        if self.comm.size > 1:
            self.comm.Allreduce(MPI.IN_PLACE, ahead, op=MPI.MAX)
        if interface is not None and ahead[0]:
            interface.look_around()
        if collisions is not None and collisions.search_is_due(step, float(ahead[1])):
            collisions.search()

    def _push_surfaces(
        self, max_squared_frequency: float, step: float, velocity: np.ndarray, *, front_is_active: bool
    ) -> None:
        """Forces of the bonds and of colliding surfaces at the mean velocities (nodes, 3) in m/s; collective."""
        interface, collisions, deepest = self._sliding, self.collisions, self.penetrations
        fetched: list[Fetched] = []
        given: list[Given] = []
        for part in (interface, collisions):
            if part is not None:
                some, sums = part.bring(velocity)
                fetched, given = fetched + some, given + sums
        exchange_rows(self.comm, fetched, given)
        given = []
        if interface is not None:
            given += interface.find_forces(max_squared_frequency, step, velocity, self.force)
            deepest.at_interface(interface.deepest, front_is_active=front_is_active)
        if collisions is not None:
            given += collisions.find_forces(
                max_squared_frequency * (1.0 - _PLANE_FRACTION if self.planes else 1.0), step
            )
            deepest.collision = max(deepest.collision, collisions.deepest)
            deepest.interior_collision = max(deepest.interior_collision, collisions.deepest_interior)
        exchange_rows(self.comm, [], given)
        for part in (interface, collisions):
            if part is not None:
                part.take_reactions(self.force)

    def _push_from_planes(self, max_squared_frequency: float, step: float, velocity: np.ndarray) -> None:
        """Forces of the planes, and the impulse that they have given, by the trapezoidal rule; collective."""
        if not self.planes:
            return
        now = np.zeros(3)
        for plane in self.planes:
            plane.add_forces(max_squared_frequency * _PLANE_FRACTION, step, velocity, self.force)
            now += plane.given
            self.penetrations.plane = max(self.penetrations.plane, plane.deepest)
            self.penetrations.interior_plane = max(self.penetrations.interior_plane, plane.deepest_interior)
        now = self.comm.allreduce(now) if self.comm.size > 1 else now
        self.impulse += 0.5 * step * (self.plane_force + now)
        self.plane_force = now

    def set_level(self, level: int) -> None:
        """Contact takes 2^`level` steps in a longest one from now on; the levels of the nodes are known by then."""
        self._fraction = 1.0 / 2**level
        nodes = self._fields.nodes
        self._faster = self._nodes[nodes.finest[self._nodes] > level]
        self._last_position = nodes.position[self._faster]
        self._own_velocity = np.empty_like(self._last_position)

    @contextmanager
    def _mean_velocities(self, step: float) -> Iterator[np.ndarray]:
        """Mean velocities (nodes, 3) over contact's step (s): while they are used, in place of the velocities."""
        nodes, faster = self._fields.nodes, self._faster
        if step <= 0.0 or not len(faster):
            yield nodes.velocity
            return
        take_means(faster, nodes.position, step, self._last_position, self._own_velocity, nodes.velocity)
        try:
            yield nodes.velocity
        finally:
            place_rows(self._own_velocity, faster, nodes.velocity)

    @property
    def _parts(self) -> list[ChargeContacts | CollidingSurfaces | PlaneContact]:
        return [part for part in (self.interface, self.collisions, *self.planes) if part is not None]

    @property
    def spring_energy(self) -> float:
        """Energy now in the springs (J), on this rank."""
        return float(sum(part.energies[0] for part in self._parts))

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
