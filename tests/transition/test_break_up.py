"""The break-up as a whole: what is handed over, from which random stream, turned and tilted."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from tests.transition.synthetic import Tube, radial
from transition import BreakUp, BreakUpSettings, InputError, break_up, realisations

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
    clusters = result.clusters
    momentum = clusters.piece[:, None] * cell_velocity[result.points.cell[clusters.point]]
    return np.add.reduceat(momentum, clusters.offset[:-1]) / clusters.mass[:, None]


def test_energy_is_lost_by_averaging_only(snapshot):
    result = break_up(snapshot, seed=3)
    energy = 0.5 * lumped(snapshot) @ (snapshot.velocity**2).sum(axis=1)
    assert result.ledger.casing_energy == pytest.approx(energy, rel=1e-12)
    assert result.ledger.cell_energy < result.ledger.casing_energy
    assert result.summary["energy_lost"] == pytest.approx(energy - result.fragments.kinetic_energy, rel=1e-9)
    assert -0.06 < result.summary["energy_error"] < -0.001
    fine = break_up(snapshot, BreakUpSettings(mean_mass=2e-4), seed=3)
    assert result.summary["energy_error"] < 2.0 * fine.summary["energy_error"] < 0.0
    for found in (result, fine):  # the velocity's change inside the cells is kept, so less is lost than without
        flat = one_velocity_a_cell(found, snapshot)
        flat_energy = 0.5 * float(found.fragments.mass @ (flat**2).sum(axis=1))
        assert flat_energy < found.ledger.energy < energy
    assert fine.ledger.energy > fine.ledger.cell_energy  # far smaller than a cell: better than rigid cells


def test_casing_that_moves_as_one_keeps_its_energy(tmp_path):
    moving = Tube(around=12, axial=10, velocity=lambda x: np.tile([30.0, -40.0, 120.0], (len(x), 1)))
    result = break_up(moving.read(tmp_path / "s.h5"))
    assert abs(result.summary["energy_error"]) < 1e-12
    np.testing.assert_allclose(result.fragments.speed, 130.0, rtol=1e-12)


def test_every_cells_mass_is_given_once_to_fragments_of_its_own_segment(pair):
    result = break_up(pair, seed=1)
    clusters, cell = result.clusters, result.points.cell[result.clusters.point]
    given = np.bincount(cell, clusters.piece, minlength=pair.casing.size)
    np.testing.assert_allclose(given, pair.mass[pair.casing], rtol=1e-12)
    np.testing.assert_allclose(np.bincount(clusters.point, clusters.piece), result.points.mass, rtol=1e-12)
    owner = np.repeat(np.arange(len(result.fragments)), np.diff(clusters.offset))
    assert (result.fragments.round[owner] == pair.round[pair.casing][cell]).all()
    assert (result.fragments.segment[owner] == pair.segment[pair.casing][cell]).all()
    assert (result.points.round == pair.round[pair.casing][result.points.cell]).all()
    assert (result.points.segment == pair.segment[pair.casing][result.points.cell]).all()


def test_fragments_above_the_lightest_that_matters_span_eight_points(snapshot):
    result = break_up(snapshot, seed=2)
    pieces = np.diff(result.clusters.offset)
    for number, (segment, law) in enumerate(zip(result.segments, BreakUp(snapshot).laws, strict=True)):
        mine = result.fragments.segment == number
        assert float(law.law.mass_fraction_above(segment.resolved)) > 0.979
        matter = mine & (result.fragments.mass >= segment.resolved)
        assert pieces[matter].min() >= 8
        assert result.fragments.mass[matter].sum() > 0.96 * result.fragments.mass[mine].sum()


def test_a_turn_moves_all_fragments_together_about_the_rounds_axis(tmp_path):
    tilt = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]])
    made = Tube(around=24, axial=20, rotation=tilt, velocity=lambda x: radial(x) + np.array([0.0, 90.0, 0.0])).read(
        tmp_path / "s.h5"
    )
    data = replace(made.rounds[0], axis=tuple(tilt[:, 2]), position=(0.0, 0.0, 0.0))
    made = replace(made, rounds=(data,))
    prepared, turned = (BreakUp(made, replace(ALONG_THE_FIELD, random_roll=turn)) for turn in (False, True))
    angles = []
    for number in range(40):
        still, moved = prepared.fragments(4, number), turned.fragments(4, number)
        np.testing.assert_array_equal(moved.mass, still.mass)
        local, after = still.velocity @ tilt, moved.velocity @ tilt
        np.testing.assert_allclose(after[:, 2], local[:, 2], atol=1e-9)
        change = (after[:, 0] + 1j * after[:, 1]) / (local[:, 0] + 1j * local[:, 1])
        np.testing.assert_allclose(change, change[0], atol=1e-10)
        place, to = still.position @ tilt, moved.position @ tilt
        np.testing.assert_allclose((to[:, 0] + 1j * to[:, 1]), change[0] * (place[:, 0] + 1j * place[:, 1]), atol=1e-12)
        angles.append(np.angle(change[0]))
    # each realisation its own angle, all alike: the mean of 40 unit vectors is longer than 0.34 once in 100 times
    assert np.unique(np.round(angles, 6)).size == 40
    assert abs(np.exp(1j * np.array(angles)).mean()) < 0.34
    whole = turned.realisation(4, 3)
    assert whole.attitude.turn == pytest.approx(angles[3] % (2.0 * np.pi), abs=1e-9)
    assert whole.summary["turn"] == whole.attitude.turn
    assert whole.ledger.momentum_error < 1e-12
    still = prepared.realisation(4, 3)
    assert still.attitude.turn is None
    # held against the casing turned as well: sectors of 5 degrees are cut elsewhere, no more
    before, after = (dict(found.directions)[0] for found in (still, whole))
    assert abs(after.azimuth_difference - before.azimuth_difference) < 0.02
    assert np.abs(after.azimuth_cells - before.azimuth_cells).max() > 1e-3


def test_several_rounds_are_never_turned(pair):
    asked, plain = BreakUp(pair, BreakUpSettings(random_roll=True)).realisation(2), BreakUp(pair).realisation(2)
    assert asked.attitude.turn is None
    np.testing.assert_array_equal(asked.fragments.velocity, plain.fragments.velocity)


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
    result = break_up(snapshot, BreakUpSettings(mean_mass=1e-3), seed=1)
    found = dict(result.directions)[0]
    assert found.polar_cells.sum() == pytest.approx(1.0)
    assert found.azimuth_fragments.sum() == pytest.approx(1.0)
    # 48 columns of 4 samples on 72 bins: two or three of 192 in each, where the columns alone leave bins empty
    assert found.azimuth_cells == pytest.approx(1.0 / 72.0, rel=0.34)
    reported = result.summary["rounds"][0]["directions"]
    assert reported["polar_fragments"] == found.polar_fragments.tolist()
    assert reported["azimuth_cells"] == found.azimuth_cells.tolist()
    assert found.polar_difference < 0.03
    assert found.azimuth_difference < 0.05
    # a wall that flies outwards and up to 100 m/s along the axis: within 6 degrees of the equator
    assert found.polar_cells[(np.abs(found.polar - 90.0) < 10.0)].sum() == pytest.approx(1.0)


def test_same_seed_same_fragments_and_order_does_not_matter(pair):
    settings = BreakUpSettings()
    ensemble = list(realisations(pair, settings, seed=7, count=3))
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
    names = {"name", "kind", "mean_mass", "mu", "n0", "fragments", "mass", "mass_deficit", "v0"}
    segments = summary["rounds"][0]["segments"]
    assert all(names <= set(segment) for segment in segments)
    assert sum(segment["fragments"] for segment in segments) == summary["fragments"] == len(result.fragments)
    assert summary["rounds"][0]["name"] == "round 0"
    assert (result.fragments.shape_factor == 2600.0).all()


@pytest.mark.parametrize("seed", [-1, 0.5, "one"])
def test_seed_refused(snapshot, seed):
    with pytest.raises(InputError, match=r"break_up seed: found .*; a whole number from 0 upwards is needed"):
        break_up(snapshot, seed=seed)


def test_empty_ensemble_refused(snapshot):
    with pytest.raises(InputError, match="realisations: found 0; at least 1"):
        list(realisations(snapshot, count=0))


@pytest.mark.parametrize("turned", [True, False])
def test_a_tilt_is_a_rotation_of_everything_about_the_centre_of_the_base(tmp_path, turned):
    made = Tube(around=12, axial=10).read(tmp_path / "s.h5")
    deviation = np.radians(2.0)
    few = BreakUpSettings(mean_mass=0.05, random_roll=turned)  # fragments enough to show a rotation
    plain, tilted = BreakUp(made, few), BreakUp(made, replace(few, tilt=deviation))
    base = np.array(made.rounds[0].position)
    tilts = []
    for number in range(200):
        before, after = plain.fragments(4, number), tilted.fragments(4, number)
        np.testing.assert_array_equal(after.mass, before.mass)
        matrix, *_ = np.linalg.lstsq(before.velocity, after.velocity, rcond=None)
        np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-9)
        np.testing.assert_allclose(after.position - base, (before.position - base) @ matrix, atol=1e-12)
        # a rotation about a horizontal axis: its antisymmetric part has no component along z
        assert abs(matrix[0, 1] - matrix[1, 0]) < 1e-9
        size = np.arccos(np.clip(matrix[2, 2], -1.0, 1.0))
        axis = np.array([matrix[1, 2] - matrix[2, 1], matrix[2, 0] - matrix[0, 2]])
        tilts.append(size * axis / np.linalg.norm(axis))
    # normal about each horizontal axis: bounds that one in a thousand ensembles of 200 passes
    assert np.abs(np.mean(tilts, axis=0)).max() < 3.3 * deviation / np.sqrt(200)
    np.testing.assert_allclose(np.std(tilts, axis=0), deviation, rtol=3.3 / np.sqrt(400))


def test_a_tilt_loses_nothing_and_is_reported(tmp_path):
    made = Tube(around=24, axial=20).read(tmp_path / "s.h5")
    result = BreakUp(made, BreakUpSettings(random_roll=True, tilt=0.1, direction_scatter=0.0)).realisation(4, 3)
    upright = BreakUp(made, BreakUpSettings(random_roll=True, direction_scatter=0.0)).realisation(4, 3)
    assert result.ledger.momentum_error < 1e-12
    assert result.attitude.turn == upright.attitude.turn
    assert upright.attitude.tilt == (0.0, 0.0)
    assert result.summary["tilt"] == list(result.attitude.tilt)
    assert np.hypot(*result.attitude.tilt) > 0.0
    assert result.summary["tilt_deviation"] == 0.1
    # directions are those about the round's own axis
    one, other = (dict(found.directions)[0] for found in (result, upright))
    np.testing.assert_allclose(one.polar_fragments, other.polar_fragments, atol=1e-9)
    assert one.polar_difference == pytest.approx(other.polar_difference, abs=1e-9)


def test_images_are_tilted_with_the_rounds_they_mirror(pair):
    plain, tilted = (BreakUp(pair, BreakUpSettings(tilt=tilt)).fragments(2) for tilt in (0.0, 0.05))
    matrix, *_ = np.linalg.lstsq(plain.velocity, tilted.velocity, rcond=None)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(tilted.velocity, plain.velocity @ matrix, atol=1e-8)
    apart = plain.position - plain.position[0]
    np.testing.assert_allclose(tilted.position - tilted.position[0], apart @ matrix, atol=1e-10)
