"""The break-up as a whole: what is handed over, from which random stream, turned and tilted."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.transition.synthetic import Tube, azimuth_difference, joined, polar_difference, radial
from transition import BreakUp, BreakUpSettings, InputError, break_up
from transition.motion import draw_attitude
from transition.points import POINTS_PER_FRAGMENT

ALONG_THE_FIELD = BreakUpSettings(direction_scatter=0.0)


def lumped(snapshot):
    """Casing mass at the nodes, assembled as the burst stage does."""
    mass = np.zeros(len(snapshot.position))
    for corner in range(8):
        np.add.at(mass, snapshot.cells[snapshot.casing, corner], snapshot.mass[snapshot.casing] / 8.0)
    return mass


def test_mass_and_momentum_are_those_of_the_lumped_casing(pair):
    result = break_up(pair, ALONG_THE_FIELD, seed=3)
    mass = lumped(pair)
    assert result.fragments.total_mass == pytest.approx(mass.sum(), rel=1e-12)
    scale = mass @ np.linalg.norm(pair.velocity, axis=1)
    assert np.linalg.norm(result.fragments.momentum - mass @ pair.velocity) < 1e-12 * scale
    assert abs(result.summary["mass_error"]) < 1e-12
    assert result.summary["momentum_error"] < 1e-12


def one_velocity_a_cell(result, snapshot):
    """What the fragments would get if all points of a cell moved as its mean."""
    cell_velocity = snapshot.velocity[snapshot.cells[snapshot.casing]].mean(axis=1)
    points, clusters = joined(result)
    momentum = np.zeros((clusters.mass.size, 3))
    np.add.at(momentum, clusters.fragment, clusters.piece[:, None] * cell_velocity[points.cell[clusters.point]])
    return momentum / clusters.mass[:, None]


def test_energy_is_lost_by_averaging_only(snapshot):
    result = break_up(snapshot, seed=3)
    energy = 0.5 * lumped(snapshot) @ (snapshot.velocity**2).sum(axis=1)
    assert result.ledger.casing_energy == pytest.approx(energy, rel=1e-12)
    assert result.ledger.energy == pytest.approx(result.fragments.kinetic_energy, rel=1e-9)
    assert -0.06 < result.summary["energy_error"] < -0.001
    fine = break_up(snapshot, BreakUpSettings(mean_mass=2e-4), seed=3)
    assert result.summary["energy_error"] < 2.0 * fine.summary["energy_error"] < 0.0
    for found in (result, fine):  # the velocity's change inside the cells is kept, so less is lost than without
        flat = one_velocity_a_cell(found, snapshot)
        flat_energy = 0.5 * float(found.fragments.mass @ (flat**2).sum(axis=1))
        assert flat_energy < found.ledger.energy < energy
    cell_velocity = snapshot.velocity[snapshot.cells[snapshot.casing]].mean(axis=1)
    rigid = 0.5 * float(snapshot.mass[snapshot.casing] @ (cell_velocity**2).sum(axis=1))
    assert fine.ledger.energy > rigid  # far smaller than a cell: better than rigid cells


def test_casing_that_moves_as_one_keeps_its_energy(tmp_path):
    moving = Tube(around=12, axial=10, velocity=lambda x: np.tile([30.0, -40.0, 120.0], (len(x), 1)))
    result = break_up(moving.read(tmp_path / "s.h5"))
    assert abs(result.summary["energy_error"]) < 1e-12
    np.testing.assert_allclose(result.fragments.speed, 130.0, rtol=1e-12)


def test_every_cells_mass_is_given_once_to_fragments_of_its_own_segment(pair):
    result = break_up(pair, seed=1)
    points, clusters = joined(result)
    cell = points.cell[clusters.point]
    given = np.bincount(cell, clusters.piece, minlength=pair.casing.size)
    np.testing.assert_allclose(given, pair.mass[pair.casing], rtol=1e-12)
    np.testing.assert_allclose(np.bincount(clusters.point, clusters.piece), points.mass, rtol=1e-9)
    owner = clusters.fragment
    assert (result.fragments.round[owner] == pair.round[pair.casing][cell]).all()
    assert (result.fragments.segment[owner] == pair.segment[pair.casing][cell]).all()


def test_fragments_above_the_lightest_that_matters_span_eight_points(snapshot):
    result = break_up(snapshot, seed=2)
    points, clusters = joined(result)
    pieces = np.bincount(clusters.fragment)
    segment = snapshot.segment[snapshot.casing][points.cell]
    for number, law in enumerate(BreakUp(snapshot).laws):
        mine = result.fragments.segment == number
        resolved = POINTS_PER_FRAGMENT * points.mass[segment == number].max()
        assert float(law.law.mass_fraction_above(resolved)) > 0.979
        matter = mine & (result.fragments.mass >= resolved)
        assert pieces[matter].min() >= 8
        assert result.fragments.mass[matter].sum() > 0.96 * result.fragments.mass[mine].sum()


def test_threads_give_the_same_fragments_bit_by_bit(snapshot):
    prepared = BreakUp(snapshot)
    alone, four = prepared.many(5, range(6), threads=1), prepared.many(5, range(6), threads=4)
    for one, other in zip(alone, four, strict=True):
        for name in ("mass", "position", "velocity"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_many_realisations_are_drawn_on_as_many_threads_as_asked_for(snapshot, monkeypatch):
    """Three that wait for each other get through on three threads."""
    together = threading.Barrier(3, timeout=30.0)
    monkeypatch.setattr(BreakUp, "fragments", lambda self, seed, number: (together.wait(), seed, number)[1:])
    assert BreakUp(snapshot).many(7, [4, 2, 9], threads=3) == [(7, 4), (7, 2), (7, 9)]


def test_fragments_lie_on_the_casing_and_fly_as_it_does_there(snapshot):
    result = break_up(snapshot, replace(ALONG_THE_FIELD, mean_mass=1e-3), seed=1)
    fragments = result.fragments
    light = fragments.mass < 1e-3
    assert light.sum() > 0.6 * len(fragments)
    radius = np.linalg.norm(fragments.position[light, :2], axis=1)
    assert radius.min() > 1.9 * 0.0595 * 0.98
    assert radius.max() < 1.9 * 0.0775
    outwards = np.einsum("ij,ij->i", fragments.position[light, :2], fragments.velocity[light, :2]) / radius
    np.testing.assert_allclose(outwards, 1000.0, rtol=0.02)


def test_directions_are_those_of_the_cells(snapshot):
    result = break_up(snapshot, replace(ALONG_THE_FIELD, mean_mass=1e-3), seed=1)
    found = result.directions[0]
    assert found.polar_cells.sum() == pytest.approx(1.0)
    assert found.azimuth_fragments.sum() == pytest.approx(1.0)
    # 48 columns of 4 samples on 72 bins: two or three of 192 in each, where the columns alone leave bins empty
    assert found.azimuth_cells == pytest.approx(1.0 / 72.0, rel=0.34)
    reported = result.summary["rounds"][0]["directions"]
    assert reported["polar_fragments"] == found.polar_fragments.tolist()
    assert reported["azimuth_cells"] == found.azimuth_cells.tolist()
    assert polar_difference(found) < 0.03
    assert azimuth_difference(found) < 0.05
    # a wall that flies outwards and up to 100 m/s along the axis: within 6 degrees of the equator
    assert found.polar_cells[(np.abs(found.polar_deg - 90.0) < 10.0)].sum() == pytest.approx(1.0)


def test_same_seed_same_fragments_and_order_does_not_matter(pair):
    settings = BreakUpSettings()
    ensemble = [break_up(pair, settings, seed=7, realisation=number) for number in range(3)]
    last_first = BreakUp(pair, settings)
    for number in (2, 0, 1):
        again = last_first.realisation(7, number).fragments
        np.testing.assert_array_equal(again.mass, ensemble[number].fragments.mass)
        np.testing.assert_array_equal(again.velocity, ensemble[number].fragments.velocity)
        np.testing.assert_array_equal(again.position, ensemble[number].fragments.position)
    assert not np.array_equal(ensemble[0].fragments.mass[:20], ensemble[1].fragments.mass[:20])
    other = break_up(pair, settings, seed=8).fragments
    assert not np.array_equal(ensemble[0].fragments.mass[:20], other.mass[:20])


def test_one_rounds_randomness_does_not_depend_on_the_others(pair):
    """Another law for round 1 leaves round 0 as it is; the two rounds, though alike, break differently."""
    cut = BreakUpSettings(segments={"round 1": (0.1,)})
    first, second = break_up(pair, seed=5).fragments, break_up(pair, cut, seed=5).fragments
    np.testing.assert_array_equal(first.mass[first.round == 0], second.mass[second.round == 0])
    left, right = first.mass[first.round == 0], first.mass[first.round == 1]
    assert not np.isin(left, right).any()


def test_summary_holds_the_names_of_the_contract(snapshot):
    result = break_up(snapshot, BreakUpSettings(dimension="mixed"), seed=2)
    summary = result.summary
    assert {"fragments", "mass", "mass_error", "momentum_error", "energy_error", "rounds"} <= set(summary)
    segments = summary["rounds"][0]["segments"]
    assert all({"name", "mean_mass", "mu", "n0", "fragments", "mass"} <= set(segment) for segment in segments)
    assert sum(segment["fragments"] for segment in segments) == summary["fragments"] == len(result.fragments)
    assert summary["rounds"][0]["name"] == "round 0"
    assert (result.fragments.shape_factor == 2600.0).all()


@pytest.mark.parametrize("seed", [-1, 0.5, "one"])
def test_seed_refused(snapshot, seed):
    with pytest.raises(InputError, match=r"break_up seed: found .*; a whole number from 0 upwards is needed"):
        break_up(snapshot, seed=seed)


@pytest.mark.parametrize("tilt", [0.0, 0.05])
@pytest.mark.parametrize("rounds", [1, 2])
def test_a_realisation_is_turned_about_its_axis_and_tilted_about_its_foot(tmp_path, rounds, tilt):
    """As its attitude says, beside scipy's rotations; nothing is lost, directions count from the round's own axis.

    Several rounds are tilted about the mean of their feet, and never turned.
    """
    axis, places = np.array([0.6, 0.0, 0.8]), ((0.3, -0.2, 0.1), (0.3, 0.4, 0.1))[:rounds]
    lean = Rotation.from_rotvec([0.0, np.arccos(0.8), 0.0]).as_matrix()
    made = Tube(
        around=12, axial=10, places=places, rotation=lean, velocity=lambda x: radial(x) + np.array([0.0, 300.0, 0.0])
    ).read(tmp_path / "s.h5")
    made = replace(made, rounds=tuple(replace(data, axis=tuple(axis)) for data in made.rounds))
    few = replace(ALONG_THE_FIELD, mean_mass=0.02)
    still, moved = BreakUp(made, few), BreakUp(made, replace(few, random_roll=True, tilt=tilt))
    for number in range(3):
        attitude = draw_attitude(4, number, turned=rounds == 1, tilt=tilt)
        motion = Rotation.from_rotvec([*attitude.tilt, 0.0]) * Rotation.from_rotvec((attitude.turn or 0.0) * axis)
        before, after = still.fragments(4, number), moved.fragments(4, number)
        np.testing.assert_array_equal(after.mass, before.mass)
        np.testing.assert_allclose(after.velocity, motion.apply(before.velocity), rtol=0.0, atol=1e-9)
        foot = np.mean(places, axis=0)
        np.testing.assert_allclose(after.position, foot + motion.apply(before.position - foot), rtol=0.0, atol=1e-12)
    plain, whole = still.realisation(4, 2), moved.realisation(4, 2)
    np.testing.assert_array_equal(whole.fragments.velocity, after.velocity)
    assert whole.summary["tilt_deviation"] == tilt
    assert whole.ledger.momentum_error < 1e-12
    for one, other in zip(plain.directions.values(), whole.directions.values(), strict=True):
        np.testing.assert_allclose(other.polar_fragments, one.polar_fragments, atol=1e-9)
        assert polar_difference(other) == pytest.approx(polar_difference(one), abs=1e-9)
        # A turn takes pieces over the two bounds of sectors that the largest difference lies between.
        piece = float(whole.fragments.mass.max()) / whole.ledger.casing_mass * rounds
        assert azimuth_difference(other) == pytest.approx(azimuth_difference(one), abs=2.0 * piece)
