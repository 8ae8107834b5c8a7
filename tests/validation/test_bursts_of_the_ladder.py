"""Checks of the copper cylinder, the steel tubes and the M107 of 1944, on made-up records."""

from __future__ import annotations

import copy

import h5py
import numpy as np
import pytest

import flight
from validation.copper_cylinder import check as cylinder
from validation.copper_cylinder.streak import Streak, streak
from validation.m107_1944 import check as m107
from validation.m107_1944.counts import Counts, count, prescribed
from validation.runs import ROOT, StudyError, changed_case
from validation.steel_tubes import check as tubes
from validation.steel_tubes.study import tube_of

LENGTH, RADIUS, FRONT = 0.3, 0.0153, 6940.0
SPEED, TURN = 1400.0, 0.1  # of the wall, m/s; part of it that points away from the initiated end


def _wall(time):
    """Rings of a wall that moves at one velocity once the front has passed; (nodes, 3), initiated end up."""
    heights = np.linspace(0.0, LENGTH, 61)
    away = np.maximum(time - (LENGTH - heights) / FRONT, 0.0)
    around = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    rings = []
    for share in (1.0, 0.5):  # the outer surface, and nodes within
        radius = share * RADIUS + SPEED * away
        rings.append(
            np.stack(
                [
                    np.outer(radius, np.cos(around)),
                    np.outer(radius, np.sin(around)),
                    np.repeat((heights - TURN * SPEED * away)[:, None], 16, axis=1),
                ],
                axis=-1,
            ).reshape(-1, 3)
        )
    return np.concatenate(rings)


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    folder = tmp_path_factory.mktemp("burst")
    for number, time in enumerate(np.arange(0.0, 50e-6, 0.5e-6)):
        with h5py.File(folder / f"{number:04d}.h5", "w") as file:
            file["position"] = _wall(time)
            file.attrs["time"] = time
    return folder


def test_the_slit_sees_the_radius_at_a_fixed_station(series):
    """A steady wall r(z, t): at fixed z, dr/dt = v_r - v_z dr/dz = v_r / (1 - v_z / D), v_z from the initiated end."""
    record = streak(series, 0.2, LENGTH)
    seen = SPEED / (1.0 - TURN * SPEED / FRONT)
    for displacement in (6e-3, 19e-3):
        assert record.speed_at(displacement, 2e-3) == pytest.approx(seen, rel=2e-3)


def test_a_file_without_a_series_is_refused(tmp_path):
    with pytest.raises(StudyError, match="no time series of a burst"):
        streak(tmp_path / "burst", 0.2, LENGTH)


def _moving(speed, end):
    time = np.arange(0.0, end / speed, 0.3e-6)
    return Streak(time, speed * time)


def test_the_cylinder_is_held_against_the_two_speeds():
    rows = {row.quantity: row for row in cylinder.check("jwl", _moving(1397.0 * 1.029, 25e-3))}
    assert rows["jwl: wall speed at 19 mm"].error == pytest.approx(0.029, abs=1e-6)
    assert rows["jwl: wall speed at 19 mm"].passed is True
    assert rows["jwl: wall speed at 6 mm"].passed is False
    informing = cylinder.check("jwl", _moving(1500.0, 25e-3), verdict=False)
    assert [row.passed for row in informing if "wall speed" in row.quantity] == [None, None]


def test_a_record_that_ends_too_early_is_not_compared():
    (row,) = cylinder.check("jwl", _moving(1400.0, 20e-3))
    assert row.quantity == "jwl: record of the wall ends at"
    assert row.passed is False
    with pytest.raises(StudyError, match="speed at 19 mm needs it to 21 mm"):
        _moving(1400.0, 20e-3).speed_at(19e-3, 2e-3)


def test_gurneys_formula():
    """C/M = 1 and sqrt(2E) = 2405 m/s: 2405/sqrt(1.5); a heavy casing takes nearly all of the energy."""
    assert tubes.gurney_speed(2405.0, 1.0) == pytest.approx(1963.67, abs=0.01)
    assert tubes.gurney_speed(2405.0, 1e-4) == pytest.approx(24.05, rel=1e-4)
    assert tubes.gurney_velocity() == 2405.0


@pytest.mark.parametrize("ratio", tubes.REFERENCE["charge_ratios"])
def test_the_tubes_have_the_mass_ratio_asked_for(ratio):
    from tomllib import loads

    from fragfield.case.conversion.stages import burst_rounds
    from fragfield.case.load import case_from_document

    text = changed_case(ROOT / tubes.REFERENCE["case"], tube_of(ratio))
    (item,) = burst_rounds(case_from_document(loads(text), source="tube", folder=ROOT))
    volumes = item.profile.volumes()
    found = volumes.charge * item.explosive.density / (volumes.casing * item.casing.density)
    assert found == pytest.approx(ratio, rel=1e-9)


def _tube(share):
    """Speeds over Gurney's at C/M = 0.25: `share` in the middle, half of it at the ends."""
    place = (np.arange(20) + 0.5) / 20
    middle = (place > 0.2) & (place < 0.8)
    speed = tubes.gurney_speed(tubes.gurney_velocity(), 0.25) * np.where(middle, share, 0.5 * share)
    return tubes.Along(place, speed, np.ones(20))


def _burst(complete=2e-4, ratio=0.25):
    return {"acceleration_complete": complete, "charge_mass": ratio, "casing_mass": 1.0}


@pytest.mark.parametrize(("share", "passed"), [(0.96, True), (0.94, False)])
def test_the_middle_of_a_tube_is_held_against_gurney(share, passed):
    rows = {row.quantity: row for row in tubes.check(0.25, _tube(share), _burst())}
    assert rows["C/M 0.25: speed of the middle"].passed is passed
    assert rows["C/M 0.25: speed of the middle"].error == pytest.approx(share - 1.0)
    assert rows["C/M 0.25: whole tube, ends included"].error == pytest.approx(0.8 * share - 1.0)
    assert rows["C/M 0.25: whole tube, ends included"].passed is None


@pytest.mark.parametrize("burst", [_burst(complete=None), _burst(ratio=0.26)])
def test_a_tube_that_still_accelerates_or_has_another_ratio_is_not_compared(burst):
    rows = tubes.check(0.25, _tube(1.0), burst)
    assert len(rows) == 2
    assert [row.passed for row in rows].count(False) == 1


def test_prescribed_fragments_follow_the_tables_law():
    rounds = prescribed(m107.REFERENCE, seed=3, realisations=20)
    mass = np.concatenate([one.mass for one in rounds])
    assert len(mass) / 20 == pytest.approx(1760.0, rel=0.01)
    assert mass.sum() / 20 == pytest.approx(26.4, rel=1e-9)
    heavy = 4 * 7.5e-3  # N(m)/N0 = exp(-2)
    assert (mass > heavy).mean() == pytest.approx(np.exp(-2.0), rel=0.02)
    assert all(np.ptp(one.speed) == 0.0 for one in rounds)


def test_counts_follow_the_law_of_constant_drag_in_whatever_direction():
    """V = v0 exp(-s/L), L = 2 m/(Cd rho A), A = (m/k)^(2/3): who still has 79 J at s, and the lightest of them."""
    reference = copy.deepcopy(m107.REFERENCE)
    reference["flight"]["drag"] = drag = 0.9
    masses = np.geomspace(1e-4, 0.2, 400)
    directions = np.random.default_rng(5).normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    one = flight.Fragments(masses, (0.0, 0.0, 0.0), 1000.0 * directions)
    other = flight.Fragments(masses, (0.0, 0.0, 0.0), 1000.0 * directions[::-1])
    counts = count([one, other], m107.TABLE, reference, threads=1)
    scale = 2.0 * masses ** (1.0 / 3.0) * 2600.0 ** (2.0 / 3.0) / (drag * 1.225)
    for row, distance in enumerate(m107.TABLE.distance):
        speed = 1000.0 * np.exp(-distance / scale)
        hazardous = 0.5 * masses * speed**2 >= 79.0
        assert counts.number[row] == pytest.approx(hazardous.sum(), abs=1e-9)
        assert counts.speed[row] == pytest.approx(speed[hazardous][0], rel=1e-4)
    assert counts.fragments == 400.0
    assert counts.initial_speed == pytest.approx(1000.0)


def _as_the_table(number=1.0, speed=1.0):
    far = np.arange(30.0, 112.0, 2.0)
    places = np.concatenate([m107.TABLE.distance, far])
    of_far = np.interp(far, m107.TABLE.distance, m107.TABLE.number)
    numbers = number * np.concatenate([m107.TABLE.number, of_far])
    return Counts(
        places, numbers, speed * np.interp(places, m107.TABLE.distance, m107.TABLE.speed), 1760.0, 15e-3, 1067.0
    )


def test_the_tables_own_numbers_pass():
    """Among them the distance of 62 to 63 m, which follows from the table's densities."""
    rows = m107.check("table", _as_the_table(), from_burst=True)
    assert all(row.passed is not False for row in rows)
    assert next(row for row in rows if "distance" in row.quantity).ours == pytest.approx(62.5, abs=1.5)
    judged = [row.quantity for row in rows if row.passed is not None]
    assert len([quantity for quantity in judged if "hazardous fragments at" in quantity]) == 7  # 20 to 150 ft
    assert "table: hazardous fragments at 200 ft" not in judged
    assert "table: mean initial speed" in judged


def test_numbers_or_speeds_off_by_more_than_a_tenth_are_missed():
    few = m107.check("few", _as_the_table(number=0.89), from_burst=False)
    missed = [row.quantity for row in few if row.passed is False]
    assert len([quantity for quantity in missed if "hazardous fragments at" in quantity]) == 7
    slow = m107.check("slow", _as_the_table(speed=0.89), from_burst=False)
    assert len([row for row in slow if row.passed is False]) == 7


def test_distances_that_nothing_hazardous_reaches_are_reported_as_none():
    counts = _as_the_table()
    counts.number[0], counts.speed[0] = 0.0, np.nan
    rows = {row.quantity: row for row in m107.check("none", counts, from_burst=False)}
    assert rows["none: hazardous fragments at 20 ft"].ours == 0.0
    assert rows["none: hazardous fragments at 20 ft"].passed is False
    assert "none: speed of the lightest hazardous fragment at 20 ft" not in rows
