"""Detonation: arrival, burn, the front for every product model, its energy, nothing ahead of it; leakage."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.mechanics.detonation import AxialSlices, burn_rates, ignition_times, largest_faces, place_ignition
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.problem import Hourglass, IgnitionPoint, Leakage, Part, Round, Viscosity
from tests.burst_fenicsx.axisymmetric.meridians import hold, rectangle, ring_burst, whole_steps
from tests.burst_fenicsx.bodies import QUIET
from tests.burst_fenicsx.boxes import BARE, ELASTIC, TNT, box, burst, rotation_matrix, run_until

pytestmark = pytest.mark.dolfinx


D = TNT.detonation_velocity
P_CJ = TNT.density * D**2 / 4.0
LENGTH = 0.1


@dataclass
class Front:
    """Speed over D, smallest V/V0, peak over the Chapman-Jouguet pressure, ledger error and products' balance."""

    speed: float
    compression: float
    peak: float
    energy_error: float
    balance: float


def front(cells: int, products: str, burn: str) -> Front:
    """Ignite a rigidly held bar of charge at its closed nose end and follow the front through half P_CJ."""
    size = LENGTH / cells
    mesh = box((1, 1, cells), (size, size, LENGTH), Part.CHARGE)
    settings = replace(BARE, products=products, burn=burn, viscosity=Viscosity(), hourglass=Hourglass())
    point = IgnitionPoint(station=0.0, offset=(0.5 * size, 0.5 * size))
    solver = burst(mesh, replace(settings, energy_tolerance=1.0), ignition=(point,))
    start = solver.fields.start
    nodes = np.arange(len(start))
    nose = np.flatnonzero(start[:, 2] > LENGTH - 1e-9)
    solver.constraints = (
        NodalConstraint(nodes, [1, 0, 0]),
        NodalConstraint(nodes, [0, 1, 0]),
        NodalConstraint(nose, [0, 0, 1]),
    )
    station = LENGTH - start[solver.fields.mesh.dofmap].mean(axis=1)[:, 2]
    slots, held = solver.fields.blocks.slots
    level = 0.5 * P_CJ
    arrival = np.full(cells, np.nan)
    smallest, peak, before, time = 1.0, 0.0, np.zeros(cells), 0.0
    while solver.time < 0.9 * LENGTH / D:
        solver.step(0.9 * LENGTH / D)
        pressure = solver.fields.charge.pressure[:cells].copy()
        new = np.isnan(arrival) & (pressure >= level)
        arrival[new] = time + (solver.time - time) * (level - before[new]) / (pressure[new] - before[new])
        before, time = pressure, solver.time
        volume = np.empty(cells)
        volume[held] = solver.fields.grid.volume[slots]
        smallest, peak = min(smallest, volume.min() / size**3), max(peak, pressure.max())
    passed = (station > 0.2 * LENGTH) & (station < 0.8 * LENGTH)
    speed = np.polyfit(arrival[passed], station[passed], 1)[0]
    entry = solver.ledger.record(solver.fields, solver.time, solver.time_step, 0.0)
    balance = float(solver.ledger.products_balances(solver.fields)[0])
    return Front(speed / D, smallest, peak / P_CJ, entry.energy_error, balance)


@pytest.mark.parametrize("burn", ["time", "time_or_compression"])
@pytest.mark.parametrize("products", ["landau_cj", "jwl"])
def test_front_runs_at_d_and_does_not_collapse(products, burn):
    """Speed D with an error that falls with the cell size; V/V0 and P as at Chapman-Jouguet; energy closes.

    Coarse cells smear the front, so the pressure rises to that of Chapman and Jouguet with their number.
    """
    counts = (25, 50, 100, 200)
    fronts = [front(count, products, burn) for count in counts]
    errors = [abs(item.speed - 1.0) for item in fronts]
    rate = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert errors[-1] < 2e-3, f"rate {rate:.2f}, errors {errors}"
    assert rate > 1.0, f"rate {rate:.2f}, errors {errors}"
    assert (np.diff([item.peak for item in fronts]) > 0.0).all(), fronts
    assert fronts[-1].peak > 0.97, fronts[-1]
    for item in fronts:
        assert 0.73 < item.compression < 0.80, item
        assert 0.8 < item.peak < 1.04, item
        assert item.energy_error < 5e-3, item


def test_front_of_the_papers_isentrope_runs_at_its_own_speed():
    """P v^3 = rho D^2/8 has no steady front at D; burning by compression makes one where its Rayleigh line touches.

    27/256 rho D'^2 = 1/8 rho D^2 gives D' = sqrt(32/27) D = 1.0887 D and v = 3/4: no collapse, but 9 % too fast.
    """
    item = front(100, "landau", "time_or_compression")
    assert item.speed == pytest.approx(np.sqrt(32.0 / 27.0), rel=3e-3)
    assert 0.73 < item.compression < 0.75
    assert item.energy_error < 1e-3
    # Initiated progressively, the isentrope of the instantaneous explosion gives 12 % more than rho Q.
    assert item.balance == pytest.approx(1.12, abs=0.01)


@pytest.mark.parametrize(("products", "expected", "level"), [("landau_cj", 1.0, 0.01), ("jwl", 1.0, 1e-3)])
def test_products_give_the_heat_of_detonation(products, expected, level):
    """Work given and left, net of the front's viscosity, tends to rho Q (the JWL set: E0) with the cell size."""
    coarse, fine = (abs(front(count, products, "time_or_compression").balance - expected) for count in (25, 100))
    assert fine < 0.5 * coarse
    assert fine < level


def test_arrival_is_the_earliest_over_the_points():
    random = np.random.default_rng(2)
    centres, places = random.normal(size=(50, 3)), random.normal(size=(4, 3))
    delays = np.array([0.0, 1e-5, 3e-5, 1.0])
    times = ignition_times(centres, places, delays, 7000.0)
    for centre, time in zip(centres, times, strict=True):
        each = [d + np.linalg.norm(centre - p) / 7000.0 for p, d in zip(places, delays, strict=True)]
        assert time == pytest.approx(min(each), rel=1e-14)
    assert np.isinf(ignition_times(centres, places[:0], delays[:0], 7000.0)).all()


def test_points_are_placed_from_the_nose_across_the_axis():
    points = (IgnitionPoint(0.1), IgnitionPoint(0.3, offset=(0.01, 0.02), delay=2e-6))
    item = Round("r", TNT, ELASTIC, position=(1.0, 2.0, 3.0), axis=(0.0, 0.0, 2.0), ignition=points)
    places, delays = place_ignition(item, 0.4)
    np.testing.assert_allclose(places, [[1.0, 2.0, 3.3], [1.01, 2.02, 3.1]], atol=1e-15)
    np.testing.assert_array_equal(delays, [0.0, 2e-6])
    lying = replace(item, axis=(1.0, 0.0, 0.0))
    np.testing.assert_allclose(place_ignition(lying, 0.4)[0][0], [1.3, 2.0, 3.0], atol=1e-15)


def test_burn_fraction_follows_eq_5():
    """Xi = min(2 (t - t1) D A_max / (3 V), 1); delayed and several points; nothing initiated without a point."""
    mesh = box((2, 1, 4), (0.02, 0.02, 0.08), Part.CHARGE)
    corners = mesh.nodes[mesh.cells]
    np.testing.assert_allclose(largest_faces(corners), 0.02 * 0.02, rtol=1e-12)
    rates = burn_rates(corners, np.full(8, 8e-6 / 2), D)
    np.testing.assert_allclose(rates, 2.0 * D * 4e-4 / (3.0 * 4e-6), rtol=1e-12)
    points = (IgnitionPoint(0.0, (0.01, 0.01)), IgnitionPoint(0.08, (0.01, 0.01), delay=4e-6))
    solver = burst(mesh, replace(BARE, burn="time"), ignition=points)
    charge, fields = solver.fields.charge, solver.fields
    centre = fields.start[fields.mesh.dofmap].mean(axis=1)
    near = np.linalg.norm(centre - [0.01, 0.01, 0.08], axis=1) / D
    far = 4e-6 + np.linalg.norm(centre - [0.01, 0.01, 0.0], axis=1) / D
    np.testing.assert_allclose(charge.ignition_time, np.minimum(near, far), rtol=1e-12)
    assert (near < far).any()
    assert (far < near).any()
    seen = 0
    while solver.time < 12e-6:
        solver.step()
        expected = np.clip((solver.time - charge.ignition_time) * rates[0], 0.0, 1.0)
        np.testing.assert_allclose(charge.burn_fraction[:8], expected, rtol=1e-12)
        seen += int(((expected > 0.0) & (expected < 1.0)).any())
    assert seen > 5
    assert charge.burn_fraction.min() == 1.0


def on_the_hugoniot(relative):
    """Pressure of matter brought from rest to V/V0 by one shock: P = rho0 U u, U = c0 + s u, 1 - V/V0 = u/U."""
    speed = TNT.sound_speed / (1.0 - TNT.hugoniot_slope * (1.0 - relative))
    return TNT.density * speed**2 * (1.0 - relative)


@pytest.mark.parametrize("relative", [0.97, 0.9, 0.8, 0.69])
def test_unreacted_charge_is_pressed_along_its_hugoniot(relative):
    """The closed form of the jump conditions."""
    solver = burst(box((1, 1, 1), (0.01,) * 3, Part.CHARGE), replace(BARE, burn="time"))
    solver.fields.nodes.position[:] *= relative ** (1.0 / 3.0)
    solver.add_forces(0.0)
    assert solver.fields.charge.pressure[0] == pytest.approx(on_the_hugoniot(relative), rel=1e-10)


def test_beyond_its_limit_the_unreacted_charge_goes_on_along_the_tangent():
    """The pressure grows on without a pole, linearly in rho/rho0, and meets the Hugoniot without a kink."""
    limit = TNT.hugoniot_limit
    pressures = []
    for mu in (limit * (1.0 - 1e-4), limit, limit * (1.0 + 1e-4), 2.0 * limit, 3.0 * limit):
        solver = burst(box((1, 1, 1), (0.01,) * 3, Part.CHARGE), replace(BARE, burn="time"))
        solver.fields.nodes.position[:] *= (1.0 + mu) ** (-1.0 / 3.0)
        solver.add_forces(0.0)
        pressures.append(solver.fields.charge.pressure[0])
    below, at, above, twice, thrice = pressures
    assert at == pytest.approx(on_the_hugoniot(1.0 / (1.0 + limit)), rel=1e-10)
    assert above - at == pytest.approx(at - below, rel=1e-3)
    assert (twice - at) / limit == pytest.approx((above - at) / (1e-4 * limit), rel=1e-6)
    assert thrice - twice == pytest.approx(twice - at, rel=1e-9)


def test_the_speed_of_a_shock_satisfies_its_jump_conditions():
    """P = rho0 U u with U = c0 + s u; an acoustic wave runs at c0."""
    assert TNT.shock_speed(0.0) == TNT.sound_speed
    speed = TNT.shock_speed(5e9)
    matter = (speed - TNT.sound_speed) / TNT.hugoniot_slope
    assert TNT.density * speed * matter == pytest.approx(5e9, rel=1e-12)


START = np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.2, 0.0, 1.0], [0.0, 0.2, 1.0], [0.0, 0.0, 0.5]])


def leakage_of(radii_moved, **options):
    """Two parts of two nodes each, 0.1 and 0.2 m from the axis, moved outward."""
    outward = np.array([[1.0, 0, 0], [0, 1.0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 0]])
    part = np.array([0, 0, 1, 1, -1], dtype=np.int32)
    radius = np.array([0.1, 0.1, 0.2, 0.2, 0.0])
    leakage = AxialSlices.of_charges(Leakage(**options), MPI.COMM_SELF, part, START, radius, outward, 2)
    moved = np.append(np.repeat(radii_moved, 2), 0.0)
    leakage.update(START + moved[:, None] * outward + [0.0, 0.0, 0.3])
    return leakage


def test_leakage_factors_equal_hand_values():
    """Eq. 6: r_i = r0 + mean displacement (0.21 and 0.30 m); Eq. 7: alpha (r_cr / r_i)^beta beyond r_cr, 1 before."""
    leakage = leakage_of([0.11, 0.10], radius_ratio=1.75)
    np.testing.assert_allclose(leakage.factor, [0.175 / 0.21, 1.0, 1.0], rtol=1e-12)
    leakage = leakage_of([0.11, 0.30], radius_ratio=1.75, alpha=0.9, beta=2.0)
    np.testing.assert_allclose(leakage.factor, [0.9 * (0.175 / 0.21) ** 2, 0.9 * (0.35 / 0.5) ** 2, 1.0], rtol=1e-12)
    # A round's mean radius weighs its parts by their charge: r0^2 of parts of one length.
    assert leakage.mean_radii(np.array([0.2, 0.4]), 1) == pytest.approx([(0.2 + 4.0 * 0.4) / 5.0], rel=1e-12)
    # Not a hair before r_cr.
    np.testing.assert_array_equal(leakage_of([0.0749, 0.1499], radius_ratio=1.75).factor, 1.0)
    assert leakage_of([0.11, 0.30], enabled=False).factor.tolist() == [1.0, 1.0, 1.0]


def test_what_has_vented_does_not_return():
    """A round that is squeezed again vents as at its widest."""
    leakage = leakage_of([0.11, 0.10], radius_ratio=1.75)
    leakage.update(START)
    np.testing.assert_allclose(leakage.factor, [0.175 / 0.21, 1.0, 1.0], rtol=1e-12)


def test_parts_shorter_than_the_cells_vent_with_their_neighbours():
    """Parts that hold no surface node take the radius of the nearest that does, in the same round only."""
    start = np.array([[0.1, 0.0, 0.0], [0.2, 0.0, 1.0]])
    outward = np.array([[1.0, 0.0, 0.0]] * 2)
    part = np.array([0, 4], dtype=np.int32)
    leakage = AxialSlices.of_charges(Leakage(parts=3), MPI.COMM_SELF, part, start, start[:, 0], outward, 9)
    leakage.update(start + outward * [[0.1], [0.0]])
    vented = 1.75 / 2.0
    np.testing.assert_allclose(leakage.factor, [vented] * 3 + [1.0] * 7, rtol=1e-12)
    np.testing.assert_allclose(leakage.initial_radius, [0.1] * 3 + [0.2] * 3 + [0.0] * 3)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_part_grows_by_the_mean_of_its_nodes_ways_outward(axis):
    """Whichever way is outward, and nothing by what a node moves across it: 0.1 m and the mean of 0.02 and 0.04 m."""
    outward = np.roll([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0]], axis, axis=1)
    across = np.roll([[0.0, 0.3, 0.4], [0.8, -0.6, 0.5]], axis, axis=1)
    start, part = 0.1 * outward, np.zeros(2, dtype=np.int32)
    leakage = AxialSlices.of_charges(Leakage(parts=1), MPI.COMM_SELF, part, start, np.full(2, 0.1), outward, 1)
    found = leakage.radii(start + across + outward * [[0.02], [0.04]])
    np.testing.assert_allclose(found, [0.13], rtol=1e-9)


@pytest.mark.parametrize("edges", [(1.0, 2.0, 3.0), (3.0, 1.0, 2.0), (2.0, 3.0, 1.0)])
def test_the_largest_face_of_a_box_is_that_of_its_longer_edges(edges):
    """However it is turned, and each cell for itself."""
    unit = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    axes = [(0, 0, 1), (1, 0, 0), (0, 1, 0), (1, 2, 3), (-1, 1, 2)]
    turned = [unit * edges @ rotation_matrix(axis, angle).T for axis, angle in zip(axes, range(5), strict=True)]
    np.testing.assert_allclose(largest_faces(np.array([*turned, 2.0 * unit])), [6.0] * 5 + [4.0], rtol=1e-12)


def test_leaking_cells_push_with_the_reduced_pressure():
    """The factor acts on the forces, not on the state of the gas."""
    solver = burst(box((1, 1, 1), (0.01,) * 3, Part.CHARGE), BARE)
    charge = solver.fields.charge
    charge.burn_fraction[:] = 1.0
    solver.add_forces(0.0)
    whole, pressure = solver.fields.nodes.force.copy(), charge.pressure[0]
    charge.leakage[:] = 0.4
    solver.add_forces(0.0)
    np.testing.assert_allclose(solver.fields.nodes.force, 0.4 * whole, rtol=1e-12)
    assert charge.pressure[0] == pressure


INITIATION = (IgnitionPoint(station=0.0),)


def noisy(solver):
    """Give every node a velocity at random, which compresses unreacted cells by some parts in a thousand."""
    velocity = solver.fields.nodes.velocity
    axes = [0, 2] if velocity.shape[1] == 3 and np.ptp(solver.fields.start[:, 1]) == 0.0 else [0, 1, 2]
    velocity[:, axes] = np.random.default_rng(5).normal(0.0, 20.0, (len(velocity), len(axes)))
    velocity[solver.fields.start[:, 0] == 0.0, 0] = 0.0
    return solver


def ahead(solver):
    """Burnt fractions of the cells that no front is near."""
    charge, cells = solver.fields.charge, solver.fields.mesh.cells
    return charge.burn_fraction[:cells][solver.time < np.minimum(charge.ignition_time, charge.compression_from)[:cells]]


def test_noise_burns_nothing_ahead_of_the_front_in_the_meridian():
    """A charge in cells of 1 mm with noise, its front half-way: exactly zero ahead. Allowed earlier, it burns."""
    settings = replace(QUIET, cell_size=1e-3)
    mesh = rectangle((6, 60), (0.0, 6e-3), 0.06, Part.CHARGE)
    solver = noisy(ring_burst(mesh, settings, ignition=INITIATION))
    run_until(solver, 0.03 / D)
    far = ahead(solver)
    assert len(far) > 100
    assert far.max() == 0.0
    assert (solver.fields.charge.burn_fraction == 1.0).sum() > 100
    careless = noisy(ring_burst(mesh, settings, ignition=INITIATION))
    near = careless.fields.charge.compression_from.copy()
    careless.fields.charge.compression_from[:] = 0.0
    run_until(careless, 0.03 / D)
    careless.fields.charge.compression_from[:] = near
    assert (ahead(careless) > 1e-3).mean() > 0.3


def test_noise_burns_nothing_ahead_of_the_front_in_hexahedra():
    solver = noisy(
        burst(box((3, 3, 30), (9e-3, 9e-3, 0.09), Part.CHARGE), replace(QUIET, cell_size=3e-3), ignition=INITIATION)
    )
    run_until(solver, 0.04 / D)
    far = ahead(solver)
    assert len(far) > 80
    assert far.max() == 0.0
    assert (solver.fields.charge.burn_fraction == 1.0).sum() > 50


@pytest.mark.parametrize(("products", "fastest"), [("landau", np.sqrt(32.0 / 27.0)), ("landau_cj", 1.0)])
def test_the_front_runs_ahead_by_no_more_than_the_products_own_speed(products, fastest):
    """Landau's own front is faster than D by sqrt(32/27), that of landau_cj is D; three cells more are allowed.

    A charge in a rigid tube; the front is where a cell is half burnt. It falls behind the timed one nowhere.
    """
    cell, length = 2e-3, 0.24
    settings = whole_steps(QUIET, cell_size=cell, products=products)
    solver = ring_burst(rectangle((3, 120), (0.0, 3 * cell), length, Part.CHARGE), settings, ignition=INITIATION)
    start = solver.fields.start
    hold(solver, np.stack([start[:, 0] > 2.9 * cell, start[:, 2] > length - 1e-9], axis=1))
    depth = length - start[solver.fields.mesh.dofmap, 2].mean(axis=1)
    for share in (0.3, 0.5, 0.75):
        run_until(solver, share * length / D)
        half = solver.fields.charge.burn_fraction[: solver.fields.mesh.cells] > 0.5
        front = depth[half].max()
        assert front < fastest * D * solver.time + 3.0 * cell, (share, front)
        assert front > D * solver.time - 3.0 * cell, (share, front)
    if products == "landau":
        assert solver.fields.products[0].front_speed == pytest.approx(fastest * D, rel=1e-12)
