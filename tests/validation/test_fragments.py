"""Studies of break-up and flight: published mean masses, panels of the M48, table of the M107, numbers of fragments."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

import flight
from tests.transition.synthetic import Tube, radial
from transition import BreakUp, BreakUpSettings
from transition.law.mean_mass import (
    EXPLOSIVES,
    FACTORS,
    OUTER_DIAMETER,
    STEEL_DENSITY,
    STEEL_YIELD,
    WALL_RATIO,
    outside_data,
)
from transition.law.mott import MottLaw
from validation.m107_1944 import study as m107
from validation.m107_1944.counts import count, falling_through, prescribed
from validation.mean_mass.data import above_a_cut, fit_numbers, from_recovery, measured
from validation.mean_mass.scatter import LAWS, scatter
from validation.paper_3_1.study import number_rows
from validation.polar_zones.zones import deciding_scatter, sample_of, zones_of
from validation.rows import Rows

MU = 5e-3


def pieces(count: int = 400_000) -> np.ndarray:
    """Stratified sample of a Mott law in two dimensions with the scale MU (kg)."""
    return MU * np.log((np.arange(count) + 0.5) / count) ** 2


def test_fit_gives_back_the_law_that_made_the_points():
    mass = np.array([0.3e-3, 1e-3, 5e-3, 20e-3])
    found = fit_numbers(mass, 1800.0 * np.exp(-np.sqrt(mass / MU)))
    assert (found.mean, found.number) == (pytest.approx(2.0 * MU, rel=1e-9), pytest.approx(1800.0, rel=1e-9))
    assert found.rms < 1e-9
    law = MottLaw.from_mean(found.mean, 2)
    assert law.parts[0].mu == pytest.approx(MU, rel=1e-9)


@pytest.mark.parametrize("cut", [1e-5, 6.5e-5, 2e-3])
def test_mean_of_all_pieces_from_that_above_a_cut(cut):
    mass = pieces()
    assert above_a_cut(float(mass[mass > cut].mean()), cut) == pytest.approx(2.0 * MU, rel=3e-3)


@pytest.mark.parametrize("cut", [1e-4, 1e-3])
def test_mean_of_all_pieces_from_what_was_recovered(cut):
    mass = pieces()
    kept = mass[mass > cut]
    assert from_recovery(len(kept), float(kept.sum()), float(mass.sum())) == pytest.approx(2.0 * MU, rel=3e-3)


def test_bounds_of_the_program_are_those_of_the_data():
    casings = measured()
    diameters = [casing.outer_diameter for casing in casings]
    assert (min(diameters), max(diameters)) == pytest.approx(OUTER_DIAMETER, rel=1e-9)
    wall_ratios = [casing.wall / casing.inner_diameter for casing in casings]
    assert WALL_RATIO[0] <= min(wall_ratios) <= 1.2 * WALL_RATIO[0]
    assert WALL_RATIO[1] / 1.2 <= max(wall_ratios) <= WALL_RATIO[1]
    assert {casing.explosive for casing in casings} == set(EXPLOSIVES)
    assert all(STEEL_DENSITY[0] <= casing.density <= STEEL_DENSITY[1] for casing in casings)
    for casing in casings:
        ratio = 1600.0 * casing.inner_diameter**2 / (7850.0 * (casing.outer_diameter**2 - casing.inner_diameter**2))
        metal, filling = (casing.density, STEEL_YIELD[0]), (casing.explosive, 1600.0)
        assert not list(outside_data(casing.outer_diameter, ratio, metal, filling))


@pytest.mark.parametrize("law", LAWS)
def test_stated_factor_is_that_of_the_law(law):
    found = scatter(law, measured())
    assert found.geometries == 14
    assert found.factor <= FACTORS[law] < 1.1 * found.factor
    bias, deviation = math.log(found.bias), math.log(found.deviation)
    whole = math.hypot(bias, deviation * math.sqrt(1.0 - 1.0 / found.geometries))
    assert found.factor == pytest.approx(math.exp(whole), rel=1e-9)


# --- panels of the 75 mm M48 ------------------------------------------------------------------------------------------


def test_directions_all_around_hold_the_solid_angles_of_the_zones():
    count = 400_000
    cosine = (np.arange(count) + 0.5) / count * 2.0 - 1.0  # even over the sphere
    found = zones_of(np.degrees(np.arccos(cosine)), 100)
    assert found.number == count / 100
    for name, solid in (("side", 3.772), ("base", 0.291), ("nose", 0.291)):  # sr, as the reference states them
        assert getattr(found, name) == pytest.approx(100.0 * solid / (4.0 * math.pi), rel=2e-3)
    assert found.peak == pytest.approx(1.0, rel=1e-3)
    assert found.side + found.base + found.nose + found.between == pytest.approx(100.0)


def test_a_thin_sheet_has_the_peak_of_its_window():
    """All in one window of 5 degrees at 95 degrees: 1 over the window's fraction of the sphere."""
    solid = 0.5 * (math.cos(math.radians(92.5)) - math.cos(math.radians(97.5)))
    assert zones_of(np.full(100, 95.0), 1).peak == pytest.approx(1.0 / solid, rel=1e-2)


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
    sample = sample_of(round_of_tube, settings, 3)
    number = 0.5 * sample.energy.shape[1] / 3
    limit = sample.limit(number)
    assert (sample.energy[0] > limit).sum() / 3 == pytest.approx(number, abs=1.0)
    assert (np.diff(sample.energy, axis=0) <= 0.0).all()  # farther away they carry less
    angle, mass = sample.angles(0.0)
    assert mass.shape == sample.energy[0].shape
    assert np.median(angle) == pytest.approx(90.0 + math.degrees(math.atan(0.3)), abs=1.0)


# --- M107 of 1944 -----------------------------------------------------------------------------------------------------


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


def test_a_density_falls_through_the_limit_for_the_last_time():
    place = np.array([5.0, 15.0, 25.0, 35.0])
    for density, distance in (
        ([9.0, 4.0, 2.0, 0.0], 20.0),
        ([9.0, 1.0, 4.0, 2.0], 30.0),  # the farthest counts
        ([9.0, 9.0, 9.0, 9.0], 35.0),
        ([0.0, 0.0, 0.0, 0.0], 0.0),
    ):
        assert falling_through(place, np.array(density), 3.0) == pytest.approx(distance)
    # N / (4 pi r^2): the exact distance within the step squared
    middle, limit = np.arange(0.5, 100.0), 1.0 / 55.7
    exact = math.sqrt(900.0 / (4.0 * math.pi * limit))
    assert falling_through(middle, 900.0 / (4.0 * np.pi * middle**2), limit) == pytest.approx(exact, rel=1e-4)


# --- numbers of fragments ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    return BreakUp(Tube().read(tmp_path_factory.mktemp("burst") / "s.h5"), BreakUpSettings(mean_mass=5e-3))


def test_the_sampler_hands_over_mass_and_number_of_the_law(prepared):
    rows = Rows("paper_3_1")
    number_rows(rows, prepared)
    assert [row.passed for row in rows[:2]] == [True, True]
    assert rows[2].error == pytest.approx(0.0, abs=0.1)


def test_a_sampler_that_leaves_the_law_fails(prepared, monkeypatch):
    def heavier(self, *arguments):
        drawn = [one.select(one.mass > 0.0) for one in many(self, *arguments)]
        for one in drawn:
            one.mass[: one.mass.size // 20] *= 3.0
        return drawn

    many = BreakUp.many
    monkeypatch.setattr(BreakUp, "many", heavier)
    rows = Rows("paper_3_1")
    number_rows(rows, prepared)
    assert [row.passed for row in rows][::2] == [False, False]
