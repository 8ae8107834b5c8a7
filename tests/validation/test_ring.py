"""Hits of an ensemble on the ring of Section 3.2: sums by a law known beforehand, and realisations flown together."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flight
from tests.transition.synthetic import Tube
from transition import BreakUp, BreakUpSettings
from validation.paper_3_2.ring import AT_ONCE, HITS, RADIUS, Ring, mean_of, ratio_of_means, ring_of

LOBE, SHARE, REALISATIONS, NUMBER = 20.0, 2.5, 60, 900
EVERYWHERE = (0.0, 90.0)


@pytest.fixture(scope="module")
def ring():
    """Hits SHARE times as dense within LOBE degrees of 90 and 270, twice as heavy and a half faster than elsewhere."""
    generator = np.random.default_rng(5)
    hits = np.zeros(REALISATIONS * NUMBER, dtype=HITS)
    hits["realisation"] = np.repeat(np.arange(REALISATIONS), NUMBER)
    inside = generator.random(len(hits)) < SHARE * LOBE / (SHARE * LOBE + 90.0 - LOBE)
    away = np.where(inside, generator.uniform(0.0, LOBE, len(hits)), generator.uniform(LOBE, 90.0, len(hits)))
    side, focus = generator.choice([-1.0, 1.0], len(hits)), generator.choice([90.0, 270.0], len(hits))
    hits["azimuth"] = focus + side * away
    hits["mass"] = np.where(inside, 0.02, 0.01)
    hits["initial_speed"] = np.where(inside, 1500.0, 1000.0) * generator.uniform(0.9, 1.1, len(hits))
    return Ring(np.full(REALISATIONS, NUMBER), hits)


def within(estimate, value):
    return abs(estimate.value - value) < 4.0 * estimate.error


def test_numbers_masses_and_speeds_are_those_of_the_law(ring):
    lobe, rest = (0.0, LOBE), (LOBE, 90.0)
    density = NUMBER / 4.0 / (SHARE * LOBE + 90.0 - LOBE)  # of a degree outside of the lobes
    assert within(mean_of(ring.per_degree(rest)), density)
    assert within(mean_of(ring.per_degree(lobe)), SHARE * density)
    assert within(mean_of(ring.per_degree((5.0, 10.0))), SHARE * density)
    assert ring.per_degree(EVERYWHERE) == pytest.approx(np.full(REALISATIONS, NUMBER / 360.0), rel=1e-12)
    assert ring.per_degree(lobe, "mass") == pytest.approx(0.02 * ring.per_degree(lobe), rel=1e-12)
    assert within(mean_of(ring.mean_speed(lobe)), 1500.0)
    assert within(mean_of(ring.mean_speed(rest)), 1000.0)
    assert ring.fast_speed(rest, 1.0).max() == ring.hits["initial_speed"][ring.hits["mass"] == 0.01].max()
    assert mean_of(ring.fast_speed(rest, 0.99)).value == pytest.approx(1098.0, abs=2.0)


def test_the_ratio_of_values_that_depend_on_each_other_has_the_error_of_both(ring):
    """What is in the lobes is not outside: the errors add up, and many ensembles scatter as the error says."""
    found = ratio_of_means(ring.per_degree((0.0, LOBE)), ring.per_degree((LOBE, 90.0)))
    assert within(found, SHARE)
    share = SHARE * LOBE / (SHARE * LOBE + 90.0 - LOBE)
    inside = np.random.default_rng(6).binomial(NUMBER, share, (4000, REALISATIONS)).mean(axis=1)
    trials = (inside / LOBE) / ((NUMBER - inside) / (90.0 - LOBE))
    assert found.error == pytest.approx(trials.std(), rel=4.0 / math.sqrt(2.0 * REALISATIONS))
    same = ratio_of_means(ring.per_degree(EVERYWHERE), 2.0 * ring.per_degree(EVERYWHERE))
    assert (same.value, same.error) == (pytest.approx(0.5), pytest.approx(0.0, abs=1e-15))


def test_every_realisation_is_flown_as_by_itself_whatever_the_threads(tmp_path):
    snapshot = Tube(around=24, axial=12).read(tmp_path / "s.h5")
    settings, air = BreakUpSettings(mean_mass=0.05), {"air": 1.069}
    count = AT_ONCE + 2
    one, two = (ring_of(snapshot, settings, air, seed=4, realisations=count, threads=n) for n in (1, 2))
    assert np.array_equal(one.fragments, two.fragments)
    assert one.hits.tobytes() == two.hits.tobytes()
    prepared, surface = BreakUp(snapshot, settings), flight.Cylinder(RADIUS, name="ring")
    for number in range(count):
        fragments = prepared.fragments(4, number)
        domain = flight.Domain(radius=1.1 * RADIUS, floor=-1000.0)
        alone = flight.fly(fragments, **air, ground=None, witnesses=[surface], domain=domain).hits
        assert one.fragments[number] == len(fragments)
        mine = one.hits[one.hits["realisation"] == number]
        assert len(mine) == len(alone) > 100
        for name in ("mass", "azimuth", "initial_speed"):
            assert np.sort(mine[name]) == pytest.approx(np.sort(alone[name]), rel=1e-12), name
