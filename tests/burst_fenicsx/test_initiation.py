"""Initiation by shock: a bar of unreacted explosive struck by a steel plate, against the closed form of the impact."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.files.checkpoint import read_checkpoint, write_checkpoint
from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from burst_fenicsx.problem import BurstSettings, Leakage, Part, ShockInitiation, Viscosity
from tests.burst_fenicsx.boxes import ELASTIC, TNT, box, burst, run_until
from tests.burst_fenicsx.rank_states import END_BY_SHOCK, GAP, OF_RANKS, differences, state, tubes
from tests.burst_fenicsx.rank_states import burst as burst_of_tubes

pytestmark = pytest.mark.dolfinx

SHOCK = frozenset({"shock"})

CELL = 2e-3
FLYER, BUFFER, CHARGE = 10, 20, 60  # cells
SPEED = 400.0  # of the flyer (m/s)
SETTINGS = BurstSettings(cell_size=CELL, leakage=Leakage(enabled=False), viscosity=Viscosity(linear=0.1, quadratic=1.5))


@dataclass(frozen=True)
class Impact:
    """Closed form of the flyer's impact: pressure in the charge (Pa), speeds of shock and of sound in steel (m/s)."""

    pressure: float
    shock: float
    sound: float

    @property
    def arrival(self) -> float:
        """Time at which the shock enters the charge (s)."""
        return BUFFER * CELL / self.sound

    @property
    def length(self) -> float:
        """Time for which the pressure stays up: to the free end of the flyer and back (s)."""
        return 2.0 * FLYER * CELL / self.sound


def impact() -> Impact:
    """The buffer brings the charge half the flyer's speed; P = rho0 U u with U = c0 + s u.

    The deviator of the unreacted charge is neglected.
    """
    nu = ELASTIC.poisson_ratio
    modulus = ELASTIC.elastic_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    sound = np.sqrt(modulus / ELASTIC.density)
    impedance = ELASTIC.density * sound
    low, high = 0.0, SPEED
    for _ in range(60):
        u = 0.5 * (low + high)
        shock = TNT.sound_speed + TNT.hugoniot_slope * u
        # Incident stress impedance * SPEED / 2 in steel that moves at SPEED / 2, relieved to the charge's.
        too_slow = TNT.density * shock * u < impedance * (SPEED - u)
        low, high = (u, high) if too_slow else (low, u)
    return Impact(TNT.density * shock * u, shock, sound)


def struck(threshold, duration=0.0, settings=SETTINGS, comm=MPI.COMM_SELF, **options):
    """Flyer, buffer and charge along z in one bar that cannot widen; the flyer comes from the high end."""
    count = FLYER + BUFFER + CHARGE
    mesh = box((1, 1, count), (CELL, CELL, count * CELL))
    height = mesh.nodes[mesh.cells].mean(axis=1)[:, 2]
    part = np.where(height < CHARGE * CELL, Part.CHARGE, Part.CASING).astype(np.int32)
    mesh = replace(mesh, part=part, segment=np.where(part == Part.CASING, 0, -1).astype(np.int32))
    solver = burst(mesh, settings, initiation=ShockInitiation(threshold, duration), comm=comm, **options)
    everywhere = np.arange(len(solver.fields.start))
    solver.constraints = (
        NodalConstraint(everywhere, np.array([1.0, 0.0, 0.0])),
        NodalConstraint(everywhere, np.array([0.0, 1.0, 0.0])),
    )
    nodes = solver.fields.nodes
    interface = (CHARGE + BUFFER) * CELL
    start = solver.fields.start[:, 2]
    nodes.velocity[start > interface + 0.1 * CELL, 2] = -SPEED
    # The common node of flyer and buffer has their common momentum.
    nodes.velocity[np.abs(start - interface) < 0.1 * CELL, 2] = -0.5 * SPEED
    return solver


def run(solver, end):
    """Step to the time (s); arrival of the burn at the middle of every charge cell, by height."""
    charge = solver.fields.charge
    own = np.flatnonzero(solver.fields.mesh.part == Part.CHARGE)
    height = solver.fields.start[solver.fields.mesh.dofmap[own]].mean(axis=1)[:, 2]
    burnt = np.full(len(own), np.inf)
    while solver.time < end * (1.0 - 1e-12):
        solver.step(end)
        burnt[(charge.burn_fraction[own] >= 0.5) & np.isinf(burnt)] = solver.time
    order = np.argsort(-height)
    return burnt[order], height[order]


def test_the_closed_form_is_what_an_unreacted_charge_shows():
    """The plateau behind the shock lies within 3 % of the impact's pressure; nothing burns by itself."""
    expected = impact()
    solver = struck(1e30)
    run(solver, expected.arrival + 0.6 * expected.length)
    charge, mesh = solver.fields.charge, solver.fields.mesh
    own = mesh.part == Part.CHARGE
    pressed = np.sort(charge.pressure[: mesh.cells][own])[::-1]
    assert pressed[2] == pytest.approx(expected.pressure, rel=0.03)
    assert (charge.burn_fraction[: mesh.cells][own] == 0.0).all()
    assert np.isinf(charge.ignition_time[own]).all()


@pytest.mark.parametrize("burn", ["time", "time_or_compression"])
def test_the_charge_is_initiated_where_and_when_the_shock_arrives_and_then_detonates(burn):
    """In the first cell, within the time in which the shock crosses a cell; then a front at D, no cell crushed."""
    expected = impact()
    solver = struck(0.6 * expected.pressure, settings=replace(SETTINGS, burn=burn))
    solver.ledger.energy_tolerance = np.inf  # it does not know what the flyer brings
    brought = 0.5 * float(solver.fields.mass @ (solver.fields.nodes.velocity**2).sum(axis=1))
    watch = solver.initiation
    assert watch.waiting
    assert watch.sources == [None]
    run(solver, expected.arrival - CELL / expected.shock)
    assert watch.sources == [None]
    end = expected.arrival + 0.85 * CHARGE * CELL / TNT.detonation_velocity
    burnt, height = run(solver, end)
    source = watch.sources[0]
    first = (CHARGE - 0.5) * CELL
    assert source.place == pytest.approx((0.5 * CELL, 0.5 * CELL, first), abs=1e-12)
    crossing = CELL / expected.shock
    assert source.time == pytest.approx(expected.arrival + 0.5 * crossing, abs=crossing)
    front = solver.fields.charge.ignition_time[solver.fields.mesh.part == Part.CHARGE]
    times = source.time + np.abs(height - first) / TNT.detonation_velocity
    np.testing.assert_allclose(np.sort(front), times, rtol=1e-12)
    passed = slice(10, 45)
    speed = -np.polyfit(burnt[passed], height[passed], 1)[0]
    assert speed == pytest.approx(TNT.detonation_velocity, rel=0.02)
    mesh, (slots, held) = solver.fields.mesh, solver.fields.blocks.slots
    volume = np.empty(mesh.cells)
    volume[held] = solver.fields.grid.volume[slots]
    assert volume[mesh.part == Part.CHARGE].min() > 0.5 * CELL**3
    entry = solver.ledger.record(solver.fields, solver.time, solver.time_step, 0.0)
    stored = entry.kinetic + entry.strain + entry.plastic + entry.viscous + entry.hourglass
    assert entry.products_work > 5.0 * brought
    assert stored - entry.products_work == pytest.approx(brought, abs=5e-3 * entry.products_work)


def test_below_the_threshold_the_charge_is_never_initiated():
    """Nor does compression burn it: pressed to 0.9 of the threshold until the shock has run through."""
    expected = impact()
    solver = struck(expected.pressure / 0.9)
    burnt, _ = run(solver, expected.arrival + CHARGE * CELL / expected.shock)
    assert np.isinf(burnt).all()
    assert solver.initiation.sources == [None]
    assert solver.initiation.waiting
    own = solver.fields.mesh.part == Part.CHARGE
    assert (solver.fields.charge.burn_fraction[: len(own)][own] == 0.0).all()
    assert not solver.ledger.sums[3] > 0.0  # the charge has taken work, it has given none


def test_the_pressure_must_be_held_for_the_duration():
    """0.6 of the flyer's pulse initiates the charge that much later; 1.5 of it never does."""
    expected = impact()
    late = 0.6 * expected.length
    sources = []
    for duration in (0.0, late):
        solver = struck(0.6 * expected.pressure, duration)
        run(solver, expected.arrival + late + 3.0 * CELL / expected.shock)
        sources.append(solver.initiation.sources[0])
    assert sources[1].time - sources[0].time == pytest.approx(late, abs=CELL / expected.sound)
    never = struck(0.6 * expected.pressure, 1.5 * expected.length)
    run(never, expected.arrival + 3.0 * expected.length)
    assert never.initiation.sources == [None]
    assert never.initiation.held.max() < 1.5 * expected.length


def test_the_step_resolves_the_burn_once_the_charge_is_initiated():
    """Before, it need not; from then on no cell burns by time by more than a quarter in a step of its own."""
    expected = impact()
    solver = struck(0.6 * expected.pressure)
    run(solver, 0.9 * expected.arrival)
    largest = solver.fields.charge.burn_rate.max()
    assert solver.time_step > 0.3 / largest
    while solver.initiation.sources[0] is None:
        solver.step()
    solver.step()
    fields = solver.fields
    level = fields.blocks.cell_levels
    light, rate = fields.charge.ignition_time, fields.charge.burn_rate
    burning = (fields.charge.burn_fraction[: len(level)] < 1.0) & (light < solver.time + 3.0 * solver.time_step)
    assert burning.any()
    assert (solver.time_step / 2.0 ** level[burning] <= 0.25 / rate[burning]).all()


@pytest.fixture(scope="module")
def initiated_by_neighbour(tmp_path_factory):
    """A tube that waits beside one that is initiated, run through."""
    return burst_of_tubes(tmp_path_factory.mktemp("shock"), MPI.COMM_SELF, SHOCK)


def test_a_tube_is_initiated_by_the_one_beside_it(initiated_by_neighbour):
    """Not at once, and on the side of the neighbour; then it bursts as well."""
    first, second = initiated_by_neighbour.initiation.sources
    assert first is None
    assert second.place[0] < 0.155 + GAP
    assert 10e-6 < second.time < END_BY_SHOCK
    charge, mesh = initiated_by_neighbour.fields.charge, initiated_by_neighbour.fields.mesh
    waiting = (mesh.part == Part.CHARGE) & (mesh.round == 1)
    assert np.isfinite(charge.ignition_time[waiting]).all()
    assert charge.burn_fraction[: mesh.cells][waiting].max() == 1.0


def test_the_summary_shows_when_where_and_by_what_each_tube_was_initiated(initiated_by_neighbour):
    own, by_shock = (entry["ignition"] for entry in initiated_by_neighbour.finish().summary["rounds"])
    assert [(one["by"], one["time"], one["station"]) for one in own] == [("point", 0.0, pytest.approx(0.0, abs=1e-12))]
    source = initiated_by_neighbour.initiation.sources[1]
    assert [(one["by"], one["time"], one["place"]) for one in by_shock] == [("shock", source.time, list(source.place))]
    assert by_shock[0]["station"] == pytest.approx(initiated_by_neighbour.mesh.lengths[1] - source.place[2])


@pytest.mark.parametrize("after", [0.5, 1.05])
def test_a_burst_that_waits_for_shock_goes_on_from_a_checkpoint(tmp_path, initiated_by_neighbour, after):
    """To the last bit, from before the neighbour is initiated and from shortly after."""
    time = after * initiated_by_neighbour.initiation.sources[1].time
    whole, resumed = (tubes(tmp_path, MPI.COMM_SELF, SHOCK) for _ in range(2))
    while whole.solver.time < time:
        whole.solver.step(END_BY_SHOCK)
    write_checkpoint(whole.checkpoint_path, whole.solver, {}, whole.key)
    read_checkpoint(whole.checkpoint_path, resumed.solver, resumed.key)
    assert (resumed.initiation.sources[1] is None) == (after < 1.0)
    for going in (whole, resumed):
        run_until(going.solver, END_BY_SHOCK)
    assert differences(state(whole), state(resumed)) == []
    assert resumed.initiation.sources == whole.initiation.sources
    assert resumed.initiation.sources[1] is not None


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_ranks_initiate_the_neighbour_alike(tmp_path, on_ranks, initiated_by_neighbour, ranks):
    path = tmp_path / "state.npz"
    on_ranks(ranks, "-m", "tests.burst_fenicsx.rank_states", path, "random", *SHOCK)
    found = {name: values for name, values in np.load(path).items() if name not in OF_RANKS}
    assert differences(state(initiated_by_neighbour), found) == []


def test_pressure_that_falls_in_between_starts_again():
    """Two pulses of 0.7 of the duration initiate nothing."""
    duration, step = 1.0e-6, 0.1e-6
    solver = burst(box((1, 1, 4), (CELL, CELL, 4 * CELL), Part.CHARGE), initiation=ShockInitiation(5e9, duration))
    charge = solver.fields.charge
    for number in range(20):
        charge.pressure[0] = 0.0 if number == 8 else 6e9
        found = solver.initiation.update(number * step, step)
        assert found == (number == 9 + 10)
