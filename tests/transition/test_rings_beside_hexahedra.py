"""The M107 from its meridian and from hexahedra, with one analytic velocity field: the same fragments.

Both meshes have 8 mm cells. Every statistic is a mean over realisations; the two are compared by their standard errors,
at 1 % over all statistics together (Bonferroni).
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from burst_fenicsx.geometry import load_profile
from tests.transition.profiles import hexahedral_snapshot, meridian_snapshot
from transition import BreakUp, BreakUpSettings

COUNT = 40
ANGLES = np.arange(60.0, 121.0, 10.0)


def rows(prepared, count):
    """Statistics of each realisation (count, k), with the mean speed less that of the points it was made from."""
    found = []
    for number in range(count):
        result = prepared.realisation(7, number)
        fragments, points = result.fragments, result.points
        speed = np.linalg.norm(fragments.velocity, axis=1)
        of_points = points.mass @ np.linalg.norm(points.velocity, axis=1) / points.mass.sum()
        polar = np.degrees(np.arccos(fragments.velocity[:, 2] / speed))
        share = fragments.mass / fragments.mass.sum()
        found.append(
            [
                share @ speed - of_points, of_points, len(speed), (fragments.mass > 1e-2).sum(),
                *np.quantile(fragments.mass, [0.1, 0.25, 0.5, 0.75, 0.9, 0.99]),
                *np.quantile(speed, [0.1, 0.5, 0.9, 0.99]),
                *(share[polar < angle].sum() for angle in ANGLES),
                *((polar < angle).mean() for angle in ANGLES),
            ]
        )  # fmt: skip
    return np.array(found)


@pytest.fixture(scope="module")
def both():
    profile = load_profile("m107")
    settings = BreakUpSettings(direction_scatter=0.0)
    return tuple(BreakUp(make(profile, 8e-3), settings) for make in (meridian_snapshot, hexahedral_snapshot))


def test_fragments_are_statistically_the_same(both):
    rings, hexahedra = (rows(prepared, COUNT) for prepared in both)
    speed = rings[:, 1].mean(), hexahedra[:, 1].mean()
    assert speed[0] == pytest.approx(speed[1], rel=2e-3)  # the field itself, on cells of 8 mm
    # Those drawn are as many as the laws expect: each segment's are rounded up or down at random.
    numbers = [sum(law.n0 for law in prepared.laws) for prepared in both]
    for found, expected in zip((rings, hexahedra), numbers, strict=True):
        drawn = found[:, 2]
        assert abs(drawn.mean() - expected) < 4.0 * drawn.std(ddof=1) / np.sqrt(COUNT), (drawn.mean(), expected)
        assert np.abs(drawn - expected).max() < len(both[0].laws)
    assert numbers[0] == pytest.approx(numbers[1], rel=5e-3)
    rings, hexahedra = (np.delete(found, [1, 2], axis=1) for found in (rings, hexahedra))
    error = np.sqrt((rings.var(axis=0, ddof=1) + hexahedra.var(axis=0, ddof=1)) / COUNT)
    deviation = (rings.mean(axis=0) - hexahedra.mean(axis=0)) / error
    assert np.abs(deviation).max() < norm.ppf(1.0 - 0.005 / deviation.size), deviation
    # A number of fragments above 10 g that is 1 % off would be found.
    assert error[1] < 0.01 * rings[:, 1].mean() / 3.0


def test_what_is_handed_over_is_the_same(both):
    rings, hexahedra = (prepared.realisation(3).ledger for prepared in both)
    assert rings.casing_mass == pytest.approx(hexahedra.casing_mass, rel=1e-5)
    assert rings.casing_energy == pytest.approx(hexahedra.casing_energy, rel=5e-3)
    assert rings.casing_momentum[2] == pytest.approx(hexahedra.casing_momentum[2], abs=2e-4 * 34.5 * 830.0)
    assert rings.momentum_error < 1e-12
