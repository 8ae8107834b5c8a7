"""The end of the burst: asymptote, its crossing, collisions, and what outputs may not move."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.mechanics.step_control import BurningTimes
from burst_fenicsx.problem import BurstSettings, Leakage
from burst_fenicsx.records.acceleration import Acceleration
from burst_fenicsx.run_burst import simulate
from burst_fenicsx.simulation import Simulation
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
