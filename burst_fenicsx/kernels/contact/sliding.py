"""Sliding of a charge's surface nodes on the casing's faces: where each lies, what presses, what rubs (Eqs. 12-18).

The casing's faces are quadrilaterals with a normal interpolated between those of their corners, so that it is
continuous from face to face. A node lies at the point of the surface from which the normal there leads to it; it is
followed from face to face as it slides. Its force acts along that line and is shared by the face's corners with their
weights: linear and angular momentum are kept.

What they do to each other is `slide_law`'s.

The contacts are worked on sixteen at a time, as cells are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.constants import OFF_EDGE
from burst_fenicsx.kernels.contact.coulomb import add_product, product, trial_slip
from burst_fenicsx.kernels.contact.slide_law import SlideLaw, around, has_left, slide
from burst_fenicsx.kernels.contact.slide_points import (
    BEYOND,
    ETA,
    FOUND,
    NODE,
    PLACE,
    POINT_ROWS,
    VECTOR,
    XI,
    SlideSurface,
    find_inner_points,
    find_points,
    stays_inside,
)
from burst_fenicsx.kernels.lanes import LANES, block_kernel, kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import ChargeState
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.nodal_values import cells_of_lanes
from burst_fenicsx.kernels.vectors.tensors import Vector, load_vector, store_vector
from burst_fenicsx.kernels.vectors.transposition import WIDTH, address, addresses, load_triples, prefetch

__all__ = [
    "NodeMotion",
    "SlideContacts",
    "add_slide_forces",
    "attached_state",
    "find_slide_forces",
]


class NodeMotion(NamedTuple):
    """Nodes as contact sees them."""

    position: np.ndarray  # (nodes, 3) m
    velocity: np.ndarray  # (nodes, 3) m/s, the mean over contact's step
    mass: np.ndarray  # (nodes,) kg


class SlideContacts(NamedTuple):
    """A contact for every group: a node of the charge on one smooth surface."""

    contact: np.ndarray  # (own contacts,) int32, those that this rank computes
    slave: np.ndarray  # (contacts,) int32 local node of the charge, -1 where this rank does not compute it
    row: np.ndarray  # (contacts,) int32 row of the charge's node among the interface nodes
    of_node: np.ndarray  # (contacts,) number of the node's contacts
    cells: np.ndarray  # (contacts,) number of the charge's cells around the node
    strength: np.ndarray  # (contacts,) Pa, shear strength of the unreacted explosive
    area: np.ndarray  # (contacts, 3) m2, four times the charge's own area vector of the contact, now
    face: np.ndarray  # (contacts,) int32, face on which it lies
    point: np.ndarray  # (contacts, 2) coordinates -1 to 1 in it
    bonded: np.ndarray  # (contacts,) int8, 1 until broken or burnt
    gap: np.ndarray  # (contacts,) m, negative where the charge lies inside the casing
    stiffness: np.ndarray  # (contacts,) N/m of the last step, 0 where nothing touched
    slip: np.ndarray  # (contacts, 3) m, tangential displacement that the spring holds
    weight: np.ndarray  # (contacts, 4) of the face's corners
    force: np.ndarray  # (contacts, 3) N on the charge's node
    off: np.ndarray  # (contacts,) int8, 1 where the node has left its surface over an edge or has only released cells
    tally: np.ndarray  # (contacts, 3) J stored in springs, J of friction in this step, penetration (m)
    load: np.ndarray  # (rows,) sum of the weights with which contacts lie on a node of the casing


_RUN = 1024  # contacts that share scratch
_AHEAD, _NODE_BYTES = 24, np.uint64(24)  # nodes lie scattered: those of the contact so many later are fetched now

# Rows of the scratch of forces, behind those of points. Of the charge's node: velocity, mass, sums over the cells
# around it and their number.
_SPEED, _MASS, _STATE, _CELLS = POINT_ROWS, POINT_ROWS + 3, POINT_ROWS + 4, POINT_ROWS + 7
# Of the face: velocities, masses, loads and weights of the corners. The contact's force.
_SPEEDS, _MASSES, _LOADS = POINT_ROWS + 8, POINT_ROWS + 20, POINT_ROWS + 24
_WEIGHT, _FORCE = POINT_ROWS + 28, POINT_ROWS + 32
# The contact's state.
_OF_NODE, _STRENGTH, _AREA, _BONDED = POINT_ROWS + 35, POINT_ROWS + 36, POINT_ROWS + 37, POINT_ROWS + 40
_STIFFNESS, _SLIP, _OFF, _TALLY = POINT_ROWS + 41, POINT_ROWS + 42, POINT_ROWS + 45, POINT_ROWS + 46
_ROWS = POINT_ROWS + 49
# Rows of the scratch of numbers: contacts, their nodes and rows, corners of their faces and the corners' groups.
_CONTACT, _OWN_NODE, _OWN_ROW, _CORNER, _GROUP, _NUMBERS = 0, 1, 2, 3, 7, 11


@kernel
def attached_state(
    first: np.ndarray,
    cells: np.ndarray,
    rows: np.ndarray,
    charge: ChargeState,
    eroded: np.ndarray,
    slot: np.ndarray,
    rounding: tuple[float, float],
    total: np.ndarray,
) -> None:
    """Sums `total` (rows, 3), exact, over the charge's cells around the interface nodes `rows` (k,), see `around`.

    The cells of row k are `cells` from `first[k]` to `first[k + 1]`.
    """
    on_threads(rows.size, _attached_some, (first, cells, rows, charge, eroded, slot, rounding, total))


@kernel
def _attached_some(
    start: int,
    stop: int,
    first: np.ndarray,
    cells: np.ndarray,
    rows: np.ndarray,
    charge: ChargeState,
    eroded: np.ndarray,
    slot: np.ndarray,
    rounding: tuple[float, float],
    total: np.ndarray,
) -> None:
    for k in range(start, stop):
        chosen = cells[first[k] : first[k + 1]]
        burnt, pressure, whole = around(chosen, charge, eroded, slot, rounding[0], rounding[1])
        total[rows[k], 0], total[rows[k], 1], total[rows[k], 2] = burnt, pressure, whole


@kernel
def find_slide_forces(
    law: SlideLaw,
    surface: SlideSurface,
    contacts: SlideContacts,
    attached: np.ndarray,
    casing: NodeMotion,
    charge: NodeMotion,
) -> None:
    """Find every contact's point and force, and advance its state.

    `attached` (rows, 3) are the sums of `attached_state`; `casing` are the casing's interface nodes by row, `charge`
    this rank's nodes.
    """
    runs = (contacts.contact.size + _RUN - 1) // _RUN
    on_threads(runs, _slide_runs, (law, surface, contacts, attached, casing, charge))


@kernel
def _slide_runs(
    start: int,
    stop: int,
    law: SlideLaw,
    surface: SlideSurface,
    contacts: SlideContacts,
    attached: np.ndarray,
    casing: NodeMotion,
    charge: NodeMotion,
) -> None:
    work, number = np.zeros(_ROWS * LANES), np.zeros(_NUMBERS * LANES, dtype=np.int64)
    face, found, lanes = np.empty(_RUN, dtype=np.int32), np.empty((_RUN, 6)), np.zeros((4, LANES), dtype=np.int64)
    wandering = np.empty(_RUN, dtype=np.int32)
    for run in range(start, stop):
        chosen = contacts.contact[run * _RUN : min((run + 1) * _RUN, contacts.contact.size)]
        count = 0
        for first in range(0, chosen.size, LANES):
            size = min(LANES, chosen.size - first)
            _load(first, size, chosen, surface, contacts, attached, casing, charge, number, work)
            find_inner_points(work)
            _press(law, work)
            _store(first, size, chosen, True, contacts, work)
            for lane in range(size):
                if not stays_inside(work, lane):
                    wandering[count] = chosen[first + lane]
                    count += 1
        # Those that have come to another face, or to the surface's edge.
        chosen = wandering[:count]
        for k in range(count):
            face[k] = contacts.face[chosen[k]]
        find_points(
            chosen, contacts.slave, charge.position, charge.velocity, surface, casing.position, face, contacts.point,
            found, work, lanes,
        )  # fmt: skip
        for k in range(count):
            contacts.face[chosen[k]] = face[k]
        for first in range(0, count, LANES):
            size = min(LANES, count - first)
            _load(first, size, chosen, surface, contacts, attached, casing, charge, number, work)
            for lane in range(size):
                for i in range(found.shape[1]):
                    work[(FOUND + i) * LANES + lane] = found[first + lane, i]
            _press(law, work)
            _store(first, size, chosen, False, contacts, work)


@block_kernel
def _load(
    first: int,
    size: int,
    chosen: np.ndarray,
    surface: SlideSurface,
    contacts: SlideContacts,
    attached: np.ndarray,
    casing: NodeMotion,
    charge: NodeMotion,
    number: np.ndarray,
    work: np.ndarray,
) -> None:
    """Gather what the `chosen` contacts (k,) from `first` on know into lanes; those beyond `size` repeat the last."""
    faces, group, mass, load = surface.faces, surface.corner, casing.mass, contacts.load
    places, velocities = address(charge.position), address(charge.velocity)
    for lane in range(LANES):
        k = first + min(lane, size - 1)
        later = _NODE_BYTES * np.uint64(contacts.slave[chosen[min(k + _AHEAD, chosen.size - 1)]])
        prefetch(places + later)
        prefetch(velocities + later)
        c = np.uint64(chosen[k])
        node, now = np.uint64(contacts.slave[c]), np.uint64(contacts.face[c])
        number[_CONTACT * LANES + lane], number[_OWN_NODE * LANES + lane] = c, node
        number[_OWN_ROW * LANES + lane] = contacts.row[c]
        for n in range(4):
            corner = np.uint64(faces[now, n])
            number[(_CORNER + n) * LANES + lane], number[(_GROUP + n) * LANES + lane] = corner, group[now, n]
            work[(_MASSES + n) * LANES + lane], work[(_LOADS + n) * LANES + lane] = mass[corner], load[corner]
        work[XI * LANES + lane], work[ETA * LANES + lane] = contacts.point[c, 0], contacts.point[c, 1]
        work[_MASS * LANES + lane], work[_CELLS * LANES + lane] = charge.mass[node], contacts.cells[c]
        work[_OF_NODE * LANES + lane], work[_STRENGTH * LANES + lane] = contacts.of_node[c], contacts.strength[c]
        work[_BONDED * LANES + lane] = contacts.bonded[c]
        work[_STIFFNESS * LANES + lane] = contacts.stiffness[c]
        work[_OFF * LANES + lane] = 1.0 if contacts.off[c] != 0 else 0.0
    _load_vectors(_CONTACT, contacts.area, _AREA, number, work)
    _load_vectors(_CONTACT, contacts.slip, _SLIP, number, work)
    _load_vectors(_OWN_ROW, attached, _STATE, number, work)
    _load_vectors(_OWN_NODE, charge.position, NODE, number, work)
    _load_vectors(_OWN_NODE, charge.velocity, _SPEED, number, work)
    for n in range(4):
        _load_vectors(_CORNER + n, casing.position, PLACE + 3 * n, number, work)
        _load_vectors(_CORNER + n, casing.velocity, _SPEEDS + 3 * n, number, work)
        _load_vectors(_GROUP + n, surface.vector, VECTOR + 3 * n, number, work)


@lane_function
def _load_vectors(numbers: int, vectors: np.ndarray, row: int, number: np.ndarray, work: np.ndarray) -> None:
    """Gather `vectors` (n, 3) of the lanes' `numbers`, a row of them, into three rows of the scratch."""
    start = address(vectors)
    for lane in range(0, LANES, WIDTH):
        members = cells_of_lanes(number, numbers * LANES + lane)
        load_triples(addresses(start, _NODE_BYTES, members), work, row * LANES + lane)


@lane_function
def _relative(work: np.ndarray, lane: int) -> Vector:
    """Velocity (m/s) of a charge's node relative to the weighted corners of its face."""
    v = load_vector(work, _SPEED, lane)
    v = add_product(v, -work[_WEIGHT * LANES + lane], load_vector(work, _SPEEDS, lane))
    v = add_product(v, -work[(_WEIGHT + 1) * LANES + lane], load_vector(work, _SPEEDS + 3, lane))
    v = add_product(v, -work[(_WEIGHT + 2) * LANES + lane], load_vector(work, _SPEEDS + 6, lane))
    return add_product(v, -work[(_WEIGHT + 3) * LANES + lane], load_vector(work, _SPEEDS + 9, lane))


@lane_function
def _weigh(k: int, s: float, t: float, inverse_mass: float, work: np.ndarray, lane: int) -> float:
    """Set the weight of the corner at xi = s, eta = t and add its share to the contact's inverse mass (1/kg)."""
    xi, eta = work[XI * LANES + lane], work[ETA * LANES + lane]
    weight = 0.25 * (1.0 + s * xi) * (1.0 + t * eta)
    work[(_WEIGHT + k) * LANES + lane] = weight
    return inverse_mass + weight * max(work[(_LOADS + k) * LANES + lane], weight) / work[(_MASSES + k) * LANES + lane]


@block_kernel
def _press(law: SlideLaw, work: np.ndarray) -> None:
    """Force, state and energies of sixteen contacts."""
    widest_vectors()
    for lane in range(LANES):
        inverse_mass = work[_OF_NODE * LANES + lane] / work[_MASS * LANES + lane]
        inverse_mass = _weigh(0, -1.0, -1.0, inverse_mass, work, lane)
        inverse_mass = _weigh(1, 1.0, -1.0, inverse_mass, work, lane)
        inverse_mass = _weigh(2, 1.0, 1.0, inverse_mass, work, lane)
        inverse_mass = _weigh(3, -1.0, 1.0, inverse_mass, work, lane)
        v = _relative(work, lane)
        n, gap = load_vector(work, FOUND + 1, lane), work[FOUND * LANES + lane]
        old = work[_STIFFNESS * LANES + lane]
        reach = OFF_EDGE * np.sqrt(0.25 * work[(FOUND + 4) * LANES + lane])
        left = has_left(work[BEYOND * LANES + lane], gap, reach, law.step * np.sqrt(product(v, v)), old != 0.0)
        # Products of which nothing is left hold no place any more.
        off = (work[_OFF * LANES + lane] != 0.0) | left | (work[(_STATE + 2) * LANES + lane] == 0.0)
        count = max(work[_CELLS * LANES + lane], 1.0)
        # Tangential displacement of the spring, turned into today's plane and moved on by this step (Eq. 13).
        old_slip = load_vector(work, _SLIP, lane)
        slip, length = trial_slip(old_slip, law.step, v, n)
        whole, gas, stiffness, kept, stored, heat, depth = slide(
            law,
            work[_BONDED * LANES + lane] != 0.0,
            off,
            min(work[_STATE * LANES + lane] / count, 1.0),
            work[(_STATE + 1) * LANES + lane] / count,
            work[_STRENGTH * LANES + lane],
            0.25 * abs(product(load_vector(work, _AREA, lane), n)),
            gap,
            law.max_squared_frequency / inverse_mass,
            length,
            old,
            np.sqrt(product(old_slip, old_slip)),
        )
        press = gas - stiffness * gap
        shrink = kept / length if kept < length else 1.0
        slip = (shrink * slip[0], shrink * slip[1], shrink * slip[2])
        force = (
            press * n[0] - stiffness * slip[0],
            press * n[1] - stiffness * slip[1],
            press * n[2] - stiffness * slip[2],
        )
        store_vector((stored, heat, depth), work, _TALLY, lane)
        work[_BONDED * LANES + lane] = 1.0 if whole else 0.0
        work[_OFF * LANES + lane] = 1.0 if off else 0.0
        work[_STIFFNESS * LANES + lane] = stiffness
        store_vector(slip, work, _SLIP, lane)
        store_vector(force, work, _FORCE, lane)


@block_kernel
def _store(first: int, size: int, chosen: np.ndarray, inside: bool, contacts: SlideContacts, work: np.ndarray) -> None:
    """Write the state of the `chosen` contacts (k,) from `first` on back; only those `inside` their faces, or all."""
    for lane in range(size):
        if inside and not stays_inside(work, lane):
            continue
        c = np.uint64(chosen[first + lane])
        contacts.point[c, 0], contacts.point[c, 1] = work[XI * LANES + lane], work[ETA * LANES + lane]
        contacts.gap[c], contacts.stiffness[c] = work[FOUND * LANES + lane], work[_STIFFNESS * LANES + lane]
        contacts.bonded[c], contacts.off[c] = work[_BONDED * LANES + lane], work[_OFF * LANES + lane]
        for i in range(3):
            contacts.slip[c, i] = work[(_SLIP + i) * LANES + lane]
            contacts.force[c, i] = work[(_FORCE + i) * LANES + lane]
            contacts.tally[c, i] = work[(_TALLY + i) * LANES + lane]
        for k in range(4):
            contacts.weight[c, k] = work[(_WEIGHT + k) * LANES + lane]


@kernel
def add_slide_forces(
    surface: SlideSurface,
    contacts: SlideContacts,
    rounding: float,
    load_rounding: float,
    sums: np.ndarray,
    force: np.ndarray,
) -> None:
    """Add the contacts' forces (N) to `force` of the charge's nodes and, with the loads, to `sums` (rows, 4), exactly.

    A load is the sum of the weights with which contacts lie on a node of the casing.
    """
    faces = surface.faces
    for c in contacts.contact:
        node, face = np.uint64(contacts.slave[c]), np.uint64(contacts.face[c])
        fx, fy, fz = contacts.force[c, 0], contacts.force[c, 1], contacts.force[c, 2]
        gx, gy, gz = 0.0, 0.0, 0.0
        for corner in range(4):
            other, weight = np.uint64(faces[face, corner]), contacts.weight[c, corner]
            # The node gets what the face's corners give, to the last bit; where nothing touches that is nothing.
            px, py, pz = (
                quantise(weight * fx, rounding),
                quantise(weight * fy, rounding),
                quantise(weight * fz, rounding),
            )
            sums[other, 0] -= px
            sums[other, 1] -= py
            sums[other, 2] -= pz
            sums[other, 3] += quantise(weight, load_rounding)
            gx, gy, gz = gx + px, gy + py, gz + pz
        force[node, 0] += gx
        force[node, 1] += gy
        force[node, 2] += gz
