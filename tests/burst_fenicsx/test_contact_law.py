"""The law of all pairs by closed forms, and what contact gives and takes from the nodes' own motion."""

from __future__ import annotations

import logging
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.constants import BENT, ENTRY, MOST_CORRECTION
from burst_fenicsx.kernels.contact.law import Law, bonded_spring, has_left, spring
from burst_fenicsx.kernels.contact.pairs import (
    Rows,
    add_pairs,
    gather_rows,
    give_rows,
    no_pairs,
    press_on_plane,
    set_spring,
)
from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.vectors.exact import rounding_constant
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.problem import ContactSettings, RigidPlane
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.axisymmetric.meridians import ring_burst
from tests.burst_fenicsx.axisymmetric.test_slide_line import bench
from tests.burst_fenicsx.bodies import QUIET, bodies, energy, replace_entry
from tests.burst_fenicsx.boxes import BARE, box, with_fixed_step
from tests.burst_fenicsx.test_sliding import SIDE, layered

pytestmark = pytest.mark.dolfinx


TENSION, COHESION, FRICTION, AREA, STIFFNESS, STRENGTH = 5e6, 4e6, 0.3, 2e-5, 1e9, 60e6
LAW = Law(1e14, 1e-7, FRICTION, TENSION, COHESION)
NORMAL, ALONG = (0.0, 0.0, 1.0), (0.6, 0.8, 0.0)
BUDGET, STEP, DEPTH, SPEED = 4e12, 1e-7, 1e-5, 40.0


def slid(gap, *, bonded=True, off=False, burnt=0.0, pressure=0.0, trial=0.0, slip=0.0):
    """As `bonded_spring` with the values above: gas, force, stiffness, slip's size, stored, heat, whole."""
    moved, before = (tuple(size * x for x in ALONG) for size in (trial - slip, slip))
    gas, force, stiffness, kept, *rest = bonded_spring(
        LAW, bonded, off, burnt, pressure, STRENGTH, AREA, gap, STIFFNESS, NORMAL, moved, before, STIFFNESS
    )
    return gas, force, stiffness, float(np.linalg.norm(kept)), *rest


@pytest.mark.parametrize("burnt", [0.0, 0.4])
def test_a_bond_breaks_at_its_tensile_strength_which_fades_as_it_burns(burnt):
    opening = (1.0 - burnt) * TENSION * AREA / STIFFNESS
    for gap, holds in ((0.999 * opening, True), (1.001 * opening, False)):
        gas, force, stiffness, *_, whole = slid(gap, burnt=burnt)
        assert (whole, gas, stiffness) == (holds, 0.0, STIFFNESS if holds else 0.0)
        assert force == pytest.approx((0.0, 0.0, -STIFFNESS * gap if holds else 0.0))
    # Broken, it bears no tension, and presses as before.
    assert slid(1e-9, bonded=False)[2] == 0.0
    _, force, stiffness, _, stored, _, whole = slid(-1e-9, bonded=False)
    assert (whole, stiffness) == (False, STIFFNESS)
    assert force == pytest.approx((0.0, 0.0, 1.0), rel=1e-12)
    assert stored == pytest.approx(0.5 * STIFFNESS * 1e-18, rel=1e-12)


@pytest.mark.parametrize(("press", "limit"), [(0.0, COHESION), (50e6, COHESION + FRICTION * 50e6), (1e9, STRENGTH)])
def test_the_explosive_holds_cohesion_and_friction_up_to_its_own_strength(press, limit):
    """Dragged far, the spring keeps the largest tangential force; the bond has given way then."""
    gap = -press * AREA / STIFFNESS

    def held(**changes):
        _, force, stiffness, kept, *_, whole = slid(gap, trial=1.0, **changes)
        assert not whole
        assert force[:2] == pytest.approx([-stiffness * kept * x for x in ALONG[:2]], rel=1e-9, abs=1e-9)
        return stiffness * kept

    assert held() == pytest.approx(limit * AREA, rel=1e-12)
    assert held(burnt=0.5) == pytest.approx(0.5 * limit * AREA, rel=1e-12)
    broken = min(limit - COHESION, STRENGTH) if press < 1e9 else STRENGTH
    assert held(bonded=False) == pytest.approx(broken * AREA, rel=1e-12, abs=1e-12)
    # Dragged less than that, nothing slips and the bond stays.
    within = 0.999 * limit * AREA / STIFFNESS
    gas, _, stiffness, kept, *_, whole = slid(gap, trial=within)
    assert (gas, stiffness, whole) == (0.0, STIFFNESS, True)
    assert kept == pytest.approx(within, rel=1e-12)


def test_products_press_with_their_pressure_and_neither_pull_nor_rub():
    pressure = 2e9
    own = pressure * AREA
    for gap in (-1e-6, 0.0, 1e-6, 0.999 * own / STIFFNESS):
        gas, _, stiffness, kept, *_, whole = slid(gap, burnt=1.0, pressure=pressure, trial=1e-3)
        assert (whole, kept) == (False, 0.0)
        assert gas == pytest.approx(own, rel=1e-12)
        assert stiffness == STIFFNESS
    # Far behind the wall the correction is a multiple of their own force; before it they are apart.
    gas, _, stiffness, *_ = slid(-2e-2, burnt=1.0, pressure=pressure)
    assert gas == pytest.approx(own, rel=1e-12)
    assert stiffness * 2e-2 == pytest.approx(MOST_CORRECTION * own, rel=1e-12)
    # Beyond that, over an edge, and without pressure they do nothing.
    for gone in (
        slid(1.001 * own / STIFFNESS, burnt=1.0, pressure=pressure),
        slid(0.0, burnt=1.0, pressure=pressure, off=True),
        slid(-1e-4, burnt=1.0),
    ):
        assert gone[:3] == (0.0, (0.0, 0.0, 0.0), 0.0)


def test_a_spring_that_parts_turns_what_it_held_into_heat():
    _, _, stiffness, kept, stored, heat, _ = slid(-1e-4, off=True, slip=1e-6, trial=2e-6)
    assert (stiffness, kept, stored) == (0.0, 0.0, 0.0)
    assert heat == pytest.approx(0.5 * STIFFNESS * 1e-12, rel=1e-12)


def test_a_node_has_left_beyond_the_rim_too_deep_or_deeper_than_it_can_have_come():
    reach, moved = 1e-3, 2e-5
    assert not has_left(0.999 * reach, 0.0, reach, moved, True)
    assert has_left(1.001 * reach, 0.0, reach, moved, True)
    assert not has_left(0.0, -0.999 * reach, reach, moved, True)
    assert has_left(0.0, -1.001 * reach, reach, moved, True)
    entered = ENTRY * moved + BENT * reach
    assert not has_left(0.0, -0.999 * entered, reach, moved, False)
    assert has_left(0.0, -1.001 * entered, reach, moved, False)


def test_friction_takes_the_work_that_the_spring_does_not_store():
    """Work of the mean force on the whole way: spring and heat, to round-off."""
    random = np.random.default_rng(3)
    slipped = 0
    for _ in range(200):
        stiffness, old, trial, limit = random.uniform(0.1, 1.0, 4)
        old = min(old, limit / stiffness)  # the last step kept to its own limit
        moved, before = (tuple(size * x for x in ALONG) for size in (trial - old, old))
        _, now, slip, stored, heat, _ = spring(
            1.0, 0.0, limit, 0.0, np.inf, 0.0, stiffness, NORMAL, moved, before, stiffness
        )
        kept = np.linalg.norm(slip)
        assert now == stiffness
        assert stored == pytest.approx(0.5 * stiffness * kept**2, rel=1e-12)
        assert stiffness * kept <= limit * (1.0 + 1e-12)
        assert kept <= trial * (1.0 + 1e-12)
        assert heat >= 0.0
        if heat > 0.0:
            slipped += 1
            assert stiffness * kept == pytest.approx(limit, rel=1e-12)
            work = 0.5 * stiffness * (old + kept) * (trial - old)
            assert heat + 0.5 * stiffness * (kept**2 - old**2) == pytest.approx(work, rel=1e-9, abs=1e-12)
    assert 20 < slipped < 180


FACE, MASS = np.array([[0, 1, 2, 3]], dtype=np.int32), np.array([0.3, 0.7, 0.2, 0.5, 0.4])


def one_node(facets, weight, velocity=(0.0, 0.0, 0.0), mass=MASS):
    """A pair of a node, the last, that moves at a velocity (m/s) behind a facet at rest; and the rows."""
    pairs, count = no_pairs(np.array([4]), facets.shape[1]), len(mass)
    pairs.facet[0], pairs.gap[0], pairs.normal[0] = 0, -DEPTH, NORMAL
    pairs.weight[0] = weight
    local, still = np.arange(count, dtype=np.int32), np.zeros(count, dtype=bool)
    rows = Rows(local, mass, still, *np.zeros((2, count, 3)), np.zeros(count), np.zeros((count, 4)))
    rows.velocity[4], rows.position[4, 2] = velocity, -DEPTH
    return pairs, rows


@kernel
def pressed_once(law, pairs, facets, rows):
    set_spring(0, law, 0.0, pairs, facets, rows)


def pressed_on_plane(law, normal, pairs, rows):
    """A step of the one pair of a plane through the origin: what it sums up is the pair's own."""
    near, plane = np.zeros(1, dtype=np.int32), np.zeros((1, 0), dtype=np.int32)
    rows.sums[:] = 0.0
    friction, force, deepest, inner = press_on_plane(law, normal, 0.0, near, 1, (0.0, 0.0, 0.0), pairs, plane, rows)
    assert (friction, deepest, inner) == (pairs.energies[0, 1], -pairs.gap[0], 0.0)
    np.testing.assert_array_equal(force, pairs.force[0])
    np.testing.assert_array_equal(rows.sums[4], [*force, 0.0])


@pytest.mark.parametrize("weight", [(0.25, 0.25, 0.25, 0.25), (0.1, 0.4, 0.4, 0.1), (0.0, 0.0, 0.0, 1.0)])
@pytest.mark.parametrize("load", [0.0, 5.0])
def test_the_reduced_mass_is_the_force_over_the_acceleration_of_the_gap(weight, load):
    """A force between node and facet accelerates one against the other by F / m_red; shared, springs are softer."""
    pairs, rows = one_node(FACE, weight)
    rows.load[2] = load
    pressed_once(Law(BUDGET, STEP, FRICTION), pairs, FACE, rows)
    for inner, deepest in ((1, 0.0), (0, DEPTH)):
        rows.sums[:] = 0.0
        assert add_pairs(pairs, FACE, inner, (1e3, 1e3, 0.0), rows) == (pairs.energies[0, 1], DEPTH, deepest)
    force, acceleration = pairs.force[0, 2], rows.sums[:, 2] / MASS
    apart = acceleration[4] - weight @ acceleration[:4]
    assert pairs.reduced[0] == pytest.approx(force / apart, rel=1e-5)
    # Two equal grids share the budget, of which one node has 1 / 1.6 halves.
    assert force == pytest.approx(0.5 * BUDGET / max(load, 1.6) * pairs.reduced[0] * DEPTH, rel=1e-12)
    assert (rows.sums[:, :3].sum(axis=0) == 0.0).all()
    np.testing.assert_allclose(rows.sums[:4, 2], -np.array(weight) * force, rtol=1e-5)
    np.testing.assert_allclose(rows.sums[:, 3], np.append(weight, 1.0) * pairs.reduced[0] / MASS)


@pytest.mark.parametrize("plane", [False, True])
def test_friction_heats_by_its_force_times_the_way(plane):
    """Dragged along at constant depth: after the spring has given way the heat is mu N v dt in every step."""
    facets = np.zeros((1, 0), dtype=np.int32) if plane else FACE
    pairs, rows = one_node(facets, () if plane else (0.4, 0.3, 0.2, 0.1), SPEED * np.array(ALONG))
    law, heat, work = Law(BUDGET, STEP, FRICTION), [], 0.0
    for _ in range(30):
        old = pairs.force[0].copy()
        if plane:
            pressed_on_plane(law, np.array(NORMAL), pairs, rows)
        else:
            pressed_once(law, pairs, facets, rows)
        heat.append(pairs.energies[0, 1])
        work -= 0.5 * (old + pairs.force[0]) @ ALONG * SPEED * STEP
    press = pairs.force[0, 2]
    if plane:
        assert press == pytest.approx(BUDGET * MASS[4] * DEPTH, rel=1e-12)
    assert pairs.force[0] == pytest.approx(press * np.array([-0.6 * FRICTION, -0.8 * FRICTION, 1.0]), rel=1e-12)
    assert heat[0] == 0.0 or heat[0] < heat[-1]
    assert heat[-1] == pytest.approx(FRICTION * press * SPEED * STEP, rel=1e-12)
    slip = np.linalg.norm(pairs.slip[0])
    assert sum(heat) + 0.5 * pairs.stiffness[0] * slip**2 == pytest.approx(work, rel=1e-12)


def test_a_plane_rubs_alike_whichever_way_it_faces():
    """Turned as a whole, plane and motion give the turned force: axes by turns, and a skew rotation."""
    plane, velocity, found = np.zeros((1, 0), dtype=np.int32), SPEED * np.array([0.6, 0.8, 0.1]), []
    skew, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    for turn in (np.eye(3), np.eye(3)[[1, 2, 0]], np.eye(3)[[2, 0, 1]], skew * np.linalg.det(skew)):
        pairs, rows = one_node(plane, (), turn @ velocity)
        rows.position[4] = -DEPTH * turn[:, 2]
        heat = []
        for _ in range(30):
            law = Law(BUDGET, STEP, FRICTION)
            pressed_on_plane(law, turn[:, 2].copy(), pairs, rows)
            heat.append(pairs.energies[0, 1])
        found.append((turn.T @ pairs.force[0], pairs.energies[0, 0], heat))
    for force, stored, heat in found[1:]:
        assert force == pytest.approx(found[0][0], rel=1e-9, abs=1e-9 * np.linalg.norm(force))
        assert stored == pytest.approx(found[0][1], rel=1e-9)
        np.testing.assert_allclose(heat, found[0][2], rtol=1e-9, atol=1e-15)


CELL = 0.01


def test_work_on_rows_is_force_times_way():
    """Half a step of the rows named, and of no others; rounded, the same in any order; the forces are passed on."""
    random = np.random.default_rng(2)
    position, velocity, resultant, last = random.normal(size=(4, 9, 3))
    sums, chosen = random.normal(size=(9, 4)), np.array([7, 1, 4, 0], dtype=np.int32)
    local = random.permutation(9).astype(np.int32)

    def rows():
        return Rows(local, np.ones(9), np.ones(9, dtype=bool), last.copy(), np.zeros((9, 3)), np.zeros(9), sums.copy())

    now, step = rows(), 1e-3
    moved = position[local] - last
    expected = 0.5 * (sums[chosen, :3] * moved[chosen]).sum()
    assert gather_rows(chosen, step, position, velocity, 0.0, now) == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(now.velocity[chosen], moved[chosen] / step)
    np.testing.assert_array_equal(now.position[chosen], position[local[chosen]])
    np.testing.assert_array_equal(now.load[chosen], sums[chosen, 3])
    assert np.flatnonzero(now.sums.any(axis=1)).tolist() == [2, 3, 5, 6, 8]
    now.sums[:] = sums
    before = resultant.copy()
    before[local[chosen]] += 0.25 * sums[chosen, :3]
    assert give_rows(chosen, step, 0.25, 0.0, now, resultant) == pytest.approx(expected, rel=1e-12)
    np.testing.assert_array_equal(resultant, before)
    # Without a step the velocity is the nodes' own, and that of nodes that take no shorter steps than contact.
    gather_rows(chosen, 0.0, position, velocity, 0.0, now)
    np.testing.assert_array_equal(now.velocity[chosen], velocity[local[chosen]])
    rounding = rounding_constant(8.0)
    one, other = (gather_rows(some, step, position, velocity, rounding, rows()) for some in (chosen, chosen[::-1]))
    assert one == other == pytest.approx(expected, rel=1e-9)


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
    while not plane.deepest > 0.0 or solver.contact.spring_energy < 0.1 * before:
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
    return solver.contact.force, solver.contact.interface.pairs


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
