"""Sliding of a charge on its casing in the meridian: the slide surface of `kernels.sliding` as a line.

The casing's edges have a normal interpolated between those of their ends, so that it is continuous from edge to edge.
A node of the charge lies at the point of the line from which the normal there leads to it, and is followed as it
slides. Its force acts along that normal and is shared by the edge's ends with their weights. Products press with their
own pressure, corrected by a spring for what is left of the gap (Nitsche's method); unreacted explosive is bonded by
springs with tensile strength, cohesion and friction, which fade as it burns. Forces, masses and areas are those of the
whole ring.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.lanes import block_kernel, kernel
from burst_fenicsx.kernels.sliding import SlideLaw

__all__ = ["LineContacts", "SlideLine", "add_line_forces", "boundary_vectors"]

_NEWTON, _WALKS = 12, 10
_CLOSE = 1e-13  # change of an edge's coordinate below which a point is found
_ENTRY = 1.5  # a node newly met lies no deeper than it can have come in this many steps ...
_BENT = 0.1  # ... and this share of the distance below
_OFF_END = 0.5  # of the edge's length: a node farther beyond the end of its smooth line has left it


class SlideLine(NamedTuple):
    """Edges that the charge may slide on; a group is a node with those of its edges that are smooth together."""

    edges: np.ndarray  # (edges, 2) int32 nodes of casing or fuze; the charge lies to the right of their direction
    neighbour: np.ndarray  # (edges, 2) int32, edge beyond each end; -1 beyond a crease
    end: np.ndarray  # (edges, 2) int32, group of each end
    sides: np.ndarray  # (groups, 2) int32, edges of each group, -1 for none
    on_axis: np.ndarray  # (groups,) bool, whether the group's node lies on the axis, beyond which its edge is mirrored
    vector: np.ndarray  # (groups, 2) m, sum of the edges' lengths times their normals (r, z)
    nodes: np.ndarray  # (line nodes,) int32, all nodes of the line and all of the charge on it


class LineContacts(NamedTuple):
    """A contact for every group that the charge lies on: a node of the charge on one smooth line."""

    slave: np.ndarray  # (contacts,) int32 node of the charge
    share: np.ndarray  # (contacts,) number of the node's contacts
    strength: np.ndarray  # (contacts,) Pa, shear strength of the unreacted explosive
    side: np.ndarray  # (contacts, 2, 2) int32, the charge's own edges of the contact, -1 for none
    first_cell: np.ndarray  # (contacts + 1,) int32 into `cell`
    cell: np.ndarray  # int32, the charge's cells around each contact's node
    face: np.ndarray  # (contacts,) int32, edge on which it lies
    point: np.ndarray  # (contacts,) coordinate 0 to 1 in it
    bonded: np.ndarray  # (contacts,) int8, 1 until broken or burnt
    gap: np.ndarray  # (contacts,) m, negative where the charge lies inside the casing
    stiffness: np.ndarray  # (contacts,) N/m of the last step, 0 where nothing touched
    slip: np.ndarray  # (contacts,) m, tangential displacement that the spring holds
    weight: np.ndarray  # (contacts, 2) of the edge's ends
    force: np.ndarray  # (contacts, 2) N (r, z) on the charge's node
    off: np.ndarray  # (contacts,) int8, 1 where the node has left its line over an end
    tally: np.ndarray  # (contacts, 4), see `kernels.sliding.COLUMNS`
    load: np.ndarray  # (nodes,) sum of the weights with which contacts lie on a node
    last_position: np.ndarray  # (nodes, 3) m at the last step of contact


@block_kernel
def boundary_vectors(position: np.ndarray, line: SlideLine) -> None:
    """Sum the edges' normals times their lengths over each group, into `line.vector`."""
    for group in range(line.sides.shape[0]):
        r, z = 0.0, 0.0
        for k in range(2):
            edge = line.sides[group, k]
            if edge >= 0:
                a, b = line.edges[edge, 0], line.edges[edge, 1]
                r += position[b, 2] - position[a, 2]
                z -= position[b, 0] - position[a, 0]
        if line.on_axis[group]:
            r, z = 0.0, 2.0 * z
        line.vector[group, 0], line.vector[group, 1] = r, z


@kernel
def add_line_forces(
    law: SlideLaw,
    share: float,
    line: SlideLine,
    contacts: LineContacts,
    burn_fraction: np.ndarray,
    pressure: np.ndarray,
    position: np.ndarray,
    mass: np.ndarray,
    own: np.ndarray,
    force: np.ndarray,
) -> None:
    """Find every contact's point and force, advance its state, and add `share` of the forces (N) to those of the nodes.

    `burn_fraction` and `pressure` (cells,) Pa of the charge; `position`, `mass` and `force` of the nodes; `own`
    (nodes, 3) receives the contacts' forces alone.
    """
    boundary_vectors(position, line)
    for c in range(contacts.slave.size):
        burnt, gas = 0.0, 0.0
        first, last = contacts.first_cell[c], contacts.first_cell[c + 1]
        for k in range(first, last):
            burnt += burn_fraction[contacts.cell[k]]
            gas += pressure[contacts.cell[k]]
        count = last - first
        _slide(c, law, line, contacts, min(burnt / count, 1.0), gas / count, position, mass)
    for node in line.nodes:
        contacts.load[node] = 0.0
        for i in range(3):
            own[node, i] = 0.0
            contacts.last_position[node, i] = position[node, i]
    for c in range(contacts.slave.size):
        node, edge = contacts.slave[c], contacts.face[c]
        for k in range(2):
            other = line.edges[edge, k]
            contacts.load[other] += contacts.weight[c, k]
            if contacts.stiffness[c] > 0.0:
                for i in range(2):
                    part = contacts.weight[c, k] * contacts.force[c, i]
                    own[other, 2 * i] -= part
                    own[node, 2 * i] += part
    for node in line.nodes:
        for i in range(3):
            force[node, i] += share * own[node, i]


@block_kernel
def _slide(
    c: int,
    law: SlideLaw,
    line: SlideLine,
    contacts: LineContacts,
    burnt: float,
    pressure: float,
    position: np.ndarray,
    mass: np.ndarray,
) -> None:
    node = contacts.slave[c]
    px, pz = position[node, 0], position[node, 2]
    # Work that contact takes: half of the last force and half of the new one on this step's relative displacement.
    taken = -0.5 * _work(c, line, contacts, position)
    edge, s = contacts.face[c], contacts.point[c]
    gap, nr, nz, beyond, size = 0.0, 0.0, 1.0, 0.0, 1.0
    tolerance = 1e-12  # by which a point may lie beyond an end; larger with every edge, so that the search ends
    held = False
    for walk in range(_WALKS):
        a, b = line.edges[edge, 0], line.edges[edge, 1]
        dr, dz = position[b, 0] - position[a, 0], position[b, 2] - position[a, 2]
        g, h = line.end[edge, 0], line.end[edge, 1]
        along = 0.0
        for _ in range(_NEWTON):
            vr = (1.0 - s) * line.vector[g, 0] + s * line.vector[h, 0]
            vz = (1.0 - s) * line.vector[g, 1] + s * line.vector[h, 1]
            size = np.sqrt(vr * vr + vz * vz)
            nr, nz = vr / size, vz / size
            rr, rz = px - position[a, 0] - s * dr, pz - position[a, 2] - s * dz
            gap = rr * nr + rz * nz
            # The tangent points along the edge: the normal is to its right.
            along = -rr * nz + rz * nr
            if held:
                break
            change = along / (-dr * nz + dz * nr)
            s = min(max(s + change, -2.0), 3.0)
            if abs(change) < _CLOSE:
                break
        beyond = abs(along) if held else 0.0
        if held or (s >= -tolerance and s <= 1.0 + tolerance):
            break
        onward = line.neighbour[edge, 0] if s < 0.0 else line.neighbour[edge, 1]
        if onward < 0 or walk == _WALKS - 2:
            s, held = min(max(s, 0.0), 1.0), True
        else:
            edge, s = onward, 0.5
        tolerance *= 16.0
    contacts.face[c], contacts.point[c] = edge, s
    a, b = line.edges[edge, 0], line.edges[edge, 1]
    contacts.weight[c, 0], contacts.weight[c, 1] = 1.0 - s, s
    inverse_mass = contacts.share[c] / mass[node]
    ur = px - contacts.last_position[node, 0]
    uz = pz - contacts.last_position[node, 2]
    for k in range(2):
        other, weight = line.edges[edge, k], contacts.weight[c, k]
        inverse_mass += weight * max(contacts.load[other], weight) / mass[other]
        ur -= weight * (position[other, 0] - contacts.last_position[other, 0])
        uz -= weight * (position[other, 2] - contacts.last_position[other, 2])
    # A node that has left over an end may come back behind the line: it is free for good. One that did not touch is
    # met no deeper than it can have come in this step, and a little more, since the line bends.
    reach, old = 0.5 * _OFF_END * size, contacts.stiffness[c]
    entered = _ENTRY * np.sqrt(ur * ur + uz * uz) + _BENT * reach
    off = contacts.off[c] != 0 or beyond > reach or gap < -reach or (old == 0.0 and gap < -entered)
    contacts.off[c] = off
    stiffness = law.budget / inverse_mass
    unreacted = 1.0 - burnt
    area = abs(_ring_area(c, contacts, position, nr, nz))
    whole = contacts.bonded[c] != 0 and unreacted > 0.0
    was_bonded, old_gap, old_slip = contacts.bonded[c] != 0, contacts.gap[c], contacts.slip[c]
    press = burnt * max(pressure, 0.0) * area - stiffness * gap
    apart = off or press <= (-law.tensile_strength * unreacted * area if whole else 0.0)
    if apart:
        press = 0.0
    slip = old_slip - ur * nz + uz * nr
    # Where friction would hold more than the explosive bears, it is the explosive that yields.
    limit = max((law.cohesion * area if whole else 0.0) + press * law.friction, 0.0)
    limit = unreacted * min(limit, contacts.strength[c] * area)
    heat, kept = 0.0, 0.0
    if apart:
        heat = 0.5 * old * old_slip * old_slip
        slip, stiffness, whole = 0.0, 0.0, False
    else:
        kept = abs(slip)
        if stiffness * kept > limit:
            heat = 0.5 * (old * abs(old_slip) + limit) * (kept - limit / stiffness)
            slip = np.copysign(limit / stiffness, slip)
            kept = limit / stiffness
            whole = False
    before = 0.5 * old * (old_gap * old_gap + old_slip * old_slip)
    stored = 0.5 * stiffness * (gap * gap + kept * kept)
    contacts.tally[c, 3] = max(-gap, 0.0) if not apart else 0.0
    contacts.bonded[c] = 1 if (whole and was_bonded) else 0
    contacts.gap[c], contacts.stiffness[c], contacts.slip[c] = gap, stiffness, slip
    contacts.force[c, 0] = press * nr + stiffness * slip * nz
    contacts.force[c, 1] = press * nz - stiffness * slip * nr
    taken -= 0.5 * _work(c, line, contacts, position)
    contacts.tally[c, 0], contacts.tally[c, 1] = stored, heat
    contacts.tally[c, 2] = stored - before + heat - taken


@block_kernel
def _work(c: int, line: SlideLine, contacts: LineContacts, position: np.ndarray) -> float:
    """Work (J) of a contact's force on the displacement of its node relative to the line since the last step."""
    work, node = 0.0, contacts.slave[c]
    for i in range(2):
        moved = position[node, 2 * i] - contacts.last_position[node, 2 * i]
        for k in range(2):
            other = line.edges[contacts.face[c], k]
            moved -= contacts.weight[c, k] * (position[other, 2 * i] - contacts.last_position[other, 2 * i])
        work += contacts.force[c, i] * moved
    return work


@block_kernel
def _ring_area(c: int, contacts: LineContacts, position: np.ndarray, nr: float, nz: float) -> float:
    """The contact's share of the charge's surface, projected on the normal (m2): what a pressure there acts on.

    An edge from a to b gives a the share 2 pi (2 r_a + r_b) / 6 of its length times its normal.
    """
    total, node = 0.0, contacts.slave[c]
    for k in range(2):
        a, b = contacts.side[c, k, 0], contacts.side[c, k, 1]
        if a >= 0:
            other = b if a == node else a
            radius = 2.0 * np.pi / 6.0 * (2.0 * position[node, 0] + position[other, 0])
            dr, dz = position[b, 0] - position[a, 0], position[b, 2] - position[a, 2]
            total += radius * (dz * nr - dr * nz)
    return total
