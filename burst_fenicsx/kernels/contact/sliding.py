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

from burst_fenicsx.kernels.cells.erosion import WHOLE
from burst_fenicsx.kernels.constants import OFF_EDGE
from burst_fenicsx.kernels.contact.coulomb import add_product, product, trial_slip
from burst_fenicsx.kernels.contact.slide_law import SlideLaw, has_left, slide
from burst_fenicsx.kernels.contact.slide_points import (
    BEYOND,
    GAP,
    NORMAL,
    POINT_ROWS,
    SIZE,
    SlideSurface,
    find_points,
)
from burst_fenicsx.kernels.lanes import LANES, block_kernel, kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import ChargeState
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.tensors import Vector, load_vector, store_vector

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


_RUN = 512  # contacts that share scratch

# Rows of the scratch of forces. Of the charge's node: velocity, mass, sums over the cells around it and their number.
_SPEED, _MASS, _STATE, _CELLS = 0, 3, 4, 7
# Of the face: velocities, masses, loads and weights of the corners. The contact's force.
_SPEEDS, _MASSES, _LOADS, _WEIGHT, _FORCE = 8, 20, 24, 28, 32
# What `find_points` found, and the contact's state.
_XI, _ETA, _GAP, _NORMAL, _BEYOND, _SIZE = 35, 36, 37, 38, 41, 42
_OF_NODE, _STRENGTH, _AREA, _BONDED, _STIFFNESS, _SLIP, _OFF, _TALLY = 43, 44, 45, 48, 49, 50, 53, 54
_ROWS = 57


@kernel
def attached_state(
    first: np.ndarray,
    around: np.ndarray,
    cells: np.ndarray,
    rows: np.ndarray,
    charge: ChargeState,
    eroded: np.ndarray,
    slot: np.ndarray,
    rounding: tuple[float, float],
    total: np.ndarray,
) -> None:
    """Sums `total` (rows, 3), exact, over the charge's cells around the interface nodes `rows` (k,).

    Those of row k are the members `around`[first[k]:first[k + 1]] of `cells`. The columns are burn fractions and
    pressures (Pa) after leakage, rounded by `quantise` with these constants, and the number of cells not eroded.
    """
    values = np.empty((cells.size, 3))  # every cell lies at several nodes
    on_threads(cells.size, _cell_state, (cells, charge, eroded, slot, rounding, values))
    on_threads(rows.size, _attached_some, (first, around, rows, values, total))


@kernel
def _cell_state(
    start: int,
    stop: int,
    cells: np.ndarray,
    charge: ChargeState,
    eroded: np.ndarray,
    slot: np.ndarray,
    rounding: tuple[float, float],
    values: np.ndarray,
) -> None:
    for k in range(start, stop):
        cell = np.uint64(cells[k])
        vented = charge.leakage[charge.axial_slice[cell]] * charge.pressure[cell]
        values[k, 0] = quantise(charge.burn_fraction[cell], rounding[0])
        values[k, 1] = quantise(vented, rounding[1])
        values[k, 2] = 1.0 if eroded[slot[cell]] == WHOLE else 0.0


@kernel
def _attached_some(
    start: int,
    stop: int,
    first: np.ndarray,
    around: np.ndarray,
    rows: np.ndarray,
    values: np.ndarray,
    total: np.ndarray,
) -> None:
    for k in range(start, stop):
        burnt, pressure, whole = 0.0, 0.0, 0.0
        for at in range(first[k], first[k + 1]):
            member = np.uint64(around[at])
            burnt, pressure, whole = burnt + values[member, 0], pressure + values[member, 1], whole + values[member, 2]
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
    face, found = np.empty(_RUN, dtype=np.int32), np.empty((_RUN, 6))
    work, lanes = np.zeros(_ROWS * LANES), np.zeros((4, LANES), dtype=np.int64)
    for run in range(start, stop):
        chosen = contacts.contact[run * _RUN : min((run + 1) * _RUN, contacts.contact.size)]
        for k in range(chosen.size):
            face[k] = contacts.face[chosen[k]]
        find_points(
            chosen, contacts.slave, charge.position, charge.velocity, surface, casing.position, face, contacts.point,
            found, work[: POINT_ROWS * LANES], lanes,
        )  # fmt: skip
        for first in range(0, chosen.size, LANES):
            some = chosen[first : first + min(LANES, chosen.size - first)]
            _load(some, face[first:], found[first:], surface.faces, contacts, attached, casing, charge, work)
            _press(law, work)
            _store(some, face[first:], contacts, work)


@block_kernel
def _load(
    chosen: np.ndarray,
    face: np.ndarray,
    found: np.ndarray,
    faces: np.ndarray,
    contacts: SlideContacts,
    attached: np.ndarray,
    casing: NodeMotion,
    charge: NodeMotion,
    work: np.ndarray,
) -> None:
    """Gather what the `chosen` contacts (k,) know into lanes; those beyond keep what they have."""
    velocity, mass, load = casing.velocity, casing.mass, contacts.load
    for lane in range(chosen.size):
        c = np.uint64(chosen[lane])
        node, row = np.uint64(contacts.slave[c]), np.uint64(contacts.row[c])
        now = np.uint64(face[lane])
        work[_MASS * LANES + lane] = charge.mass[node]
        for i in range(3):
            work[(_STATE + i) * LANES + lane] = attached[row, i]
        work[_CELLS * LANES + lane] = contacts.cells[c]
        for i in range(3):
            work[(_SPEED + i) * LANES + lane] = charge.velocity[node, i]
            work[(_AREA + i) * LANES + lane] = contacts.area[c, i]
            work[(_SLIP + i) * LANES + lane] = contacts.slip[c, i]
            work[(_NORMAL + i) * LANES + lane] = found[lane, NORMAL + i]
        for k in range(4):
            corner = np.uint64(faces[now, k])
            work[(_MASSES + k) * LANES + lane], work[(_LOADS + k) * LANES + lane] = mass[corner], load[corner]
            for i in range(3):
                work[(_SPEEDS + 3 * k + i) * LANES + lane] = velocity[corner, i]
        work[_XI * LANES + lane], work[_ETA * LANES + lane] = contacts.point[c, 0], contacts.point[c, 1]
        work[_GAP * LANES + lane], work[_BEYOND * LANES + lane] = found[lane, GAP], found[lane, BEYOND]
        work[_SIZE * LANES + lane] = found[lane, SIZE]
        work[_OF_NODE * LANES + lane], work[_STRENGTH * LANES + lane] = contacts.of_node[c], contacts.strength[c]
        work[_BONDED * LANES + lane] = contacts.bonded[c]
        work[_STIFFNESS * LANES + lane] = contacts.stiffness[c]
        work[_OFF * LANES + lane] = 1.0 if contacts.off[c] != 0 else 0.0


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
    xi, eta = work[_XI * LANES + lane], work[_ETA * LANES + lane]
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
        n, gap = load_vector(work, _NORMAL, lane), work[_GAP * LANES + lane]
        old = work[_STIFFNESS * LANES + lane]
        reach = OFF_EDGE * np.sqrt(0.25 * work[_SIZE * LANES + lane])
        left = has_left(work[_BEYOND * LANES + lane], gap, reach, law.step * np.sqrt(product(v, v)), old != 0.0)
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
def _store(chosen: np.ndarray, face: np.ndarray, contacts: SlideContacts, work: np.ndarray) -> None:
    """Write the state of the `chosen` contacts (k,) back."""
    for lane in range(chosen.size):
        c = np.uint64(chosen[lane])
        contacts.face[c] = face[lane]
        contacts.gap[c], contacts.stiffness[c] = work[_GAP * LANES + lane], work[_STIFFNESS * LANES + lane]
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
