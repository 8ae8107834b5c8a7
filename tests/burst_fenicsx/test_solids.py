"""The casing's solid against closed forms, with rates: waves in bars, the thick-walled tube; external forces, holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.problem import Hourglass, TimeStep, Viscosity
from tests.burst_fenicsx.boxes import BARE, ELASTIC, box, burst, ring_sector, run_until

pytestmark = pytest.mark.dolfinx

QUADRATURES = ("one_point", "full")


def frequency_error(cells: int, held: bool, quadrature: str) -> float:
    """Relative error of the first longitudinal frequency of a free bar 1 m long, held laterally or thin and free."""
    length = 1.0
    width = length / cells if held else 0.01
    settings = replace(BARE, quadrature=quadrature, time_step=TimeStep(cfl=0.5))
    solver = burst(box((cells, 1, 1), (length, width, width)), settings)
    nodes = np.arange(len(solver.fields.start))
    if held:
        solver.constraints = (NodalConstraint(nodes, [0, 1, 0]), NodalConstraint(nodes, [0, 0, 1]))
    modulus, poisson = ELASTIC.elastic_modulus, ELASTIC.poisson_ratio
    lateral = (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson))  # lambda + 2 mu over E
    speed = np.sqrt(modulus * (lateral if held else 1.0) / ELASTIC.density)
    omega = np.pi * speed / length
    along = solver.fields.start[:, 0]
    shape = np.cos(np.pi * along / length)
    solver.fields.nodes.velocity[:, 0] = 1e-3 * shape
    while solver.time < 1.125 * 2.0 * np.pi / omega:  # in equal steps: a shortened last one would be of first order
        solver.step()
    fields = solver.fields
    # The velocity at the time of the places.
    velocity = fields.nodes.velocity[:, 0] + 0.5 * solver.time_step * fields.inverse_mass * fields.nodes.force[:, 0]
    moving = (fields.mass * shape * velocity).sum()
    moved = (fields.mass * shape * (fields.nodes.position[:, 0] - along)).sum()
    phase = 2.0 * np.pi + np.arctan2(omega * moved, moving)
    return phase / solver.time / omega - 1.0


@pytest.mark.parametrize("quadrature", QUADRATURES)
@pytest.mark.parametrize("held", [True, False], ids=["laterally held", "thin"])
def test_waves_run_at_the_elastic_speed(held, quadrature):
    """C = sqrt((lambda + 2 mu)/rho) in a laterally held bar, sqrt(E/rho) in a thin one, to second order."""
    counts = (10, 20, 40) if held else (20, 40, 80)
    errors = [abs(frequency_error(count, held, quadrature)) for count in counts]
    rate = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert rate == pytest.approx(2.0, abs=0.15), f"rate {rate:.2f}, errors {errors}"
    assert errors[-1] < 3e-4, f"rate {rate:.2f}, errors {errors}"


PLASTIC = replace(ELASTIC, elastic_modulus=100e9, shear_strength=500e6, tensile_strength=2000e6)
INNER, OUTER, MOVED, SPEED = 1.0, 2.0, 0.07, 2.0


def tube_pressure_error(cells: int, quadrature: str) -> float:
    """Relative difference of the inner pressure of a plastic tube from 2 tau_c ln(b/a) at its present radii.

    A sector of one cell in plane strain; the inner nodes move outward slowly (no inverse mass) and their reaction
    is the pressure. The mean over the last fifth of the way, where the whole wall flows.
    """
    size = (OUTER - INNER) / cells
    angle = size / 1.5
    mesh = ring_sector(INNER, OUTER, angle, size, (cells, 1, 1))
    settings = replace(BARE, quadrature=quadrature, viscosity=Viscosity(), hourglass=Hourglass())
    solver = burst(mesh, settings, casing=PLASTIC)
    start = solver.fields.start
    radius, azimuth = np.hypot(start[:, 0], start[:, 1]), np.arctan2(start[:, 1], start[:, 0])
    solver.constraints = (
        NodalConstraint(np.arange(len(start)), [0, 0, 1]),
        NodalConstraint(np.flatnonzero(azimuth < 1e-9), [0, 1, 0]),
        NodalConstraint(np.flatnonzero(azimuth > angle - 1e-9), [-np.sin(angle), np.cos(angle), 0]),
    )
    inner, outer = np.flatnonzero(radius < INNER + 1e-9), np.flatnonzero(radius > OUTER - 1e-9)
    solver.fields.inverse_mass[inner] = 0.0
    outward = start[inner] * [1.0, 1.0, 0.0] / radius[inner, None]
    ratios = []
    a = INNER
    while a < INNER + MOVED:
        slow = min(1.0, 0.05 + solver.time * SPEED / (0.2 * MOVED))
        solver.fields.nodes.velocity[inner] = SPEED * slow * outward
        solver.step()
        place = solver.fields.nodes.position
        a, b = (np.hypot(place[some, 0], place[some, 1]).mean() for some in (inner, outer))
        # The flat inner face stands across the sector's middle; what acts along the held planes' normals is taken away.
        area = 2.0 * a * np.sin(0.5 * angle) * size * np.cos(0.5 * angle)
        pressure = -np.einsum("ij,ij->", solver.fields.nodes.force[inner], outward) / area
        if a > INNER + 0.8 * MOVED:
            ratios.append(pressure / (2.0 * PLASTIC.shear_strength * np.log(b / a)))
    assert solver.fields.solid.shear_strain.min() > 0.0
    return float(np.mean(ratios)) - 1.0


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_thick_walled_tube_yields_at_the_closed_form(quadrature):
    """The pressure is 2 tau_c ln(b/a) in plane strain (Hill 1950, chapter V), to second order in the cell size."""
    counts = (3, 6, 12)
    errors = [abs(tube_pressure_error(count, quadrature)) for count in counts]
    rate = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert rate > 1.7, f"rate {rate:.2f}, errors {errors}"
    assert errors[-1] < 2e-3, f"rate {rate:.2f}, errors {errors}"


def test_held_nodes_do_not_move_along_the_direction():
    mesh = box((2, 2, 2), (0.01,) * 3)
    direction = np.array([1.0, 2.0, -2.0]) / 3.0

    def push(_, force):
        force[:] += [100.0, -50.0, 30.0]

    solver = burst(mesh, BARE, external=push)
    solver.constraints = (NodalConstraint(np.arange(9), direction),)
    solver.add_forces(0.0)
    run_until(solver, 5e-6)
    moved = solver.fields.nodes.position - solver.fields.start
    assert np.abs(moved[:9] @ direction).max() < 1e-12 * np.abs(moved[:9]).max()
    assert np.abs(moved[:9]).max() > 1e-10


def test_a_state_that_is_no_number_stops_the_run():
    solver = burst(box((2, 2, 2), (0.01,) * 3), BARE)
    solver.fields.nodes.velocity[3, 1] = np.nan
    with pytest.raises(NumericalStop, match="has turned inside out"):
        solver.step()


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_the_stable_step_is_that_of_the_cell(quadrature):
    """L/c for a cube of edge L (Flanagan and Belytschko 1981), less what the viscosity takes in compression."""
    edge = 0.01
    solver = burst(box((3, 3, 3), (3 * edge,) * 3), replace(BARE, quadrature=quadrature, viscosity=Viscosity()))
    speed = np.sqrt(200e9 * 0.7 / (1.3 * 0.4) / 7850.0)
    assert solver.control.stable_step == pytest.approx(edge / speed, rel=1e-12)
    if solver.control.levels_are_due(0.0):
        solver.choose_levels()
    assert solver.control.next_step(0.0, np.inf) == pytest.approx(0.8 * edge / speed, rel=1e-12)
    rate = -1e4
    solver.fields.nodes.velocity[:] = solver.fields.start * rate
    solver.add_forces(0.0)
    damped = 0.06 * speed + 1.5 * edge * 3.0 * abs(rate)
    assert solver.control.stable_step == pytest.approx(edge / (np.hypot(speed, damped) + damped), rel=1e-9)
