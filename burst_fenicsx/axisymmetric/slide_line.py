"""Contact of charge and casing in the meridian: bonded until the charge has reacted, then products slide.

The line and its contacts are built here from the mesh; `kernels.axisymmetric.slide_line` finds their forces.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.axisymmetric.mesh import outer_edges
from burst_fenicsx.contact.charge_contacts import ChargeContacts
from burst_fenicsx.contact.forces import ContactForces
from burst_fenicsx.contact.nodes import ContactNodes
from burst_fenicsx.kernels.axisymmetric.slide_line import SPREAD, LineContact, Spread
from burst_fenicsx.kernels.cells.layout import CHARGE_PARAMETERS
from burst_fenicsx.kernels.constants import SMOOTH
from burst_fenicsx.kernels.contact.facets import Surface
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.axisymmetric.mesh import MeridianMesh
    from burst_fenicsx.kernels.contact.law import Law
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.problem import BurstSettings, ContactSettings

_TIED = 2  # value of `off`: the node belongs to both sides
_AXIS = (1.0, 0.0, 0.0)  # on the axis the line is mirrored, as in a plane of symmetry


class LineInterface(ChargeContacts):
    """The slide lines of a round and the contacts of its charge.

    Parameters
    ----------
    mesh : the meridian, its charge split from the casing.
    fields : the state. nodes : contact's rows, those of the line and of the charge on it.
    settings : strength and friction of unreacted explosive on the casing.
    lines : of `line_edges`.

    Attributes
    ----------
    spread : the kernels' arrays.
    """

    def __init__(
        self,
        mesh: MeridianMesh,
        fields: BurstFields,
        nodes: ContactNodes,
        settings: ContactSettings,
        lines: tuple[np.ndarray, np.ndarray, np.ndarray],
    ) -> None:
        # A node that charge and line still share, at the rim of a fuze, is its own twin.
        twin = np.arange(len(mesh.nodes))
        twin[mesh.interface_pairs[:, 1]] = mesh.interface_pairs[:, 0]
        edges, cell, covered = lines
        surface, group_node = smooth_line(mesh.nodes, edges)
        beside = np.full_like(edges, -1)
        beside[covered] = nodes.rows_of(twin[edges[covered]])
        # A contact for every group that has an edge at which the charge lies, which it begins with.
        at_charge = np.zeros(len(group_node), dtype=bool)
        at_charge[surface.corner[covered]] = True
        group = np.flatnonzero(at_charge).astype(np.int32)
        slave = twin[group_node[group]]
        members = [surface.member[surface.first[g] : surface.first[g + 1]] for g in group]
        facet = np.array([next(edge for edge in some if covered[edge]) for some in members])
        around = np.bincount(mesh.cells[mesh.part == Part.CHARGE].ravel(), minlength=len(mesh.nodes))
        material = len(Part) * mesh.round[cell[facet]] + Part.CHARGE
        super().__init__(
            fields,
            nodes,
            settings,
            surface._replace(facets=nodes.rows_of(edges)),
            cell,
            beside.astype(np.int32),
            group,
            nodes.rows_of(slave),
            around[slave].astype(float),
            fields.charge.parameters[material, CHARGE_PARAMETERS.index("unreacted_strength")],
        )
        self.pairs.facet[:] = facet
        self.pairs.point[:, 0] = np.where(surface.corner[facet, 1] == group, 1.0, -1.0)
        self.bonds.off[slave == group_node[group]] = _TIED
        contact, count = np.full(len(group_node), -1), len(group)
        contact[group] = np.arange(count)
        self.spread = Spread(
            span=contact[surface.corner[covered]].astype(np.int32),
            over=np.zeros((count, SPREAD), dtype=np.int32),
            share=np.zeros((count, SPREAD)),
            bearing=np.zeros(count, dtype=np.int32),
        )
        self._no_gas, self.watched = np.zeros(count), nodes.own
        self.sums, self.deepest_so_far = np.zeros(2), np.zeros(2)

    def in_substeps(self, law: Law, level: int, front_until: float) -> LineContact:
        """As the kernels take it along."""
        return LineContact(
            law, level, front_until, self.around, self.groups, self.surface, self.pairs, self._no_gas, self.bonds,
            self.spread, self.attached._replace(slot=self._fields.blocks.slot_of_cell), self._nodes.rows, self.sums,
            self.deepest_so_far,
        )  # fmt: skip


class LineContactForces(ContactForces):
    """Contact of an axisymmetric burst: a slide line, on which the kernels act within the substeps."""

    interface: LineInterface | None

    @property
    def acts_in_substeps(self) -> bool:
        """As `ContactForces.acts_in_substeps`."""
        return self.interface is not None

    def in_substeps(self, stable_for: float, step: float, level: int, front_until: float) -> LineContact:
        """As `ContactForces.in_substeps`."""
        assert self.interface is not None
        fraction = 1.0 / 2**level
        max_squared_frequency = self._max_squared_phase / (fraction * stable_for) ** 2 if stable_for > 0.0 else 0.0
        law = self.interface.law(max_squared_frequency, fraction * step)
        return self.interface.in_substeps(law, level, front_until)

    def take_sums(self) -> None:
        """As `ContactForces.take_sums`."""
        assert self.interface is not None
        sums = self.interface.sums
        self.work, self.friction = self.work + sums[0], self.friction + sums[1]
        sums[:] = 0.0
        for depth, front_is_active in zip(self.interface.deepest_so_far, (True, False), strict=True):
            self.penetrations.at_interface(float(depth), front_is_active=front_is_active)


def meridian_contact(mesh: MeridianMesh, fields: BurstFields, settings: BurstSettings) -> ContactForces:
    """Contact of an axisymmetric burst: its slide line, where charge and casing have nodes of their own."""
    interface, lines = None, line_edges(mesh)
    touched = np.unique(np.append(lines[0], mesh.interface_pairs)) if len(mesh.interface_pairs) else np.zeros(0, int)
    nodes = ContactNodes(fields, touched)
    if len(mesh.interface_pairs):
        interface = LineInterface(mesh, fields, nodes, settings.contact, lines)
    return LineContactForces(fields, settings.time_step, len(mesh.cells), nodes, interface=interface)


def line_edges(mesh: MeridianMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of the casing on which a charge may slide (edges, 2), their cells, and whether a charge lies at each.

    Besides those at a charge the ones to which these lead on without a crease, free or behind a fuze: a line that ended
    at the fuze's rim would lose the products that slide there.
    """
    edges, cells, behind = outer_edges(mesh, np.where(mesh.part == Part.CASING, 0, -1))
    covered = (behind >= 0) & (mesh.part[behind] == Part.CHARGE)
    neighbour = smooth_line(mesh.nodes, edges)[0].neighbour
    chosen = covered.copy()
    while True:
        onward = neighbour[chosen].ravel()
        wider = chosen.copy()
        wider[onward[onward >= 0]] = True
        if (wider == chosen).all():
            break
        chosen = wider
    return edges[chosen], cells[chosen], covered[chosen]


def smooth_line(nodes: np.ndarray, edges: np.ndarray) -> tuple[Surface, np.ndarray]:
    """The edges (edges, 2) with their smooth groups at each node, and each group's node."""
    along = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    direction = along / np.linalg.norm(along, axis=1)[:, None]
    starts = np.full(len(nodes), -1)
    starts[edges[:, 0]] = np.arange(len(edges))
    before = np.arange(len(edges))
    onward = starts[edges[:, 1]]
    before, onward = before[onward >= 0], onward[onward >= 0]
    smooth = (direction[before] * direction[onward]).sum(axis=1) > SMOOTH
    hollow = ~smooth & (along[before, 0] * along[onward, 2] - along[before, 2] * along[onward, 0] < 0.0)
    across = np.full((2, len(edges), 4), -1, dtype=np.int32)  # neighbours, and those beyond hollow creases
    for kind, chosen in enumerate((smooth, hollow)):
        across[kind, before[chosen], 1] = onward[chosen]
        across[kind, onward[chosen], 3] = before[chosen]
    # A group for the second end of each edge, and for every first end that no edge leads on to.
    corner = np.stack([np.full(len(edges), -1), np.arange(len(edges))], axis=1)
    corner[onward[smooth], 0] = before[smooth]
    free = np.flatnonzero(corner[:, 0] < 0)
    corner[free, 0] = len(edges) + np.arange(len(free))
    group_node = np.concatenate([edges[:, 1], edges[free, 0]])
    order = np.argsort(corner.ravel(), kind="stable")
    first = np.searchsorted(corner.ravel()[order], np.arange(len(group_node) + 1))
    surface = Surface(
        facets=edges.astype(np.int32),
        neighbour=across[0],
        hollow=across[1],
        corner=corner.astype(np.int32),
        first=first.astype(np.int32),
        member=(order // 2).astype(np.int32),
        mirrors=np.where(nodes[group_node, 0] == 0.0, 1.0, 0.0)[:, None, None] * np.array([[_AXIS]]),
        known=np.ones(len(edges), dtype=bool),
        area=np.zeros((len(edges), 3)),
        vector=np.zeros((len(group_node), 3)),
    )
    return surface, group_node
