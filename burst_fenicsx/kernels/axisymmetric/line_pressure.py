"""The gas's pressure on the slide line: spread over its nodes by the integral of both sides' shape functions.

A mortar method: an even pressure loads the casing evenly wherever the charge's nodes have slid to. In three dimensions
each node's pressure goes to the corners of its face alone, which does there; in the meridian nodes then leave the
line.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.axisymmetric.line_points import SPREAD, LineContacts, SlideLine, edge_weight
from burst_fenicsx.kernels.lanes import inlined_kernel

__all__ = ["spread_pressure"]

_MOST_EDGES = 24  # of the line under one edge of the charge
_GAUSS = 0.5 / np.sqrt(3.0)


@inlined_kernel
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


@inlined_kernel
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
            own = edge_weight(ar, position[b, 0]) * length * contacts.weight[c, k]
            other = edge_weight(position[b, 0], ar) * length * contacts.weight[d, k]
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
            weight = np.pi * abs(ar + x * dr)
            weight = weight * (to - t) * np.sqrt(square)
            for k in range(2):
                node, own = line.edges[edge, k], (y if k == 1 else 1.0 - y) * weight
                _add_spread(c, node, (1.0 - x) * own, contacts)
                _add_spread(d, node, x * own, contacts)
        if edge == last:
            return
        edge, s, t = line.neighbour[edge, 1], 0.0, to


@inlined_kernel
def _leads_on(edge: int, last: int, line: SlideLine) -> bool:
    """Whether the line leads from an edge on to another over so few that pressure is spread over them."""
    for _ in range(_MOST_EDGES):
        if edge == last:
            return True
        edge = line.neighbour[edge, 1]
        if edge < 0:
            return False
    return False


@inlined_kernel
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
