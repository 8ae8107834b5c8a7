"""The end of the burst by its asymptote; speeds by station and their quantiles over the mass; distorted cells."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.mechanics.step_control import BurningTimes
from burst_fenicsx.meshing import merge
from burst_fenicsx.problem import BurstSettings, Leakage, Part
from burst_fenicsx.records.acceleration import Acceleration
from burst_fenicsx.records.measures import Distortion, Measures, RoundMeasures, speed_quantiles
from burst_fenicsx.run_burst import simulate
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.bodies import bodies, moved
from tests.burst_fenicsx.boxes import burst, distorted_box, grid
from tests.burst_fenicsx.test_erosion import drawn
from tests.burst_fenicsx.tubes import SETTINGS, tube

pytestmark = pytest.mark.dolfinx


THIN = SimpleNamespace(dilute_exponent=4.0 / 3.0)
RADII = np.linspace(0.05, 0.25, 201)
ONE = np.array([True])


def begun(rounds=1, *, beta=1.0, left=0.1, touched=False):
    """A record of equal rounds without an entry; each has touched every other, or none."""
    sizes = np.ones(rounds), np.full(rounds, 0.04)  # J, m
    record = Acceleration([THIN] * rounds, Leakage(beta > 0.0, beta=beta), left, *sizes)
    record.touched |= touched
    return record


def taken(energies, radii=RADII, *, initiated=ONE, **given):
    """The record of casings whose energies (J) go with their radii (m), a microsecond an entry, until it is over."""
    record = begun(len(initiated), **given)
    for index, (energy, radius) in enumerate(zip(energies, radii, strict=True)):
        record.record(index * 1e-6, np.atleast_1d(energy), np.atleast_1d(radius), initiated)
        if record.end() <= index * 1e-6:
            break
    return record


@pytest.mark.parametrize(("beta", "exponent"), [(1.0, 5.0 / 3.0), (0.0, 2.0 / 3.0), (2.0, 8.0 / 3.0)])
def test_thin_products_give_the_asymptote_whenever_one_stops(beta, exponent):
    """K = K_inf (1 - (a/r)^n): every line ends in K_inf, the burst where (a/r)^n / (1 - (a/r)^n) = `left`."""
    start = 0.05
    for left in (0.2, 0.1, 0.05):  # from two windows of growth on
        radii = start * np.geomspace(1.01, 200.0, 3000)
        record = taken(7.0 * (1.0 - (start / radii) ** exponent), radii, beta=beta, left=left)
        known = np.array(record.asymptotes)[:, 0]
        known = known[np.isfinite(known)]
        np.testing.assert_allclose(known, 7.0, rtol=1e-9)
        assert len(known) > 100
        end = start * ((1.0 + left) / left) ** (1.0 / exponent)
        assert radii[len(record.rows) - 2] < end <= radii[len(record.rows) - 1]
        assert record.left()[0] == pytest.approx(left, rel=0.02)


def test_the_end_is_foreseen_between_two_entries():
    """Entries 3 mm apart: the time by the line through the last two is right to a thirtieth of an entry."""
    radii = np.arange(0.05, 0.4, 3e-3)
    energies = 1.0 - (0.04 / radii) ** (5.0 / 3.0)
    exact = (0.04 * 11.0 ** (3.0 / 5.0) - radii[0]) / 3e-3 * 1e-6
    record = begun()
    for index, (energy, radius) in enumerate(zip(energies, radii, strict=True)):
        if index * 1e-6 > exact:
            break
        record.record(index * 1e-6, np.array([energy]), np.array([radius]), ONE)
    assert record.end() == pytest.approx(exact, abs=3e-8)


def test_casings_that_collide_do_not_end_the_burst():
    """Energy that falls and rises again passes through no growth at all; the end comes when its asymptote is steady."""
    radii = np.linspace(0.05, 0.5, 451)
    free = 1.0 - (0.04 / radii) ** (5.0 / 3.0)
    dip = 0.25 * np.clip((radii - 0.10) / 0.02, 0.0, 1.0) * np.exp(-np.clip(radii - 0.12, 0.0, None) / 0.03)
    growth = np.diff(free - dip)
    assert (growth[:-1] * growth[1:] < 0.0).any()
    collided, alone = taken(free - dip, radii), taken(free, radii)
    assert 1.3 * alone.rows[-1][2] < collided.rows[-1][2] < 0.45
    assert collided.asymptotes[-1][0] == pytest.approx(1.0, abs=0.02)


def test_what_nothing_has_initiated_is_not_waited_for_and_the_slowest_of_the_others_is():
    both = np.stack([1.0 - (0.04 / RADII) ** (5.0 / 3.0), 1.0 - (0.045 / RADII) ** (5.0 / 3.0)], axis=1)
    radii = np.stack([RADII, RADII], axis=1)
    ends = [len(taken(both, radii, initiated=np.array(some, dtype=bool)).rows) for some in ([1, 1], [1, 0], [0, 1])]
    assert ends[0] == ends[2] > ends[1]
    assert taken(both, radii, initiated=np.array([False, False])).end() == np.inf
    # Metal that a neighbour has thrown keeps the speed that it has.
    assert np.isnan(taken(both, radii, initiated=np.array([True, False])).left()).tolist() == [False, True]


def squeezed():
    """Energies (J) and radii (m) of a free round and of one between others, whose gas works on the free one.

    The free one's radius grows evenly. That of the squeezed one shrinks first and grows late; each gas gives what thin
    products give from its radius on, and contact hands three quarters of the squeezed one's to the free one.
    """
    free = np.linspace(0.05, 0.5, 451)
    inner = 0.06 + 0.08 * np.clip(free - 0.2, 0.0, None) - 0.01 * np.clip((free - 0.1) / 0.1, 0.0, 1.0)
    given, late = (2.0 * (1.0 - (0.04 / radii) ** (5.0 / 3.0)) for radii in (free, inner))
    return np.stack([given + 0.75 * late, 0.25 * late], axis=1), np.stack([free, inner], axis=1)


def test_rounds_that_have_touched_end_by_their_sum_which_alone_has_an_asymptote():
    """All the gas gives 4 J in the end, as is known long before, and the two rounds' asymptotes add up to it.

    By its own radius the squeezed one is not foreseen to end: its gas hardly grows.
    """
    energies, radii = squeezed()
    both = np.array([True, True])
    together = taken(energies, radii, initiated=both, touched=True, left=0.3)
    assert together.end() == together.rows[-1][0]
    assert len(together.rows) < len(radii)
    assert np.sum(together.asymptotes[-1]) == pytest.approx(4.0, rel=1e-9)
    row, rho = together.rows[-1], together.left()
    assert (1.0 + rho) @ row[1:3] == pytest.approx(np.sum(together.asymptotes[-1]), rel=1e-12)
    assert taken(energies, radii, initiated=both, left=0.3).end() == np.inf


def test_equal_rounds_end_as_one_whether_they_touch_or_not():
    """So does a row whose images are computed: the end of a pair is that of its half."""
    one = 1.0 - (0.04 / RADII) ** (5.0 / 3.0)
    energies, radii, both = np.stack([one, one], axis=1), np.stack([RADII, RADII], axis=1), np.array([True, True])
    alone = taken(one)
    for touched in (False, True):
        record = taken(energies, radii, initiated=both, touched=touched)
        assert record.end() == pytest.approx(alone.end(), rel=1e-12)
        np.testing.assert_allclose(record.asymptotes[-1], alone.asymptotes[-1][0], rtol=1e-12)


def test_a_record_goes_on_from_its_checkpoint():
    whole, half = taken(1.0 - (0.04 / RADII) ** (5.0 / 3.0)), begun()
    half.restore(whole.array()[:-20], whole.touched)
    for row in whole.rows[-20:]:
        half.record(row[0], row[1:2], row[2:3], ONE)
    np.testing.assert_array_equal(half.array(), whole.array())


@pytest.mark.parametrize(
    ("ignition", "pressed", "complete"),
    [
        ((1e-6, np.inf, 90e-6), False, False),  # the last cell is ignited later
        ((1e-6, np.inf, 60e-6), False, False),  # it burns until 72 us
        ((1e-6, np.inf, 57e-6), False, True),  # until 69 us
        ((1e-6, np.inf, 57e-6), True, False),  # a shock is about to initiate the other charge
        ((np.inf, np.inf, np.inf), False, False),  # nothing has been initiated yet
    ],
)
def test_acceleration_is_not_complete_while_a_charge_burns_or_waits_for_its_delay(ignition, pressed, complete):
    charge = SimpleNamespace(ignition_time=np.array(ignition), burn_rate=np.full(3, 1.0 / 12e-6))
    fields = SimpleNamespace(charge=charge, mesh=SimpleNamespace(comm=MPI.COMM_SELF))
    shocks = SimpleNamespace(is_pressed=lambda: pressed)
    run = SimpleNamespace(
        initiation=shocks, solver=SimpleNamespace(time=70e-6, burning=BurningTimes(fields)), comm=MPI.COMM_SELF,
        acceleration=SimpleNamespace(end=lambda: 70e-6), settings=replace(SETTINGS, end_time=None),
    )  # fmt: skip
    run._burnt_out = lambda: Simulation._burnt_out(run)
    assert (Simulation._expected_end(run) <= 70e-6) == complete


def test_fragments_start_no_slower_than_at_the_end():
    """A round that would still hand energy on keeps what it has, as does one without an asymptote."""
    left = np.array([0.1, -0.04, np.nan])
    run = SimpleNamespace(
        acceleration=SimpleNamespace(left=lambda: left), _ended_by_acceleration=True, rounds=[0, 0, 0]
    )
    np.testing.assert_allclose(Simulation.speed_factors(run), [np.sqrt(1.1), 1.0, 1.0])


RING = BurstSettings(cell_size=12e-3, geometry="axisymmetric")


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """The tube in the meridian until its acceleration ends, with its folder."""
    folder = tmp_path_factory.mktemp("ended")
    return simulate([tube()], RING, folder, series=False), folder


def test_fragments_start_with_the_asymptote_which_a_longer_burst_confirms(ended, tmp_path):
    """The end is where a tenth is left; speeds handed over are those at the end times the root of what is left.

    A burst half as long again has the same asymptote to 1 %; its speeds, of an end that was given, stay as they are.
    """
    result, folder = ended
    summary = result.summary
    assert summary["end_time"] == summary["acceleration_complete"] == result.history["time"][-1]
    assert 0.05 < summary["acceleration_left"] <= 0.1 + 1e-3
    factor = np.sqrt(1.0 + summary["acceleration_left"])
    assert summary["mean_initial_speed"] == pytest.approx(factor * summary["mean_speed_at_end"], rel=1e-9)
    longer = simulate([tube()], replace(RING, end_time=1.5 * summary["end_time"]), tmp_path, series=False).summary
    assert longer["mean_initial_speed"] == pytest.approx(longer["mean_speed_at_end"], rel=1e-12)
    assert longer["mean_speed_at_end"] > summary["mean_speed_at_end"]
    assert longer["acceleration_left"] < 0.7 * summary["acceleration_left"]
    tended = longer["mean_speed_at_end"] * np.sqrt(1.0 + longer["acceleration_left"])
    assert tended == pytest.approx(summary["mean_initial_speed"], rel=0.01)
    with h5py.File(folder / "burst_snapshot.h5") as file:
        segments = file["rounds/0/segments"][()]
    mean = segments["casing_mass"] @ segments["speed"] / segments["casing_mass"].sum()
    assert mean == pytest.approx(summary["mean_initial_speed"], rel=0.01)


def test_no_data_set_moves_with_the_output_interval(ended, tmp_path):
    """Neither the snapshot nor the history; states are written at the times asked for all the same."""
    _, folder = ended
    for interval in (5e-6, 21e-6):
        simulate([tube()], replace(RING, output_interval=interval), tmp_path)
        with h5py.File(folder / "burst_snapshot.h5") as one, h5py.File(tmp_path / "burst_snapshot.h5") as other:
            names = []
            one.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)  # noqa: B023
            assert len(names) > 30
            for name in names:
                np.testing.assert_array_equal(other[name][()], one[name][()], err_msg=name)
            end = one.attrs["time"]
        times = [float(text.split('"')[0]) for text in (tmp_path / "burst.xdmf").read_text().split('Time Value="')[1:]]
        np.testing.assert_allclose(times, [*np.arange(0.0, end, interval), end], rtol=1e-9)


def measured(speed, mass):
    nothing = np.zeros(0)
    return RoundMeasures(nothing, nothing, nothing, nothing, nothing, np.asarray(speed), np.asarray(mass))


def test_quantiles_of_speed_are_those_of_the_mass():
    """A mass that grows evenly with the speed: the speed itself, whatever the whole mass and however it is shared."""
    speed = np.linspace(0.0, 1000.0, 2001)[1::2]  # of cells of 1 m/s, at their middles
    for whole in (0.02, 7.0):
        mass = np.full(1000, whole / 1000)
        both = [measured(speed[:300], mass[:300]), measured(speed[300:], mass[300:])]
        for rounds in ([measured(speed, mass)], both, both[::-1]):
            found = speed_quantiles(rounds)
            assert found == {"90": pytest.approx(900.0, abs=0.01), "99": pytest.approx(990.0, abs=0.01)}
    # Three quarters of the mass at 100 m/s, the rest at 500: on the line between the middles of both, 0.375 and 0.875.
    assert speed_quantiles([measured([500.0, 100.0], [0.5, 1.5])])["90"] == 500.0
    assert speed_quantiles([measured([500.0, 100.0], [0.1, 0.9])])["90"] == pytest.approx(100.0 + 400.0 * 0.45 / 0.5)
    assert speed_quantiles([measured([], [])]) == {"90": 0.0, "99": 0.0}


def no_bins(mesh, bins=0):
    """Surfaces of a mesh none of whose nodes is in one of the bins of its two rounds."""
    nowhere = np.full(len(mesh.nodes), -1, dtype=np.int32)
    outward, radius = np.zeros_like(mesh.nodes), np.zeros(len(mesh.nodes))
    bin_round, place = np.repeat([0, 1], bins), np.tile((np.arange(bins) + 0.5) / max(bins, 1), 2)
    return SimpleNamespace(
        casing_bin=nowhere, outward=outward, radius=radius, bin_round=bin_round, bin_station=place
    )  # fmt: skip


def test_speeds_of_a_round_are_means_by_mass_of_the_cells_in_each_bin():
    """Two bars with cells of very different mass, two to a bin; the second is half of a round with its image."""
    uneven = 0.02 * np.array([0, 2, 5, 6, 10, 14, 15, 17, 20])
    bar = grid((1, 1, 8), lambda p: np.column_stack([0.01 * p[:, :2], uneven[np.rint(8 * p[:, 2]).astype(int)]]))
    rounds = [bar, moved(bar, (1.0, 0.0, 0.0), 1)]
    solver, mesh = bodies(rounds, [(0.0, 0.0, 0.0)] * 2), merge([replace(one, segments=((),)) for one in rounds])
    state = solver.fields
    random = np.random.default_rng(6)
    state.nodes.velocity[:] = random.uniform(100.0, 900.0, (len(mesh.nodes), 1)) * [0.6, 0.0, 0.8]
    speed, cell_mass = np.empty((2, len(mesh.cells)))
    speed[state.mesh.cell] = np.linalg.norm(state.nodes.velocity[state.mesh.dofmap].mean(axis=1), axis=1)
    cell_mass[state.mesh.cell] = state.cell_mass
    first, second = Measures(state, no_bins(mesh, 4), mesh, multiplicity=np.array([1.0, 2.0])).rounds()
    station = 0.4 - mesh.nodes[mesh.cells].mean(axis=1)[:, 2]
    for index, (found, times) in enumerate(((first, 1.0), (second, 2.0))):
        for k in range(4):
            own = np.flatnonzero((mesh.round == index) & (station // 0.1 == k))
            mass = cell_mass[own]
            assert len(own) == 2
            assert mass.max() > 1.1 * mass.min()
            assert found.casing_mass[k] == pytest.approx(times * mass.sum(), rel=1e-12)
            assert found.mean_speed[k] == pytest.approx(np.average(speed[own], weights=mass), rel=1e-12)
            assert found.max_speed[k] == pytest.approx(speed[own].max(), rel=1e-12)
        whole = np.flatnonzero(mesh.round == index)
        whole = whole[np.argsort(speed[whole])]
        np.testing.assert_allclose(found.speed, speed[whole], rtol=1e-12)
        np.testing.assert_allclose(found.mass, times * cell_mass[whole], rtol=1e-12)
        assert found.mean == pytest.approx(np.average(speed[whole], weights=cell_mass[whole]), rel=1e-12)
        assert found.largest == pytest.approx(speed[whole].max(), rel=1e-12)


def test_distorted_cells_are_counted_once_for_every_image():
    """A folded cell that is then eroded; a lost one, which is folded as well; of a charge they weigh nothing."""
    solver, cell = drawn()
    state = solver.fields
    given = grid((3, 3, 3), lambda p: p * 9e-3)
    count = Measures(state, no_bins(given), given, images=4).distortion
    folded = int(state.folded().sum())
    mass = 4.0 * state.cell_mass[state.folded()].sum()
    assert count() == Distortion(0, 4 * folded, pytest.approx(mass, rel=1e-12), 0.0, 0)
    solver.erode_metal()
    eroded = 4.0 * state.cell_mass[cell]
    assert count() == Distortion(0, 4 * folded - 4, pytest.approx(mass - eroded, rel=1e-12), pytest.approx(eroded), 4)
    for part, weight in ((Part.CASING, 1.0), (Part.CHARGE, 0.0)):
        given = distorted_box(1, 1e-3, part)
        state = burst(given).fields
        state.nodes.position[:, 2] *= -1.0
        found = Measures(state, no_bins(given), given, images=4).distortion()
        assert found == Distortion(4, 4, pytest.approx(4.0 * weight * state.cell_mass[0]))
