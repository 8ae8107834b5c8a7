"""The published mean masses: how they are read from tables, and that the program's bounds and factor are theirs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from transition.law.mean_mass_data import (
    EXPLOSIVES,
    FACTORS,
    OUTER_DIAMETER,
    STEEL_DENSITY,
    STEEL_YIELD,
    WALL_RATIO,
    outside_data,
)
from transition.law.mott import MottLaw
from validation.m107_1944.check import TABLE
from validation.mean_mass.check import check_laws
from validation.mean_mass.data import REFERENCE, above_a_cut, fit_numbers, fit_shells, from_recovery, measured
from validation.mean_mass.scatter import LAWS, computed, ratios, scatter

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


def test_two_measurements_of_the_75_mm_shell_agree():
    """Pit tests of 1938 and the tables of 1944: 3.5 and 3.7 g."""
    mean = {casing.name: casing.mean for casing in measured() if casing.geometry == "75 mm M48"}
    assert set(mean) == {"75 mm M48", "75 mm M48, pit"}
    assert mean["75 mm M48, pit"] == pytest.approx(mean["75 mm M48"], rel=0.1)


def test_the_m107_is_that_of_the_table_that_came_another_way():
    (shell,) = (one for one in REFERENCE["shell"] if one["name"] == "155 mm M107")
    np.testing.assert_array_equal(shell["number"], TABLE.number)
    assert pytest.approx(1e3 * fit_shells()["155 mm M107"].mean, rel=0.1) == 2e3 * 7.5e-3  # that table's own fit


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


def test_a_geometry_counts_once():
    casings = measured()
    found = ratios("mott", casings)
    own = [computed("mott", casing) / casing.mean for casing in casings if casing.geometry == "cylinder"]
    assert len(own) == 9
    assert found["cylinder"] == pytest.approx(math.prod(own) ** (1.0 / 9.0), rel=1e-12)


def test_all_judging_rows_pass_and_every_casing_has_a_row():
    rows = check_laws()
    assert [row.quantity for row in rows if row.passed is False] == []
    assert sum(row.passed is True for row in rows) == 6
    assert sum(row.quantity.startswith("mott: ") and row.unit == "g" for row in rows) == len(measured())
    assert sum("Composition B over TNT" in row.quantity for row in rows) == len(LAWS)
