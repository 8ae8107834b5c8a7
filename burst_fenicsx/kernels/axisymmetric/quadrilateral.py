"""One-point quadrilaterals of the half plane (r, z) with mean gradients: volume-weighted Galerkin method.

All quantities are those of the whole ring that a quadrilateral makes around the axis. With V its volume and A_a the
integral of N_a over 2 pi dA,

    bz_a = dV/dz_a,  br_a = dV/dr_a - A_a,
    L_rr = br.vr / V,  L_rz = bz.vr / V,  L_zr = br.vz / V,  L_zz = bz.vz / V,  L_tt = A.vr / V,
    f_r = -(s_rr br + s_rz bz + s_tt A),  f_z = -(s_rz br + s_zz bz),

the analogue of the hexahedron with the mean gradient of Flanagan and Belytschko (1981). The trace of L is (dV/dt) / V,
so a pressure does exactly p dV of work, and the axial forces of a cell add up to nothing. The hourglass vector
gamma = h - (h.r) br / V - (h.z) bz / V is free of linear fields. The coefficients of hourglass control are chosen so
that its mode decays and oscillates as in a cube of the same size; they are bounded by what the step lets a cell bear.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.one_point import resist_mode
from burst_fenicsx.kernels.constants import MOST_DAMPED
from burst_fenicsx.kernels.lanes import LANES, block_kernel, inlined_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    dot,
    fma,
    load_symmetric,
    load_vector,
    scaled,
    store_matrix,
    store_vector,
)

Four = tuple[float, float, float, float]

STORED_ROWS = 3
"""Numbers of elastic hourglass forces that a cell stores: those of its one mode."""

_SIXTH, _TWELFTH = 2.0 * np.pi / 6.0, 2.0 * np.pi / 12.0


@lane_function
def ring_integrals(r: Four, z: Four) -> tuple[Four, Four, Four, float, float]:
    """Integrals br, bz and A (m2), volume (m3) of a ring; area (m2) of its quadrilateral."""
    r0, r1, r2, r3 = r
    z0, z1, z2, z3 = z
    area = 0.5 * ((r2 - r0) * (z3 - z1) - (r3 - r1) * (z2 - z0))
    # Values of the Jacobian at the corners.
    c0 = (r1 - r0) * (z3 - z0) - (r3 - r0) * (z1 - z0)
    c1 = (r2 - r1) * (z0 - z1) - (r0 - r1) * (z2 - z1)
    c2 = (r3 - r2) * (z1 - z2) - (r1 - r2) * (z3 - z2)
    c3 = (r0 - r3) * (z2 - z3) - (r2 - r3) * (z0 - z3)
    a0, a1 = area * _SIXTH + c0 * _TWELFTH, area * _SIXTH + c1 * _TWELFTH
    a2, a3 = area * _SIXTH + c2 * _TWELFTH, area * _SIXTH + c3 * _TWELFTH
    bz0 = _SIXTH * (r3 - r1) * (r3 + r0 + r1)
    bz1 = _SIXTH * (r0 - r2) * (r0 + r1 + r2)
    bz2 = _SIXTH * (r1 - r3) * (r1 + r2 + r3)
    bz3 = _SIXTH * (r2 - r0) * (r2 + r3 + r0)
    g0 = _SIXTH * ((r3 + 2.0 * r0) * (z0 - z3) + (2.0 * r0 + r1) * (z1 - z0))
    g1 = _SIXTH * ((r0 + 2.0 * r1) * (z1 - z0) + (2.0 * r1 + r2) * (z2 - z1))
    g2 = _SIXTH * ((r1 + 2.0 * r2) * (z2 - z1) + (2.0 * r2 + r3) * (z3 - z2))
    g3 = _SIXTH * ((r2 + 2.0 * r3) * (z3 - z2) + (2.0 * r3 + r0) * (z0 - z3))
    volume = r0 * a0 + r1 * a1 + r2 * a2 + r3 * a3
    return (
        (g0 - a0, g1 - a1, g2 - a2, g3 - a3),
        (bz0, bz1, bz2, bz3),
        (a0, a1, a2, a3),
        volume,
        area,
    )


@lane_function
def _dot(a: Four, b: Four) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


@lane_function
def _load(scratch: np.ndarray, row: int, lane: int) -> Four:
    return (
        scratch[row * LANES + lane],
        scratch[(row + 1) * LANES + lane],
        scratch[(row + 2) * LANES + lane],
        scratch[(row + 3) * LANES + lane],
    )


@lane_function
def _load_nodes(scratch: np.ndarray, row: int, lane: int) -> tuple[Four, Four]:
    return (
        (
            scratch[row * LANES + lane],
            scratch[(row + 3) * LANES + lane],
            scratch[(row + 6) * LANES + lane],
            scratch[(row + 9) * LANES + lane],
        ),
        (
            scratch[(row + 2) * LANES + lane],
            scratch[(row + 5) * LANES + lane],
            scratch[(row + 8) * LANES + lane],
            scratch[(row + 11) * LANES + lane],
        ),
    )


@lane_function
def _store(v: Four, scratch: np.ndarray, row: int, lane: int) -> None:
    scratch[row * LANES + lane], scratch[(row + 1) * LANES + lane] = v[0], v[1]
    scratch[(row + 2) * LANES + lane], scratch[(row + 3) * LANES + lane] = v[2], v[3]


@inlined_kernel
def load_shares(block: int, inverse_share: np.ndarray, scratch: np.ndarray) -> None:
    """Copy the inverse of a block's shares of its nodes' masses."""
    for k in range(4 * LANES):
        scratch[at.INVERSE_SHARE * LANES + k] = inverse_share[block, k]


@block_kernel
def velocity_gradient(step: float, scratch: np.ndarray) -> None:
    """Mean velocity gradient and hourglass rate of the rings in a step (s), and their shape after it.

    The velocity gradient is the mean one on the mid-step configuration. The length L in c dt <= L is 2 c over the
    highest frequency, omega^2 = rho c^2 / V times the largest eigenvalue of the sum over the nodes of g g^T / m_a with
    g = (br + A, bz) and m_a the cell's own share of the node's mass: exact for a pressure. Nodes on the axis do not
    move radially.
    """
    widest_vectors()
    for lane in range(LANES):
        (r, z), (vr, vz) = _load_nodes(scratch, at.POSITION, lane), _load_nodes(scratch, at.VELOCITY, lane)
        h = 0.5 * step
        middle_r = (r[0] - h * vr[0], r[1] - h * vr[1], r[2] - h * vr[2], r[3] - h * vr[3])
        middle_z = (z[0] - h * vz[0], z[1] - h * vz[1], z[2] - h * vz[2], z[3] - h * vz[3])
        br, bz, a, volume, _ = ring_integrals(middle_r, middle_z)
        over = 1.0 / volume
        rr, rz, zr, zz = over * _dot(br, vr), over * _dot(bz, vr), over * _dot(br, vz), over * _dot(bz, vz)
        hoop = over * _dot(a, vr)
        store_matrix(((rr, 0.0, rz), (0.0, hoop, 0.0), (zr, 0.0, zz)), scratch, at.RATE, lane)
        scratch[at.DILATATION * LANES + lane] = rr + hoop + zz
        hr = middle_r[0] - middle_r[1] + middle_r[2] - middle_r[3]
        hz = middle_z[0] - middle_z[1] + middle_z[2] - middle_z[3]
        qr = vr[0] - vr[1] + vr[2] - vr[3] - rr * hr - rz * hz
        qz = vz[0] - vz[1] + vz[2] - vz[3] - zr * hr - zz * hz
        store_vector((qr, 0.0, qz), scratch, at.HOURGLASS_RATE, lane)

        br, bz, a, volume, area = ring_integrals(r, z)
        _store(br, scratch, at.BR, lane)
        _store(bz, scratch, at.BZ, lane)
        _store(a, scratch, at.HOOP, lane)
        scratch[at.VOLUME * LANES + lane] = scratch[at.MIN_VOLUME * LANES + lane] = volume
        scratch[at.AREA * LANES + lane] = area
        w = _load(scratch, at.INVERSE_SHARE, lane)
        u0, u1 = w[0] if r[0] > 0.0 else 0.0, w[1] if r[1] > 0.0 else 0.0
        u2, u3 = w[2] if r[2] > 0.0 else 0.0, w[3] if r[3] > 0.0 else 0.0
        g0, g1, g2, g3 = br[0] + a[0], br[1] + a[1], br[2] + a[2], br[3] + a[3]
        rr = g0 * g0 * u0 + g1 * g1 * u1 + g2 * g2 * u2 + g3 * g3 * u3
        zz = bz[0] * bz[0] * w[0] + bz[1] * bz[1] * w[1] + bz[2] * bz[2] * w[2] + bz[3] * bz[3] * w[3]
        rz = g0 * bz[0] * u0 + g1 * bz[1] * u1 + g2 * bz[2] * u2 + g3 * bz[3] * u3
        largest = 0.5 * (rr + zz) + np.sqrt(0.25 * (rr - zz) * (rr - zz) + rz * rz)
        over = 1.0 / volume
        frequency = 0.5 * over * np.sqrt(scratch[at.MASS * LANES + lane] * largest)
        scratch[at.FREQUENCY * LANES + lane], scratch[at.LENGTH * LANES + lane] = frequency, 1.0 / frequency
        hr, hz = r[0] - r[1] + r[2] - r[3], z[0] - z[1] + z[2] - z[3]
        scratch[at.MODE_R * LANES + lane], scratch[at.MODE_Z * LANES + lane] = hr, hz
        hr, hz = over * hr, over * hz
        y0, y1 = 1.0 - hr * br[0] - hz * bz[0], -1.0 - hr * br[1] - hz * bz[1]
        y2, y3 = 1.0 - hr * br[2] - hz * bz[2], -1.0 - hr * br[3] - hz * bz[3]
        scratch[at.GAMMA_SQUARE * LANES + lane] = y0 * y0 * w[0] + y1 * y1 * w[1] + y2 * y2 * w[2] + y3 * y3 * w[3]


@lane_function
def turn_stored(rotation: Matrix, scratch: np.ndarray, lane: int) -> None:
    """Turn the stored elastic force with the cell."""
    (xx, _, xz), _, (zx, _, zz) = rotation
    x, z = scratch[at.HOURGLASS_STORED * LANES + lane], scratch[(at.HOURGLASS_STORED + 2) * LANES + lane]
    scratch[at.HOURGLASS_STORED * LANES + lane] = fma(xx, x, xz * z)
    scratch[(at.HOURGLASS_STORED + 2) * LANES + lane] = fma(zx, x, zz * z)


@block_kernel
def hourglass_coefficients(
    viscous: float, stiffness: float, modulus: float, step: float, next_dt: float, scratch: np.ndarray
) -> None:
    """As `one_point.hourglass_coefficients`, always with the limit, which costs little here."""
    widest_vectors()
    per_step = 1.0 / next_dt if next_dt > 0.0 else np.inf
    for lane in range(LANES):
        frequency, mass = scratch[at.FREQUENCY * LANES + lane], scratch[at.MASS * LANES + lane]
        scratch[at.DAMPING * LANES + lane] = viscous * mass * scratch[at.SOUND * LANES + lane] * frequency
        width = scratch[at.VOLUME * LANES + lane] / scratch[at.AREA * LANES + lane]
        scratch[at.SPRING * LANES + lane] = stiffness / 9.0 * modulus * step * width
        scratch[at.COEFFICIENT_LIMIT * LANES + lane] = per_step / scratch[at.GAMMA_SQUARE * LANES + lane]


@block_kernel
def dashpots(scratch: np.ndarray) -> None:
    """Viscous force (N) against the mode and its power (W)."""
    for lane in range(LANES):
        rate = load_vector(scratch, at.HOURGLASS_RATE, lane)
        damping = min(scratch[at.DAMPING * LANES + lane], MOST_DAMPED * scratch[at.COEFFICIENT_LIMIT * LANES + lane])
        store_vector(scaled(damping, rate), scratch, at.HOURGLASS_FORCE, lane)
        scratch[at.HOURGLASS_POWER * LANES + lane] = damping * dot(rate, rate)


@block_kernel
def springs_and_dashpots(scratch: np.ndarray) -> None:
    """Elastic and viscous force (N) against the mode and its power (W)."""
    for lane in range(LANES):
        scratch[at.HOURGLASS_POWER * LANES + lane] = resist_mode(0, scratch, lane)


@block_kernel
def nodal_forces(fraction: float, scratch: np.ndarray) -> None:
    """Nodal forces (N) times `fraction`; one thread sums them in one order, so they are not rounded."""
    widest_vectors()
    for lane in range(LANES):
        br, bz, a = _load(scratch, at.BR, lane), _load(scratch, at.BZ, lane), _load(scratch, at.HOOP, lane)
        over = 1.0 / scratch[at.VOLUME * LANES + lane]
        hr, hz = over * scratch[at.MODE_R * LANES + lane], over * scratch[at.MODE_Z * LANES + lane]
        srr, stt, szz, _, _, srz = load_symmetric(scratch, at.STRESS, lane)
        pressure = scratch[at.PRESSURE * LANES + lane] + scratch[at.VISCOUS * LANES + lane]
        srr, stt, szz = srr - pressure, stt - pressure, szz - pressure
        qr = fraction * scratch[at.HOURGLASS_FORCE * LANES + lane]
        qz = fraction * scratch[(at.HOURGLASS_FORCE + 2) * LANES + lane]
        # The linear part of gamma acts like a stress, which need not be symmetric.
        rr, rz, hoop = qr * hr - fraction * srr, qr * hz - fraction * srz, fraction * stt
        zr, zz = qz * hr - fraction * srz, qz * hz - fraction * szz
        scratch[at.FORCE * LANES + lane] = rr * br[0] + rz * bz[0] - hoop * a[0] - qr
        scratch[(at.FORCE + 3) * LANES + lane] = rr * br[1] + rz * bz[1] - hoop * a[1] + qr
        scratch[(at.FORCE + 6) * LANES + lane] = rr * br[2] + rz * bz[2] - hoop * a[2] - qr
        scratch[(at.FORCE + 9) * LANES + lane] = rr * br[3] + rz * bz[3] - hoop * a[3] + qr
        scratch[(at.FORCE + 2) * LANES + lane] = zr * br[0] + zz * bz[0] - qz
        scratch[(at.FORCE + 5) * LANES + lane] = zr * br[1] + zz * bz[1] + qz
        scratch[(at.FORCE + 8) * LANES + lane] = zr * br[2] + zz * bz[2] - qz
        scratch[(at.FORCE + 11) * LANES + lane] = zr * br[3] + zz * bz[3] + qz
