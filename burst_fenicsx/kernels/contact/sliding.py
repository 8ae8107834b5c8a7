"""Charges on their casings: where each of a charge's surface nodes lies, what presses, what rubs (Eqs. 12-15).

Force and reaction act along the line that leads from the surface to the node and are shared by the facet's corners
with their weights: linear and angular momentum are kept.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.cells.erosion import WHOLE
from burst_fenicsx.kernels.constants import OFF_EDGE
from burst_fenicsx.kernels.contact.facets import Surface, area_vectors, find_point, group_vectors, weigh
from burst_fenicsx.kernels.contact.law import Law, add_product, bonded_spring, has_left, product
from burst_fenicsx.kernels.contact.pairs import Pairs, Rows, relative_motion
from burst_fenicsx.kernels.lanes import block_kernel, kernel, lane_function
from burst_fenicsx.kernels.state import ChargeState
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.tensors import Vector


class Attached(NamedTuple):
    """The charges' cells of this rank around nodes that slide."""

    row: np.ndarray  # (k,) int32 rows of the nodes
    first: np.ndarray  # (k + 1,) int32 into `cell`
    cell: np.ndarray  # int32
    slot: np.ndarray  # (cells,) int32, where each cell stands in `SolidState.eroded`
    roundings: tuple[float, float]  # constants of `quantise` for burn fractions and for pressures
    total: np.ndarray  # (rows, 3) sums, see `sum_attached`


class Bonds(NamedTuple):
    """What the contacts of charges have besides `Pairs`: one for each smooth group in which a charge's node lies."""

    group: np.ndarray  # (contacts,) int32
    of_node: np.ndarray  # (contacts,) number of the node's contacts
    cells: np.ndarray  # (contacts,) number of the charge's cells around the node, of all ranks
    strength: np.ndarray  # (contacts,) Pa, shear strength of the unreacted explosive
    beside: np.ndarray  # (facets, corners) int32 rows of the charge's nodes at each facet; -1 where none lies
    area: np.ndarray  # (facets, 3) area vectors of these facets of the charge (m2), of edges their lengths (m), now
    bonded: np.ndarray  # (contacts,) int8, 1 until broken or burnt
    off: np.ndarray  # (contacts,) int8, 1 where the node has left its surface or has only released cells, 2 where it
    # belongs to both sides


@block_kernel
def sum_attached(first: int, last: int, attached: Attached, charge: ChargeState, eroded: np.ndarray) -> None:
    """Sums over the cells around the nodes from `first` to `last` of `attached.row`, exact by `quantise`.

    These are burn fractions, pressures (Pa) after leakage, and the number of cells that have not been eroded.
    """
    burnt_rounding, pressure_rounding = attached.roundings
    for k in range(first, last):
        burnt, pressure, whole = 0.0, 0.0, 0.0
        for at in range(attached.first[k], attached.first[k + 1]):
            cell = np.uint64(attached.cell[at])
            burnt += quantise(charge.burn_fraction[cell], burnt_rounding)
            vented = charge.leakage[charge.axial_slice[cell]] * charge.pressure[cell]
            pressure += quantise(vented, pressure_rounding)
            whole += 1.0 if eroded[attached.slot[cell]] == WHOLE else 0.0
        row = attached.row[k]
        attached.total[row, 0], attached.total[row, 1], attached.total[row, 2] = burnt, pressure, whole


@kernel
def attached_state(attached: Attached, charge: ChargeState, eroded: np.ndarray) -> None:
    """As `sum_attached`, of all rows by all threads."""
    on_threads(attached.row.size, sum_attached, (attached, charge, eroded))


@kernel
def slide_charges(
    law: Law,
    facets: np.ndarray,
    groups: np.ndarray,
    surface: Surface,
    pairs: Pairs,
    bonds: Bonds,
    attached: np.ndarray,
    rows: Rows,
) -> None:
    """Find every contact's point and force, and advance its state; `facets` and `groups` are those around them.

    `attached` (rows, 3) are the sums of `sum_attached` over all ranks.
    """
    on_threads(facets.size, area_vectors, (facets, surface.facets, rows.position, surface.area))
    on_threads(facets.size, area_vectors, (facets, bonds.beside, rows.position, bonds.area))
    on_threads(groups.size, group_vectors, (groups, surface))
    on_threads(pairs.node.size, slide, (law, surface, pairs, bonds, attached, rows))


@block_kernel
def slide(
    first: int,
    last: int,
    law: Law,
    surface: Surface,
    pairs: Pairs,
    bonds: Bonds,
    attached: np.ndarray,
    rows: Rows,
) -> None:
    """As `slide_charges`, of the contacts from `first` to `last`."""
    corners, position = surface.facets.shape[1], rows.position
    for c in range(first, last):
        node, old_stiffness = np.uint64(pairs.node[c]), pairs.stiffness[c]
        x = (position[node, 0], position[node, 1], position[node, 2])
        single = bonds.of_node[c] < 1.5
        facet, xi, eta, gap, n, beyond, size = find_point(
            x, np.int64(pairs.facet[c]), pairs.point[c, 0], pairs.point[c, 1], single, surface, position
        )
        pairs.facet[c], pairs.gap[c] = facet, gap
        pairs.point[c, 0], pairs.point[c, 1] = xi, eta
        pairs.normal[c, 0], pairs.normal[c, 1], pairs.normal[c, 2] = n
        inverse = max(rows.load[node], bonds.of_node[c]) / rows.mass[node]
        for corner in range(corners):
            weight, other = weigh(corner, corners, xi, eta), np.uint64(surface.facets[facet, corner])
            pairs.weight[c, corner] = weight
            inverse += weight * max(rows.load[other], weight) / rows.mass[other]
        moved = relative_motion(c, law.step, pairs, surface.facets, rows)
        # Of an edge's or a face's size: at a rim, where some of them are missing, of less.
        reach = 0.5 * OFF_EDGE * (size if corners == 2 else np.sqrt(size))
        left = has_left(beyond, gap, reach, np.sqrt(product(moved, moved)), old_stiffness > 0.0)
        # Products of which nothing is left hold no place any more.
        if bonds.off[c] == 0 and (left or attached[node, 2] == 0.0):
            bonds.off[c] = 1
        count = max(bonds.cells[c], 1.0)
        old_slip = (pairs.slip[c, 0], pairs.slip[c, 1], pairs.slip[c, 2])
        gas, force, stiffness, slip, stored, heat, whole = bonded_spring(
            law, bonds.bonded[c] != 0, bonds.off[c] != 0, min(attached[node, 0] / count, 1.0),
            attached[node, 1] / count, bonds.strength[c], _area(c, n, surface, pairs, bonds, position), gap,
            law.max_squared_frequency / inverse, n, moved, old_slip, old_stiffness,
        )  # fmt: skip
        bonds.bonded[c] = 1 if whole else 0
        pairs.gas[c], pairs.stiffness[c] = gas, stiffness
        pairs.energies[c, 0], pairs.energies[c, 1] = stored, heat
        for i in range(3):
            pairs.slip[c, i], pairs.force[c, i] = slip[i], force[i]


@lane_function
def edge_weight(near: float, far: float) -> float:
    """Integral along an edge, over its length, of 2 pi r times the shape function of the end at radius `near` (m)."""
    return 2.0 * np.pi / 6.0 * (2.0 * near + far)


@lane_function
def _area(c: int, n: Vector, surface: Surface, pairs: Pairs, bonds: Bonds, position: np.ndarray) -> float:
    """A contact's part of the charge's surface, projected on the normal (m2): what a pressure acts on (Eq. 14)."""
    group, total = bonds.group[c], (0.0, 0.0, 0.0)
    for at in range(surface.first[group], surface.first[group + 1]):
        facet = np.uint64(surface.member[at])
        nodes, area = bonds.beside[facet], bonds.area
        if nodes[0] < 0:
            continue
        share = 0.25
        if nodes.size == 2:
            other = nodes[1] if nodes[0] == pairs.node[c] else nodes[0]
            share = edge_weight(position[pairs.node[c], 0], position[other, 0])
        total = add_product(total, share, (area[facet, 0], area[facet, 1], area[facet, 2]))
    return abs(product(total, n))
