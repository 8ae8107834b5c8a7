"""Tresca's return against a brute-force projection, the principal values against LAPACK, and softening in a cell."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from burst_fenicsx.kernels.cells.layout import SOLID_OWN
from burst_fenicsx.materials.solids.tresca import (
    is_elastic,
    principal_stresses,
    return_stress,
    strengths,
    without_strength,
)
from tests.burst_fenicsx.boxes import matrices

MODULUS, POISSON = 210e9, 0.3
COMPLIANCE = (np.eye(3) * (1.0 + POISSON) - POISSON) / MODULUS
"""Of principal stresses (1/Pa)."""


def returned(stress, tau, sigma, poisson=POISSON):
    """Return (n, 6) trial stresses with strengths (n,): stresses, shear strain, volume strain, dissipation."""
    results = [
        return_stress(tuple(trial), shear, tension, MODULUS, poisson)
        for trial, shear, tension in zip(stress.tolist(), tau.tolist(), sigma.tolist(), strict=True)
    ]
    columns = (np.array(column) for column in zip(*results, strict=True))
    return tuple(columns)


def projected(principal, tau, sigma):
    """Closest admissible principal stresses by trying every set of up to three active constraints.

    Nine constraints in three unknowns, s_i - s_j <= 2 tau and s_i <= sigma; nothing is assumed on order or region.
    """
    rows = [np.eye(3)[i] - np.eye(3)[j] for i in range(3) for j in range(3) if i != j] + list(np.eye(3))
    normals = np.array(rows)
    bounds = np.column_stack([2.0 * tau] * 6 + [sigma] * 3)
    scale = np.abs(principal).max() + 1.0
    best, energy = np.full_like(principal, np.nan), np.full(len(principal), np.inf)
    stiffness = np.linalg.inv(COMPLIANCE)
    for size in range(4):
        for active in combinations(range(9), size):
            a = normals[list(active)]
            gram = a @ stiffness @ a.T
            if size and np.linalg.cond(gram) > 1e10:
                continue
            point = principal.copy()
            if size:
                multiplier = np.linalg.solve(gram, (principal @ a.T - bounds[:, list(active)]).T).T
                point = principal - multiplier @ a @ stiffness
            distance = np.einsum("ni,ij,nj->n", point - principal, COMPLIANCE, point - principal)
            better = (point @ normals.T <= bounds + 1e-12 * scale).all(axis=1) & (distance < energy)
            best[better], energy[better] = point[better], distance[better]
    return best


def six(matrix):
    return matrix[..., [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]


def random_rotations(count, random):
    q, r = np.linalg.qr(random.normal(size=(count, 3, 3)))
    return q * np.sign(np.einsum("nii->ni", r))[:, None, :]


@pytest.fixture(scope="module")
def trials():
    """10,000 trial stresses: all regions, equal principal values, softened to nothing in shear, in tension, in both."""
    random = np.random.default_rng(1)
    count = 10_000
    principal = random.normal(size=(count, 3)) * 1.2e9 + random.normal(size=(count, 1)) * 8e8
    principal[:1000, 1] = principal[:1000, 0]
    principal[1000:2000, 1] = principal[1000:2000, 2]
    principal[2000:2200] = principal[2000:2200, :1]
    principal[2200:2300] = 0.0
    principal[2300:2600, 1:] = 0.0
    tau, sigma = random.uniform(0.0, 8e8, count), random.uniform(0.0, 1.6e9, count)
    tau[3000:4000] = 0.0
    sigma[3500:4500] = 0.0
    tau[4500:4600] = sigma[4500:4600] = 1e12
    turn = random_rotations(count, random)
    turn[5000:6000] = np.eye(3)
    return principal, tau, sigma, turn, six(np.einsum("nia,na,nja->nij", turn, principal, turn))


def test_return_is_the_closest_admissible_stress(trials):
    """Against the enumeration of all active sets, in the norm of the elastic energy; every region occurs."""
    principal, tau, sigma, turn, stress = trials
    found, _, _, _ = returned(stress, tau, sigma)
    exact = projected(principal, tau, sigma)
    expected = six(np.einsum("nia,na,nja->nij", turn, exact, turn))
    error = np.abs(found - expected).max() / np.abs(stress).max()
    assert error < 1e-13, f"largest error {error:.2e}"
    low, middle, high = np.sort(exact, axis=1).T
    near = 1e-6 * np.abs(principal).max()
    yields, tears = high - low > 2.0 * tau - near, high > sigma - near
    edges = (high - middle < near) | (middle - low < near)
    for region in (
        ~yields & ~tears,
        yields & ~tears & ~edges,
        yields & ~tears & edges,
        ~yields & tears & ~edges,
        ~yields & tears & edges,
        yields & tears & ~edges,
        yields & tears & edges,
        high - low < near,
    ):
        assert region.sum() > 50


def test_plastic_strain_is_what_the_elastic_law_leaves_over(trials):
    """C^-1 (trial - returned): norm of its deviator (Eq. 11), trace (Eq. 10), work; a second return changes nothing."""
    _, tau, sigma, _, stress = trials
    found, shear, volume, dissipation = returned(stress, tau, sigma)
    excess = matrices(stress - found)
    trace = np.trace(excess, axis1=1, axis2=2)
    strain = ((1.0 + POISSON) * excess - POISSON * trace[:, None, None] * np.eye(3)) / MODULUS
    dilatation = np.trace(strain, axis1=1, axis2=2)
    deviator = strain - dilatation[:, None, None] / 3.0 * np.eye(3)
    np.testing.assert_allclose(shear, np.linalg.norm(deviator, axis=(1, 2)), atol=1e-13 * shear.max())
    np.testing.assert_allclose(volume, dilatation, atol=1e-13 * volume.max())
    work = np.einsum("nij,nij->n", strain, matrices(found))
    np.testing.assert_allclose(dissipation, work, atol=1e-12 * dissipation.max())
    assert dissipation.min() > -1e-12 * dissipation.max()
    assert volume.min() > -1e-13 * volume.max()
    again, more_shear, more_volume, _ = returned(found, tau, sigma)
    np.testing.assert_allclose(again, found, atol=1e-14 * np.abs(stress).max())
    assert max(more_shear.max(), np.abs(more_volume).max()) < 1e-13 * shear.max()


def test_what_the_bound_finds_elastic_stays_to_the_last_bit(trials):
    """No cell's result depends on plastic cells of its block: all trials that the bound keeps are admissible."""
    principal, tau, sigma, _, stress = trials
    kept = 0
    for s, shear, tension, values in zip(stress.tolist(), tau.tolist(), sigma.tolist(), principal, strict=True):
        if is_elastic(tuple(s), shear, tension):
            kept += 1
            assert return_stress(tuple(s), np.inf, np.inf, MODULUS, POISSON) == (tuple(s), 0.0, 0.0, 0.0)
            near = 1e-12 * np.abs(values).max()
            assert 0.5 * np.ptp(values) <= shear + near
            assert values.max() <= tension + near
    assert 500 < kept < len(stress)


def test_return_turns_with_the_stress(trials):
    _, tau, sigma, _, stress = trials
    turn = random_rotations(1, np.random.default_rng(9))[0]
    turned = six(turn @ matrices(stress) @ turn.T)
    found, shear, volume, _ = returned(stress, tau, sigma)
    other, other_shear, other_volume, _ = returned(turned, tau, sigma)
    np.testing.assert_allclose(other, six(turn @ matrices(found) @ turn.T), atol=2e-14 * np.abs(stress).max())
    np.testing.assert_allclose(other_shear, shear, atol=1e-13 * shear.max())
    np.testing.assert_allclose(other_volume, volume, atol=1e-13 * shear.max())


def test_principal_stresses_equal_lapacks_to_round_off(trials):
    """Values to 1e-14 of the largest, in order; the dyads are of orthonormal directions and rebuild the stress."""
    stress = trials[4]
    worst_value = worst_stress = worst_dyad = 0.0
    for s in stress:
        s1, s2, s3, first, *tensors = principal_stresses(tuple(s.tolist()))
        dyad, difference = (matrices(np.array(tensor)) for tensor in tensors)
        assert s1 >= s2 >= s3
        alone, upper, lower = (s1, s2, s3) if first else (s3, s1, s2)
        across = np.eye(3) - dyad
        size = np.abs(s).max() + 1.0
        worst_value = max(worst_value, np.abs(np.linalg.eigvalsh(matrices(s)) - (s3, s2, s1)).max() / size)
        rebuilt = alone * dyad + 0.5 * (upper + lower) * across + 0.5 * (upper - lower) * difference
        worst_stress = max(worst_stress, np.abs(rebuilt - matrices(s)).max() / size)
        if s1 > s3:
            worst_dyad = max(worst_dyad, np.abs(dyad @ dyad - dyad).max(), abs(np.trace(dyad) - 1.0))
    assert max(worst_value, worst_stress, worst_dyad) < 1e-14, (worst_value, worst_stress, worst_dyad)


@pytest.mark.parametrize(
    ("shear", "volume", "left"),
    [
        (0, 0, 1),
        (0.125, 0, 0.75),
        (0, 0.125, 0.5),
        (0.25, 0.1, 0.5),
        (0.1, 0.2, 0.2),
        (0.5, 0, 0),
        (0, 0.25, 0),
        (9, 9, 0),
    ],
)
def test_both_strengths_fall_linearly_with_the_strain_that_is_nearer_its_limit(shear, volume, left):
    """Eq. 9: what is torn in shear bears no tension, and the other way round; without limits nothing softens."""
    row = np.array([0.0] * SOLID_OWN + [8e8, 1e9, 2.0, 4.0])
    assert strengths(row, shear, volume, 1.0) == pytest.approx((8e8 * left, 1e9 * left), rel=1e-12, abs=1e-6)
    assert strengths(row, 2.0 * shear, 2.0 * volume, 0.5) == strengths(row, shear, volume, 1.0)
    points = np.array([[shear, 0.0]]), np.array([[volume, 0.0]])
    assert not without_strength(row[None], *points, np.ones(1))[0]  # the second point holds
    assert without_strength(row[None], *(column[:, :1] for column in points), np.ones(1))[0] == (left == 0)
    row[-2:] = 0.0
    assert strengths(row, shear, volume, 1.0) == (8e8, 1e9)


@pytest.mark.dolfinx
@pytest.mark.parametrize("quadrature", ["one_point", "full"])
def test_a_softened_cell_carries_compression_only(quadrature):
    """Sheared and torn beyond both limits, a cell holds no shear and no tension for good, but pressure as before."""
    pytest.importorskip("burst_fenicsx.compat")
    from tests.burst_fenicsx.boxes import BARE, STEEL, box, burst
    from tests.burst_fenicsx.test_elements import moved

    weak = replace(STEEL, shear_softening_strain=0.05, tensile_softening_strain=0.05)
    solver = burst(box((1, 1, 1), (1e-2,) * 3), replace(BARE, quadrature=quadrature), casing=weak)
    state = solver.fields.solid

    def strain(gradient, steps, base):
        for k in range(1, steps + 1):
            moved(solver, lambda start, g=gradient * k / steps: start @ (base @ (np.eye(3) + g)).T, step=1e-7)
        return base @ (np.eye(3) + gradient)

    shear = np.zeros((3, 3))
    shear[0, 1] = 0.05
    base = strain(shear, 50, np.eye(3))
    # Eq. 9 on the way: tau = tau_c (1 - gamma / gamma_lim), the strength of the step before.
    gamma = float(state.shear_strain[0, 0])
    stress = np.linalg.eigvalsh(matrices(state.stress[0, 0]))
    tau = 0.5 * (stress[2] - stress[0])
    # Pure shear e_xy: the deviator's norm is sqrt(2) e_xy.
    assert gamma == pytest.approx(np.sqrt(2.0) * (0.025 - tau / (2.0 * 210e9 / 2.6)), rel=5e-3)
    assert tau == pytest.approx(8e8 * (1.0 - gamma / 0.05), rel=0.05)
    base = strain(2.0 * shear, 50, base)
    assert state.shear_strain.min() > 0.05
    assert np.ptp(np.linalg.eigvalsh(matrices(state.stress[0, 0]))) < 1e-6 * 8e8
    base = strain(np.diag([1e-3, 1e-3, 1e-3]), 5, base)
    assert np.abs(state.stress[:1]).max() < 1e-6 * 8e8  # torn in shear alone it bears no tension
    assert state.volume_strain.max() < 0.01
    base = strain(np.diag([0.03, 0.03, 0.03]), 50, base)
    assert state.volume_strain.min() > 0.05
    assert np.abs(state.stress[:1]).max() < 1e-6 * 8e8
    torn = state.volume_strain[0, 0]
    base = strain(np.diag([-0.01, -0.01, -0.01]), 20, base)
    bulk = 210e9 / (3.0 * 0.4)
    pressure = -state.stress[0, :, :3].mean(axis=1)
    np.testing.assert_allclose(pressure, -3.0 * bulk * np.log(0.99), rtol=1e-3)
    assert np.abs(state.stress[0, :, 3:]).max() < 1e-6 * 8e8
    base = strain(0.2 * shear, 20, base)
    assert np.ptp(np.linalg.eigvalsh(matrices(state.stress[0, 0]))) < 1e-6 * 8e8
    strain(np.diag([0.02, 0.02, 0.02]), 20, base)
    assert np.abs(state.stress[:1]).max() < 1e-6 * 8e8
    assert state.volume_strain[0, 0] > torn
