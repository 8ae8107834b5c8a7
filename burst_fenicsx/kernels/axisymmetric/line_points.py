"""Where a node of the charge lies on the slide line: the point from which the line's continuous normal leads to it.

The casing's edges have a normal interpolated between those of their ends, so that it is continuous from edge to edge.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.axisymmetric.line_state import LineContacts, SlideLine, moved
from burst_fenicsx.kernels.constants import OFF_EDGE
from burst_fenicsx.kernels.contact.slide_law import has_left
from burst_fenicsx.kernels.lanes import block_kernel

__all__ = ["boundary_vectors", "find_point"]

_NEWTON, _WALKS = 12, 10
_CLOSE = 1e-13  # change of an edge's coordinate below which a point is found


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


@block_kernel
def find_point(c: int, line: SlideLine, contacts: LineContacts, position: np.ndarray) -> None:
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
    ur, uz = moved(c, line, contacts, position)
    # Of the edge's length, half of it at a free end, where one edge alone counts.
    reach = 0.5 * OFF_EDGE * size
    if contacts.off[c] == 0 and has_left(beyond, gap, reach, np.sqrt(ur * ur + uz * uz), contacts.stiffness[c] > 0.0):
        contacts.off[c] = 1
    contacts.gap[c] = gap
