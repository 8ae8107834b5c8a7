"""The casing's edges in the meridian as a line, and the contacts of the charge's nodes on it: arrays of their state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.lanes import block_kernel, lane_function

__all__ = ["SPREAD", "LineContacts", "SlideLine", "edge_weight", "moved"]

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
    tally: np.ndarray  # (contacts, 3), see `kernels.contact.sliding.COLUMNS`
    span: np.ndarray  # (spans, 2) int32, contacts at the ends of each edge of the charge, in the line's direction
    spread_over: np.ndarray  # (contacts, SPREAD) int32, nodes of the line that bear the pressure
    spread: np.ndarray  # (contacts, SPREAD) their shares, which add up to one
    spread_count: np.ndarray  # (contacts,) int32
    pressing: np.ndarray  # (contacts, 2) N (r, z), the gas's own pressure on the charge's node
    normal: np.ndarray  # (contacts, 2) of the line at the contact, towards the charge
    load: np.ndarray  # (nodes,) sum of the weights with which contacts lie on a node
    last_position: np.ndarray  # (nodes, 3) m at the last step of contact


@block_kernel
def moved(c: int, line: SlideLine, contacts: LineContacts, position: np.ndarray) -> tuple[float, float]:
    """Displacement (m) of a contact's node since the last step, relative to the point of the edge on which it lies."""
    node, edge = contacts.slave[c], contacts.face[c]
    r = position[node, 0] - contacts.last_position[node, 0]
    z = position[node, 2] - contacts.last_position[node, 2]
    for k in range(2):
        other, weight = line.edges[edge, k], contacts.weight[c, k]
        r -= weight * (position[other, 0] - contacts.last_position[other, 0])
        z -= weight * (position[other, 2] - contacts.last_position[other, 2])
    return r, z


@lane_function
def edge_weight(near: float, far: float) -> float:
    """Integral along an edge, over its length, of the weight times the shape function of the end at radius `near`."""
    return 2.0 * np.pi / 6.0 * (2.0 * near + far)
