"""Contact of charge and casing in the meridian: bonded until the charge has reacted, then products slide.

The line and its contacts are built here from the mesh; `kernels.axisymmetric.slide_line` finds their forces.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.axisymmetric.mesh import outer_edges
from burst_fenicsx.contact.charge_contacts import ChargeContacts, slide_law
from burst_fenicsx.contact.forces import ContactForces
from burst_fenicsx.kernels.axisymmetric.line_points import SPREAD, LineContacts, SlideLine
from burst_fenicsx.kernels.axisymmetric.slide_line import LineContact
from burst_fenicsx.kernels.cells.layout import CHARGE_PARAMETERS
from burst_fenicsx.kernels.constants import SMOOTH
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.axisymmetric.mesh import MeridianMesh
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.problem import BurstSettings, ContactSettings

__all__ = ["LineContactForces", "LineInterface", "meridian_contact"]

_TIED = 2  # value of `off`: the node belongs to both sides


class LineInterface(ChargeContacts):
    """The slide lines of a round and the contacts of its charge.

    Parameters
    ----------
    mesh : the meridian, its charge split from the casing.
    fields : the state.
    settings : strength and friction of unreacted explosive on the casing.

    Attributes
    ----------
    line, contacts : the kernels' arrays.
    """

    contacts: LineContacts

    def __init__(self, mesh: MeridianMesh, fields: BurstFields, settings: ContactSettings) -> None:
        self.settings = settings
        local = fields.mesh.local_node
        # A node that charge and line still share, at the rim of a fuze, is its own twin.
        of_node = np.arange(len(mesh.nodes))
        of_node[mesh.interface_pairs[:, 1]] = mesh.interface_pairs[:, 0]
        edges, cell_of_edge, covered = _line_edges(mesh)
        neighbour, end, sides = _smooth_groups(mesh.nodes, edges)
        group_node = np.full(len(sides), -1)
        group_node[end.ravel()] = edges.ravel()
        nodes = np.unique(np.concatenate([local(edges).ravel(), local(of_node[edges[covered]]).ravel()]))
        self.line = SlideLine(
            edges=local(edges).astype(np.int32),
            neighbour=neighbour,
            across=_across_creases(mesh.nodes, edges, neighbour),
            end=end,
            sides=sides,
            on_axis=mesh.nodes[group_node, 0] == 0.0,
            vector=np.zeros((len(sides), 2)),
            nodes=nodes.astype(np.int32),
        )
        # A contact for every group that has an edge at which the charge lies.
        at_charge = np.array([any(covered[edge] for edge in pair if edge >= 0) for pair in sides])
        groups = np.flatnonzero(at_charge)
        slave = local(of_node[group_node[groups]]).astype(np.int32)
        face = np.array([next(e for e in sides[g] if e >= 0 and covered[e]) for g in groups], dtype=np.int32)
        point = (end[face, 1] == groups).astype(float)
        side = np.full((len(groups), 2, 2), -1, dtype=np.int32)
        for c, group in enumerate(groups):
            for k, edge in enumerate(sides[group]):
                if edge >= 0 and covered[edge]:
                    side[c, k] = local(of_node[edges[edge]])
        first_cell, cell = _cells_around(fields, slave)
        of_round = mesh.round[cell_of_edge[face]]
        parameters = fields.charge.parameters[len(Part) * of_round + Part.CHARGE]
        count = len(groups)
        self.contacts = LineContacts(
            slave=slave,
            of_node=np.bincount(slave, minlength=1)[slave].astype(float),
            strength=parameters[:, CHARGE_PARAMETERS.index("unreacted_strength")].copy(),
            side=side,
            first_cell=first_cell,
            cell=cell,
            face=face,
            point=point,
            bonded=np.ones(count, dtype=np.int8),
            gap=np.zeros(count),
            stiffness=np.zeros(count),
            slip=np.zeros(count),
            weight=np.zeros((count, 2)),
            force=np.zeros((count, 2)),
            off=np.where(of_node[group_node[groups]] == group_node[groups], _TIED, 0).astype(np.int8),
            tally=np.zeros((count, 3)),
            span=_spans(edges, covered, end, groups),
            spread_over=np.zeros((count, SPREAD), dtype=np.int32),
            spread=np.zeros((count, SPREAD)),
            spread_count=np.zeros(count, dtype=np.int32),
            pressing=np.zeros((count, 2)),
            normal=np.zeros((count, 2)),
            load=np.zeros(len(fields.mass)),
        )
        super().__init__(fields, self.line.nodes, np.arange(count, dtype=np.int32), cell_of_edge)


class LineContactForces(ContactForces):
    """Contact of an axisymmetric burst: a slide line, on which the kernels act within the substeps."""

    interface: LineInterface | None

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._sums, self._deepest = np.zeros(2), np.zeros(2)

    @property
    def acts_in_substeps(self) -> bool:
        """As `ContactForces.acts_in_substeps`."""
        return self.interface is not None

    def in_substeps(self, stable_for: float, step: float, level: int, front_until: float) -> LineContact:
        """As `ContactForces.in_substeps`."""
        state, interface = self._fields, self.interface
        assert interface is not None
        fraction = 1.0 / 2**level
        max_squared_frequency = self._max_squared_phase / (fraction * stable_for) ** 2 if stable_for > 0.0 else 0.0
        return LineContact(
            slide_law(interface.settings, max_squared_frequency, fraction * step), level, front_until, interface.line,
            interface.contacts, state.blocks.slot_of_cell, state.mass, self.force, self._faster, self._last_position,
            self._own_velocity, self._sums, self._deepest,
        )  # fmt: skip

    def take_sums(self) -> None:
        """As `ContactForces.take_sums`."""
        self.work, self.friction = self.work + self._sums[0], self.friction + self._sums[1]
        self._sums[:] = 0.0
        for depth, front_is_active in zip(self._deepest, (True, False), strict=True):
            self.penetrations.at_interface(float(depth), front_is_active=front_is_active)


def meridian_contact(mesh: MeridianMesh, fields: BurstFields, settings: BurstSettings) -> ContactForces:
    """Contact of an axisymmetric burst: its slide line, where charge and casing have nodes of their own."""
    interface = LineInterface(mesh, fields, settings.contact) if len(mesh.interface_pairs) else None
    touched = np.zeros(len(fields.mass), dtype=bool)
    if interface is not None:
        touched[interface.nodes] = True
    return LineContactForces(fields, settings.time_step, len(mesh.cells), touched, interface=interface)


def _line_edges(mesh: MeridianMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of the casing on which a charge may slide (edges, 2), their cells, and whether a charge lies at each.

    Besides those at a charge the ones to which these lead on without a crease, free or behind a fuze: a line that ended
    at the fuze's rim would lose the products that slide there.
    """
    edges, cells, behind = outer_edges(mesh, np.where(mesh.part == Part.CASING, 0, -1))
    covered = (behind >= 0) & (mesh.part[behind] == Part.CHARGE)
    neighbour, _, _ = _smooth_groups(mesh.nodes, edges)
    chosen = covered.copy()
    while True:
        onward = neighbour[chosen].ravel()
        wider = chosen.copy()
        wider[onward[onward >= 0]] = True
        if (wider == chosen).all():
            break
        chosen = wider
    return edges[chosen], cells[chosen], covered[chosen]


def _smooth_groups(nodes: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edge beyond each end (edges, 2), group of each end (edges, 2), edges of each group (groups, 2); -1 for none."""
    along = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    along /= np.linalg.norm(along, axis=1)[:, None]
    starts = {int(node): edge for edge, node in enumerate(edges[:, 0])}
    neighbour = np.full((len(edges), 2), -1, dtype=np.int32)
    end = np.full((len(edges), 2), -1, dtype=np.int32)
    sides: list[tuple[int, int]] = []
    for edge, node in enumerate(edges[:, 1]):
        onward = starts.get(int(node), -1)
        smooth = onward >= 0 and float(along[edge] @ along[onward]) > SMOOTH
        end[edge, 1] = len(sides)
        sides.append((edge, onward if smooth else -1))
        if smooth:
            neighbour[edge, 1], neighbour[onward, 0] = onward, edge
            end[onward, 0] = end[edge, 1]
    for edge in np.flatnonzero(end[:, 0] < 0):
        end[edge, 0] = len(sides)
        sides.append((int(edge), -1))
    return neighbour, end, np.array(sides, dtype=np.int32).reshape(-1, 2)


def _across_creases(nodes: np.ndarray, edges: np.ndarray, neighbour: np.ndarray) -> np.ndarray:
    """Edge beyond each end (edges, 2) int32 where a crease there is hollow towards the charge; else -1."""
    along = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    starts = {int(node): edge for edge, node in enumerate(edges[:, 0])}
    across = np.full((len(edges), 2), -1, dtype=np.int32)
    for edge in np.flatnonzero(neighbour[:, 1] < 0):
        onward = starts.get(int(edges[edge, 1]), -1)
        if onward >= 0 and along[edge, 0] * along[onward, 2] - along[edge, 2] * along[onward, 0] < 0.0:
            across[edge, 1], across[onward, 0] = onward, edge
    return across


def _spans(edges: np.ndarray, covered: np.ndarray, end: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Contacts at the ends of every edge of the charge (spans, 2) int32, in the line's direction."""
    contact = np.full(int(end.max(initial=-1)) + 1, -1)
    contact[groups] = np.arange(len(groups))
    found: np.ndarray = contact[end[: len(edges)][covered]].astype(np.int32)
    return found


def _cells_around(fields: BurstFields, slave: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The charge's cells around each contact's node: offsets (contacts + 1,) and cells, both int32."""
    charge = np.flatnonzero(fields.mesh.part == Part.CHARGE)
    node, cell = fields.mesh.dofmap[charge].ravel(), np.repeat(charge, 4)
    order = np.argsort(node, kind="stable")
    node, cell = node[order], cell[order]
    first, last = np.searchsorted(node, slave), np.searchsorted(node, slave, side="right")
    around = [cell[a:b] for a, b in zip(first, last, strict=True)]
    offset = np.concatenate([[0], np.cumsum(last - first)]).astype(np.int32)
    return offset, np.concatenate(around).astype(np.int32) if around else np.zeros(0, dtype=np.int32)
