"""Zones of the panel test: solid angles, the window of the peak, and the scatter that peaks ask for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.transition.synthetic import Tube, radial
from transition import BreakUp, BreakUpSettings
from validation.polar_zones.base import experiments
from validation.polar_zones.check import NAME, REFERENCE
from validation.polar_zones.zones import deciding_scatter, polar_angles, sample_of, zones_of


def test_directions_all_around_hold_the_solid_angles_of_the_zones():
    count = 400_000
    cosine = (np.arange(count) + 0.5) / count * 2.0 - 1.0  # even over the sphere
    found = zones_of(np.degrees(np.arccos(cosine)), 100, REFERENCE)
    assert found.number == count / 100
    for name, solid in (("side", 3.772), ("base", 0.291), ("nose", 0.291)):  # sr, as the reference states them
        assert getattr(found, name) == pytest.approx(100.0 * solid / (4.0 * math.pi), rel=2e-3)
    assert found.peak == pytest.approx(1.0, rel=1e-3)
    assert found.side + found.base + found.nose + found.between == pytest.approx(100.0)


def test_a_thin_sheet_has_the_peak_of_its_window():
    """All in one window of 5 degrees at 95 degrees: 1 over the window's fraction of the sphere."""
    solid = 0.5 * (math.cos(math.radians(92.5)) - math.cos(math.radians(97.5)))
    assert zones_of(np.full(100, 95.0), 1, REFERENCE).peak == pytest.approx(1.0 / solid, rel=1e-2)


def test_the_scatter_that_fits_both_peaks_is_weighted_by_their_errors():
    scatters = np.arange(3.0, 10.01, 1.0)
    peaks = np.column_stack([40.0 / scatters, 40.0 / scatters])
    exact = deciding_scatter(scatters, peaks, np.array([8.0, 8.0]), np.array([0.5, 0.5]))
    assert exact[0] == pytest.approx(5.0, abs=0.02)  # between the nodes the logarithm is linear
    # One standard error: both peaks off by 0.5 / sqrt(2)
    assert exact[1] == pytest.approx(40.0 / (8.0 + 0.5 / math.sqrt(2.0)), abs=0.05)
    assert exact[2] == pytest.approx(40.0 / (8.0 - 0.5 / math.sqrt(2.0)), abs=0.05)
    near, _, _ = deciding_scatter(scatters, peaks, np.array([8.0, 5.0]), np.array([0.1, 10.0]))
    assert near == pytest.approx(5.0, abs=0.03)


@pytest.fixture(scope="module")
def round_of_tube(tmp_path_factory):
    tube = Tube(around=24, axial=20, velocity=lambda x: radial(x) + np.array([0.0, 0.0, -300.0]))
    return tube.read(tmp_path_factory.mktemp("zones") / "s.h5")


def test_the_limit_of_a_board_gives_the_number_asked_for(round_of_tube):
    settings = BreakUpSettings(mean_mass=2e-3)
    sample = sample_of(round_of_tube, settings, REFERENCE, 3)
    number = 0.5 * sample.energy.shape[1] / 3
    limit = sample.limit(number)
    assert (sample.energy[0] > limit).sum() / 3 == pytest.approx(number, abs=1.0)
    assert (np.diff(sample.energy, axis=0) <= 0.0).all()  # farther away they carry less
    angle, mass = sample.angles(0.0)
    assert mass.shape == sample.energy[0].shape
    assert np.median(angle) == pytest.approx(90.0 + math.degrees(math.atan(0.3)), abs=1.0)


def test_experiments_change_the_base_alone(round_of_tube):
    settings = BreakUpSettings(mean_mass=2e-3, direction_scatter=0.0)
    last = len(round_of_tube.rounds[0].segments) - 1
    usual = BreakUp(round_of_tube, settings).fragments(1938)
    found = dict(experiments(round_of_tube, settings))
    assert list(found) == ["no outward speed", "2 times the pieces", "2 times the pieces and no outward speed"]
    straight = found["no outward speed"].fragments(1938)
    before, after = (part.select(part.segment == last) for part in (usual, straight))
    outward = [np.hypot(part.velocity[:, 0], part.velocity[:, 1]).mean() for part in (before, after)]
    assert outward[1] < 0.75 * outward[0]  # the nodes that the base shares with the wall keep theirs
    np.testing.assert_allclose(
        after.velocity[:, 2], before.velocity[:, 2], rtol=1e-4
    )  # the points' rigid rotation differs
    others = usual.segment != last
    np.testing.assert_array_equal(straight.velocity[straight.segment != last], usual.velocity[others])
    doubled = found["2 times the pieces"].fragments(1938)
    ratio = (doubled.segment == last).sum() / (usual.segment == last).sum()
    assert ratio == pytest.approx(2.0, rel=0.02)
    angle, _ = polar_angles(found["no outward speed"], 1, 0.0)
    assert angle.size == len(straight)


def test_the_default_stands_in_the_reference_of_the_check():
    assert NAME == "polar_zones"
    zones = REFERENCE["zones"]
    # The densities times the solid angles are the percentages of the perforations at 15 ft.
    for name in ("side", "base", "nose"):
        zone = zones[name]
        solid = 2.0 * math.pi * (math.cos(math.radians(zone["from"])) - math.cos(math.radians(zone["to"])))
        share = 100.0 * 100.0 * zone["density"][0] * solid / REFERENCE["boards"]["number"][0]
        assert share == pytest.approx(REFERENCE["percent"][name], abs=0.6)
    spherical = [number / (4.0 * math.pi) / 100.0 for number in REFERENCE["boards"]["number"]]
    for board, ratio in enumerate(REFERENCE["peak"]["over_mean"]):
        assert REFERENCE["peak"]["density"][board] / spherical[board + 1] == pytest.approx(ratio, abs=0.06)
    assert replace(BreakUpSettings()).direction_scatter == pytest.approx(math.radians(6.0), rel=1e-12)
