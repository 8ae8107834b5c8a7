"""Charge and casing of rings against closed forms: bond, friction and its heat, stiffness of a contact's spring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.kernels.contact.law import Law
from burst_fenicsx.kernels.vectors.exact import quantum
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, Part
from tests.burst_fenicsx.axisymmetric.meridians import contacts_of, line_forces, meridian, named, ring_burst
from tests.burst_fenicsx.axisymmetric.test_slide_line import COUNT, bench, pressed
from tests.burst_fenicsx.bodies import QUIET
from tests.burst_fenicsx.boxes import TNT

pytestmark = pytest.mark.dolfinx


LENGTH_OF_BENCH, CELLS_OF_BENCH = 0.06, 24
BUDGET, STEP = 1e13, 1e-7
FRICTION = 0.36


def slid(tensile, cohesion, *, gap=0.0, slip=0.0, burnt=0.0, steps=1):
    """The cylinder's charge moved away from its casing by `gap` at once, and along it by `slip` (m) in equal steps.

    Gives, of the contacts away from the ends, whether they are bonded, their stiffness (N/m3), normal and tangential
    traction (Pa).
    """
    angle = np.degrees(np.arctan(FRICTION))
    settings = ContactSettings(tensile_strength=tensile, cohesion=cohesion, friction_angle=angle)
    solver = ring_burst(bench("cylinder"), replace(QUIET, contact=settings))
    interface, state = solver.contact.interface, solver.fields
    contacts, position = contacts_of(solver), state.nodes.position
    state.charge.burn_fraction[:], state.charge.pressure[:] = burnt, 0.0
    charge = np.unique(state.mesh.dofmap[state.mesh.part == Part.CHARGE])
    velocity = np.zeros_like(position)
    for number in range(steps + 1):
        if number:
            position[charge, 0] -= gap if number == 1 else 0.0  # the charge lies within
            position[charge, 2] += slip / steps
            velocity[charge, 2] = slip / steps / STEP
        line_forces(solver, interface.law(BUDGET, STEP), velocity)
    inner = np.abs(state.start[contacts.slave, 2] / LENGTH_OF_BENCH - 0.5) < 0.3
    # Each node's share of the surface: 2 pi r times the cell.
    area = 2.0 * np.pi * position[contacts.slave, 0] * LENGTH_OF_BENCH / CELLS_OF_BENCH
    press, _, shear = np.abs(contacts.force).T / area
    return tuple(values[inner] for values in (contacts.bonded, contacts.stiffness / area, press, shear))


def test_friction_of_rings_is_cohesion_and_a_share_of_the_pressure():
    """Pressed by p and slid far: c + p tan(phi) while it yields, half of it half burnt, at most the shear strength."""
    tensile, cohesion, pressure = 20e6, 5e6, 40e6
    gap = -pressure / slid(tensile, cohesion, gap=-1e-9)[1].mean()
    slip = -3.0 * gap * (cohesion / pressure + FRICTION)
    for burnt in (0.0, 0.5):
        bonded, _, press, shear = slid(tensile, cohesion, gap=gap, slip=slip, burnt=burnt)
        np.testing.assert_allclose(press, pressure, rtol=0.02)
        np.testing.assert_allclose(shear, (1.0 - burnt) * (cohesion + FRICTION * press), rtol=1e-6)
        assert (bonded == 0).all()
    # Slid on without a bond: friction alone.
    _, _, press, shear = slid(tensile, cohesion, gap=gap, slip=2.0 * slip, steps=2)
    np.testing.assert_allclose(shear, FRICTION * press, rtol=1e-6)
    # A bond that would hold more than the explosive: its shear strength.
    shear = slid(tensile, 1e9, gap=gap, slip=20.0 * slip)[3]
    np.testing.assert_allclose(shear, TNT.shear_strength, rtol=1e-6)


@pytest.mark.parametrize(("shape", "axis"), [("cylinder", 2), ("disc", 0)])
def test_what_charge_and_casing_do_together_is_no_slip(shape, axis):
    """Both carried along the line, the charge by a little more: the springs hold the difference, and no heat comes."""
    law = Law(BUDGET, STEP, 0.0, 1e12, 1e12)
    common, more = 1e-6, 2e-8
    for both, own in ((common, more), (-common, more), (common, 0.0)):
        solver = ring_burst(bench(shape), QUIET)
        _interface, state = solver.contact.interface, solver.fields
        contacts, position = contacts_of(solver), state.nodes.position
        contacts.strength[:] = 1e15
        state.charge.burn_fraction[:] = state.charge.pressure[:] = 0.0
        charge = np.unique(state.mesh.dofmap[state.mesh.part == Part.CHARGE])
        energy, forces, moved = [], np.zeros((2, *state.nodes.force.shape)), np.zeros_like(position)
        for force in forces:
            position += moved
            force[:] = line_forces(solver, law, moved / STEP)
            energy.append(contacts.energies.copy())
            moved[:, axis] = both
            moved[charge, axis] += own
        inner = np.abs(state.start[contacts.slave, axis] / LENGTH_OF_BENCH - 0.5) < 0.3
        slipped = np.linalg.norm(contacts.slip[inner], axis=1)
        np.testing.assert_allclose(slipped, own, rtol=1e-5, atol=1e-13)
        spring = contacts.stiffness[inner] * slipped
        np.testing.assert_allclose(np.abs(contacts.force[inner, axis]), np.abs(spring), rtol=1e-5, atol=1e-6)
        assert np.abs(energy[1][inner, 1]).max() == 0.0
        # What the springs store is the work of the relative motion: nothing is left over.
        np.testing.assert_allclose(energy[1][inner, 0], 0.5 * contacts.stiffness[inner] * own**2, rtol=1e-5, atol=1e-12)
        stored = energy[1][:, 0].sum()
        assert (forces.mean(axis=0) * moved).sum() == pytest.approx(-stored, rel=1e-5, abs=1e-9)


def test_the_spring_of_a_contact_is_as_stiff_as_its_reduced_mass_bears():
    """Alone between two nodes of the line: k (1/m + w0^2/m0 + w1^2/m1) is the budget."""
    solver = ring_burst(bench("cylinder"), QUIET)
    _interface, state = solver.contact.interface, solver.fields
    contacts, position = contacts_of(solver), state.nodes.position
    state.charge.burn_fraction[:] = state.charge.pressure[:] = 0.0
    charge = np.unique(state.mesh.dofmap[state.mesh.part == Part.CHARGE])
    position[charge, 2] += 0.3 * LENGTH_OF_BENCH / CELLS_OF_BENCH
    line_forces(solver, Law(BUDGET, STEP, 0.0, 1e12, 1e12))
    inner = np.abs(state.start[contacts.slave, 2] / LENGTH_OF_BENCH - 0.5) < 0.3
    assert inner.sum() > 10
    np.testing.assert_allclose(np.sort(contacts.weight[inner], axis=1), [[0.3, 0.7]] * inner.sum(), rtol=1e-9)
    ends = contacts.edges[contacts.facet[inner]]
    inverse = 1.0 / state.mass[contacts.slave[inner]] + (contacts.weight[inner] ** 2 / state.mass[ends]).sum(axis=1)
    np.testing.assert_allclose(contacts.stiffness[inner] * inverse, BUDGET, rtol=1e-12)


def test_the_ledger_takes_the_heat_of_sliding_rings():
    """Pressed and dragged along: what the step hands to contact is the heat of all contacts, and never negative."""
    solver = ring_burst(bench("cylinder"), replace(QUIET, contact=ContactSettings(cohesion=0.0, friction_angle=20.0)))
    state, contacts = solver.fields, contacts_of(solver)
    charge = np.unique(state.mesh.dofmap[state.mesh.part == Part.CHARGE])
    solver.control.uncut_step = STEP
    heat, given = 0.0, []
    for number in range(6):
        state.nodes.position[charge, 0 if number == 0 else 2] += 2e-7 if number == 0 else 2e-5
        state.nodes.velocity[charge, 2] = 2e-5 / STEP if number else 0.0
        solver.add_forces(STEP)
        heat += contacts.energies[:, 1].sum()
        given.append(solver.contact.friction)
    rounded = len(given) * len(contacts.slave) * quantum(state.grid.rounding)
    assert given[-1] == pytest.approx(heat, rel=1e-12, abs=rounded)
    assert heat > 0.0
    assert (np.diff(given) >= 0.0).all()
    press = np.abs(contacts.force[:, 0])
    rate = np.tan(np.radians(20.0)) * press.sum() * 2e-5
    assert given[-1] - given[-2] == pytest.approx(rate, rel=0.05)


def shares_by_hand(places, sliding):
    """Of a line of unit edges 0, 1, ...: which share of a charge node's load each node takes, by sums over points.

    `places` are those of three or more of the charge's nodes one after another, `sliding` the number of the one asked
    for. Where two follow in the line's direction the load of the way between them is spread by both shapes' product,
    where they have changed places half of it presses where the node lies.
    """
    line = np.arange(COUNT + 1.0)
    found = np.zeros(len(line))
    for near, far in ((sliding, sliding - 1), (sliding, sliding + 1)):
        way = places[far] - places[near]
        if way * (far - near) > 0.0:
            x = (np.arange(4000) + 0.5) / 4000
            at = places[near] + x * way
            hats = np.maximum(1.0 - np.abs(at - line[:, None]), 0.0)
            found += abs(way) * ((1.0 - x) * hats).mean(axis=1)
        else:
            found += 0.5 * abs(way) * np.maximum(1.0 - np.abs(places[near] - line), 0.0)
    return found / found.sum()


@pytest.mark.parametrize("changed", [(9.7, 9.4), (10.3, 8.6), (9.2, 9.9), (10.4, 9.6)])
def test_the_pressure_of_nodes_that_have_changed_places_presses_where_they_are(changed):
    """Two of the charge's nodes, on one edge or on several, in their order or not: shares of the load by hand."""
    solver = ring_burst(bench("cylinder"), QUIET)
    contacts = contacts_of(solver)
    position, start, local = solver.fields.nodes.position, solver.fields.start, solver.contact.nodes.rows.local
    edge = LENGTH_OF_BENCH / CELLS_OF_BENCH
    place = start[contacts.slave, 2] / edge
    order = np.argsort(place)
    places = np.arange(COUNT + 1.0)
    places[9:11] = changed
    position[contacts.slave[order], 2] = places * edge
    pressed(solver)
    for number in (8, 9, 10, 11):
        c = order[number]
        found = np.zeros(COUNT + 1)
        over = contacts.spread.over[c, : contacts.spread.bearing[c]]
        np.add.at(
            found,
            np.rint(start[local[over], 2] / edge).astype(int),
            contacts.spread.share[c, : contacts.spread.bearing[c]],
        )
        np.testing.assert_allclose(found, shares_by_hand(places, number), atol=1e-6)


@pytest.mark.parametrize("plug", ["above", "below"])
def test_contacts_begin_at_the_edges_that_the_charge_covers(plug):
    """A tube half filled, closed by a plug on which the line leads on: contacts at the ends of the charge's edges."""
    mesh = meridian((6, 8), lambda p: np.stack([0.03 * p[:, 0], 0.04 * p[:, 1]], axis=1))
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    at_charge = (centre[:, 2] < 0.02) == (plug == "above")
    within = np.where(at_charge, Part.CHARGE, Part.FUZE)
    mesh = split_charges(named(mesh, np.where(centre[:, 0] < 0.02, within, Part.CASING)))
    solver = ring_burst(mesh, QUIET)
    contacts, start = contacts_of(solver), solver.fields.start
    assert len(contacts.edges) == 8
    ends = start[contacts.edges[contacts.facet], 2]
    low, high = (0.0, 0.02) if plug == "above" else (0.02, 0.04)
    assert (ends > low - 1e-9).all()
    assert (ends < high + 1e-9).all()
    place = 0.5 * ((1.0 - contacts.point[:, 0]) * ends[:, 0] + (1.0 + contacts.point[:, 0]) * ends[:, 1])
    np.testing.assert_allclose(place, start[contacts.slave, 2], atol=1e-12)
    np.testing.assert_allclose(np.sort(place), np.linspace(low, high, 5), atol=1e-12)
    # Edges of the charge at four of the line's.
    beside = contacts.beside[contacts.beside[:, 0] >= 0]
    assert set(beside.ravel().tolist()) == set(contacts.node.tolist())
    assert len(beside) == 4
    # The spans between them, in the line's direction.
    assert len(contacts.spread.span) == 4
    way = start[contacts.slave[contacts.spread.span[:, 1]], 2] - start[contacts.slave[contacts.spread.span[:, 0]], 2]
    np.testing.assert_allclose(way, -0.005, atol=1e-12)
