"""One ring against closed forms: stable step, viscosity, hourglass control, crushed products, burning, energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.problem import Hourglass, Part, Viscosity
from tests.burst_fenicsx.axisymmetric.meridians import random_meridian, rectangle, ring_burst
from tests.burst_fenicsx.boxes import BARE, CONTROLLED, ELASTIC, TNT
from tests.burst_fenicsx.test_elements import moved

pytestmark = pytest.mark.dolfinx

EDGE = 1e-3
SHEAR = 0.5 * ELASTIC.elastic_modulus / (1.0 + ELASTIC.poisson_ratio)
LAME = 2.0 * SHEAR * ELASTIC.poisson_ratio / (1.0 - 2.0 * ELASTIC.poisson_ratio)
STIFF = LAME + 2.0 * SHEAR
SOUND = np.sqrt(STIFF / ELASTIC.density)


def ring(inner, part=Part.CASING, settings=BARE, **options):
    """One square ring of edge `EDGE`."""
    return ring_burst(rectangle((1, 1), (inner, inner + EDGE), EDGE, part), settings, **options)


def slanted(inner, part):
    """The mesh of one such ring whose corners are moved at random by up to a fifth of its edge; the axis stays."""
    mesh = rectangle((1, 1), (inner, inner + EDGE), EDGE, part)
    shift = 0.2 * EDGE * np.random.default_rng(9).uniform(-1, 1, mesh.nodes.shape) * [1, 0, 1]
    shift[mesh.nodes[:, 0] == 0.0, 0] = 0.0
    return replace(mesh, nodes=mesh.nodes + shift)


def volume_of(nodes):
    """Volume of the ring of a quadrilateral (4, 2) in (r, z): 2 pi times the integral of r, by Green's theorem."""
    (r, z), (s, y) = nodes.T, np.roll(nodes, -1, axis=0).T
    return np.pi / 3.0 * float(np.sum((r * r + r * s + s * s) * (y - z)))


def slopes_of(nodes):
    """Derivatives (4, 2) of the ring's volume by the places of its nodes (m2)."""
    slopes = np.zeros((4, 2))
    for node, axis in np.ndindex(4, 2):
        move = np.zeros((4, 2))
        move[node, axis] = 1e-4 * EDGE
        slopes[node, axis] = (volume_of(nodes + move) - volume_of(nodes - move)) / (2e-4 * EDGE)
    return slopes


def length_of(nodes, masses):
    """2 c over the highest frequency: omega^2 = rho c^2 / V times the largest eigenvalue of sum g g^T / m.

    With g the derivatives of the volume by the nodes' places.
    """
    slopes = slopes_of(nodes)
    slopes[nodes[:, 0] == 0.0, 0] = 0.0  # they do not move radially
    volume, total = volume_of(nodes), masses.sum()
    largest = np.linalg.eigvalsh(np.einsum("ai,aj,a->ij", slopes, slopes, 1.0 / masses))[-1]
    return 2.0 / np.sqrt(total / volume**2 * largest)


@pytest.mark.parametrize("inner", [0.0, 5e-3, 0.2])
def test_the_stable_step_is_that_of_a_pressure_in_the_ring(inner):
    """Of a ring anywhere, and of products in it at c^2 = 3 P / rho: 2 / omega of its own stiffness against volume."""
    casing = ring_burst(slanted(inner, Part.CASING), BARE)
    gas = ring_burst(slanted(inner, Part.CHARGE), replace(BARE, products="landau"))
    gas.fields.charge.burn_fraction[:] = 1.0
    gas.add_forces(0.0)
    for solver, sound in ((casing, SOUND), (gas, np.sqrt(3.0 * gas.fields.charge.pressure[0] / TNT.density))):
        own = solver.fields.mesh.dofmap[0]
        length = length_of(solver.fields.start[own][:, [0, 2]], solver.fields.mass[own])
        assert solver.control.stable_step == pytest.approx(length / sound, rel=1e-6)
    # What may still be initiated is stepped as products at the front are, whose speed of sound is 3/4 D.
    waits = ring_burst(slanted(inner, Part.CHARGE), replace(BARE, products="landau"))
    for burnt in (0.0, 0.999):
        waits.fields.charge.burn_fraction[:] = burnt
        waits.add_forces(0.0)
        length = length_of(waits.fields.start[own][:, [0, 2]], waits.fields.mass[own])
        assert waits.control.stable_step == pytest.approx(length / (0.75 * TNT.detonation_velocity), rel=1e-6)
    # Far from the axis it is a square: the edge over c.
    assert ring(0.2).control.stable_step == pytest.approx(EDGE / SOUND, rel=0.01)


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_viscous_heat_is_the_mean_pressure_of_the_step_times_its_compression(part):
    """Two steps of radial and axial compression, the second four times as fast: q = rho L D (q1 c + q2 L D)."""
    q1, q2, step = 0.1, 1.5, 1e-9
    solver = ring(0.2, part, replace(BARE, viscosity=Viscosity(linear=q1, quadratic=q2), burn="time"))
    state, own = solver.fields, solver.fields.mesh.dofmap[0]
    mass, volume = state.cell_mass[0], volume_of(state.start[own][:, [0, 2]])
    first, viscous, heat = volume, 0.0, 0.0
    bulk, slope, shear = TNT.density * TNT.sound_speed**2, TNT.hugoniot_slope, TNT.shear_modulus
    for strain in (0.002, 0.010):
        place = np.array([1.0 - strain, 1.0, 1.0 - 0.5 * strain])
        moved(solver, lambda start, p=place: start * p, step)
        nodes = state.nodes.position[own][:, [0, 2]]
        before, volume = volume, volume_of(nodes)
        # The trace of the rates on the mid-step configuration: twice the radial one and the axial one.
        old = 0.0 if first == before else 0.002
        trace = sum(2.0 * k * (strain - old) / (2.0 - k * (strain + old)) for k in (1.0, 1.0, 0.5)) / step
        density, closing = mass / volume, length_of(nodes, state.mass[own]) * trace
        relative = volume / first
        closed = slope * (1.0 - relative)
        unreacted = relative * bulk * (1.0 + closed) / (1.0 - closed) ** 3  # -v dP/dv on its Hugoniot
        stiff = STIFF if part == Part.CASING else unreacted + 4.0 / 3.0 * shear
        was, viscous = viscous, density * closing * (q1 * np.sqrt(stiff / density) + q2 * closing)
        heat += 0.5 * (was + viscous) * (before - volume)
    assert solver.ledger.sums[1] == pytest.approx(heat, rel=1e-5)


@pytest.mark.parametrize("inner", [0.0, 5e-3])
@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_the_viscous_pressure_pushes_the_nodes_as_a_pressure(part, inner):
    """In a step too short for anything else, of any compression: q dV/dx, along the radius, the axis and the hoop."""
    q1, q2, step = 0.1, 1.5, 1e-18
    solver = ring_burst(slanted(inner, part), replace(BARE, viscosity=Viscosity(linear=q1, quadratic=q2), burn="time"))
    state, own = solver.fields, solver.fields.mesh.dofmap[0]
    nodes, mass = state.start[own][:, [0, 2]], state.cell_mass[0]
    velocity = -3e3 * nodes + np.random.default_rng(2).normal(0.0, 2.0, (4, 2))
    velocity[nodes[:, 0] == 0.0, 0] = 0.0
    state.nodes.velocity[own] = np.insert(velocity, 1, 0.0, axis=1)
    solver.add_forces(step)
    slopes, volume = slopes_of(nodes), volume_of(nodes)
    trace = float((slopes * velocity).sum()) / volume
    stiff = STIFF if part == Part.CASING else TNT.density * TNT.sound_speed**2 + 4.0 / 3.0 * TNT.shear_modulus
    density, closing = mass / volume, -length_of(nodes, state.mass[own]) * trace
    pressure = density * closing * (q1 * np.sqrt(stiff / density) + q2 * closing)
    assert closing > 0.0
    expected = pressure * slopes
    expected[nodes[:, 0] == 0.0, 0] = 0.0
    np.testing.assert_allclose(
        solver.fields.nodes.force[own][:, [0, 2]], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max()
    )


def test_hourglass_control_is_that_of_a_cube_of_the_same_size():
    """Far from the axis a hourglass velocity u meets -(16 k_v c / h + 16 k_s c^2 dt / (9 h^2)) u, as in a cube."""
    step = 1e-7
    for axis in (0, 2):
        solver = ring(2.0, settings=CONTROLLED)
        nodes = solver.fields.nodes
        corner = np.sign(solver.fields.start[:, [0, 2]] - solver.fields.start[:, [0, 2]].mean(axis=0)).prod(axis=1)
        nodes.velocity[:, axis] = corner
        solver.add_forces(step)
        answer = solver.fields.nodes.force[:, axis] / solver.fields.mass
        expected = 16.0 * 0.05 * SOUND / EDGE + 64.0 / 36.0 * 0.05 * (SOUND / EDGE) ** 2 * step
        np.testing.assert_allclose(answer, -expected * corner, rtol=3e-3)
        assert np.abs(solver.fields.nodes.force[:, 2].sum()) < 1e-9 * np.abs(solver.fields.nodes.force).sum()


def hourglass_vector(nodes):
    """The mode 1, -1, 1, -1 less its linear part: h - (h.r) br / V - (h.z) bz / V, br = dV/dr - A, bz = dV/dz."""
    points = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    area = np.zeros(4)
    for xi, eta in points / np.sqrt(3.0):
        shape = 0.25 * (1 + points[:, 0] * xi) * (1 + points[:, 1] * eta)
        slope = 0.25 * np.stack([points[:, 0] * (1 + points[:, 1] * eta), points[:, 1] * (1 + points[:, 0] * xi)])
        area += 2.0 * np.pi * shape * np.linalg.det(slope @ nodes)
    slopes = slopes_of(nodes)
    slopes[:, 0] -= area
    mode = np.array([1.0, -1.0, 1.0, -1.0])
    return mode - slopes @ (mode @ nodes) / volume_of(nodes)


@pytest.mark.parametrize("inner", [0.0, 5e-3, 0.2])
@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
@pytest.mark.parametrize("last", [1.0, 0.1, 0.0])
def test_hourglass_damping_takes_away_a_rate_at_most_as_a_whole(inner, part, last):
    """However large its coefficient: of a distorted ring by itself nothing is left of the rate after the next step.

    The step before it was as long, shorter, or none, where forces are found again without a step.
    """
    step, random = 1e-12, np.random.default_rng(9)
    hourglass = Hourglass(charge_viscous=1e9, casing_viscous=1e9, casing_stiffness=0.0)
    settings = replace(BARE, hourglass=hourglass, burn="time")
    solver = ring_burst(slanted(inner, part), settings, explosive=replace(TNT, shear_strength=0.0))
    state, own = solver.fields, solver.fields.mesh.dofmap[0]
    state.grid = state.grid._replace(longest=step)
    velocity = random.normal(0.0, 10.0, (4, 2))
    velocity[state.start[own, 0] == 0.0, 0] = 0.0
    state.nodes.velocity[own] = np.insert(velocity, 1, 0.0, axis=1)
    solver.add_forces(last * step)
    vector = hourglass_vector(state.start[own][:, [0, 2]])
    rate = vector @ velocity
    change = vector @ (step * solver.fields.nodes.force[own][:, [0, 2]] / state.mass[own][:, None])
    assert change[1] == pytest.approx(-rate[1], rel=1e-5)
    if inner > 0.0:  # nodes on the axis are held
        assert change[0] == pytest.approx(-rate[0], rel=1e-5)


def test_all_crushed_rings_of_a_block_are_released_and_keep_their_volume():
    """Whole blocks of them: the volume that counts stays that of before, however far they are pressed on."""
    mesh = rectangle((2 * LANES, 1), (5e-3, 5e-3 + 2 * LANES * EDGE), EDGE, Part.CHARGE)
    solver = ring_burst(mesh, replace(BARE, products="landau", burn="time"))
    state = solver.fields
    state.charge.burn_fraction[:] = 1.0
    before = state.grid.volume.copy()
    for relative in (0.25, 0.1):
        state.nodes.position[:, 2] = relative * state.start[:, 2]
        solver.add_forces(0.0)
        assert state.eroded.all()
        assert np.abs(solver.fields.nodes.force).max() == 0.0
        np.testing.assert_array_equal(state.grid.volume, before)


def test_a_ring_that_is_nearly_burnt_burns_on_by_compression():
    """To (1 - V/V0) / (1 - v_CJ), with v_CJ = 3/4 of gamma = 3: wholly at that volume, to 0.95 a little before."""
    for before, relative, after in ((0.9, 0.7625, 0.95), (0.9, 0.74, 1.0), (0.9, 0.9, 0.9), (0.0, 0.9, 0.4)):
        solver = ring(5e-3, Part.CHARGE, replace(BARE, products="landau_cj", burn="time_or_compression"))
        state = solver.fields
        state.charge.burn_fraction[:], state.charge.compression_from[:] = before, -1.0
        state.nodes.position[:, 2] *= relative
        solver.add_forces(0.0)
        assert state.charge.burn_fraction[0] == pytest.approx(after, rel=1e-9)


def test_energy_of_a_random_ring_in_tension_shear_and_pressure():
    """Elastic energy by the compliance: half of stress times strain over the whole ring, its hoop stress included."""
    solver = ring_burst(random_meridian(3, 5e-3, 0.02), BARE)
    state = solver.fields
    random = np.random.default_rng(6).normal(size=state.solid.stress.shape) * 1e8
    random[..., 3:5] = 0.0
    state.solid.stress[:] = random
    nodes = state.start[state.mesh.dofmap][..., [0, 2]]
    energy = 0.0
    for cell, s in enumerate(random[: state.mesh.cells, 0]):
        whole = np.array([[s[0], 0.0, s[5]], [0.0, s[1], 0.0], [s[5], 0.0, s[2]]])
        nu, modulus = ELASTIC.poisson_ratio, ELASTIC.elastic_modulus
        strain = ((1.0 + nu) * whole - nu * np.trace(whole) * np.eye(3)) / modulus
        energy += 0.5 * float((whole * strain).sum()) * volume_of(nodes[cell])
    assert state.solid_sums()[0] == pytest.approx(energy, rel=1e-12)
