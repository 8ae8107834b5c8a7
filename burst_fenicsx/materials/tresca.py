"""Tresca plasticity with tension cut-off and linear softening (Wang et al., Eqs. 8-11).

The admissible stresses are those with (s1 - s3)/2 <= tau_c and s1 <= sigma_t, s1 >= s2 >= s3 being the
principal stresses. A trial stress outside is returned to the closest admissible one in the norm of
the elastic energy, which is the backward Euler step of the associated flow rule; the plastic strain
is what the elastic law leaves over, C^-1 (trial - returned).

All routines work on a block of lanes (see `burst_fenicsx.kernels`): stresses as six rows
xx, yy, zz, xy, yz, zx of `LANES` entries.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, kernel

__all__ = ["principal_stresses", "return_principal", "return_stresses", "softened_strength"]

# Cyclic Jacobi converges cubically at the end: four sweeps leave round-off only.
_SWEEPS = 4


@kernel
def softened_strength(initial: float, strain: float, inverse_limit: float) -> float:
    """Strength after the plastic strain `strain` (Eq. 9); zero and no less once the limit strain is reached.

    `inverse_limit` is 1/gamma_lim or 1/eps_lim; zero switches softening off.
    """
    return initial * max(0.0, 1.0 - strain * inverse_limit)


@kernel
def _rotate(matrix: np.ndarray, vectors: np.ndarray, p: int, q: int, pq: int, rp: int, rq: int) -> None:
    """One Jacobi rotation in the plane (p, q) for every lane; pq, rp and rq are the rows of the other entries."""
    for lane in range(LANES):
        app = matrix[p * LANES + lane]
        aqq = matrix[q * LANES + lane]
        apq = matrix[pq * LANES + lane]
        difference = aqq - app
        # The tangent of the smaller angle; the tiny term keeps 0/0 away where nothing is to be done.
        root = np.sqrt(difference * difference + 4.0 * apq * apq) + 1e-290
        tangent = 2.0 * apq / (difference + np.copysign(root, difference))
        cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
        sine = tangent * cosine
        matrix[p * LANES + lane] = app - tangent * apq
        matrix[q * LANES + lane] = aqq + tangent * apq
        matrix[pq * LANES + lane] = 0.0
        arp = matrix[rp * LANES + lane]
        arq = matrix[rq * LANES + lane]
        matrix[rp * LANES + lane] = cosine * arp - sine * arq
        matrix[rq * LANES + lane] = sine * arp + cosine * arq
        for i in range(3):
            vp = vectors[(3 * p + i) * LANES + lane]
            vq = vectors[(3 * q + i) * LANES + lane]
            vectors[(3 * p + i) * LANES + lane] = cosine * vp - sine * vq
            vectors[(3 * q + i) * LANES + lane] = sine * vp + cosine * vq


@kernel
def principal_stresses(stress: np.ndarray, matrix: np.ndarray, vectors: np.ndarray) -> None:
    """Principal values and directions by cyclic Jacobi rotations.

    Parameters
    ----------
    stress : (6 LANES,) Pa.
    matrix : (6 LANES,) scratch; on return its first three rows are the principal values (Pa), not sorted.
    vectors : (9 LANES,) on return row 3 k + i is component i of the unit vector of value k.

    Notes
    -----
    Jacobi (1846); Golub and Van Loan, Matrix Computations, section 8.5. It has no trigonometry and no
    loss of accuracy at repeated values, and every lane does the same work.
    """
    for k in range(6 * LANES):
        matrix[k] = stress[k]
    for k in range(9 * LANES):
        vectors[k] = 0.0
    for i in range(3):
        for lane in range(LANES):
            vectors[4 * i * LANES + lane] = 1.0
    for _ in range(_SWEEPS):
        _rotate(matrix, vectors, 0, 1, 3, 5, 4)
        _rotate(matrix, vectors, 1, 2, 4, 3, 5)
        _rotate(matrix, vectors, 2, 0, 5, 4, 3)


@kernel
def return_principal(
    s1: float, s2: float, s3: float, tau: float, sigma: float, poisson: float
) -> tuple[float, float, float]:
    """Closest admissible principal stresses to s1 >= s2 >= s3 in the norm of the elastic energy.

    Parameters
    ----------
    s1, s2, s3 : trial principal stresses (Pa), in descending order.
    tau, sigma : current shear and tensile strength (Pa), both at least zero.
    poisson : Poisson's ratio.

    Returns
    -------
    The returned principal stresses (Pa), in descending order.

    Notes
    -----
    The set is convex, so the projection is found by cases. On the Tresca prism alone: main plane or one of its
    two edges, the mean stress unchanged. On the cut-off alone: plane, edge or apex. If each of the two
    leaves the other violated, both hold with equality: s1 = sigma and s3 = sigma - 2 tau, and s2
    minimises the energy between them.
    """
    mean = (s1 + s2 + s3) / 3.0
    excess = max(0.5 * (s1 - s3) - tau, 0.0)
    a1, a2, a3 = s1 - excess, s2, s3 + excess
    right = a2 > a1  # edge s1 = s2
    left = a2 < a3  # edge s2 = s3
    a1 = mean + 2.0 / 3.0 * tau if right else (mean + 4.0 / 3.0 * tau if left else a1)
    a3 = mean - 4.0 / 3.0 * tau if right else (mean - 2.0 / 3.0 * tau if left else a3)
    a2 = a1 if right else (a3 if left else a2)

    # Cut-off alone. In units of the plane modulus M = lambda + 2 G, lambda / M = nu / (1 - nu).
    ratio = poisson / (1.0 - poisson)
    plane = s1 - sigma
    b2, b3 = s2 - ratio * plane, s3 - ratio * plane
    edge = b2 > sigma
    both = (s1 + s2 - 2.0 * sigma) / (1.0 + ratio)
    b3 = s3 - ratio * both if edge else b3
    b2 = sigma if edge else b2
    b3 = min(b3, sigma)

    # Both with equality.
    c3 = sigma - 2.0 * tau
    c2 = s2 - poisson * (s1 + s3 - sigma - c3)
    c2 = min(max(c2, c3), sigma)

    prism_is_enough = a1 <= sigma
    cut_is_enough = sigma - b3 <= 2.0 * tau
    r1 = a1 if prism_is_enough else sigma
    r2 = a2 if prism_is_enough else (b2 if cut_is_enough else c2)
    r3 = a3 if prism_is_enough else (b3 if cut_is_enough else c3)
    return r1, r2, r3


@kernel
def return_stresses(
    stress: np.ndarray,
    tau: np.ndarray,
    sigma: np.ndarray,
    modulus: float,
    poisson: float,
    matrix: np.ndarray,
    vectors: np.ndarray,
    shear_strain: np.ndarray,
    volume_strain: np.ndarray,
    dissipation: np.ndarray,
) -> None:
    """Return the trial stresses of a block to the admissible set.

    Parameters
    ----------
    stress : (6 LANES,) trial stresses (Pa), overwritten by the returned ones.
    tau, sigma : (LANES,) current shear and tensile strengths (Pa).
    modulus, poisson : Young's modulus (Pa) and Poisson's ratio.
    matrix, vectors : (6 LANES,) and (9 LANES,) scratch.
    shear_strain, volume_strain : (LANES,) increments of the equivalent plastic shear strain (the norm of the
        deviator, Eq. 11) and of the plastic volumetric strain (Eq. 10), overwritten.
    dissipation : (LANES,) plastic work per volume (J/m3), overwritten.

    Notes
    -----
    Eq. 11 is taken on the increments and summed: this equals the paper's for proportional straining, does not
    depend on the cell's rotation, and lets no strength come back on reversal.
    """
    principal_stresses(stress, matrix, vectors)
    shear_modulus = 0.5 * modulus / (1.0 + poisson)
    bulk_modulus = modulus / (3.0 * (1.0 - 2.0 * poisson))
    for lane in range(LANES):
        d0, d1, d2 = matrix[lane], matrix[LANES + lane], matrix[2 * LANES + lane]
        low, high = min(d0, d1), max(d0, d1)
        s1, s3 = max(high, d2), min(low, d2)
        s2 = max(low, min(high, d2))
        r1, r2, r3 = return_principal(s1, s2, s3, tau[lane], sigma[lane], poisson)
        # Equal values are returned to equal values, so the comparison need not tell them apart.
        e0 = (r1 if d0 == s1 else (r3 if d0 == s3 else r2)) - d0
        e1 = (r1 if d1 == s1 else (r3 if d1 == s3 else r2)) - d1
        e2 = (r1 if d2 == s1 else (r3 if d2 == s3 else r2)) - d2
        mean = (e0 + e1 + e2) / 3.0
        f0, f1, f2 = e0 - mean, e1 - mean, e2 - mean
        shear_strain[lane] = np.sqrt(f0 * f0 + f1 * f1 + f2 * f2) / (2.0 * shear_modulus)
        volume_strain[lane] = -mean / bulk_modulus
        dissipation[lane] = -(
            (f0 * (d0 + e0) + f1 * (d1 + e1) + f2 * (d2 + e2)) / (2.0 * shear_modulus)
            + mean * (d0 + e0 + d1 + e1 + d2 + e2) / (3.0 * bulk_modulus)
        )
        x0, y0, z0 = vectors[lane], vectors[LANES + lane], vectors[2 * LANES + lane]
        x1, y1, z1 = vectors[3 * LANES + lane], vectors[4 * LANES + lane], vectors[5 * LANES + lane]
        x2, y2, z2 = vectors[6 * LANES + lane], vectors[7 * LANES + lane], vectors[8 * LANES + lane]
        stress[lane] += e0 * x0 * x0 + e1 * x1 * x1 + e2 * x2 * x2
        stress[LANES + lane] += e0 * y0 * y0 + e1 * y1 * y1 + e2 * y2 * y2
        stress[2 * LANES + lane] += e0 * z0 * z0 + e1 * z1 * z1 + e2 * z2 * z2
        stress[3 * LANES + lane] += e0 * x0 * y0 + e1 * x1 * y1 + e2 * x2 * y2
        stress[4 * LANES + lane] += e0 * y0 * z0 + e1 * y1 * z1 + e2 * y2 * z2
        stress[5 * LANES + lane] += e0 * z0 * x0 + e1 * z1 * x1 + e2 * z2 * x2
