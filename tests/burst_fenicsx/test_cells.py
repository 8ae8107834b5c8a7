"""One cell against closed forms: energies, stable step, pressure and strength of the charge, softening, hourglass."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.cells.one_point import vector_square
from burst_fenicsx.problem import Hourglass, IgnitionPoint, Part, Viscosity
from tests.burst_fenicsx.boxes import BARE, ELASTIC, STEEL, TNT, boundary_nodes, box, burst, distorted_box
from tests.burst_fenicsx.test_elements import QUADRATURES, moved

pytestmark = pytest.mark.dolfinx

EDGE = 4e-3
CUBE = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=float)
SHEAR = 0.5 * ELASTIC.elastic_modulus / (1.0 + ELASTIC.poisson_ratio)
BULK = ELASTIC.elastic_modulus / (3.0 * (1.0 - 2.0 * ELASTIC.poisson_ratio))


def cube(part=Part.CASING, settings=BARE, **options):
    """One cell of edge `EDGE`."""
    return burst(box((1, 1, 1), (EDGE,) * 3, part), settings, **options)


def burnt(settings, stretch):
    """A cube of burnt charge, its edges stretched by a factor with nothing else changed."""
    solver = cube(Part.CHARGE, settings)
    solver.fields.charge.burn_fraction[:] = 1.0
    solver.fields.nodes.position[:] *= stretch
    solver.add_forces(0.0)
    return solver


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_elastic_energy_in_shear_tension_and_pressure(quadrature):
    """tau^2 / (2 G), sigma^2 / (2 E) and p^2 / (2 K) a volume."""
    solver = cube(settings=replace(BARE, quadrature=quadrature))
    stress, size = solver.fields.solid.stress, 3e8
    for row, modulus in ((3, SHEAR), (4, SHEAR), (5, SHEAR), (1, ELASTIC.elastic_modulus), (slice(0, 3), BULK)):
        stress[:] = 0.0
        stress[..., row] = size
        assert solver.fields.solid_sums()[0] == pytest.approx(EDGE**3 * size**2 / (2.0 * modulus), rel=1e-12)


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_viscous_heat_is_the_mean_pressure_of_the_step_times_its_compression(quadrature):
    """Two steps of uniaxial compression, the second four times as fast: q = rho h D (q1 c + q2 h D) at their ends."""
    q1, q2, step = 0.1, 1.5, 1e-8
    settings = replace(BARE, quadrature=quadrature, viscosity=Viscosity(linear=q1, quadratic=q2))
    solver = cube(settings=settings)
    modulus, mass = BULK + 4.0 / 3.0 * SHEAR, ELASTIC.density * EDGE**3
    height, viscous, heat = EDGE, 0.0, 0.0
    for strain in (0.002, 0.010):
        moved(solver, lambda start, s=strain: start * [1.0, 1.0, 1.0 - s], step)
        before, height = height, (1.0 - strain) * EDGE
        volume = EDGE**2 * height
        closing = height * (before - height) / (0.5 * (before + height) * step)
        old, density = viscous, mass / volume
        viscous = density * closing * (q1 * np.sqrt(modulus / density) + q2 * closing)
        heat += 0.5 * (old + viscous) * EDGE**2 * (before - height)
    assert solver.ledger.sums[1] == pytest.approx(heat, rel=1e-9)


@pytest.mark.parametrize(("stretch", "gamma"), [(0.95, 3.0), (1.05, 3.0), (2.0, 4.0 / 3.0)])
def test_the_stable_step_of_products_is_that_of_their_sound(stretch, gamma):
    """Edge over c with c^2 = gamma P / rho on the isentrope, P ~ v^-3 when dense and v^-4/3 when thin."""
    solver = burnt(replace(BARE, products="landau"), stretch)
    pressure, density = solver.fields.charge.pressure[0], TNT.density / stretch**3
    assert solver.control.stable_step == pytest.approx(stretch * EDGE / np.sqrt(gamma * pressure / density), rel=1e-9)


@pytest.mark.parametrize("stretch", [1.0, 1.1, 1.4])
def test_products_press_by_the_jwl_equation(stretch):
    """P = A (1 - w/(R1 v)) exp(-R1 v) + B (1 - w/(R2 v)) exp(-R2 v) + w E / v, and E falls by the work done."""
    solver = burnt(replace(BARE, products="jwl"), stretch)
    jwl, v = TNT.jwl, stretch**3
    pressure, energy = solver.fields.charge.pressure[0], solver.fields.charge.energy[0]
    cold = sum(a * (1.0 - jwl.omega / (r * v)) * np.exp(-r * v) for a, r in ((jwl.A, jwl.R1), (jwl.B, jwl.R2)))
    assert pressure == pytest.approx(cold + jwl.omega * energy / v, rel=1e-9)
    assert pressure > 0.0
    fresh = cube(Part.CHARGE, replace(BARE, products="jwl"))
    fresh.fields.charge.burn_fraction[:] = 1.0
    fresh.add_forces(0.0)
    # From the same state at rest in one step: E0 less the mean pressure times the change of volume.
    start = fresh.fields.charge.pressure[0]
    fresh.fields.nodes.position[:] *= stretch
    fresh.add_forces(0.0)
    mean = 0.5 * (start + fresh.fields.charge.pressure[0])
    assert fresh.fields.charge.energy[0] == pytest.approx(jwl.E0 - mean * (v - 1.0), rel=1e-9)


@pytest.mark.parametrize("stretch", [0.95, 1.0, 1.2, 1.6])
def test_the_stable_step_of_jwl_products_is_that_of_their_sound(stretch):
    """Edge over c; rho c^2 = -v dP/dv along the isentrope, dE = -P dv, by differences."""
    solver = burnt(replace(BARE, products="jwl"), stretch)
    jwl, v, h = TNT.jwl, stretch**3, 1e-5
    pressure, energy = solver.fields.charge.pressure[0], solver.fields.charge.energy[0]

    def pressure_at(v, energy):
        cold = sum(a * (1.0 - jwl.omega / (r * v)) * np.exp(-r * v) for a, r in ((jwl.A, jwl.R1), (jwl.B, jwl.R2)))
        return cold + jwl.omega * energy / v

    slope = (pressure_at(v - h, energy + pressure * h) - pressure_at(v + h, energy - pressure * h)) / (2.0 * h)
    sound = np.sqrt(slope * v / (TNT.density / v))
    assert solver.control.stable_step == pytest.approx(stretch * EDGE / sound, rel=1e-6)


@pytest.mark.parametrize(("stretch", "crushed"), [(0.68, False), (0.66, True)])
def test_products_with_hardly_any_volume_left_are_released(stretch, crushed):
    """Below 0.3 of the charge's volume a cell presses no more, even inside out; its neighbours' motion goes on."""
    solver = burnt(replace(BARE, products="landau"), stretch)
    assert solver.fields.eroded[0] == crushed
    assert (np.abs(solver.fields.nodes.force).max() == 0.0) == crushed
    assert np.isinf(solver.control.stable_step) == crushed
    solver.fields.nodes.position[:] *= -1.0
    solver.add_forces(1e-9)
    solver.check_cells()
    assert solver.fields.eroded[0]
    assert solver.ledger.sums[3] == 0.0


def test_an_unreacted_charge_is_never_released():
    """However far it is pressed: it is no gas between nodes. Inside out, it stops the run."""
    solver = cube(Part.CHARGE)
    solver.fields.nodes.position[:] *= 0.5
    solver.add_forces(0.0)
    assert not solver.fields.eroded[0]
    assert solver.fields.charge.pressure[0] > 1e11
    solver.fields.nodes.position[:] *= -1.0
    solver.add_forces(1e-9)
    with pytest.raises(NumericalStop, match="inside out"):
        solver.check_cells()


def test_an_unreacted_charge_parts_in_tension_at_its_strength():
    """rho0 c0^2 (rho/rho0 - 1) down to the strength, not below it however far it is stretched."""
    bulk, strength = TNT.density * TNT.sound_speed**2, TNT.shear_strength
    for stretch in (1.0 + 0.2 * strength / bulk, 1.02):
        solver = cube(Part.CHARGE)
        solver.fields.nodes.position[:] *= stretch
        solver.add_forces(0.0)
        expected = max(bulk * (stretch**-3 - 1.0), -strength)
        assert solver.fields.charge.pressure[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("burnt", [0.0, 0.25, 0.9])
def test_the_charges_strength_fades_as_it_burns(burnt):
    """Sheared far: the strength of what has not burnt; sheared little: G times the shear. All of its work is lost."""
    for shear in (0.2, 0.05 * (1.0 - burnt) * TNT.shear_strength / TNT.shear_modulus):
        solver = cube(Part.CHARGE, replace(BARE, burn="time"))
        solver.fields.charge.burn_fraction[:] = burnt
        solver.add_forces(0.0)
        before = solver.ledger.sums[0]
        moved(solver, lambda start, s=shear: start @ np.array([[1.0, 0.0, s], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), 1e-8)
        stress = solver.fields.charge.stress[0, 0]
        largest = np.sqrt(0.5 * (stress[:3] ** 2).sum() + (stress[3:] ** 2).sum())
        limit = (1.0 - burnt) * TNT.shear_strength
        expected = min(limit, TNT.shear_modulus * shear)
        assert largest == pytest.approx(expected, rel=1e-3 if shear == 0.2 else 1e-6)
        # From no stress to that one in the step: the mean of both over the shear.
        assert solver.ledger.sums[0] - before == pytest.approx(0.5 * expected * shear * EDGE**3, rel=0.02)


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (-0.5, 0.3, 0.8)])
def test_the_charges_strength_resists_changes_of_shape_alone(stretch):
    """2 G times the deviator of the strain, which has no trace; nothing where all sides grow alike."""
    strain = 0.2 * TNT.shear_strength / TNT.shear_modulus * np.array(stretch)
    solver = cube(Part.CHARGE, replace(BARE, burn="time"))
    solver.add_forces(0.0)
    for share in (0.5, 1.0):
        moved(solver, lambda start, s=share: start @ np.diag(np.exp(s * strain)), 1e-8)
    stress = solver.fields.charge.stress[0, 0]
    expected = 2.0 * TNT.shear_modulus * (strain - strain.mean())
    np.testing.assert_allclose(stress[:3], expected, rtol=0.0, atol=1e-3 * TNT.shear_strength)
    np.testing.assert_allclose(stress[3:], 0.0, atol=1e-9 * TNT.shear_strength)
    # From no stress to that one in two steps: half of it times the strain, along every axis.
    least = 1e-3 * TNT.shear_strength * np.abs(strain).max() * EDGE**3
    assert solver.ledger.sums[0] == pytest.approx(0.5 * expected @ strain * EDGE**3, rel=0.02, abs=least)


def test_a_cell_may_burn_by_compression_from_three_cells_ahead_of_the_front():
    """Two burning times of 3/2 h / D each, before which a neighbour's shock burns nothing."""
    cells, size = 12, 2e-3
    mesh = box((1, 1, cells), (size, size, cells * size), Part.CHARGE)
    solver = burst(mesh, replace(BARE, products="landau_cj"), ignition=(IgnitionPoint(0.0, (0.5 * size, 0.5 * size)),))
    charge = solver.fields.charge
    early = charge.ignition_time - charge.compression_from
    np.testing.assert_allclose(early, 3.0 * size / TNT.detonation_velocity, rtol=1e-9)


def test_a_cell_moves_with_the_mean_of_its_nodes():
    """Of a linear velocity field that of the centre. The sum of volumes does not depend on inner nodes."""
    solver = burst(distorted_box(3, EDGE))
    state = solver.fields
    slope = np.random.default_rng(8).normal(size=(3, 3)) * 1e4
    state.nodes.velocity[:] = state.start @ slope.T + [10.0, -20.0, 30.0]
    centres = state.start[state.mesh.dofmap].mean(axis=1)
    expected = np.linalg.norm(centres @ slope.T + [10.0, -20.0, 30.0], axis=1)
    np.testing.assert_allclose(state.casing_speeds()[1], expected, rtol=1e-11)
    inner = ~boundary_nodes(box((3, 3, 3), (3 * EDGE,) * 3))[state.mesh.node]
    before = state.volumes()
    state.nodes.position[inner] += 0.1 * EDGE
    assert state.volumes().sum() == pytest.approx(before.sum(), rel=1e-12)
    assert np.abs(state.volumes() / before - 1.0).max() > 0.05
    cube_of = cube().fields
    assert cube_of.volumes() == pytest.approx([EDGE**3], rel=1e-14)


@pytest.mark.parametrize(
    ("balanced", "left"),
    [
        (np.zeros((0, 3)), 1.0),
        (np.array([[0.0, 0.0, 1.0]]), 5.0 / 13.0),
        (np.array([[0.6, 0.8, 0.0]]), 12.0 / 13.0),  # all of (3, 4, 0)
        (np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), 4.0 / 13.0),
    ],
)
def test_momentum_that_images_balance_is_no_error(balanced, left):
    """A cube that flies with (3, 4, 12) m/s: what remains across the directions of planes through it, over its size."""
    solver = cube()
    solver.fields.nodes.velocity[:] = [3.0, 4.0, 12.0]
    solver.ledger.balanced, solver.ledger.energy_tolerance = balanced, np.inf
    entry = solver.ledger.record(solver.fields, 0.0, 0.0, 0.0)
    assert entry.momentum_error == pytest.approx(left, rel=1e-12, abs=1e-14)
    assert entry.kinetic == pytest.approx(0.5 * ELASTIC.density * EDGE**3 * 169.0, rel=1e-12)


def test_the_impulse_of_planes_is_no_error_of_the_momentum():
    """A cube that has come to rest on a plane has lost what the plane has taken; without the plane that is an error."""
    solver = cube()
    solver.fields.nodes.velocity[:] = [3.0, 0.0, 4.0]
    solver.ledger.energy_tolerance = np.inf
    mass = ELASTIC.density * EDGE**3
    for taken, error in (((3.0, 0.0, 4.0), 0.0), ((0.0, 0.0, 4.0), 0.6), ((3.0, 0.0, 0.0), 0.8)):
        contact = SimpleNamespace(energy=0.0, gain=0.0, impulse=mass * np.array(taken))
        entry = solver.ledger.record(solver.fields, 0.0, 0.0, 0.0, contact)
        assert entry.momentum_error == pytest.approx(error, abs=1e-12)
    solver.fields.nodes.velocity[:] = 0.0
    assert solver.ledger.record(solver.fields, 0.0, 0.0, 0.0).momentum_error == 0.0


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_tension_softens_by_the_edge_of_a_cube_of_equal_volume(quadrature):
    """Half of the strength is left at half of the limit strain, which is twice as large in cells of half the length."""
    limit, length = 0.4, 8e-3
    weak = replace(STEEL, shear_softening_strain=None, tensile_softening_strain=limit, softening_length=length)
    for size in ((4e-3, 4e-3, 4e-3), (2e-3, 4e-3, 8e-3), (8e-3, 8e-3, 8e-3)):
        scale = np.cbrt(np.prod(size)) / length
        for share in (0.25, 0.5, 0.999):
            solver = burst(box((1, 1, 1), size), replace(BARE, quadrature=quadrature), casing=weak)
            solid = solver.fields.solid
            assert solid.softening_scale[0] == pytest.approx(scale, rel=1e-12)
            solid.volume_strain[:] = share * limit / scale
            moved(solver, lambda start: start * 1.02, 1e-8)
            left = (1.0 - share) * weak.tensile_strength
            np.testing.assert_allclose(solid.stress[..., :3], left, rtol=1e-9)


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_plastic_work_in_shear_is_the_strength_times_the_plastic_strain(quadrature):
    """Without softening: tau (gamma - tau / G) a volume, however many steps it takes."""
    weak = replace(ELASTIC, shear_strength=400e6)
    solver = burst(box((1, 1, 1), (EDGE,) * 3), replace(BARE, quadrature=quadrature), casing=weak)
    for strain in np.linspace(0.002, 0.02, 10):
        moved(solver, lambda start, s=strain: start + s * start[:, [2, 0, 1]] * [1.0, 0.0, 0.0], 1e-8)
    expected = weak.shear_strength * (0.02 - weak.shear_strength / SHEAR) * EDGE**3
    assert solver.ledger.sums[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
@pytest.mark.parametrize("last", [1.0, 0.1, 0.0])
@pytest.mark.parametrize("mode", range(4))
def test_hourglass_damping_takes_away_a_rate_at_most_as_a_whole(part, last, mode):
    """However large its coefficient: the rate of each mode of a distorted cell is not turned round in the next step.

    The step before it was as long, shorter, or none, where forces are found again without a step.
    """
    step = 1e-12
    hourglass = Hourglass(charge_viscous=1e9, casing_viscous=1e9, casing_stiffness=0.0)
    mesh = distorted_box(1, EDGE, part, share=0.0)
    solver = burst(mesh, replace(BARE, hourglass=hourglass, burn="time"), explosive=replace(TNT, shear_strength=0.0))
    state, own = solver.fields, solver.fields.mesh.dofmap[0]
    state.grid = state.grid._replace(longest=step)
    vectors, _, _ = hourglass_vectors(state.start[own])
    state.nodes.velocity[own] = np.outer(vectors[mode], [3.0, -2.0, 1.0])
    before = vectors @ state.nodes.velocity[own]
    solver.add_forces(last * step)
    after = before + vectors @ (state.nodes.force[own] / state.mass[own][:, None]) * step
    left = (after * before).sum(axis=1) / (before * before).sum(axis=1)
    assert left[mode] > -1e-9
    assert left[mode] < 0.9


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_the_work_of_hourglass_damping_is_accumulated_as_such(part):
    """A cube bent in one mode at constant speed, which strains nothing: force times way, and nothing else."""
    hourglass = Hourglass(charge_viscous=0.1, casing_viscous=0.1, casing_stiffness=0.0)
    settings = replace(BARE, hourglass=hourglass, burn="time", viscosity=Viscosity(linear=0.1, quadratic=1.5))
    solver = cube(part, settings, explosive=replace(TNT, shear_strength=0.0))
    state, step, way = solver.fields, 1e-9, 1e-9
    vectors, _, _ = hourglass_vectors(state.start[state.mesh.dofmap[0]])
    bent = np.zeros((8, 3))
    bent[state.mesh.dofmap[0]] = np.outer(vectors[1], [way, 0.0, 0.0])
    moved(solver, lambda start: start + bent, step)
    work = -float((state.nodes.force * bent).sum())
    assert work > 0.0
    assert solver.ledger.sums[2] == pytest.approx(work, rel=1e-3)
    assert np.abs(solver.ledger.sums[:2]).max() < 1e-3 * work


def hourglass_vectors(corner):
    """Flanagan and Belytschko's vectors (4, 8) of a hexahedron, its modes' moments (4, 3), mean gradients (8, 3)."""
    modes = np.array([CUBE[:, 1] * CUBE[:, 2], CUBE[:, 2] * CUBE[:, 0], CUBE[:, 0] * CUBE[:, 1], CUBE.prod(axis=1)])
    gradient, volume = np.zeros((8, 3)), 0.0
    for point in CUBE / np.sqrt(3.0):
        shape = 1.0 + CUBE * point
        local = 0.125 * CUBE * np.stack([shape[:, 1] * shape[:, 2], shape[:, 2] * shape[:, 0],
                                         shape[:, 0] * shape[:, 1]], axis=1)  # fmt: skip
        jacobian = local.T @ corner
        volume += np.linalg.det(jacobian)
        gradient += np.linalg.det(jacobian) * local @ np.linalg.inv(jacobian).T
    moments = modes @ corner
    return modes - moments @ (gradient / volume).T, moments, gradient / volume


def test_no_hourglass_vector_is_longer_than_its_bound():
    """Of hexahedra at random; and axes may be exchanged."""
    random = np.random.default_rng(5)
    tightest = 0.0
    for _ in range(100):
        corner = (CUBE + random.uniform(-0.5, 0.5, CUBE.shape)) * random.uniform(0.2, 1.0, 3)
        vectors, moments, gradient = hourglass_vectors(corner)
        norms = np.linalg.norm(gradient, axis=0)
        for vector, moment in zip(vectors, moments, strict=True):
            bound = vector_square(tuple(moment), tuple(norms))
            assert vector @ vector <= bound * (1.0 + 1e-12)
            tightest = max(tightest, vector @ vector / bound)
            for turn in ([1, 2, 0], [2, 0, 1]):
                assert vector_square(tuple(moment[turn]), tuple(norms[turn])) == pytest.approx(bound, rel=1e-12)
    assert tightest > 0.7
    assert vector_square((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)) == pytest.approx(8.0, rel=1e-12)
