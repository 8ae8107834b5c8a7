"""One ring against closed forms: stable step, viscosity, hourglass control, crushed products, bond and friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.kernels.axisymmetric.slide_line import add_line_forces
from burst_fenicsx.kernels.sliding import SlideLaw
from burst_fenicsx.problem import ContactSettings, Hourglass, Part, Viscosity
from tests.burst_fenicsx.axisymmetric.meridians import random_meridian, rectangle, ring_burst
from tests.burst_fenicsx.axisymmetric.test_slide_line import bench
from tests.burst_fenicsx.bodies import QUIET
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
        assert solver.stable_step == pytest.approx(length / sound, rel=1e-6)
    # Far from the axis it is a square: the edge over c.
    assert ring(0.2).stable_step == pytest.approx(EDGE / SOUND, rel=0.01)


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
        solver.resultant[own][:, [0, 2]], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max()
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
        answer = solver.resultant[:, axis] / solver.fields.mass
        expected = 16.0 * 0.05 * SOUND / EDGE + 64.0 / 36.0 * 0.05 * (SOUND / EDGE) ** 2 * step
        np.testing.assert_allclose(answer, -expected * corner, rtol=3e-3)
        assert np.abs(solver.resultant[:, 2].sum()) < 1e-9 * np.abs(solver.resultant).sum()


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
    change = vector @ (step * solver.resultant[own][:, [0, 2]] / state.mass[own][:, None])
    assert change[1] == pytest.approx(-rate[1], rel=1e-5)
    if inner > 0.0:  # nodes on the axis are held
        assert change[0] == pytest.approx(-rate[0], rel=1e-5)


@pytest.mark.parametrize(("relative", "released"), [(0.5, False), (0.4, True)])
def test_products_below_less_than_half_of_the_charges_volume_give_up_their_forces(relative, released):
    """Burnt, they are released with no pressure; the unreacted charge never is."""
    for burnt in (1.0, 0.0):
        solver = ring(5e-3, Part.CHARGE, replace(BARE, products="landau", burn="time"))
        state = solver.fields
        state.charge.burn_fraction[:] = burnt
        state.nodes.position[:, 2] *= relative
        solver.add_forces(0.0)
        gone = released and burnt == 1.0
        assert bool(state.released[0]) is gone
        assert bool(np.abs(solver.resultant).max() == 0.0) is gone
        assert bool(state.charge.pressure[0] == 0.0) is gone
        assert not gone or np.isinf(solver.stable_step)


def test_a_ring_that_is_nearly_burnt_burns_on_by_compression():
    """To (1 - V/V0) / (1 - v_CJ), with v_CJ = 3/4 of gamma = 3: wholly at that volume, to 0.95 a little before."""
    for before, relative, after in ((0.9, 0.7625, 0.95), (0.9, 0.74, 1.0), (0.9, 0.9, 0.9), (0.0, 0.9, 0.4)):
        solver = ring(5e-3, Part.CHARGE, replace(BARE, products="landau_cj", burn="time_or_compression"))
        state = solver.fields
        state.charge.burn_fraction[:], state.charge.compression_from[:] = before, -1.0
        state.nodes.position[:, 2] *= relative
        solver.add_forces(0.0)
        assert state.charge.burn_fraction[0] == pytest.approx(after, rel=1e-9)


def slid(law, *, gap=0.0, slip=0.0, burnt=0.0, steps=1):
    """The cylinder's charge moved away from its casing by `gap` at once, and along it by `slip` (m) in equal steps.

    Gives the contacts, which of them lie away from the ends, their areas (m2), forces (N) and heat of all steps (J).
    """
    solver = ring_burst(bench("cylinder"), QUIET)
    interface, state = solver.contact.interface, solver.fields
    contacts, position = interface.contacts, state.nodes.position
    state.charge.burn_fraction[:], state.charge.pressure[:] = burnt, 0.0
    charge = np.unique(state.mesh.dofmap[state.mesh.part == Part.CHARGE])
    heat = np.zeros(len(contacts.slave))
    for number in range(steps + 1):
        if number == 1:
            position[charge, 0] -= gap  # the charge lies within
        if number:
            position[charge, 2] += slip / steps
        force = np.zeros_like(state.nodes.force)
        add_line_forces(
            law, 1.0, interface.line, contacts, state.charge.burn_fraction, state.charge.pressure,
            state.rings.released, position, state.mass, np.zeros_like(force), force,
        )  # fmt: skip
        heat += contacts.tally[:, 1]
    height = state.start[contacts.slave, 2]
    inner = (height > 0.2 * LENGTH_OF_BENCH) & (height < 0.8 * LENGTH_OF_BENCH)
    # Each node's share of the surface: 2 pi r times the cell.
    radius = position[contacts.slave, 0]
    area = 2.0 * np.pi * radius * (LENGTH_OF_BENCH / CELLS_OF_BENCH)
    on_charge = contacts.force
    return contacts, inner, area, on_charge, heat


LENGTH_OF_BENCH, CELLS_OF_BENCH = 0.06, 24
BUDGET, STEP = 1e13, 1e-7


def test_the_bond_of_rings_breaks_at_its_tensile_strength():
    """Pulled off its casing the charge is held up to the strength times the area, whatever the stiffness; then not."""
    strength = 20e6
    law = SlideLaw(BUDGET, STEP, strength, 1e12, 0.0)
    contacts, inner, area, force, _ = slid(law, gap=1e-9)
    stiffness = contacts.stiffness[inner] / area[inner]
    opening = strength / stiffness.mean()
    for share, holds in ((0.95, True), (1.05, False)):
        contacts, inner, area, force, _ = slid(law, gap=share * opening)
        assert (contacts.bonded[inner] == int(holds)).all()
        traction = np.abs(force[inner, 0]) / area[inner]
        np.testing.assert_allclose(traction, share * strength if holds else 0.0, rtol=0.02)


def test_friction_of_rings_is_cohesion_and_a_share_of_the_pressure():
    """Pressed by p and slid far: shear stress c + p tan(phi) while it yields, never above the explosive's strength."""
    cohesion, friction = 5e6, 0.36
    law = SlideLaw(BUDGET, STEP, 20e6, cohesion, friction)
    contacts, inner, area, _, _ = slid(law, gap=-1e-9)
    stiffness = (contacts.stiffness[inner] / area[inner]).mean()
    pressure = 40e6
    slip = 3.0 * (cohesion + friction * pressure) / stiffness
    contacts, inner, area, force, _ = slid(law, gap=-pressure / stiffness, slip=slip)
    pressed = np.abs(force[inner, 0]) / area[inner]
    np.testing.assert_allclose(pressed, pressure, rtol=0.02)
    np.testing.assert_allclose(np.abs(force[inner, 1]) / area[inner], cohesion + friction * pressed, rtol=1e-6)
    assert (contacts.bonded[inner] == 0).all()
    # Slid on without a bond: friction alone.
    contacts, inner, area, force, _ = slid(law, gap=-pressure / stiffness, slip=2.0 * slip, steps=2)
    np.testing.assert_allclose(np.abs(force[inner, 1]), friction * np.abs(force[inner, 0]), rtol=1e-6)
    # Half burnt: half of it.
    contacts, inner, area, force, _ = slid(law, gap=-pressure / stiffness, slip=slip, burnt=0.5)
    pressed = np.abs(force[inner, 0]) / area[inner]
    np.testing.assert_allclose(np.abs(force[inner, 1]) / area[inner], 0.5 * (cohesion + friction * pressed), rtol=1e-6)
    # A bond that would hold more than the explosive: its shear strength.
    contacts, inner, area, force, _ = slid(law._replace(cohesion=1e9), gap=-pressure / stiffness, slip=20.0 * slip)
    np.testing.assert_allclose(np.abs(force[inner, 1]) / area[inner], TNT.shear_strength, rtol=1e-6)


def test_the_heat_of_sliding_rings_is_friction_times_the_way():
    """At constant pressure, once it slides: mu N ds in every step, and nothing while the springs hold."""
    friction = 0.36
    law = SlideLaw(BUDGET, STEP, 0.0, 0.0, friction)
    contacts, inner, area, _, _ = slid(law, gap=-1e-9)
    stiffness = (contacts.stiffness[inner] / area[inner]).mean()
    gap, ahead = -40e6 / stiffness, friction * 40e6 / stiffness
    *_, force, smallest = slid(law, gap=gap, slip=0.0)
    assert np.abs(smallest).max() == 0.0
    contacts, inner, area, force, heat = slid(law, gap=gap, slip=10.0 * ahead, steps=200)
    press = np.abs(force[inner, 0])
    last = contacts.tally[inner, 1]
    np.testing.assert_allclose(last, friction * press * 10.0 * ahead / 200, rtol=1e-6)
    # Of the whole way, less the part in which the springs were loaded.
    np.testing.assert_allclose(heat[inner], friction * press * 9.0 * ahead, rtol=0.01)


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


@pytest.mark.parametrize(("shape", "axis"), [("cylinder", 2), ("disc", 0)])
def test_what_charge_and_casing_do_together_is_no_slip(shape, axis):
    """Both carried along the line, the charge by a little more: the springs hold the difference, and no heat comes."""
    law = SlideLaw(BUDGET, STEP, 1e12, 1e12, 0.0)
    common, more = 1e-6, 2e-8
    for both, own in ((common, more), (-common, more), (common, 0.0)):
        solver = ring_burst(bench(shape), QUIET)
        interface, state = solver.contact.interface, solver.fields
        contacts, position = interface.contacts, state.nodes.position
        contacts.strength[:] = 1e15
        state.charge.burn_fraction[:] = state.charge.pressure[:] = 0.0
        charge = np.unique(state.mesh.dofmap[state.mesh.part == Part.CHARGE])
        energy = []
        for _ in range(2):
            force = np.zeros_like(state.nodes.force)
            add_line_forces(
                law, 1.0, interface.line, contacts, state.charge.burn_fraction, state.charge.pressure,
                state.rings.released, position, state.mass, np.zeros_like(force), force,
            )  # fmt: skip
            energy.append(contacts.tally.copy())
            position[:, axis] += both
            position[charge, axis] += own
        inner = np.abs(state.start[contacts.slave, axis] / LENGTH_OF_BENCH - 0.5) < 0.3
        position[:, axis] -= both
        position[charge, axis] -= own
        slipped = np.abs(contacts.slip[inner])
        np.testing.assert_allclose(slipped, own, rtol=1e-5, atol=1e-13)
        spring = contacts.stiffness[inner] * contacts.slip[inner]
        np.testing.assert_allclose(np.abs(contacts.force[inner, axis // 2]), np.abs(spring), rtol=1e-5, atol=1e-6)
        assert np.abs(energy[1][inner, 1]).max() == 0.0
        # What the springs store is the work of the relative motion: nothing is left over.
        np.testing.assert_allclose(energy[1][inner, 0], 0.5 * contacts.stiffness[inner] * own**2, rtol=1e-5, atol=1e-12)
        assert np.abs(energy[1][inner, 2]).max() < 1e-5 * max(energy[1][inner, 0].max(), 1e-9)


def test_the_spring_of_a_contact_is_as_stiff_as_its_reduced_mass_bears():
    """Alone between two nodes of the line: k (1/m + w0^2/m0 + w1^2/m1) is the budget."""
    solver = ring_burst(bench("cylinder"), QUIET)
    interface, state = solver.contact.interface, solver.fields
    contacts, line, position = interface.contacts, interface.line, state.nodes.position
    state.charge.burn_fraction[:] = state.charge.pressure[:] = 0.0
    charge = np.unique(state.mesh.dofmap[state.mesh.part == Part.CHARGE])
    position[charge, 2] += 0.3 * LENGTH_OF_BENCH / CELLS_OF_BENCH
    force = np.zeros_like(state.nodes.force)
    add_line_forces(
        SlideLaw(BUDGET, STEP, 1e12, 1e12, 0.0), 1.0, line, contacts, state.charge.burn_fraction,
        state.charge.pressure, state.rings.released, position, state.mass, np.zeros_like(force), force,
    )  # fmt: skip
    inner = np.abs(state.start[contacts.slave, 2] / LENGTH_OF_BENCH - 0.5) < 0.3
    assert inner.sum() > 10
    np.testing.assert_allclose(np.sort(contacts.weight[inner], axis=1), [[0.3, 0.7]] * inner.sum(), rtol=1e-9)
    ends = line.edges[contacts.face[inner]]
    inverse = 1.0 / state.mass[contacts.slave[inner]] + (contacts.weight[inner] ** 2 / state.mass[ends]).sum(axis=1)
    np.testing.assert_allclose(contacts.stiffness[inner] * inverse, BUDGET, rtol=1e-12)


def test_the_ledger_takes_the_heat_of_sliding_rings():
    """Pressed and dragged along: what the step hands to contact is the heat of all contacts, and never negative."""
    solver = ring_burst(bench("cylinder"), replace(QUIET, contact=ContactSettings(cohesion=0.0, friction_angle=20.0)))
    state, contacts = solver.fields, solver.contact.interface.contacts
    charge = np.unique(state.mesh.dofmap[state.mesh.part == Part.CHARGE])
    solver.free_step = STEP
    heat, given = 0.0, []
    for number in range(6):
        state.nodes.position[charge, 0 if number == 0 else 2] += 2e-7 if number == 0 else 2e-5
        solver.add_forces(STEP)
        heat += contacts.tally[:, 1].sum()
        given.append(solver.contact.friction)
    assert given[-1] == pytest.approx(heat, rel=1e-12)
    assert heat > 0.0
    assert (np.diff(given) >= 0.0).all()
    press = np.abs(contacts.force[:, 0])
    rate = np.tan(np.radians(20.0)) * press.sum() * 2e-5
    assert given[-1] - given[-2] == pytest.approx(rate, rel=0.05)
