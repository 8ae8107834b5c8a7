"""The hexahedron's kernels: patch test, rotation, internal force and the whole method against UFL."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

import dolfinx.fem
import ufl

from burst_fenicsx import compat
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.problem import Hourglass, Part, Viscosity
from docs.theory import method_in_ufl as demo
from tests.burst_fenicsx.boxes import (
    BARE,
    CONTROLLED,
    ELASTIC,
    STEEL,
    TNT,
    boundary_nodes,
    box,
    burst,
    carried,
    distorted_box,
    matrices,
    rotation_matrix,
)

pytestmark = pytest.mark.dolfinx


QUADRATURES = ("one_point", "full")


def moved(solver, place, step):
    """Carry the nodes to their next places and accumulate the work, as a step does."""
    carried(solver, place, step)
    solver.ledger.add(solver.fields.totals.energy, solver.fields.totals.released)


def isotropic_stress(strain, material=ELASTIC):
    """Hooke's law on (3, 3) strains (Pa)."""
    shear = 0.5 * material.elastic_modulus / (1.0 + material.poisson_ratio)
    lame = 2.0 * shear * material.poisson_ratio / (1.0 - 2.0 * material.poisson_ratio)
    return lame * np.trace(strain) * np.eye(3) + 2.0 * shear * strain


def hourglass_forces(solver):
    """Stored hourglass forces, (cells, 4 modes, 3)."""
    slots, held = solver.fields.blocks.slots
    lanes = solver.fields.solid.hourglass.reshape(-1, 12, LANES).transpose(0, 2, 1).reshape(-1, 4, 3)
    result = np.empty((solver.fields.mesh.cells, 4, 3))
    result[held] = lanes[slots]
    return result


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_patch_of_distorted_cells_takes_a_linear_field_exactly(quadrature):
    """A uniform velocity gradient gives the same exact stress in every cell and no force on inner nodes."""
    mesh = distorted_box(4, 5e-3)
    solver = burst(mesh, replace(CONTROLLED, quadrature=quadrature))
    deformation = np.eye(3) + np.array([[3e-2, -2e-2, 1e-2], [4e-2, -1e-2, 2e-2], [-3e-2, 5e-2, 2e-2]])
    moved(solver, lambda start: start @ deformation.T, step=1e-7)
    # The gradient of the displacement on the mid-step configuration.
    increment = 2.0 * (deformation - np.eye(3)) @ np.linalg.inv(deformation + np.eye(3))
    exact = isotropic_stress(0.5 * (increment + increment.T))
    stress = matrices(solver.fields.solid.stress[: solver.fields.mesh.cells])
    assert np.abs(stress - exact).max() < 1e-12 * np.abs(exact).max()
    inner = ~boundary_nodes(box((4, 4, 4), (0.02,) * 3))[solver.fields.mesh.node]
    force = solver.fields.nodes.force
    assert np.abs(force[inner]).max() < 1e-12 * np.abs(force).max()
    assert np.abs(hourglass_forces(solver)).max() < 1e-12 * np.abs(force).max()
    assert solver.ledger.sums[2] == pytest.approx(0.0, abs=1e-12 * np.abs(force).max() * 5e-3)


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_strain_superposed_on_large_rotation_gives_the_rotated_stress(quadrature):
    """Stretched slowly while turned by 90 degrees, every cell bears R (C : ln U) R^T, to second order in the step.

    The stretch along the turning axis commutes with the rotation, so the logarithmic strain is exact in the limit.
    """
    axis, angle, stretch = np.array([1.0, 2.0, 2.0]) / 3.0, 0.5 * np.pi, 0.1
    errors = []
    for steps in (20, 40):
        solver = burst(distorted_box(3, 5e-3), replace(CONTROLLED, quadrature=quadrature))
        for k in range(1, steps + 1):
            turn = rotation_matrix(axis, angle * k / steps)
            along = np.eye(3) + (np.exp(stretch * k / steps) - 1.0) * np.outer(axis, axis)
            moved(solver, lambda start, f=turn @ along: start @ f.T, step=1e-7)
        exact = isotropic_stress(stretch * np.outer(axis, axis))
        stress = matrices(solver.fields.solid.stress[: solver.fields.mesh.cells])
        errors.append(np.abs(stress - exact).max() / np.abs(exact).max())
    rate = np.log2(errors[0] / errors[1])
    assert errors[1] < 1e-3, f"errors {errors}, rate {rate:.2f}"
    assert rate > 1.8, f"errors {errors}, rate {rate:.2f}"


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_rigid_rotation_by_90_degrees_turns_the_stress_to_1e_10(quadrature):
    """In 1,000 steps about a skew axis; stored hourglass forces turn with the cells and do no work."""
    solver = burst(distorted_box(3, 5e-3), replace(CONTROLLED, quadrature=quadrature))
    state = solver.fields.solid
    random = np.random.default_rng(3)
    state.stress[:] = random.normal(size=state.stress.shape) * 1e9
    if quadrature == "one_point":
        state.hourglass[:] = random.normal(size=state.hourglass.shape) * 1e3
    before = matrices(state.stress[: solver.fields.mesh.cells].copy())
    stored = hourglass_forces(solver).copy()
    axis, steps = (1.0, -2.0, 0.5), 1000
    for k in range(1, steps + 1):
        turn = rotation_matrix(axis, 0.5 * np.pi * k / steps)
        moved(solver, lambda start, f=turn: start @ f.T + 0.01, step=1e-7)
    after = matrices(state.stress[: solver.fields.mesh.cells])
    exact = turn @ before @ turn.T
    assert np.abs(after - exact).max() < 1e-10 * np.abs(exact).max()
    np.testing.assert_allclose(hourglass_forces(solver), stored @ turn.T, atol=1e-10 * max(np.abs(stored).max(), 1.0))
    forces = solver.fields.nodes.force
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * np.abs(forces).sum()


def test_hourglass_control_opposes_every_hourglass_mode_and_keeps_momentum():
    """A pure hourglass velocity meets a force against it, of the stated size on a cube; the sum of forces is zero."""
    edge, step = 4e-3, 1e-8
    solver = burst(box((1, 1, 1), (edge,) * 3), CONTROLLED)
    nodes = solver.fields.nodes
    corner = np.sign(solver.fields.start - 0.5 * edge)
    density = ELASTIC.density
    shear = 0.5 * ELASTIC.elastic_modulus / 1.3
    speed = np.sqrt(2.0 * shear * (1.0 - 0.3) / (1.0 - 0.6) / density)
    damping = 0.25 * 0.05 * density * speed * edge**2
    spring = 0.05 / 36.0 * density * speed**2 * edge * step
    for a, b in ((0, 1), (1, 2), (2, 0)):
        mode = corner[:, a] * corner[:, b]
        solver.fields.solid.hourglass[:] = 0.0
        nodes.velocity[:] = 0.0
        nodes.velocity[:, 0] = mode
        solver.add_forces(step)
        force = solver.fields.nodes.force
        np.testing.assert_allclose(force[:, 0], -8.0 * (damping + spring) * mode, rtol=1e-9)
        assert np.abs(force[:, 1:]).max() < 1e-9 * np.abs(force).max()


def one_form(mesh, stress, degree):
    """The vector of -int sigma : grad v dx, by UFL, as (nodes, 3)."""
    test = ufl.TestFunction(mesh.vector_space)
    form = -ufl.inner(stress, ufl.grad(test)) * ufl.dx(metadata={"quadrature_degree": degree})
    return dolfinx.fem.assemble_vector(dolfinx.fem.form(form))


def as_tensor(s):
    return ufl.as_matrix([[s[0], s[3], s[5]], [s[3], s[1], s[4]], [s[5], s[4], s[2]]])


def assembled(vector):
    return np.array(vector.array).reshape(-1, 3)


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_force_of_one_point_equals_ufls_with_stress_constant_in_cells(part):
    """-int sigma : grad v dx with a DG-0 stress and 2-point Gauss, which integrates the mean gradient exactly."""
    solver = burst(distorted_box(4, 5e-3, part), BARE)
    state = solver.fields
    stress = state.solid.stress
    stress[:] = np.random.default_rng(11).normal(size=stress.shape) * 1e9
    if part == Part.CHARGE:
        # Burnt out: the products' pressure alone counts, whatever deviator is left over.
        stress[:] = 0.0
        state.charge.burn_fraction[:] = 1.0
        state.nodes.position[:] *= 1.1
    solver.add_forces(0.0)
    if part == Part.CHARGE:
        pressure = state.charge.pressure
        stress[:, 0, :3] = -pressure[:, None]
        assert pressure.min() > 1e9
    tensor = as_tensor(state.functions["stress"])
    exact = assembled(one_form(state.mesh, tensor, 3))
    error = np.abs(solver.fields.nodes.force - exact).max() / np.abs(exact).max()
    assert error < 1e-12


def test_metal_without_strength_answers_alike_at_one_and_at_2x2x2_points():
    """Only the pressure and viscous hourglass control are left: forces, pressures and work are the same."""
    shifts = np.random.default_rng(2).normal(0.0, 1e-6, (64, 3))
    soft = replace(STEEL, shear_softening_strain=0.5, tensile_softening_strain=0.5)
    control = Hourglass(casing_viscous=0.05, casing_stiffness=0.0, charge_viscous=0.1)
    found = []
    for quadrature in QUADRATURES:
        solver = burst(
            distorted_box(3, 9e-3), replace(BARE, quadrature=quadrature, hourglass=control), casing=soft, min_work=1e-9
        )
        state = solver.fields
        state.solid.shear_strain[:] = state.solid.volume_strain[:] = 1.0
        moved(solver, lambda places: 0.999 * places + shifts, 1e-7)
        assert (state.solid.stress[:, :, 0] < 0.0).all()
        pressures = -state.solid.stress[..., :3].mean(axis=(1, 2))
        found.append((state.nodes.force.copy(), pressures, solver.ledger.sums[:3].copy()))
    (force, pressure, work), (full_force, full_pressure, full_work) = found
    assert work[2] > 0.0
    np.testing.assert_allclose(full_pressure, pressure, rtol=1e-9)
    np.testing.assert_allclose(full_force, force, rtol=0.0, atol=1e-9 * np.abs(force).max())
    np.testing.assert_allclose(full_work, work, rtol=1e-9, atol=1e-12 * work[2])


def test_force_of_full_quadrature_equals_ufls_b_bar():
    """-int dev(sigma) : grad v + mean(sigma) div v dx with the stress at 2x2x2 points, mean(sigma) over the cell.

    The stress function lies in dolfinx's own order of points, which this equality would not survive otherwise.
    """
    solver = burst(distorted_box(4, 5e-3), replace(BARE, quadrature="full"))
    state = solver.fields
    stress = state.solid.stress
    stress[:] = np.random.default_rng(12).normal(size=stress.shape) * 1e9
    before = stress.copy()
    solver.add_forces(0.0)
    np.testing.assert_allclose(stress, before, rtol=1e-12)
    domain = state.mesh.domain
    tensor = as_tensor(state.functions["stress"])
    # The cell's mean of the hydrostatic stress, weighted with the volume at the points.
    metadata = {"quadrature_degree": 2, "quadrature_scheme": "default"}
    flat = ufl.TestFunction(compat.cell_space(domain))
    sums = dolfinx.fem.assemble_vector(dolfinx.fem.form(ufl.tr(tensor) / 3.0 * flat * ufl.dx(metadata=metadata))).array
    volumes = dolfinx.fem.assemble_vector(dolfinx.fem.form(flat * ufl.dx(domain, metadata=metadata))).array
    mean = dolfinx.fem.Function(compat.cell_space(domain))
    mean.x.array[:] = sums / volumes
    test = ufl.TestFunction(state.mesh.vector_space)
    form = -(ufl.inner(ufl.dev(tensor), ufl.grad(test)) + mean * ufl.div(test)) * ufl.dx(metadata=metadata)
    exact = assembled(dolfinx.fem.assemble_vector(dolfinx.fem.form(form)))
    error = np.abs(solver.fields.nodes.force - exact).max() / np.abs(exact).max()
    assert error < 1e-12


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
@pytest.mark.parametrize("offset", [1e-3, 3e-3, 6e-3])
def test_hourglass_control_takes_energy_from_warped_cells_and_gives_none(offset, part):
    """A plate of 2 mm, folded up and down by up to three times that, without strength: its motion only dies down.

    Its start is sudden: half a step of damping, by g/2 of a mode's velocity v, comes before the first displacement, and
    g m v^2 is accumulated in every further step of (1 - g) times the velocity. In all m v^2 (1 - g/2) / 2: half the
    momentum before that half step times the velocity after it.
    """
    solver, uncontrolled = (
        folded_plate(offset, part, Viscosity(), control) for control in (Hourglass(), BARE.hourglass)
    )
    velocity = solver.fields.nodes.velocity
    mass = solver.fields.mass[:, None]
    before = 0.5 * float(np.sum(mass * velocity**2))
    for plate in (solver, uncontrolled):
        plate.choose_levels()  # which finds the forces of these velocities
    step = solver.control.next_step(0.0, np.inf)
    assert uncontrolled.control.next_step(0.0, np.inf) == step
    damping = solver.fields.nodes.force - uncontrolled.fields.nodes.force
    counted = before + 0.25 * step * float(np.sum(velocity * damping))
    assert counted < 0.96 * before
    for _ in range(10):
        solver.step()
    start = balance(solver)
    assert 0.999 * counted < start < 1.013 * counted  # modes of small g have not died down yet
    for _ in range(6):
        for _ in range(50):
            solver.step()
        kinetic = 0.5 * float(np.sum(mass * velocity**2))
        assert kinetic < 1.02 * before  # a little comes back from the stored strain
        before = kinetic
    assert balance(solver) == pytest.approx(start, rel=5e-3)


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_without_hourglass_control_a_sudden_start_closes_the_balance(part):
    """The same plate from its first step on: what it has at first is kept to 0.3 %, with and without viscosity."""
    for viscosity in (Viscosity(), BARE.viscosity):
        solver = folded_plate(1e-3, part, viscosity, BARE.hourglass)
        before = 0.5 * float(np.sum(solver.fields.mass[:, None] * solver.fields.nodes.velocity**2))
        for _ in range(12):
            solver.step()
            assert balance(solver) == pytest.approx(before, rel=3e-3)


def folded_plate(offset, part, viscosity, hourglass):
    """A plate of 2 mm without strength, folded up and down by `offset` (m), its nodes moving at random."""
    mesh = box((6, 6, 1), (0.06, 0.06, 0.002), part)
    across = np.rint(mesh.nodes[:, :2] / 0.01).astype(int).sum(axis=1)
    mesh = replace(mesh, nodes=mesh.nodes + offset * np.outer((-1.0) ** across, (0.0, 0.0, 1.0)))
    weak = replace(STEEL, shear_strength=1e4, tensile_strength=1e4)
    settings = replace(BARE, viscosity=viscosity, hourglass=hourglass)
    solver = burst(mesh, settings, casing=weak, explosive=replace(TNT, shear_strength=1e4))
    solver.ledger.energy_tolerance = np.inf
    velocity = solver.fields.nodes.velocity
    # Nodes draw in the order in which dolfinx's cells come to them.
    spread = solver.fields.mesh
    turn = np.argsort(np.unique(spread.dofmap[spread.row], return_index=True)[1])
    velocity[turn] = np.random.default_rng(1).normal(0.0, 30.0, velocity.shape)
    return solver


def balance(solver):
    """Kinetic energy and all that is stored or lost, less what the charge gave (J): a constant."""
    entry = solver.ledger.record(solver.fields, solver.time, solver.time_step, 0.0)
    return entry.kinetic + entry.strain + entry.plastic + entry.viscous + entry.hourglass - entry.products_work


def test_plain_forms_and_the_solver_move_a_tube_alike():
    moved, positions, velocities = demo.differences()
    assert moved > 0.1 * 0.026  # of the outer radius
    assert positions < 1e-10
    assert velocities < 1e-10


@pytest.mark.parametrize(
    "name", ["shear_strength", "tensile_strength", "shear_softening_strain", "tensile_softening_strain"]
)
def test_every_property_of_the_steel_matters_in_that_tube(name, monkeypatch):
    """A thousandth more moves a node by far more than the two ways differ."""
    mesh = demo.tube()
    position, _ = demo.by_solver(mesh)
    monkeypatch.setattr(demo, "STEEL", replace(demo.STEEL, **{name: 1.001 * getattr(demo.STEEL, name)}))
    other, _ = demo.by_solver(mesh)
    assert np.abs(other - position).max() > 1e-7 * np.abs(position - mesh.nodes).max()
