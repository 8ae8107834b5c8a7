"""The ring against closed forms: plane waves over the axis, Lame's cylinder and sphere, rigid motion, ledger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.axisymmetric.meridian import RING
from burst_fenicsx.mechanics.nodal_loads import NodalLoads
from burst_fenicsx.problem import Hourglass
from tests.burst_fenicsx.axisymmetric import meridians
from tests.burst_fenicsx.axisymmetric.meridians import hold, meridian, rectangle, ring_burst, whole_steps
from tests.burst_fenicsx.bodies import BAR
from tests.burst_fenicsx.boxes import BARE, ELASTIC, matrices, run_until

pytestmark = pytest.mark.dolfinx

YOUNG, POISSON, PRESSURE = ELASTIC.elastic_modulus, ELASTIC.poisson_ratio, 1e6


def spread_of_a_plane_wave():
    """Largest difference of the axial speeds of a layer over the largest speed, once a pulse has crossed a cylinder."""
    solver = ring_burst(rectangle((5, 40), (0.0, 0.01), 0.08), casing=BAR)
    start, velocity = solver.fields.start, solver.fields.nodes.velocity
    velocity[:, 2] = np.where(start[:, 2] < 0.02, 10.0 * np.sin(np.pi * start[:, 2] / 0.02) ** 2, 0.0)
    run_until(solver, 0.06 / np.sqrt(BAR.elastic_modulus / BAR.density))
    assert np.abs(velocity[start[:, 2] > 0.04, 2]).max() > 4.0  # it has come that far
    layer = np.round(start[:, 2] / 2e-3).astype(int)
    spread = max(float(np.ptp(velocity[layer == k, 2])) for k in range(41))
    return spread / np.abs(velocity[:, 2]).max(), np.abs(velocity[:, 0]).max()


def test_a_plane_axial_wave_passes_the_axis_undisturbed(monkeypatch):
    """With the integrals of N r for masses all nodes of a layer move alike; with quarters of the cells they do not."""
    spread, radial = spread_of_a_plane_wave()
    assert spread < 1e-10
    assert radial < 1e-8
    alike = replace(RING, mass_fractions=lambda position, dofmap: np.full(dofmap.shape, 0.25))
    monkeypatch.setattr(meridians, "RING", alike)
    spread, _ = spread_of_a_plane_wave()
    assert spread > 0.05


def inner_pressure(solver, edges):
    """Nodal forces (nodes, 3) of the pressure on edges (n, 2) at rest, the pressed side to their right."""
    position = solver.fields.start
    a, b = position[edges[:, 0]], position[edges[:, 1]]
    normal = np.stack([-(b - a)[:, 2], np.zeros(len(a)), (b - a)[:, 0]], axis=1)
    force = np.zeros_like(position)
    for near, own, other in ((0, a, b), (1, b, a)):
        share = PRESSURE * 2.0 * np.pi / 6.0 * (2.0 * own[:, 0] + other[:, 0])
        np.add.at(force, edges[:, near], share[:, None] * normal)
    return force


def settled(mesh, pressed, held, time, damping):
    """Solver of a body at rest under an inner pressure, its motion damped away."""
    settings = whole_steps(BARE, damping=damping, hourglass=Hourglass(casing_viscous=0.05, casing_stiffness=0.05))
    solver = ring_burst(mesh, settings)
    local = solver.fields.mesh.local_node
    load = inner_pressure(solver, np.stack([local(pressed[:, 0]), local(pressed[:, 1])], axis=1))
    solver.loads = NodalLoads(solver.fields, damping, lambda now, force: force.__iadd__(load))
    hold(solver, held(solver.fields.start))
    run_until(solver, time)
    assert np.abs(solver.fields.nodes.velocity).max() < 1e-6
    return solver


def cylinder(count):
    """Thick tube of radii 10 and 20 mm in plane strain, `count` cells through the wall."""
    mesh = rectangle((count, 2), (0.01, 0.02), 0.02 / count)
    number = np.arange(3)
    solver = settled(
        mesh,
        np.stack([number[1:], number[:-1]], axis=1),
        lambda start: np.stack([np.zeros(len(start), dtype=bool), np.ones(len(start), dtype=bool)], axis=1),
        time=3e-4,
        damping=3e5,
    )
    radius = solver.fields.start[:, 0]
    moved = solver.fields.nodes.position[:, 0] - radius
    scale = PRESSURE * 0.01**2 / (0.02**2 - 0.01**2)
    exact = (1.0 + POISSON) / YOUNG * scale * ((1.0 - 2.0 * POISSON) * radius + 0.02**2 / radius)
    centre = radius[solver.fields.mesh.dofmap].mean(axis=1)
    hoop = scale * (1.0 + 0.02**2 / centre**2)
    return solver, moved, exact, hoop


def sphere(count):
    """Thick sphere of radii 10 and 20 mm, `count` cells through the wall, both of its poles on the axis."""

    def carry(points):
        radius, angle = 0.01 * (1.0 + points[:, 0]), np.pi * (1.0 - points[:, 1])
        sine = np.where(np.abs(points[:, 1] - 0.5) < 0.5 - 1e-12, np.sin(angle), 0.0)
        return np.stack([radius * sine, radius * np.cos(angle)], axis=1)

    rows = 4 * count
    mesh = meridian((count, rows), carry)
    number = np.arange(rows + 1)  # the inner surface, upwards
    solver = settled(
        mesh,
        np.stack([number[1:], number[:-1]], axis=1),
        lambda start: np.stack([start[:, 0] == 0.0, np.zeros(len(start), dtype=bool)], axis=1),
        time=3e-4,
        damping=3e5,
    )
    start = solver.fields.start
    radius = np.hypot(start[:, 0], start[:, 2])
    change = solver.fields.nodes.position - start
    moved = (change * start).sum(axis=1) / radius
    cubes = PRESSURE * 0.01**3 / (0.02**3 - 0.01**3)
    exact = cubes * ((1.0 - 2.0 * POISSON) / YOUNG * radius + (1.0 + POISSON) / (2.0 * YOUNG) * 0.02**3 / radius**2)
    centre = start[solver.fields.mesh.dofmap].mean(axis=1)
    hoop = cubes * (1.0 + 0.5 * (0.02 / np.hypot(centre[:, 0], centre[:, 2])) ** 3)
    return solver, moved, exact, hoop


def errors_of(body, counts=(4, 8)):
    """Errors in displacement and hoop stress, L2 over the largest, for numbers of cells through the wall."""
    errors, stresses = [], []
    for count in counts:
        solver, moved, exact, hoop = body(count)
        errors.append(np.sqrt(np.average((moved - exact) ** 2, weights=solver.fields.mass)) / np.abs(exact).max())
        found = matrices(solver.fields.solid.stress[: solver.fields.mesh.cells, 0])[:, 1, 1]
        stresses.append(np.sqrt(np.average((found - hoop) ** 2, weights=solver.fields.cell_mass)) / hoop.max())
    return np.array(errors), np.array(stresses)


def test_lames_cylinder():
    """The nodes' displacements are exact but for the geometry's change, of the order of p/E; hoop stress of order 2."""
    errors, stresses = errors_of(cylinder)
    text = f"displacement {errors}, hoop stress {stresses}"
    assert errors.max() < 2.0 * PRESSURE / YOUNG, text
    assert np.log2(stresses[0] / stresses[1]) > 1.8, text
    assert stresses[1] < 2e-3, text


def test_lames_sphere():
    """Both poles on the axis: displacement of order 2 and hoop stress, of cells at the axis as well."""
    errors, stresses = errors_of(sphere)
    text = f"displacement {errors}, hoop stress {stresses}"
    assert np.log2(errors[0] / errors[1]) > 1.8, text
    assert np.log2(stresses[0] / stresses[1]) > 1.0, text
    assert errors[1] < 0.01, text
    assert stresses[1] < 0.02, text


def test_an_impact_closes_the_ledger_and_keeps_axial_momentum():
    """A cylinder struck at one end and left to itself: axial momentum to 1e-12, energy to 0.5 % in short steps."""
    settings = whole_steps(BARE, hourglass=Hourglass(casing_viscous=0.05, casing_stiffness=0.05))
    settings = replace(settings, time_step=replace(settings.time_step, cfl=0.1))
    solver = ring_burst(rectangle((6, 12), (0.0, 0.012), 0.024), settings)
    fields = solver.fields
    fields.nodes.velocity[:, 2] = 20.0 * np.exp(-((fields.start[:, 2] / 6e-3) ** 2))
    start = float(fields.mass @ fields.nodes.velocity[:, 2])
    energy = 0.5 * float(fields.mass @ fields.nodes.velocity[:, 2] ** 2)
    run_until(solver, 2e-5)
    size = float(fields.mass @ np.abs(fields.nodes.velocity[:, 2]))
    assert abs(float(fields.mass @ fields.nodes.velocity[:, 2]) - start) < 1e-12 * size
    solver.ledger.energy_tolerance = np.inf
    entry = solver.ledger.record(fields, solver.time, solver.time_step, 0.0, solver.contact)
    assert entry.strain > 0.05 * energy
    stored = entry.kinetic + entry.strain + entry.plastic + entry.viscous + entry.hourglass
    assert stored == pytest.approx(energy, rel=5e-3)
