"""The random deviation of directions: its distribution, what it keeps, and where it cannot keep momentum."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tests.transition.synthetic import Tube, radial
from transition import BreakUp, BreakUpSettings
from transition.motion import deviated, draw_attitude, scattered

DEVIATION = math.radians(7.0)


@pytest.fixture(scope="module")
def generator():
    return np.random.default_rng(5)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_deviations_are_normal_about_both_axes_and_isotropic(generator):
    count = 20_000
    before = unit(generator.standard_normal((count, 3)))
    after = deviated(before, DEVIATION * generator.standard_normal((count, 2)))
    np.testing.assert_allclose(np.linalg.norm(after, axis=1), 1.0, rtol=1e-14)
    angle = np.arccos(np.clip((before * after).sum(axis=1), -1.0, 1.0))
    assert stats.kstest(angle / DEVIATION, "rayleigh").pvalue > 1e-3
    # The turn about the direction, from the plane through the direction and +z
    east = unit(np.cross([0.0, 0.0, 1.0], before))
    turn = np.arctan2((after * np.cross(before, east)).sum(axis=1), (after * east).sum(axis=1))
    assert stats.kstest(turn / (2.0 * math.pi) + 0.5, "uniform").pvalue > 1e-3


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, math.pi / 2.0, 3.0])
@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.0, -0.8)])
def test_a_deviation_is_the_rotation_by_its_angle(direction, angle):
    turned = deviated(np.array([direction]), np.array([[angle * 0.6, angle * 0.8]]))[0]
    assert math.acos(max(-1.0, min(1.0, float(turned @ direction)))) == pytest.approx(angle, abs=2e-8)
    assert np.linalg.norm(turned) == pytest.approx(1.0, rel=1e-15)


def cylinder(generator, count):
    """Masses, and velocities on a cone of 93 degrees about z."""
    cone = math.radians(93.0)
    turn = 2.0 * math.pi * generator.random(count)
    direction = np.column_stack(
        [math.sin(cone) * np.cos(turn), math.sin(cone) * np.sin(turn), np.full(count, math.cos(cone))]
    )
    return 0.01 * generator.exponential(size=count), (900.0 + 200.0 * generator.random((count, 1))) * direction


def test_speeds_and_momentum_stay_and_the_sheet_becomes_as_wide_as_the_deviation(generator):
    mass, velocity = cylinder(generator, 4000)
    after = scattered(mass, velocity, DEVIATION * generator.standard_normal((len(mass), 2)))
    np.testing.assert_allclose(np.linalg.norm(after, axis=1), np.linalg.norm(velocity, axis=1), rtol=1e-14)
    scale = mass @ np.linalg.norm(velocity, axis=1)
    assert np.linalg.norm(mass @ (after - velocity)) < 1e-12 * scale
    elevation = np.arcsin(after[:, 2] / np.linalg.norm(after, axis=1))
    # Of a sheet at rest on the equator the elevation is normal with the deviation about one axis.
    assert elevation.std() == pytest.approx(DEVIATION, rel=4.0 / math.sqrt(2.0 * len(mass)))


def test_pieces_that_fly_one_way_lose_the_cosine_along_it_and_nothing_across(generator):
    mass = np.full(3000, 0.01)
    velocity = np.tile([0.0, 0.0, -600.0], (len(mass), 1))
    after = scattered(mass, velocity, DEVIATION * generator.standard_normal((len(mass), 2)))
    change = (mass @ (after - velocity)) / (mass.sum() * 600.0)
    assert np.abs(change[:2]).max() < 1e-5
    # Mean cosine of a Rayleigh angle: 1 - s^2 + s^4/3 - ... ; here to second order in s^2
    assert change[2] == pytest.approx(DEVIATION**2 - DEVIATION**4 / 3.0, rel=0.08)


def test_one_piece_keeps_its_direction_and_what_rests_stays_at_rest():
    alone = np.array([[300.0, -400.0, 50.0]])
    np.testing.assert_allclose(scattered(np.array([2.0]), alone, np.array([[0.1, -0.2]])), alone, rtol=1e-12)
    still = np.vstack([alone, np.zeros((1, 3)), -alone])
    after = scattered(np.array([1.0, 3.0, 1.0]), still, np.full((3, 2), 0.1))
    assert (after[1] == 0.0).all()
    assert np.linalg.norm(after[0] + after[2]) < 1e-10


def test_without_scatter_the_break_up_is_what_it_was_and_with_it_only_directions_change(tmp_path):
    made = Tube(around=24, axial=20, velocity=lambda x: radial(x) + np.array([0.0, 0.0, -60.0])).read(tmp_path / "s.h5")
    plain, wide = (BreakUp(made, BreakUpSettings(direction_scatter=size)) for size in (0.0, DEVIATION))
    before, after = plain.fragments(3, 2), wide.fragments(3, 2)
    np.testing.assert_array_equal(after.mass, before.mass)
    np.testing.assert_array_equal(after.position, before.position)
    np.testing.assert_allclose(after.speed, before.speed, rtol=1e-13)
    turn = np.degrees(np.arccos(np.clip((unit(after.velocity) * unit(before.velocity)).sum(axis=1), -1.0, 1.0)))
    assert turn.mean() == pytest.approx(7.0 * math.sqrt(math.pi / 2.0), rel=0.1)
    other = wide.fragments(3, 4)
    assert not np.array_equal(other.velocity[: len(after)], after.velocity[: len(other)])
    result = wide.realisation(3, 2)
    np.testing.assert_array_equal(result.fragments.velocity, after.velocity)
    assert result.ledger.momentum_error < 1e-12
    found, without = result.directions[0], plain.realisation(3, 2).directions[0]
    assert np.count_nonzero(found.polar_fragments) > np.count_nonzero(without.polar_fragments) + 3


def test_fragments_of_one_position_are_independent(tmp_path):
    made = Tube(around=24, axial=20, velocity=radial).read(tmp_path / "s.h5")
    settings = BreakUpSettings(direction_scatter=DEVIATION, mean_mass=1e-3)
    plain, wide = BreakUp(made, replace(settings, direction_scatter=0.0)), BreakUp(made, settings)
    before, after = plain.fragments(1), wide.fragments(1)
    lift = unit(after.velocity)[:, 2] - unit(before.velocity)[:, 2]
    order = np.argsort(np.arctan2(before.position[:, 1], before.position[:, 0]))
    near = np.corrcoef(lift[order][:-1], lift[order][1:])[0, 1]
    assert abs(near) < 4.0 / math.sqrt(len(lift))


# --- Random attitudes: the distribution of turns and tilts, and that a realisation's depend on its number alone

TILT = 0.03


def test_tilts_are_normal_about_both_axes_and_independent() -> None:
    tilts = np.array([draw_attitude(7, number, turned=True, tilt=TILT).tilt for number in range(2000)])
    for axis in range(2):
        assert stats.kstest(tilts[:, axis] / TILT, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(tilts.T)[0, 1]) < 4.0 / math.sqrt(len(tilts))
    size = np.hypot(*tilts.T)
    assert abs(np.corrcoef(size[:-1], size[1:])[0, 1]) < 4.0 / math.sqrt(len(tilts))


def test_an_attitude_is_that_of_its_number_alone():
    again = [draw_attitude(7, number, turned=True, tilt=TILT) for number in (6, 3, 6)]
    assert again[0] == again[2]
    assert again[0] != again[1]
    assert draw_attitude(7, 6, turned=True, tilt=2.0 * TILT).tilt == pytest.approx([2.0 * x for x in again[0].tilt])
    assert draw_attitude(8, 6, turned=True, tilt=TILT).tilt != again[0].tilt


def test_the_turn_is_uniform_and_does_not_depend_on_the_tilt():
    turns = np.array([draw_attitude(7, number, turned=True, tilt=0.0).turn for number in range(400)])
    assert stats.kstest(turns / (2.0 * math.pi), "uniform").pvalue > 1e-3
    assert draw_attitude(7, 5, turned=True, tilt=TILT).turn == turns[5]
    still = draw_attitude(7, 5, turned=False, tilt=0.0)
    assert (still.turn, still.tilt, still.tilting) == (None, (0.0, 0.0), None)
