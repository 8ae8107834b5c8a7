"""Initiation by shock, by hand: cells in a row whose pressures are given."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.mechanics.initiation import ShockInitiations
from burst_fenicsx.problem import Part

pytestmark = pytest.mark.dolfinx

D, THRESHOLD, DURATION, STEP, RATE = 8000.0, 5e9, 2.5e-7, 1e-7, 1e6


def row(initiations, front_speed=9000.0):
    """Twelve cells, a metre each, along a slanted line: a round of four, one of six, of which one is casing, and two.

    Gives what watches them, and the fields, whose cells have the numbers 20, 19, ..., 9 in the whole mesh.
    """
    count = 12
    start = np.array([1.0, 2.0, -2.0]) / 3.0 * np.arange(count + 1)[:, None]
    part = np.full(count, Part.CHARGE)
    part[6] = Part.CASING
    mesh = SimpleNamespace(
        comm=MPI.COMM_SELF, cells=count, part=part, round=np.repeat([0, 1, 2], [4, 6, 2]), cell=20 - np.arange(count),
        dofmap=np.arange(count)[:, None] + np.array([0, 1, 0, 1, 0, 1, 0, 1]), gather_cells=np.copy,
    )  # fmt: skip
    charge = SimpleNamespace(
        pressure=np.zeros(count), compression_from=np.full(count, np.inf), ignition_time=np.full(count, np.inf),
        burn_rate=np.full(count, RATE),
    )  # fmt: skip
    products = [SimpleNamespace(front_speed=front_speed)] * 3
    fields = SimpleNamespace(mesh=mesh, charge=charge, products=products, start=start)
    rounds = [
        SimpleNamespace(explosive=SimpleNamespace(detonation_velocity=D), initiation=initiation)
        for initiation in initiations
    ]
    return ShockInitiations.of_rounds(rounds, fields), fields


CRITERION = SimpleNamespace(pressure=THRESHOLD, duration=DURATION)


def test_no_round_that_waits_needs_no_watch():
    assert row([None, None, None])[0] is None


@pytest.mark.parametrize("front_speed", [7000.0, 9000.0])
def test_fronts_run_from_every_cell_that_was_pressed_long_enough(front_speed):
    """Two cells at once and one later, which a front has nearly reached; ahead of a front cells may be compressed."""
    watch, fields = row([None, CRITERION, CRITERION], front_speed)
    charge, place = fields.charge, np.arange(12) + 0.5
    charge.ignition_time[8], charge.compression_from[8] = 1e-6, 0.9e-6  # a front from another source
    charge.pressure[[2, 4, 9]] = THRESHOLD  # the first is of a round that does not wait
    charge.pressure[6] = 1.0  # of the casing
    charge.pressure[5] = 0.99 * THRESHOLD
    results = [watch.update(number * STEP, STEP) for number in range(1, 4)]
    assert results == [False] * 3
    assert watch.held[[0, 4]].tolist() == pytest.approx([2.0 * STEP] * 2)
    assert watch.update(4.0 * STEP, STEP)
    # Pressed since the first step's end, for 0.25 us: at 0.35 us, between two steps.
    time = 1.0 * STEP + DURATION
    assert watch.sources[0] is None
    assert watch.sources[2] is None
    first = watch.sources[1]
    assert (first.time, first.cell) == (pytest.approx(time), 20 - 9)
    assert first.place == pytest.approx((9.5 / 3.0, 19.0 / 3.0, -19.0 / 3.0))
    away = np.minimum(np.abs(place - 4.5), np.abs(place - 9.5))
    arrival = np.where((place > 4.0) & (place < 10.0), time + away / D, np.inf)
    arrival[6], arrival[8] = np.inf, min(arrival[8], 1e-6)
    np.testing.assert_allclose(charge.ignition_time, arrival, rtol=1e-9)
    reach = (time - charge.compression_from[4]) * RATE
    assert 1.0 < reach < 10.0  # a few cells ahead of the front
    near = np.where(np.isfinite(arrival), time + away / max(D, front_speed) - reach / RATE, np.inf)
    near[8] = min(near[8], 0.9e-6)
    np.testing.assert_allclose(charge.compression_from, near, rtol=1e-9)
    assert watch.waiting
    # The third round later; what has a source keeps it.
    charge.pressure[:] = 0.0
    charge.pressure[[5, 11]] = 2.0 * THRESHOLD
    for number in range(20, 25):
        watch.update(number * STEP, STEP)
    assert watch.sources[1] is first
    assert watch.sources[2].cell == 9
    assert watch.sources[2].time == pytest.approx(20.0 * STEP + DURATION)


def test_a_charge_is_pressed_while_a_shock_that_may_initiate_it_lasts():
    """From the threshold on and not below; not in a round that cannot be initiated, nor in one that has a front."""
    watch, fields = row([None, CRITERION, CRITERION])
    charge = fields.charge
    charge.pressure[2] = 2.0 * THRESHOLD  # of the round that does not wait
    charge.pressure[4] = 0.99 * THRESHOLD
    watch.update(STEP, STEP)
    assert not watch.is_pressed()
    charge.pressure[4] = THRESHOLD
    watch.update(2.0 * STEP, STEP)
    assert watch.is_pressed()
    charge.pressure[4] = 0.0
    watch.update(3.0 * STEP, STEP)
    assert not watch.is_pressed()
    charge.pressure[4] = THRESHOLD
    for number in range(4, 9):
        watch.update(number * STEP, STEP)
    assert watch.sources[1] is not None
    assert not watch.is_pressed()
    watch.waiting = False
    assert not watch.is_pressed()


def test_nothing_waits_once_every_cell_is_near_a_front():
    watch, fields = row([None, CRITERION, None])
    fields.charge.compression_from[4:10] = 0.5e-6
    assert not watch.update(0.4e-6, STEP)
    assert watch.waiting
    fields.charge.compression_from[9] = 5e-6
    watch.update(0.6e-6, STEP)
    assert watch.waiting  # the last cell alone
    fields.charge.compression_from[9] = 0.5e-6
    watch.update(0.6e-6, STEP)
    assert not watch.waiting
