"""Sliding of a charge's surface nodes on the casing's faces: where each lies, what presses, what rubs (Eqs. 12-18).

The casing's faces are quadrilaterals with a normal interpolated between those of their corners, so that it is
continuous from face to face. A node lies at the point of the surface from which the normal there leads to it; it is
followed from face to face as it slides. Its force acts along that line and is shared by the face's corners with their
weights: linear and angular momentum are kept.

Products press with their own pressure, corrected by a spring for what is left of the gap (Nitsche's method): the gap
then stays a small part of what a spring alone would need. Unreacted explosive is bonded: springs with tensile strength,
cohesion and friction, which fade as it burns.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from burst_fenicsx.kernels.exact import quantise
from burst_fenicsx.kernels.lanes import inlined_kernel, kernel, parallel_kernel

__all__ = [
    "COLUMNS",
    "SlideContacts",
    "SlideLaw",
    "SlideSurface",
    "add_slide_forces",
    "attached_state",
    "find_slide_forces",
]

COLUMNS = ("stored", "friction", "work", "penetration")
"""Of `SlideContacts.tally`: J stored in springs, J of friction in this step, J given in this step by the products' own
pressure and by changes of stiffness, m."""

_NEWTON, _WALKS = 12, 10
_CLOSE = 1e-9  # change of a face's coordinates below which a point is found: the error left is far smaller
_ENTRY = 1.5  # a node newly met lies no deeper than it can have come in this many steps ...
_BENT = 0.1  # ... and this share of the distance below
_OFF_EDGE = 0.5  # of the face's size: a node farther beyond the edge of its smooth surface has left it


class SlideLaw(NamedTuple):
    """What holds for all contacts in this step."""

    budget: float  # bound on the springs' squared frequency (1/s2)
    step: float  # s
    tensile_strength: float  # Pa, of the unreacted charge's bond
    cohesion: float  # Pa
    friction: float  # tangent of the friction angle


class SlideSurface(NamedTuple):
    """Faces that the charge may slide on; a group is a corner node with those of its faces that are smooth together."""

    faces: np.ndarray  # (faces, 4) int32, rows of the casing's interface nodes, outward from the casing
    neighbour: np.ndarray  # (faces, 4) int32, face across the edge from corner k to k + 1; -1 across a crease
    corner: np.ndarray  # (faces, 4) int32, group of each corner
    first_face: np.ndarray  # (groups + 1,) int32 into `face`
    face: np.ndarray  # int32, faces of each group
    known: np.ndarray  # (faces,) bool, whether this rank knows the positions of the face and of those around it
    vector: np.ndarray  # (groups, 3) m2, sum of the groups' area vectors, now
    torn: np.ndarray  # (faces,) bool, whether the cell behind the face is torn metal: nothing lies on it any more


class SlideContacts(NamedTuple):
    """A contact for every group: a node of the charge on one smooth surface."""

    contact: np.ndarray  # (own contacts,) int32, those that this rank computes
    slave: np.ndarray  # (contacts,) int32 local node of the charge, -1 where this rank does not compute it
    row: np.ndarray  # (contacts,) int32 row of the charge's node among the interface nodes
    share: np.ndarray  # (contacts,) number of the node's contacts
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
    off: np.ndarray  # (contacts,) int8, 1 where the node has left its surface over an edge
    tally: np.ndarray  # (contacts, 4), see COLUMNS


@kernel
def attached_state(
    cells: np.ndarray,
    rows: np.ndarray,
    burn_fraction: np.ndarray,
    pressure: np.ndarray,
    rounding: tuple[float, float],
    total: np.ndarray,
) -> None:
    """Add the burn fractions and pressures (Pa) of the charge's cells to the rows of their interface nodes, exactly.

    `cells` (k,) and `rows` (k,) are the pairs; `total` (nodes, 2).
    """
    for k in range(cells.size):
        total[rows[k], 0] += quantise(burn_fraction[cells[k]], rounding[0])
        total[rows[k], 1] += quantise(pressure[cells[k]], rounding[1])


@parallel_kernel
def find_slide_forces(
    law: SlideLaw,
    surface: SlideSurface,
    contacts: SlideContacts,
    burnt: np.ndarray,
    pressure: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
    load: np.ndarray,
    charge_position: np.ndarray,
    charge_velocity: np.ndarray,
    charge_mass: np.ndarray,
) -> None:
    """Find every contact's point and force, and advance its state.

    `burnt` and `pressure` (Pa) are those of the charge's cells around each contact's node, (contacts,). `position` (m),
    `velocity` (m/s), `mass` (kg) and `load` are those of the casing's interface nodes by row, the others those of this
    rank's nodes.
    """
    for k in numba.prange(contacts.contact.size):
        c = contacts.contact[k]
        _slide(
            c,
            law,
            surface.faces,
            surface.neighbour,
            surface.corner,
            surface.known,
            surface.vector,
            surface.torn,
            contacts,
            burnt[c],
            pressure[c],
            position,
            velocity,
            mass,
            load,
            charge_position,
            charge_velocity,
            charge_mass,
        )


@inlined_kernel
def _slide(
    c: int,
    law: SlideLaw,
    faces: np.ndarray,
    neighbour: np.ndarray,
    corner: np.ndarray,
    known: np.ndarray,
    vector: np.ndarray,
    torn: np.ndarray,
    contacts: SlideContacts,
    burnt: float,
    pressure: float,
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
    load: np.ndarray,
    charge_position: np.ndarray,
    charge_velocity: np.ndarray,
    charge_mass: np.ndarray,
) -> None:
    node = contacts.slave[c]
    px, py, pz = charge_position[node, 0], charge_position[node, 1], charge_position[node, 2]
    face, xi, eta = contacts.face[c], contacts.point[c, 0], contacts.point[c, 1]
    # Work that contact takes: half of the last force and half of the new one on this step's relative motion.
    taken = -0.5 * law.step * _power(c, faces[face], contacts, velocity, charge_velocity[node])
    gap, nx, ny, nz, beyond, size = 0.0, 0.0, 0.0, 1.0, 0.0, 1.0
    tolerance = 1e-12  # by which a point may lie over an edge; larger with every face, so that the search ends
    done = False
    for walk in range(_WALKS):
        last = walk == _WALKS - 1
        clamped = done  # the edge of the surface was met: the point is held on it
        for _ in range(_NEWTON):
            ax, ay, az, bx, by, bz, x, y, z, vx, vy, vz = _surface_at(
                faces[face], corner[face], xi, eta, position, vector
            )
            size = np.sqrt(vx * vx + vy * vy + vz * vz)
            nx, ny, nz = vx / size, vy / size, vz / size
            rx, ry, rz = px - x, py - y, pz - z
            gap = rx * nx + ry * ny + rz * nz
            tx, ty, tz = rx - gap * nx, ry - gap * ny, rz - gap * nz
            if clamped:
                break
            an, bn = ax * nx + ay * ny + az * nz, bx * nx + by * ny + bz * nz
            ax, ay, az, bx, by, bz = ax - an * nx, ay - an * ny, az - an * nz, bx - bn * nx, by - bn * ny, bz - bn * nz
            aa, ab, bb = ax * ax + ay * ay + az * az, ax * bx + ay * by + az * bz, bx * bx + by * by + bz * bz
            at, bt = ax * tx + ay * ty + az * tz, bx * tx + by * ty + bz * tz
            inverse = 1.0 / (aa * bb - ab * ab)
            d_xi, d_eta = inverse * (bb * at - ab * bt), inverse * (aa * bt - ab * at)
            xi, eta = min(max(xi + d_xi, -4.0), 4.0), min(max(eta + d_eta, -4.0), 4.0)
            if abs(d_xi) + abs(d_eta) < _CLOSE:
                break
        beyond = np.sqrt(tx * tx + ty * ty + tz * tz) if clamped else 0.0
        if done or max(abs(xi), abs(eta)) <= 1.0 + tolerance:
            break
        # Across the edge that the point lies beyond most and that leads on; else it is held on the edge.
        best, farthest = -1, 1.0 + tolerance
        for edge in range(4):
            over = -eta if edge == 0 else (xi if edge == 1 else (eta if edge == 2 else -xi))
            other = neighbour[face, edge]
            if over > farthest and other >= 0 and known[other]:
                best, farthest = other, over
        if best < 0 or last:
            xi, eta, done = min(max(xi, -1.0), 1.0), min(max(eta, -1.0), 1.0), True
        else:
            face, xi, eta = best, 0.0, 0.0
        tolerance *= 16.0
    contacts.face[c], contacts.point[c, 0], contacts.point[c, 1] = face, xi, eta
    inverse_mass = contacts.share[c] / charge_mass[node]
    vx, vy, vz = charge_velocity[node, 0], charge_velocity[node, 1], charge_velocity[node, 2]
    for k in range(4):
        weight = 0.25 * (1.0 + (xi if (k == 1 or k == 2) else -xi)) * (1.0 + (eta if k >= 2 else -eta))
        contacts.weight[c, k] = weight
        other = faces[face, k]
        inverse_mass += weight * max(load[other], weight) / mass[other]
        vx -= weight * velocity[other, 0]
        vy -= weight * velocity[other, 1]
        vz -= weight * velocity[other, 2]
    # A node that has left over an edge may come back behind the surface, through its rim: it is free for good. One that
    # did not touch is met no deeper than it can have come in this step, and a little more, since the surface bends.
    reach, old = _OFF_EDGE * np.sqrt(0.25 * size), contacts.stiffness[c]
    entered = _ENTRY * law.step * np.sqrt(vx * vx + vy * vy + vz * vz) + _BENT * reach
    off = contacts.off[c] != 0 or beyond > reach or gap < -reach or (old == 0.0 and gap < -entered)
    off = off or torn[face]
    contacts.off[c] = off
    stiffness = law.budget / inverse_mass
    unreacted = 1.0 - burnt
    area = 0.25 * abs(contacts.area[c, 0] * nx + contacts.area[c, 1] * ny + contacts.area[c, 2] * nz)
    whole = contacts.bonded[c] != 0 and unreacted > 0.0
    was_bonded, old_gap = contacts.bonded[c] != 0, contacts.gap[c]
    press = burnt * max(pressure, 0.0) * area - stiffness * gap
    apart = off or press <= (-law.tensile_strength * unreacted * area if whole else 0.0)
    if apart:
        press = 0.0

    # Tangential displacement of the spring, turned into today's plane and moved on by this step (Eq. 13).
    sx, sy, sz = contacts.slip[c, 0], contacts.slip[c, 1], contacts.slip[c, 2]
    old_slip = np.sqrt(sx * sx + sy * sy + sz * sz)
    sx, sy, sz = sx + law.step * vx, sy + law.step * vy, sz + law.step * vz
    along = sx * nx + sy * ny + sz * nz
    sx, sy, sz = sx - along * nx, sy - along * ny, sz - along * nz
    length = np.sqrt(sx * sx + sy * sy + sz * sz)
    # Where friction would hold more than the explosive bears, it is the explosive that yields.
    limit = max((law.cohesion * area if whole else 0.0) + press * law.friction, 0.0)
    limit = unreacted * min(limit, contacts.strength[c] * area)
    heat, held = 0.0, 0.0
    if apart:
        heat = 0.5 * old * old_slip * old_slip
        sx, sy, sz = 0.0, 0.0, 0.0
        whole, stiffness = False, 0.0
    else:
        held = length
        if stiffness * length > limit:
            held = limit / stiffness
            heat = 0.5 * (old * old_slip + limit) * (length - held)
            whole = False
            shrink = held / length
            sx, sy, sz = shrink * sx, shrink * sy, shrink * sz
    before = 0.5 * old * (old_gap * old_gap + old_slip * old_slip)
    stored = 0.5 * stiffness * (gap * gap + held * held)
    contacts.tally[c, 3] = max(-gap, 0.0) if not apart else 0.0
    contacts.bonded[c] = 1 if (whole and was_bonded) else 0
    contacts.gap[c], contacts.stiffness[c] = gap, stiffness
    contacts.slip[c, 0], contacts.slip[c, 1], contacts.slip[c, 2] = sx, sy, sz
    contacts.force[c, 0] = press * nx - stiffness * sx
    contacts.force[c, 1] = press * ny - stiffness * sy
    contacts.force[c, 2] = press * nz - stiffness * sz
    taken -= 0.5 * law.step * _power(c, faces[face], contacts, velocity, charge_velocity[node])
    contacts.tally[c, 0], contacts.tally[c, 1] = stored, heat
    contacts.tally[c, 2] = stored - before + heat - taken


@inlined_kernel
def _power(
    c: int, nodes: np.ndarray, contacts: SlideContacts, velocity: np.ndarray, charge_velocity: np.ndarray
) -> float:
    """Power (W) of a contact's force on the motion of the charge's node relative to the corners `nodes` of its face."""
    power = 0.0
    for i in range(3):
        speed = charge_velocity[i]
        for k in range(4):
            speed -= contacts.weight[c, k] * velocity[nodes[k], i]
        power += contacts.force[c, i] * speed
    return power


@inlined_kernel
def _surface_at(
    nodes: np.ndarray, groups: np.ndarray, xi: float, eta: float, position: np.ndarray, vector: np.ndarray
) -> tuple[float, float, float, float, float, float, float, float, float, float, float, float]:
    """Tangents, place and interpolated area vector at a point of a face."""
    ax, ay, az, bx, by, bz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    x, y, z, vx, vy, vz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(4):
        s, t = (1.0 if (k == 1 or k == 2) else -1.0), (1.0 if k >= 2 else -1.0)
        w, u, v = 0.25 * (1.0 + s * xi) * (1.0 + t * eta), 0.25 * s * (1.0 + t * eta), 0.25 * t * (1.0 + s * xi)
        i, j = nodes[k], groups[k]
        qx, qy, qz = position[i, 0], position[i, 1], position[i, 2]
        ax, ay, az = ax + u * qx, ay + u * qy, az + u * qz
        bx, by, bz = bx + v * qx, by + v * qy, bz + v * qz
        x, y, z = x + w * qx, y + w * qy, z + w * qz
        vx, vy, vz = vx + w * vector[j, 0], vy + w * vector[j, 1], vz + w * vector[j, 2]
    return ax, ay, az, bx, by, bz, x, y, z, vx, vy, vz


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
    for k in range(contacts.contact.size):
        c = contacts.contact[k]
        node, face = contacts.slave[c], contacts.face[c]
        touches = contacts.stiffness[c] > 0.0
        for corner in range(4):
            other, weight = faces[face, corner], contacts.weight[c, corner]
            sums[other, 3] += quantise(weight, load_rounding)
            if touches:
                for i in range(3):
                    # The node gets what the face's corners give, to the last bit.
                    part = quantise(weight * contacts.force[c, i], rounding)
                    sums[other, i] -= part
                    force[node, i] += part
