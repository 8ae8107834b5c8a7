"""Sliding of a charge on its casing in the meridian: the slide surface of `kernels.sliding` as a line.

The casing's edges have a normal interpolated between those of their ends, so that it is continuous from edge to edge.
A node of the charge lies at the point of the line from which the normal there leads to it, and is followed as it
slides. Products press with their own pressure, corrected by a spring for what is left of the gap (Nitsche's method);
unreacted explosive is bonded by springs with tensile strength, cohesion and friction, which fade as it burns. Forces,
masses and areas are those of the whole ring.

The springs' forces are shared by the ends of the edge on which the node lies. The gas's pressure is spread over all
nodes of the line by the integral of the products of both sides' shape functions (a mortar method), so that an even
pressure loads the casing evenly wherever the charge's nodes have slid to: at the axis, where a ring's mass goes to
nothing, a load that is shared by one edge alone drives a jet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.lanes import block_kernel, kernel, lane_function
from burst_fenicsx.kernels.sliding import SlideLaw

__all__ = ["SPREAD", "LineContacts", "SlideLine", "add_line_forces", "boundary_vectors", "spread_pressure"]

_NEWTON, _WALKS = 12, 10
_CLOSE = 1e-13  # change of an edge's coordinate below which a point is found
_ENTRY = 1.5  # a node newly met lies no deeper than it can have come in this many steps ...
_BENT = 0.1  # ... and this share of the distance below
_MOST_EDGES = 24  # of the line under one edge of the charge
SPREAD = 32
"""Most nodes of the line over which the pressure of one node of the charge is spread."""
_GAUSS = 0.5 / np.sqrt(3.0)
_MOST_CORRECTION = 30.0  # force of the spring on products over that of their own pressure
_OFF_END = (
    0.5  # of the edge's length, half of it at a free end, where one edge alone counts: farther beyond, a node has left
)


class SlideLine(NamedTuple):
    """Edges that the charge may slide on; a group is a node with those of its edges that are smooth together."""

    edges: np.ndarray  # (edges, 2) int32 nodes of casing or fuze; the charge lies to the right of their direction
    metal: np.ndarray  # (edges,) int32, the cell of casing or fuze whose edge it is
    neighbour: np.ndarray  # (edges, 2) int32, edge beyond each end; -1 beyond a crease
    across: np.ndarray  # (edges, 2) int32, edge beyond a crease that is hollow towards the charge; else -1
    end: np.ndarray  # (edges, 2) int32, group of each end
    sides: np.ndarray  # (groups, 2) int32, edges of each group, -1 for none
    on_axis: np.ndarray  # (groups,) bool, whether the group's node lies on the axis, beyond which its edge is mirrored
    vector: np.ndarray  # (groups, 2) m, sum of the edges' lengths times their normals (r, z)
    nodes: np.ndarray  # (line nodes,) int32, all nodes of the line and all of the charge on it
    plane: bool  # whether areas are those per length of a plane section, and not those of rings


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
    force: np.ndarray  # (contacts, 2) N (r, z) of the springs on the charge's node
    off: np.ndarray  # (contacts,) int8, 1 where the node has left its line, 2 where it belongs to both sides
    tally: np.ndarray  # (contacts, 4), see `kernels.sliding.COLUMNS`
    span: np.ndarray  # (spans, 2) int32, contacts at the ends of each edge of the charge, in the line's direction
    spread_over: np.ndarray  # (contacts, SPREAD) int32, nodes of the line that bear the pressure
    spread: np.ndarray  # (contacts, SPREAD) their shares, which add up to one
    spread_count: np.ndarray  # (contacts,) int32
    pressing: np.ndarray  # (contacts, 2) N (r, z), the gas's own pressure on the charge's node
    normal: np.ndarray  # (contacts, 2) of the line at the contact, towards the charge
    taken: np.ndarray  # (contacts,) J, work taken in this step
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
    released: np.ndarray,
    position: np.ndarray,
    mass: np.ndarray,
    own: np.ndarray,
    force: np.ndarray,
) -> None:
    """Find every contact's point and force, advance its state, and add `share` of the forces (N) to those of the nodes.

    `burn_fraction` and `pressure` (cells,) Pa of the charge, `released` (cells,) whether a cell is no continuum any
    more; `position`, `mass` and `force` of the nodes; `own` (nodes, 3) receives the contacts' forces alone.
    """
    boundary_vectors(position, line)
    for c in range(contacts.slave.size):
        # Contact takes half of the last force and half of the new one on this step's relative displacement.
        contacts.taken[c] = -0.5 * _work(c, line, contacts, position)
        _find_point(c, line, contacts, position)
        if contacts.off[c] == 0 and _has_nothing_left(c, line, contacts, released):
            contacts.off[c] = 1
    spread_pressure(line, contacts, position)
    for c in range(contacts.slave.size):
        burnt, gas = 0.0, 0.0
        first, last = contacts.first_cell[c], contacts.first_cell[c + 1]
        for k in range(first, last):
            burnt += burn_fraction[contacts.cell[k]]
            gas += pressure[contacts.cell[k]]
        count = last - first
        _press(c, law, line, contacts, min(burnt / count, 1.0), gas / count, position, mass)
    for node in line.nodes:
        contacts.load[node] = 0.0
        for i in range(3):
            own[node, i] = 0.0
            contacts.last_position[node, i] = position[node, i]
    for c in range(contacts.slave.size):
        _share_force(c, line, contacts, own)
    for node in line.nodes:
        for i in range(3):
            force[node, i] += share * own[node, i]


@block_kernel
def _has_nothing_left(c: int, line: SlideLine, contacts: LineContacts, released: np.ndarray) -> bool:
    """Whether all products around a contact's node, or the metal that it lies on, have been released."""
    if released[line.metal[contacts.face[c]]] != 0:
        return True
    live = 0
    for k in range(contacts.first_cell[c], contacts.first_cell[c + 1]):
        live += 1 if released[contacts.cell[k]] == 0 else 0
    return live == 0


@block_kernel
def _share_force(c: int, line: SlideLine, contacts: LineContacts, own: np.ndarray) -> None:
    """Give a contact's force to its node and the opposite to the line: to each what the others lose."""
    node, edge = contacts.slave[c], contacts.face[c]
    for k in range(2):
        other = line.edges[edge, k]
        contacts.load[other] += contacts.weight[c, k]
        if contacts.stiffness[c] > 0.0:
            for i in range(2):
                part = contacts.weight[c, k] * contacts.force[c, i]
                own[other, 2 * i] -= part
                own[node, 2 * i] += part
    if contacts.stiffness[c] > 0.0:
        for k in range(contacts.spread_count[c]):
            other = contacts.spread_over[c, k]
            for i in range(2):
                part = contacts.spread[c, k] * contacts.pressing[c, i]
                own[other, 2 * i] -= part
                own[node, 2 * i] += part


@block_kernel
def _find_point(c: int, line: SlideLine, contacts: LineContacts, position: np.ndarray) -> None:
    """Find the point of the line at which a contact lies, its gap and normal, and whether it has left the line."""
    node = contacts.slave[c]
    px, pz = position[node, 0], position[node, 2]
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
        beyond_end = 0 if s < 0.0 else 1
        onward = line.neighbour[edge, beyond_end]
        if onward < 0 and contacts.share[c] < 1.5:
            # A node that slides into a hollow corner goes on along the other side; one that began there has both.
            onward = line.across[edge, beyond_end]
        if onward < 0 or walk == _WALKS - 2:
            s, held = min(max(s, 0.0), 1.0), True
        else:
            edge, s = onward, 0.5
        tolerance *= 16.0
    s = min(max(s, 0.0), 1.0)
    contacts.face[c], contacts.point[c] = edge, s
    contacts.weight[c, 0], contacts.weight[c, 1] = 1.0 - s, s
    contacts.normal[c, 0], contacts.normal[c, 1] = nr, nz
    ur, uz = _moved(c, line, contacts, position)
    # A node that has left over an end may come back behind the line: it is free for good. One that did not touch is
    # met no deeper than it can have come in this step, and a little more, since the line bends.
    reach = 0.5 * _OFF_END * size
    entered = _ENTRY * np.sqrt(ur * ur + uz * uz) + _BENT * reach
    met = contacts.stiffness[c] > 0.0
    if contacts.off[c] == 0 and (beyond > reach or (not met and gap < -min(entered, reach))):
        contacts.off[c] = 1
    contacts.gap[c] = gap


@block_kernel
def spread_pressure(line: SlideLine, contacts: LineContacts, position: np.ndarray) -> None:
    """Find over which nodes of the line, and in which shares, the pressure of every node of the charge is spread."""
    for c in range(contacts.slave.size):
        contacts.spread_count[c] = 0
    for k in range(contacts.span.shape[0]):
        _spread_span(contacts.span[k, 0], contacts.span[k, 1], line, contacts, position)
    for c in range(contacts.slave.size):
        total = 0.0
        for k in range(contacts.spread_count[c]):
            total += contacts.spread[c, k]
        if total > 0.0:
            for k in range(contacts.spread_count[c]):
                contacts.spread[c, k] /= total
        else:
            contacts.spread_count[c] = 0
            _add_spread(c, line.edges[contacts.face[c], 0], contacts.weight[c, 0], contacts)
            _add_spread(c, line.edges[contacts.face[c], 1], contacts.weight[c, 1], contacts)


@block_kernel
def _spread_span(c: int, d: int, line: SlideLine, contacts: LineContacts, position: np.ndarray) -> None:
    """Spread over the line the shares of an edge of the charge between two contacts."""
    a, b = contacts.slave[c], contacts.slave[d]
    ar, az = position[a, 0], position[a, 2]
    dr, dz = position[b, 0] - ar, position[b, 2] - az
    square = dr * dr + dz * dz
    edge, last = contacts.face[c], contacts.face[d]
    s, t = contacts.point[c], 0.0
    if not _leads_on(edge, last, line) or (edge == last and contacts.point[d] <= s):
        # Nodes that have changed places or have lost each other press where they are.
        length = np.sqrt(square)
        for k in range(2):
            own = _weight(line.plane, ar, position[b, 0]) * length * contacts.weight[c, k]
            other = _weight(line.plane, position[b, 0], ar) * length * contacts.weight[d, k]
            _add_spread(c, line.edges[edge, k], own, contacts)
            _add_spread(d, line.edges[last, k], other, contacts)
        return
    for _ in range(_MOST_EDGES + 1):
        until = contacts.point[d] if edge == last else 1.0
        if edge == last:
            to = 1.0
        else:
            end = line.edges[edge, 1]
            to = ((position[end, 0] - ar) * dr + (position[end, 2] - az) * dz) / square
            to = min(max(to, t), 1.0)
        for sign in (-1.0, 1.0):
            at = 0.5 + sign * _GAUSS
            x, y = t + at * (to - t), s + at * (until - s)
            weight = 0.5 if line.plane else np.pi * abs(ar + x * dr)
            weight = weight * (to - t) * np.sqrt(square)
            for k in range(2):
                node, own = line.edges[edge, k], (y if k == 1 else 1.0 - y) * weight
                _add_spread(c, node, (1.0 - x) * own, contacts)
                _add_spread(d, node, x * own, contacts)
        if edge == last:
            return
        edge, s, t = line.neighbour[edge, 1], 0.0, to


@block_kernel
def _leads_on(edge: int, last: int, line: SlideLine) -> bool:
    """Whether the line leads from an edge on to another over so few that pressure is spread over them."""
    for _ in range(_MOST_EDGES):
        if edge == last:
            return True
        edge = line.neighbour[edge, 1]
        if edge < 0:
            return False
    return False


@block_kernel
def _add_spread(c: int, node: int, weight: float, contacts: LineContacts) -> None:
    """Add a weight to a node's share of the pressure of a contact."""
    count = contacts.spread_count[c]
    for k in range(count):
        if contacts.spread_over[c, k] == node:
            contacts.spread[c, k] += weight
            return
    if count == SPREAD:  # what is beyond the most goes to the last
        contacts.spread[c, count - 1] += weight
        return
    contacts.spread_over[c, count], contacts.spread[c, count] = node, weight
    contacts.spread_count[c] = count + 1


@block_kernel
def _press(
    c: int,
    law: SlideLaw,
    line: SlideLine,
    contacts: LineContacts,
    burnt: float,
    pressure: float,
    position: np.ndarray,
    mass: np.ndarray,
) -> None:
    """Force of a contact by its gap, its slip and the gas around its node; its energies."""
    node, edge, gap = contacts.slave[c], contacts.face[c], contacts.gap[c]
    nr, nz = contacts.normal[c, 0], contacts.normal[c, 1]
    inverse_mass = contacts.share[c] / mass[node]
    for k in range(2):
        other, weight = line.edges[edge, k], contacts.weight[c, k]
        inverse_mass += weight * max(contacts.load[other], weight) / mass[other]
    ur, uz = _moved(c, line, contacts, position)
    stiffness, old = law.budget / inverse_mass, contacts.stiffness[c]
    unreacted = 1.0 - burnt
    area = abs(_ring_area(c, line, contacts, position, nr, nz))
    was_bonded, old_slip = contacts.bonded[c] != 0, contacts.slip[c]
    whole = was_bonded and unreacted > 0.0
    gas = burnt * max(pressure, 0.0) * area
    # Of products the spring corrects the gas's own pressure, by so much at most: where a strengthless wall has folded,
    # a node that is suddenly far from the line would else be shot off by a spring as stiff as the step bears.
    most = _MOST_CORRECTION * gas
    if burnt == 1.0 and stiffness * abs(gap) > most:
        stiffness = most / abs(gap)
    press = gas - stiffness * gap
    # Products fill what they are in: their surface does not leave the casing, unless over an end of the line.
    tension = np.inf if burnt == 1.0 else (law.tensile_strength * unreacted * area if whole else 0.0)
    apart = contacts.off[c] != 0 or press <= -tension
    slip = old_slip - ur * nz + uz * nr
    # Where friction would hold more than the explosive bears, it is the explosive that yields.
    limit = max((law.cohesion * area if whole else 0.0) + press * law.friction, 0.0)
    limit = unreacted * min(limit, contacts.strength[c] * area)
    heat, kept = 0.0, 0.0
    if apart:
        heat = 0.5 * old * old_slip * old_slip
        slip, stiffness, gas, whole = 0.0, 0.0, 0.0, False
    else:
        kept = abs(slip)
        if stiffness * kept > limit:
            heat = 0.5 * (old * abs(old_slip) + limit) * (kept - limit / stiffness)
            slip = np.copysign(limit / stiffness, slip)
            kept = limit / stiffness
            whole = False
    before = contacts.tally[c, 0]
    stored = 0.5 * stiffness * (gap * gap + kept * kept)
    contacts.tally[c, 3] = max(-gap, 0.0) if not apart else 0.0
    contacts.bonded[c] = 1 if whole else 0
    contacts.stiffness[c], contacts.slip[c] = stiffness, slip
    contacts.pressing[c, 0], contacts.pressing[c, 1] = gas * nr, gas * nz
    contacts.force[c, 0] = -stiffness * (gap * nr - slip * nz)
    contacts.force[c, 1] = -stiffness * (gap * nz + slip * nr)
    taken = contacts.taken[c] - 0.5 * _work(c, line, contacts, position)
    contacts.tally[c, 0], contacts.tally[c, 1] = stored, heat
    contacts.tally[c, 2] = stored - before + heat - taken


@block_kernel
def _moved(c: int, line: SlideLine, contacts: LineContacts, position: np.ndarray) -> tuple[float, float]:
    """Displacement (m) of a contact's node since the last step, relative to the point of the edge on which it lies."""
    node, edge = contacts.slave[c], contacts.face[c]
    r = position[node, 0] - contacts.last_position[node, 0]
    z = position[node, 2] - contacts.last_position[node, 2]
    for k in range(2):
        other, weight = line.edges[edge, k], contacts.weight[c, k]
        r -= weight * (position[other, 0] - contacts.last_position[other, 0])
        z -= weight * (position[other, 2] - contacts.last_position[other, 2])
    return r, z


@block_kernel
def _work(c: int, line: SlideLine, contacts: LineContacts, position: np.ndarray) -> float:
    """Work (J) of a contact's forces on the displacement of its node relative to the line since the last step."""
    r, z = _moved(c, line, contacts, position)
    work = contacts.force[c, 0] * r + contacts.force[c, 1] * z
    node = contacts.slave[c]
    r = position[node, 0] - contacts.last_position[node, 0]
    z = position[node, 2] - contacts.last_position[node, 2]
    for k in range(contacts.spread_count[c]):
        other, weight = contacts.spread_over[c, k], contacts.spread[c, k]
        r -= weight * (position[other, 0] - contacts.last_position[other, 0])
        z -= weight * (position[other, 2] - contacts.last_position[other, 2])
    return work + contacts.pressing[c, 0] * r + contacts.pressing[c, 1] * z


@block_kernel
def _ring_area(c: int, line: SlideLine, contacts: LineContacts, position: np.ndarray, nr: float, nz: float) -> float:
    """The contact's share of the charge's surface, projected on the normal (m2): what a pressure there acts on.

    An edge from a to b gives a the share 2 pi (2 r_a + r_b) / 6 of its length times its normal, in a section half.
    """
    total, node = 0.0, contacts.slave[c]
    for k in range(2):
        a, b = contacts.side[c, k, 0], contacts.side[c, k, 1]
        if a >= 0:
            other = b if a == node else a
            weight = _weight(line.plane, position[node, 0], position[other, 0])
            dr, dz = position[b, 0] - position[a, 0], position[b, 2] - position[a, 2]
            total += weight * (dz * nr - dr * nz)
    return total


@lane_function
def _weight(plane: bool, near: float, far: float) -> float:
    """Integral along an edge, over its length, of the weight times the shape function of the end at radius `near`."""
    return 0.5 if plane else 2.0 * np.pi / 6.0 * (2.0 * near + far)
