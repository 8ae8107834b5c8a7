"""What contact gives and takes, from its forces and the nodes' own motion: energy from nothing is seen."""

from __future__ import annotations

import logging
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.vectors.exact import rounding_constant
from burst_fenicsx.kernels.vectors.rows import work_on_rows
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, RigidPlane
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.axisymmetric.meridians import ring_burst
from tests.burst_fenicsx.axisymmetric.test_slide_line import bench
from tests.burst_fenicsx.bodies import QUIET, bodies, energy, replace_entry
from tests.burst_fenicsx.boxes import BARE, box, with_fixed_step
from tests.burst_fenicsx.test_sliding import SIDE, layered

pytestmark = pytest.mark.dolfinx

CELL, STEP = 0.01, 1e-7


def test_work_on_rows_is_force_times_way():
    """Half a step of the rows named, and of no others; rounded, the same in any order; the forces are passed on."""
    random = np.random.default_rng(2)
    force, velocity, resultant = random.normal(size=(3, 9, 3))
    rows = np.array([7, 1, 4, 0], dtype=np.int32)
    expected = 0.5e-3 * (force[rows] * velocity[rows]).sum()
    before, passed = resultant.copy(), 0.25 * force[rows]
    work = work_on_rows(0.5e-3, force, rows, velocity, 0.0, 0.25, resultant)
    assert work == pytest.approx(expected, rel=1e-12)
    before[rows] += passed
    np.testing.assert_array_equal(resultant, before)
    rounding, again = rounding_constant(1.0), force.copy()
    one = work_on_rows(0.5e-3, force, rows, velocity, rounding, 1.0, None)
    other = work_on_rows(0.5e-3, again, rows[::-1].copy(), velocity, rounding, 1.0, None)
    assert one == other == pytest.approx(expected, rel=1e-9)
    assert np.flatnonzero(force.any(axis=1)).tolist() == [2, 3, 5, 6, 8]


def thrown_at_a_wall():
    """A cube of one cell on a wall without friction, with 100 m/s towards it, on a soft spring."""
    wall = RigidPlane("wall", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), friction_angle=0.0)
    settings = with_fixed_step(replace(BARE, contact=ContactSettings(surfaces=False), planes=(wall,)), STEP)
    solver = bodies([box((1, 1, 1), (CELL,) * 3)], [(0.0, 0.0, -100.0)], settings)
    solver.contact._max_squared_phase *= 1e-3
    return solver


def test_what_contact_gives_is_what_a_body_has_lost_and_gains_nothing_from_a_constant_spring():
    """A cube on a wall: the work of the wall's force is the body's own change of energy, and the spring holds it."""
    solver = thrown_at_a_wall()
    before = energy(solver)
    lowest = np.inf
    for _ in range(60):
        solver.step()
        entry = replace_entry(solver)
        of_body = entry.kinetic + entry.strain + entry.plastic + entry.viscous + entry.hourglass
        lowest = min(lowest, of_body)
        assert solver.contact.work == pytest.approx(of_body - before, abs=2e-3 * before)
        assert abs(entry.contact_gain) < 1e-8 * before
        said, contact = solver.contact.summary(), solver.contact
        stated = [said[name] for name in ("spring_energy", "friction_heat", "work", "gain")]
        assert stated == [contact.spring_energy, contact.friction, contact.work, contact.gain]
    assert lowest < 0.9 * before  # the spring has been loaded


def test_a_spring_that_stiffens_under_load_makes_energy_that_the_ledger_sees():
    """A loaded spring that stiffens twofold at once gains (k2 - k1) d^2 / 2: contact's error, not the balance's."""
    solver = thrown_at_a_wall()
    before = energy(solver)
    (plane,) = solver.contact.planes
    while not plane.state.penetration.max() > 0.0 or solver.contact.spring_energy < 0.1 * before:
        solver.step()
    stored = solver.contact.spring_energy
    assert abs(solver.contact.gain) < 1e-8 * before
    solver.contact._max_squared_phase *= 2.0
    solver.contact.add_forces(STEP, 0.0, front_is_active=False)  # at the same place
    assert solver.contact.gain == pytest.approx(stored, rel=1e-9)
    ledger = solver.ledger
    ledger.external_work, ledger.min_work = before, 1e-6  # it began in motion
    found = ledger.record(solver.fields, solver.time, 0.0, 0.0, solver.contact)
    assert found.contact_gain == pytest.approx(stored, rel=1e-9)
    assert found.contact_error == pytest.approx(stored / before, rel=1e-9)
    assert found.energy_error < 0.05 * stored / before


@pytest.mark.parametrize(("gain", "word"), [(0.06, "made"), (-0.06, "lost"), (0.04, None), (-0.04, None)])
def test_contact_that_makes_or_loses_energy_stops_the_run(gain, word):
    """At the tolerance of the ledger, though the balance without it is closed."""
    solver = bodies([box((1, 1, 1), (CELL,) * 3)], [(0.0, 0.0, 0.0)])
    # Work of the charge, and of contact: all of it plastic
    solver.ledger.sums[3], solver.ledger.sums[0] = 1e3, 1e3 * (1.0 + gain)
    contact = SimpleNamespace(energy=0.0, gain=1e3 * gain, impulse=np.zeros(3))
    take = (solver.fields, 7e-6, 0.0, 0.0, contact)
    if word is None:
        found = solver.ledger.record(*take)
        assert found.energy_error < 1e-12
        assert found.contact_error == pytest.approx(abs(gain), rel=1e-12)
        return
    message = rf"contact has {word} 6 % of the work done \(allowed 5 %\).* {1e3 * gain:g} J"
    with pytest.raises(NumericalStop, match=message):
        solver.ledger.record(*take)


def vented(solver, factor):
    """Forces of contact (nodes, 3) in N and the contacts' own, with the products vented to a factor."""
    fields = solver.fields
    fields.charge.leakage[:] = factor
    solver.add_forces(0.0)
    return solver.contact.force.copy(), solver.contact.interface.contacts


@pytest.mark.parametrize("geometry", ["3d", "axisymmetric"])
def test_contact_presses_with_the_vented_pressure(geometry):
    """At no gap the force is the products' pressure after leakage: half of it at a factor of a half."""
    if geometry == "3d":
        solver = bodies([split_charges(layered())], [(0, 0, 0)], QUIET)
    else:
        solver = ring_burst(bench("cylinder"), QUIET)
    solver.fields.charge.burn_fraction[:] = 1.0
    solver.control.uncut_step = STEP
    whole, contacts = vented(solver, 1.0)
    assert np.abs(contacts.gap).max() < 1e-15
    assert np.abs(whole).max() > 1e3
    half, _ = vented(solver, 0.5)
    np.testing.assert_allclose(half, 0.5 * whole, rtol=1e-9, atol=1e-9 * np.abs(whole).max())


def unbalanced(mesh):
    """A charge on its casing, both oscillating: all energies less the work of contact that nothing supplies, and that.

    Over the energy at first; with the largest work of contact.
    """
    bond = ContactSettings(tensile_strength=1e12, cohesion=1e12)
    settings = replace(QUIET, cell_size=0.01, contact=bond, time_step=replace(QUIET.time_step, subcycling=False))
    solver = bodies([mesh], [(0, 0, 0)], settings)
    solver.fields.nodes.velocity[solver.fields.start[:, 2] > 0.7 * SIDE, :] = (3.0, -2.0, 5.0)
    before, largest = energy(solver), 0.0
    for _ in range(200):
        solver.step()
        largest = max(largest, abs(solver.contact.work))
    of_charge, gain = solver.ledger.sums[3], solver.contact.gain
    return (energy(solver) - before - of_charge - gain) / before, gain / before, largest / before


def test_all_that_contact_adds_to_the_energy_is_its_gain():
    """With it taken off the balance is open as far as with shared nodes, where there is no contact."""
    scheme, none, _ = unbalanced(layered())
    assert none == 0.0
    left, gain, largest = unbalanced(split_charges(layered()))
    assert largest > 0.02
    assert abs(gain) > 5e-3
    assert left == pytest.approx(scheme, abs=2e-3)


@pytest.mark.parametrize(
    ("error", "gain", "words"), [(0.0099, 5.0, ()), (0.0101, 5.0, ("made",)), (0.02, -5.0, ("lost",))]
)
def test_a_burst_warns_of_what_contact_has_made_or_lost_at_its_end(error, gain, words, caplog):
    """Above 1 % of the products' work."""
    caplog.set_level(logging.WARNING)
    last = SimpleNamespace(contact_error=error, contact_gain=gain)
    run = SimpleNamespace(ledger=SimpleNamespace(entries=[None, last]), comm=SimpleNamespace(rank=0))
    Simulation._warn_of_contact(run)
    assert [record.code for record in caplog.records] == ["contact_energy"] * len(words)
    for word in words:
        assert f"contact has {word} {100.0 * error:.2g} % of the products' work; 1 % is the aim" in caplog.text
