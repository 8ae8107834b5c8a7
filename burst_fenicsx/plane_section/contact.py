"""Contact in a section: products slide on their casings, and casings meet each other and rigid planes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.axisymmetric.slide_line import MeridianContact
from burst_fenicsx.contact.collisions import CollidingSurfaces
from burst_fenicsx.contact.forces import PLANE_REACH, ContactForces, stable_budget
from burst_fenicsx.contact.planes import PlaneContact
from burst_fenicsx.kernels.vectors.rows import add_rows, clear_rows
from burst_fenicsx.plane_section.surfaces import nodes_at_planes, section_surfaces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.axisymmetric.fields import RingFields
    from burst_fenicsx.plane_section.mesh import SectionMesh
    from burst_fenicsx.plane_section.surfaces import SectionSurfaces
    from burst_fenicsx.problem import BurstSettings, RigidPlane

__all__ = ["SectionCollisions", "SectionContact"]


class SectionCollisions(CollidingSurfaces):
    """Point-face contact of a section's casings; a node's copies move with it and hand it what they are given."""

    surfaces: SectionSurfaces
    steady = True

    def __init__(self, surfaces: SectionSurfaces, fields: RingFields, friction_angle: float, reach: float) -> None:
        self._first_copy = len(surfaces.node) - len(surfaces.copy_of)
        self._copies = self._originals = np.zeros(0, dtype=np.int64)  # near ones, and the rows that they copy
        super().__init__(surfaces, fields, friction_angle, reach)
        self._mass[self._first_copy :] *= 0.5
        self._local_of_row = np.full(len(surfaces.node), -1, dtype=np.int32)
        self._local_of_row[self._rows] = self._local

    def own_everywhere(self, values: np.ndarray) -> np.ndarray:
        """As in three dimensions; copies have the values of their nodes."""
        result = super().own_everywhere(values)
        result[self._first_copy :] = result[self.surfaces.copy_of]
        return result

    @property
    def any_near(self) -> bool:
        """Whether any node may meet a face before the next search."""
        return self._any_near

    def search(self) -> None:
        """Look for the faces that each node may meet."""
        position = self._everywhere(self._fields.nodes.position)
        position[:, 1] += self.surfaces.height
        self.search_from(position)

    def search_from(self, position: np.ndarray) -> None:
        """Search with the surface nodes (nodes, 3) at `position` (m)."""
        super().search_from(position)
        self._copies = np.unique(self.state.faces[self.state.near])
        self._originals = self.surfaces.copy_of[self._copies - self._first_copy]
        self._near_rows = np.union1d(self.state.node, self._originals).astype(np.int32)
        self._near_local = self._local_of_row[self._near_rows]
        self._any_near = len(self.state.node) > 0
        self.state.sharing[self._copies] = self.state.sharing[self._originals]
        # Rows of nodes that are no longer near would keep sums of contacts that are gone.
        self._sums[:] = 0.0

    def _exchange_motion(self, velocity: np.ndarray) -> None:
        """Bring places and speeds to the near nodes and their copies."""
        super()._exchange_motion(velocity)
        copies, originals = self._copies, self._originals
        self._position[copies] = self._position[originals]
        self._position[copies, 1] += self.surfaces.height[copies]
        self._velocity[copies] = self._velocity[originals]

    def _join_copies(self) -> None:
        """Give forces and loads of copies to their nodes; of a load both copies carry the whole."""
        copies, originals, sums = self._copies, self._originals, self._sums
        before, behind = np.split(copies, 2)
        half = originals[: len(before)]
        sums[half, :3] += sums[before, :3] + sums[behind, :3]
        sums[half, 3] += 0.5 * (sums[before, 3] + sums[behind, 3])
        self.state.sharing[copies] = sums[originals, 3]
        sums[copies] = 0.0


class SectionPlane(PlaneContact):
    """A rigid plane against the nodes of a section, whose loaded springs get no stiffer."""

    steady = True

    @property
    def clearance(self) -> float:
        """Distance (m) of the nearest node from the plane."""
        return float((self._fields.nodes.position[self.state.node] @ self._normal).min() - self._level)


class SectionContact(MeridianContact):
    """Contact of a section: the slide lines of all charges, casings among each other, and planes.

    Parameters
    ----------
    mesh : the section. fields : the state. settings : of the burst.
    planes : in the coordinates of the section.
    """

    def __init__(
        self, mesh: SectionMesh, fields: RingFields, settings: BurstSettings, planes: Sequence[RigidPlane]
    ) -> None:
        super().__init__(mesh, fields, settings)
        # The kernel of the step gives the lines' forces to the nodes itself.
        self.force = np.zeros_like(self.line_force)
        self._budget = stable_budget(settings.time_step)
        self._reach = settings.cell_size
        self._of_lines = MeridianContact.touched.fget(self)  # type: ignore[attr-defined]
        casing = np.zeros(0, dtype=np.int64)
        self._section_collisions: SectionCollisions | None = None
        if settings.contact.surfaces:
            surfaces = section_surfaces(mesh, settings.cell_size)
            casing = surfaces.node[: len(surfaces.node) - len(surfaces.copy_of)]
            self.collisions = self._section_collisions = SectionCollisions(
                surfaces, fields, settings.contact.surface_friction_angle, settings.cell_size
            )
        at_planes = np.zeros(0, dtype=np.int64)
        self._section_planes: list[SectionPlane] = []
        if planes:
            at_planes, interior = nodes_at_planes(mesh)
            rows = np.argsort(interior, kind="stable")
            local = fields.mesh.local_node(at_planes[rows])
            outer = int(np.count_nonzero(~interior))
            reach = PLANE_REACH * settings.cell_size
            self._section_planes = [SectionPlane(plane, fields, local, rows, outer, reach) for plane in planes]
            self.planes = list(self._section_planes)
        self._of_bodies = np.zeros(len(self.force), dtype=bool)
        for nodes in (casing, at_planes):
            self._of_bodies[fields.mesh.local_node(nodes)] = True
        self._nodes = np.flatnonzero(self._of_bodies).astype(np.int32)
        self._met = []
        self._pushed = self._always
        self._share = 1.0
        self._faster = np.zeros(0, dtype=np.int32)
        self._last_position = self._own_velocity = np.zeros((0, 3))

    @property
    def touched(self) -> np.ndarray:
        """Whether contact may give a force to the node (nodes,)."""
        touched: np.ndarray = self._of_lines | self._of_bodies
        return touched

    @property
    def nodal_force(self) -> np.ndarray:
        """All forces of contact (nodes, 3) in N, for output."""
        total: np.ndarray = self.force + self.line_force
        return total

    @property
    def forces(self) -> dict[str, np.ndarray]:
        """Those of casings and planes, and those of the slide lines."""
        return {"force": self.force, "line_force": self.line_force}

    @property
    def near(self) -> bool:
        """Whether casings have met each other or a plane, or are less than a cell apart."""
        if self.penetrations.collision > 0.0 or self.penetrations.plane > 0.0:
            return True
        if self._section_collisions is not None and self._section_collisions.any_near:
            return True
        return any(plane.clearance < self._reach for plane in self._section_planes)

    def set_level(self, level: int) -> None:
        """Contact takes 2^`level` steps in a longest one from now on; the levels of the nodes are known by then."""
        super().set_level(level)
        ContactForces.set_level(self, level)

    def add_forces(self, stable_for: float, step: float, *, front_near: bool) -> None:  # noqa: ARG002 - of bonds
        """Add the forces of casings and planes to the resultant, as `ContactForces` does; the lines' are there."""
        if stable_for <= 0.0 or (self.collisions is None and not self.planes):
            return
        budget = self._budget / stable_for**2
        with self._mean_velocities(step) as velocity:
            self._accumulate_work(step, velocity)
            clear_rows(self.force, self._pushed)
            self._collide(budget, step, velocity)
            self._push_from_planes(budget, step, velocity)
            self._find_pushed()
            self._accumulate_work(step, velocity)
        for part in (self.collisions, *self.planes):
            if part is not None:
                self.friction += part.energies[1]
        add_rows(self._share, self.force, self._pushed, self._fields.nodes.force)
