"""The slide line in the meridian: its edges, the contacts of the charge's nodes on it, and where each node lies.

The casing's edges have a normal interpolated between those of their ends, so that it is continuous from edge to edge. A
node belongs to the point of the line from which the normal there leads to it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.constants import OFF_EDGE
from burst_fenicsx.kernels.contact.slide_law import has_left
from burst_fenicsx.kernels.lanes import inlined_kernel, lane_function

__all__ = ["SPREAD", "LineContacts", "SlideLine", "boundary_vectors", "edge_weight", "find_point", "relative_velocity"]

_NEWTON, _WALKS = 12, 10
_CLOSE = 1e-13  # change of an edge's coordinate below which a point is found
SPREAD = 32
"""Most nodes of the line over which the pressure of one node of the charge is spread."""


class SlideLine(NamedTuple):
    """Edges that the charge may slide on; a group is a node with those of its edges that are smooth together."""

    edges: np.ndarray  # (edges, 2) int32 nodes of casing or fuze; the charge lies to the right of their direction
    neighbour: np.ndarray  # (edges, 2) int32, edge beyond each end; -1 beyond a crease
    across: np.ndarray  # (edges, 2) int32, edge beyond a crease that is hollow towards the charge; else -1
    end: np.ndarray  # (edges, 2) int32, group of each end
    sides: np.ndarray  # (groups, 2) int32, edges of each group, -1 for none
    on_axis: np.ndarray  # (groups,) bool, whether the group's node lies on the axis, beyond which its edge is mirrored
    vector: np.ndarray  # (groups, 2) m, sum of the edges' lengths times their normals (r, z)
    nodes: np.ndarray  # (line nodes,) int32, all nodes of the line and all of the charge on it


class LineContacts(NamedTuple):
    """A contact for every group that the charge lies on: a node of the charge on one smooth line."""

    slave: np.ndarray  # (contacts,) int32 node of the charge
    of_node: np.ndarray  # (contacts,) number of the node's contacts
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
    tally: np.ndarray  # (contacts, 3), as of `SlideContacts`
    span: np.ndarray  # (spans, 2) int32, contacts at the ends of each edge of the charge, in the line's direction
    spread_over: np.ndarray  # (contacts, SPREAD) int32, nodes of the line that bear the pressure
    spread: np.ndarray  # (contacts, SPREAD) their shares, which add up to one
    spread_count: np.ndarray  # (contacts,) int32
    pressing: np.ndarray  # (contacts, 2) N (r, z), the gas's own pressure on the charge's node
    normal: np.ndarray  # (contacts, 2) of the line at the contact, towards the charge
    load: np.ndarray  # (nodes,) sum of the weights with which contacts lie on a node


@inlined_kernel
def relative_velocity(c: int, line: SlideLine, contacts: LineContacts, velocity: np.ndarray) -> tuple[float, float]:
    """Velocity (r, z) in m/s of a contact's node relative to the point of the edge on which it lies."""
    node, edge = contacts.slave[c], contacts.face[c]
    r, z = velocity[node, 0], velocity[node, 2]
    for k in range(2):
        other, weight = line.edges[edge, k], contacts.weight[c, k]
        r -= weight * velocity[other, 0]
        z -= weight * velocity[other, 2]
    return r, z


@lane_function
def edge_weight(near: float, far: float) -> float:
    """Integral along an edge, over its length, of the weight times the shape function of the end at radius `near`."""
    return 2.0 * np.pi / 6.0 * (2.0 * near + far)


@inlined_kernel
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


@inlined_kernel
def find_point(
    c: int, step: float, line: SlideLine, contacts: LineContacts, position: np.ndarray, velocity: np.ndarray
) -> None:
    """Find the point of the line at which a contact lies after a step (s), its gap and normal, and whether it has left.

    `velocity` (nodes, 3) is the mean one over the step (m/s).
    """
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
        if onward < 0 and contacts.of_node[c] < 1.5:
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
    vr, vz = relative_velocity(c, line, contacts, velocity)
    # Of the edge's length, half of it at a free end, where one edge alone counts.
    reach = 0.5 * OFF_EDGE * size
    moved = step * np.sqrt(vr * vr + vz * vz)
    if contacts.off[c] == 0 and has_left(beyond, gap, reach, moved, contacts.stiffness[c] > 0.0):
        contacts.off[c] = 1
    contacts.gap[c] = gap
