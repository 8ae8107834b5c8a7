"""Motion, hourglass control and forces of the hexahedron with 2x2x2 points and mean dilatation (B-bar).

The volumetric part of the velocity gradient is the cell's mean at every point (Hughes 1980), so it does not lock in
plastic flow. The mean pressure acts as in the one-point cell; deviatoric forces are summed up over the points. Where
only the pressure is left, in metal without strength, nothing else resists hourglass modes: there, and only there, the
one-point cell's dashpots do.

A charge has no shear stiffness once it burns and its dilatation is the mean one at every point, so for it this rule is
the one-point rule, with the hourglass control it needs either way.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.hexahedron import Modes, load_modes, store_nodal_forces
from burst_fenicsx.kernels.cells.one_point import force_modes, longest_square
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    add_outer,
    add_scaled,
    add_vector,
    apply,
    cross,
    dot,
    load_matrix,
    load_symmetric,
    load_vector,
    outer,
    scaled,
    store_matrix,
    store_symmetric,
    store_vector,
)

_GAUSS = 1.0 / np.sqrt(3.0)


@lane_function
def _coordinates(point: int) -> tuple[float, float, float]:
    """Reference coordinates of a point, in the order of dolfinx's quadrature space, zeta fastest."""
    return (
        _GAUSS if point & 4 else -_GAUSS,
        _GAUSS if point & 2 else -_GAUSS,
        _GAUSS if point & 1 else -_GAUSS,
    )


@lane_function
def _store_modes(modes: Modes, scratch: np.ndarray, row: int, lane: int) -> None:
    a, b, f, c, e, d, g = modes
    store_vector(scaled(0.125, a), scratch, row, lane)
    store_vector(scaled(0.125, b), scratch, row + 3, lane)
    store_vector(scaled(0.125, f), scratch, row + 6, lane)
    store_vector(scaled(0.125, c), scratch, row + 9, lane)
    store_vector(scaled(0.125, e), scratch, row + 12, lane)
    store_vector(scaled(0.125, d), scratch, row + 15, lane)
    store_vector(scaled(0.125, g), scratch, row + 18, lane)


@lane_function
def _tangents(xi: float, eta: float, zeta: float, scratch: np.ndarray, row: int, lane: int) -> Matrix:
    """Derivatives of a field by xi, eta and zeta at one point, from an eighth of its modes."""
    a, b, f = load_vector(scratch, row, lane), load_vector(scratch, row + 3, lane), load_vector(scratch, row + 6, lane)
    c, e = load_vector(scratch, row + 9, lane), load_vector(scratch, row + 12, lane)
    d, g = load_vector(scratch, row + 15, lane), load_vector(scratch, row + 18, lane)
    return (
        add_scaled(add_scaled(a, eta, f), zeta, add_scaled(e, eta, g)),
        add_scaled(add_scaled(b, xi, f), zeta, add_scaled(d, xi, g)),
        add_scaled(add_scaled(c, xi, e), eta, add_scaled(d, xi, g)),
    )


@lane_function
def _cofactors(tangents: Matrix) -> tuple[Matrix, float]:
    """Cofactors of the Jacobian, by reference coordinates, and its determinant: grad N = dN/dxi . cofactors / det."""
    u, v, w = tangents
    normal = cross(v, w)
    return (normal, cross(w, u), cross(u, v)), dot(u, normal)


@block_kernel
def begin_points(scratch: np.ndarray) -> None:
    """After `one_point.velocity_gradient`: modes and smallest volume of a point; sums are set to zero."""
    widest_vectors()
    for lane in range(LANES):
        _store_modes(load_modes(scratch, at.POSITION, lane), scratch, at.POINTS_POSITION, lane)
        _store_modes(load_modes(scratch, at.VELOCITY, lane), scratch, at.POINTS_VELOCITY, lane)
        scratch[at.POINTS_TENSION * LANES + lane] = 0.0
        scratch[at.POINTS_PLASTIC * LANES + lane] = 0.0
    for point in range(8):
        xi, eta, zeta = _coordinates(point)
        for lane in range(LANES):
            u, v, w = _tangents(xi, eta, zeta, scratch, at.POINTS_POSITION, lane)
            volume = 8.0 * dot(u, cross(v, w))
            scratch[at.MIN_VOLUME * LANES + lane] = min(scratch[at.MIN_VOLUME * LANES + lane], volume)
    for k in range(21 * LANES):
        scratch[at.POINTS_FORCE * LANES + k] = 0.0


@block_kernel
def velocity_gradient(point: int, step: float, scratch: np.ndarray) -> None:
    """Velocity gradient at a point, its dilatation replaced by the cell's mean one, and the Jacobian after the step."""
    widest_vectors()
    xi, eta, zeta = _coordinates(point)
    back = -0.5 * step
    for lane in range(LANES):
        after, speed = (
            _tangents(xi, eta, zeta, scratch, at.POINTS_POSITION, lane),
            _tangents(xi, eta, zeta, scratch, at.POINTS_VELOCITY, lane),
        )
        middle = (
            add_scaled(after[0], back, speed[0]),
            add_scaled(after[1], back, speed[1]),
            add_scaled(after[2], back, speed[2]),
        )
        cofactor, determinant = _cofactors(middle)
        whole = add_outer(add_outer(outer(speed[0], cofactor[0]), speed[1], cofactor[1]), speed[2], cofactor[2])
        scratch[at.POINTS_MIDDLE * LANES + lane] = determinant
        inverse = 1.0 / determinant
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = (
            scaled(inverse, whole[0]),
            scaled(inverse, whole[1]),
            scaled(inverse, whole[2]),
        )
        more = (scratch[at.DILATATION * LANES + lane] - (xx + yy + zz)) * (1.0 / 3.0)
        store_matrix(((xx + more, xy, xz), (yx, yy + more, yz), (zx, zy, zz + more)), scratch, at.RATE, lane)
        cofactor, determinant = _cofactors(after)
        store_matrix(cofactor, scratch, at.POINTS_COFACTOR, lane)
        scratch[at.POINTS_DETERMINANT * LANES + lane] = determinant


@block_kernel
def add_stress(point: int, scratch: np.ndarray) -> None:
    """Add a point's deviatoric force to the modes of the nodal forces: -s . cofactor . dN/dxi, of weight one.

    dN_a/dxi = xi_a (1 + eta_a eta) (1 + zeta_a zeta) / 8, so a traction on xi enters the modes xi, xi eta,
    xi zeta and xi eta zeta. The hydrostatic part is summed up, to act with the mean gradient.
    """
    widest_vectors()
    xi, eta, zeta = _coordinates(point)
    for lane in range(LANES):
        xx, yy, zz, xy, yz, zx = load_symmetric(scratch, at.STRESS, lane)
        mean = (xx + yy + zz) * (1.0 / 3.0)
        push = ((mean - xx, -xy, -zx), (-xy, mean - yy, -yz), (-zx, -yz, mean - zz))
        cofactor = load_matrix(scratch, at.POINTS_COFACTOR, lane)
        t, u, v = apply(push, cofactor[0]), apply(push, cofactor[1]), apply(push, cofactor[2])
        add_vector(t, scratch, at.POINTS_FORCE, lane)
        add_vector(u, scratch, at.POINTS_FORCE + 3, lane)
        add_vector(add_scaled(scaled(eta, t), xi, u), scratch, at.POINTS_FORCE + 6, lane)
        add_vector(v, scratch, at.POINTS_FORCE + 9, lane)
        add_vector(add_scaled(scaled(zeta, t), xi, v), scratch, at.POINTS_FORCE + 12, lane)
        add_vector(add_scaled(scaled(zeta, u), eta, v), scratch, at.POINTS_FORCE + 15, lane)
        add_vector(
            add_scaled(add_scaled(scaled(eta * zeta, t), xi * zeta, u), xi * eta, v),
            scratch,
            at.POINTS_FORCE + 18,
            lane,
        )
        scratch[at.POINTS_TENSION * LANES + lane] += mean * scratch[at.POINTS_DETERMINANT * LANES + lane]
        scratch[at.POINTS_PLASTIC * LANES + lane] += (
            scratch[at.DISSIPATION * LANES + lane] * scratch[at.POINTS_MIDDLE * LANES + lane]
        )


@block_kernel
def end_points(scratch: np.ndarray) -> None:
    """Leave the mean pressure as the cell's stress, which acts with the mean gradient, and the mean dissipation."""
    for lane in range(LANES):
        inverse = 1.0 / scratch[at.VOLUME * LANES + lane]
        mean = scratch[at.POINTS_TENSION * LANES + lane] * inverse
        store_symmetric((mean, mean, mean, 0.0, 0.0, 0.0), scratch, at.STRESS, lane)
        scratch[at.DISSIPATION * LANES + lane] = scratch[at.POINTS_PLASTIC * LANES + lane] * inverse


@block_kernel
def hourglass_coefficients(viscous: float, step: float, scratch: np.ndarray) -> None:
    """Dashpots as of the one-point cell where no point has strength left, else none; no springs.

    They are limited by the longest hourglass vector: closer to what the step (s) bears it costs energy.
    """
    for lane in range(LANES):
        frequency, mass = scratch[at.FREQUENCY * LANES + lane], scratch[at.MASS * LANES + lane]
        own = viscous if scratch[at.STRENGTH * LANES + lane] == 0.0 else 0.0
        scratch[at.DAMPING * LANES + lane] = 0.25 * own * mass * scratch[at.SOUND * LANES + lane] * frequency
        limit = mass / (8.0 * step * longest_square(scratch, lane)) if step > 0.0 else np.inf
        for a in range(4):
            scratch[(at.COEFFICIENT_LIMIT + a) * LANES + lane] = limit


@block_kernel
def nodal_forces(fraction: float, rounding: float, scratch: np.ndarray) -> None:
    """As `one_point.nodal_forces`, with the deviatoric forces of the points."""
    widest_vectors()
    for lane in range(LANES):
        m1, m2, m3, m4, m5, m6, m7 = force_modes(scratch, lane)
        modes = (
            add_scaled(m1, 0.125, load_vector(scratch, at.POINTS_FORCE, lane)),
            add_scaled(m2, 0.125, load_vector(scratch, at.POINTS_FORCE + 3, lane)),
            add_scaled(m3, 0.125, load_vector(scratch, at.POINTS_FORCE + 6, lane)),
            add_scaled(m4, 0.125, load_vector(scratch, at.POINTS_FORCE + 9, lane)),
            add_scaled(m5, 0.125, load_vector(scratch, at.POINTS_FORCE + 12, lane)),
            add_scaled(m6, 0.125, load_vector(scratch, at.POINTS_FORCE + 15, lane)),
            add_scaled(m7, 0.125, load_vector(scratch, at.POINTS_FORCE + 18, lane)),
        )
        store_nodal_forces(modes, fraction, rounding, scratch, at.FORCE, lane)
