"""Tresca plasticity with tension cut-off and linear softening (Wang et al., Eqs. 8-11).

The admissible stresses are those with (s1 - s3)/2 <= tau_c and s1 <= sigma_t, s1 >= s2 >= s3 being the
principal stresses. A trial stress outside is returned to the closest admissible one in the norm of
the elastic energy, which is the backward Euler step of the associated flow rule; the plastic strain
is what the elastic law leaves over, C^-1 (trial - returned).

The compiled routines take and return the numbers of one lane (see `burst_fenicsx.kernels`); a stress is the tuple
(xx, yy, zz, xy, yz, zx).
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells.layout import SOLID_OWN
from burst_fenicsx.kernels.lanes import lane_function
from burst_fenicsx.kernels.vectors.tensors import Symmetric, Vector, dot, fma, symmetric_square
from burst_fenicsx.problem import CasingMaterial

MATERIAL = CasingMaterial
PARAMETERS = ("tau", "sigma", "inverse_shear_limit", "inverse_volume_limit")

_TAU, _SIGMA, _SHEAR_LIMIT, _VOLUME_LIMIT = range(SOLID_OWN, SOLID_OWN + len(PARAMETERS))

_THIRD = 1.0 / 3.0
_TINY = 1e-290  # keeps 0/0 away where nothing is to be done


def constants(material: CasingMaterial) -> tuple[float, ...]:
    """Columns of a material (Pa); an inverse limit of zero switches softening off."""
    limits = (material.shear_softening_strain, material.tensile_softening_strain)
    return (
        material.shear_strength,
        material.tensile_strength,
        *(0.0 if limit is None else 1.0 / limit for limit in limits),
    )


def without_strength(
    parameters: np.ndarray, shear_strain: np.ndarray, volume_strain: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Whether each cell (cells,) has lost its strength at every point.

    `parameters` (cells, columns); strains (cells, points); `scale` (cells,) inverse factor on the limit strains.
    """
    of_shear, of_volume = parameters[:, _SHEAR_LIMIT, None], parameters[:, _VOLUME_LIMIT, None]
    used = np.maximum(shear_strain * of_shear, volume_strain * of_volume).min(axis=1) * scale
    spent: np.ndarray = used >= 1.0
    return spent


@lane_function
def strengths(parameters: np.ndarray, shear_strain: float, volume_strain: float, scale: float) -> tuple[float, float]:
    """Shear and tensile strength (Pa) after plastic strains (Eq. 9), both by the strain that is nearer its limit.

    `scale` is the inverse factor on the limit strains. At a limit both are gone: metal torn in shear bears no tension.
    """
    used = scale * max(shear_strain * parameters[_SHEAR_LIMIT], volume_strain * parameters[_VOLUME_LIMIT])
    left = max(0.0, 1.0 - used)
    return parameters[_TAU] * left, parameters[_SIGMA] * left


@lane_function
def is_elastic(stress: Symmetric, tau: float, sigma: float) -> bool:
    """Whether bounds without principal values show that a stress keeps within the strengths `tau` and `sigma` (Pa).

    (s1 - s3)/2 <= sqrt(J2) and s1 <= mean + 2 sqrt(J2/3).
    """
    xx, yy, zz, xy, yz, zx = stress
    mean = (xx + yy + zz) * (1.0 / 3.0)
    j2 = symmetric_square((xx - mean, yy - mean, zz - mean, xy, yz, zx))
    # The cut-off bound without a root: 4 J2 / 3 <= (sigma - mean)^2.
    room = max(sigma - mean, 0.0)
    return (j2 <= tau * tau) & ((4.0 / 3.0) * j2 <= room * room) & (mean <= sigma)


@lane_function
def _cosine_of_third(cosine: float) -> float:
    """cos(phi/3) from cos(phi) between 0 and 1: the root y of 4 y^3 - 3 y = cos(phi) between cos(30 degrees) and 1.

    A polynomial that is right to 5e-6 and one step of Halley's iteration, which leaves round-off.
    """
    c = cosine
    y = 0.86603043 + c * (0.16641172 + c * (-0.04592193 + c * (0.01751219 - 0.0040354 * c)))
    value = y * (4.0 * y * y - 3.0) - c
    slope = 12.0 * y * y - 3.0
    return y - value * slope / (slope * slope - 12.0 * y * value)


@lane_function
def principal_stresses(stress: Symmetric) -> tuple[float, float, float, bool, Symmetric, Symmetric]:
    """Principal stresses and what is needed to turn them back into a stress, without principal directions.

    Parameters
    ----------
    stress : Pa.

    Returns
    -------
    The principal stresses s1 >= s2 >= s3 (Pa); whether s1 is the one farthest from the two others, else s3 is; its
    dyad n n^T; and the difference p p^T - q q^T of the dyads of the other two, the larger first (of no meaning, but
    no larger, where they are equal).

    Notes
    -----
    In the manner of Scherzinger and Dohrmann (2008, Computer Methods in Applied Mechanics and Engineering 197): the
    value farthest from the others is well conditioned, whatever they do, so it comes from the invariants. With B the
    deviator over sqrt(J2/3), the value of B is eta = 2 cos(phi/3), cos(phi) = det(B)/2, and its dyad is the adjugate
    of B - eta over its trace, which lies between 6 and 9. What is left of B in the plane across it is traceless and
    gives the other two by its norm alone. No trigonometry, no sweeps, and nothing is lost where values are equal.
    """
    xx, yy, zz, xy, yz, zx = stress
    mean = (xx + yy + zz) * _THIRD
    # Traceless to its own round-off, however small beside the mean.
    xx, yy = xx - mean, yy - mean
    zz = -(xx + yy)
    size = np.sqrt(symmetric_square((xx, yy, zz, xy, yz, zx)) * _THIRD)
    inverse = 1.0 / (size + _TINY)
    xx, yy, zz, xy, yz, zx = xx * inverse, yy * inverse, zz * inverse, xy * inverse, yz * inverse, zx * inverse
    cxx, cxy, czx = yy * zz - yz * yz, yz * zx - xy * zz, xy * yz - zx * yy
    cosine = 0.5 * dot((xx, xy, zx), (cxx, cxy, czx))
    eta = np.copysign(2.0 * _cosine_of_third(min(abs(cosine), 1.0)), cosine)

    axx, ayy, azz = xx - eta, yy - eta, zz - eta
    nxx, nyy, nzz = ayy * azz - yz * yz, azz * axx - zx * zx, axx * ayy - xy * xy
    nxy, nyz, nzx = yz * zx - xy * azz, zx * xy - yz * axx, xy * yz - zx * ayy
    over = 1.0 / (nxx + nyy + nzz)
    nxx, nyy, nzz, nxy, nyz, nzx = over * nxx, over * nyy, over * nzz, over * nxy, over * nyz, over * nzx

    half, most = 0.5 * eta, -1.5 * eta
    dxx, dyy, dzz = fma(most, nxx, xx + half), fma(most, nyy, yy + half), fma(most, nzz, zz + half)
    dxy, dyz, dzx = fma(most, nxy, xy), fma(most, nyz, yz), fma(most, nzx, zx)
    gap = np.sqrt(symmetric_square((dxx, dyy, dzz, dxy, dyz, dzx)))
    over = 1.0 / (gap + _TINY)

    first = eta >= 0.0
    alone = fma(size, eta, mean)
    upper, lower = fma(size, gap - half, mean), fma(size, -gap - half, mean)
    return (
        alone if first else upper,
        upper if first else lower,
        lower if first else alone,
        first,
        (nxx, nyy, nzz, nxy, nyz, nzx),
        (over * dxx, over * dyy, over * dzz, over * dxy, over * dyz, over * dzx),
    )


@lane_function
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
    mean = (s1 + s2 + s3) * _THIRD
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
    both = (s1 + s2 - 2.0 * sigma) * (1.0 - poisson)  # over 1 + ratio
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


@lane_function
def _plastic_flow(change: Vector, returned: Vector, modulus: float, poisson: float) -> tuple[float, float, float]:
    """Plastic strains and work, as those of `return_stress`, of a change of the principal stresses to `returned`."""
    e1, e2, e3 = change
    mean = (e1 + e2 + e3) * _THIRD
    f = e1 - mean, e2 - mean, e3 - mean
    by_shear, by_bulk = (1.0 + poisson) / modulus, 3.0 * (1.0 - 2.0 * poisson) / modulus  # 1/(2 G), 1/K
    work = -by_shear * dot(f, returned) - by_bulk * mean * (returned[0] + returned[1] + returned[2]) * _THIRD
    return by_shear * np.sqrt(dot(f, f)), -by_bulk * mean, work


@lane_function
def return_stress(
    stress: Symmetric, tau: float, sigma: float, modulus: float, poisson: float
) -> tuple[Symmetric, float, float, float]:
    """Return a trial stress to the admissible set.

    Parameters
    ----------
    stress : trial stress (Pa).
    tau, sigma : current shear and tensile strength (Pa).
    modulus, poisson : Young's modulus (Pa) and Poisson's ratio.

    Returns
    -------
    The returned stress (Pa); the increments of the equivalent plastic shear strain (the norm of the deviator, Eq. 11)
    and of the plastic volumetric strain (Eq. 10); the plastic work per volume (J/m3).

    Notes
    -----
    Eq. 11 is taken on the increments and summed: this equals the paper's for proportional straining, does not
    depend on the cell's rotation, and lets no strength come back on reversal.
    """
    s1, s2, s3, first, dyad, difference = principal_stresses(stress)
    r1, r2, r3 = return_principal(s1, s2, s3, tau, sigma, poisson)
    e1, e2, e3 = r1 - s1, r2 - s2, r3 - s3
    shear_strain, volume_strain, work = _plastic_flow((e1, e2, e3), (r1, r2, r3), modulus, poisson)

    # The change e n n^T + u p p^T + l q q^T with p p^T + q q^T = 1 - n n^T.
    alone = e1 if first else e3
    upper, lower = (e2 if first else e1), (e3 if first else e2)
    middle, half = 0.5 * (upper + lower), 0.5 * (upper - lower)
    alone -= middle
    xx, yy, zz, xy, yz, zx = stress
    returned = (
        fma(alone, dyad[0], fma(half, difference[0], xx + middle)),
        fma(alone, dyad[1], fma(half, difference[1], yy + middle)),
        fma(alone, dyad[2], fma(half, difference[2], zz + middle)),
        fma(alone, dyad[3], fma(half, difference[3], xy)),
        fma(alone, dyad[4], fma(half, difference[4], yz)),
        fma(alone, dyad[5], fma(half, difference[5], zx)),
    )
    return returned, shear_strain, volume_strain, work
