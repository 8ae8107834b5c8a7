"""The bounds of a building's hits against direct counting over 10,000 realisations."""

from __future__ import annotations

import numpy as np
import pytest

import flight
from flight.hazard.exposed import Prism, count_exposed, surfaces_of
from fragfield.hazard.exposed import share_bound, sum_bound

REALISATIONS, BLOCK, NUMBER = 10_000, 100, 60


@pytest.fixture(scope="module")
def counts() -> np.ndarray:
    """Counts of a building 60 m away in 10,000 bursts of 60 natural fragments (Mott masses, a band about level)."""
    prism = Prism(np.array([[56.0, -6.0], [66.0, -6.0], [66.0, 6.0], [56.0, 6.0]]), -1.0, 5.0, height=5.0)
    found = np.zeros(REALISATIONS, dtype=[(name, "f8") for name in ("hits", "fluence", "fluence_squares")])
    generator = np.random.default_rng(11)
    for start in range(0, REALISATIONS, BLOCK):  # many bursts in one flight: they are independent of each other
        number = BLOCK * NUMBER
        mass = 0.02 * generator.exponential(size=number) ** 2
        turn, rise = generator.uniform(0.0, 2.0 * np.pi, number), generator.normal(0.02, 0.1, number)
        way = np.column_stack([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
        fragments = flight.Fragments.from_arrays(mass, (0.0, 0.0, 1.0), 1000.0 * way)
        result = flight.fly(fragments, witnesses=surfaces_of([prism]), sample=0, threads=1)
        burst = result.hits["fragment"] // NUMBER
        for one in range(BLOCK):
            rows = result.hits[burst == one]
            if not len(rows):
                continue
            part = flight.FlightResult(result.landing, rows, result.trajectories, result.witnesses)
            row = count_exposed(part, [prism], 0, fragments.position, np.linalg.norm(fragments.velocity, axis=1))
            for name in found.dtype.names:
                found[name][start + one] = row[name][0]
    return found


@pytest.mark.slow
def test_hits_and_probability_lie_within_the_stated_bounds(counts):
    hits = counts["hits"]
    mean, share = hits.mean(), (hits > 0).mean()
    assert 0.3 < mean < 3.0
    first = hits[:200]
    spread = 200 * first.var(ddof=1)
    assert sum_bound(first.sum(), max(first.sum(), spread), 1.0) / 200 >= mean
    assert share_bound(int((first > 0).sum()), 200) >= share
    assert abs(first.mean() - mean) < 3.0 * first.std(ddof=1) / np.sqrt(200)


@pytest.mark.slow
@pytest.mark.parametrize("size", [20, 50, 200])
def test_coverage_over_all_blocks_is_that_stated(counts, size):
    largest = 1.0 / Prism(
        np.array([[56.0, -6.0], [66.0, -6.0], [66.0, 6.0], [56.0, 6.0]]), -1.0, 5.0, height=5.0
    ).min_shadow  # fmt: skip
    held = {"hits": 0, "share": 0, "fluence": 0}
    blocks = counts.reshape(-1, size)
    for block in blocks:
        total, squares = block["hits"].sum(), size * block["hits"].var(ddof=1)
        held["hits"] += sum_bound(total, max(total, squares), 1.0) / size >= counts["hits"].mean()
        held["share"] += share_bound(int((block["hits"] > 0).sum()), size) >= (counts["hits"] > 0).mean()
        spread = max(block["fluence_squares"].sum(), size * block["fluence"].var(ddof=1))
        held["fluence"] += sum_bound(block["fluence"].sum(), spread, largest) / size >= counts["fluence"].mean()
    allowed = 0.95 - 2.0 * np.sqrt(0.05 * 0.95 / len(blocks))
    for name, number in held.items():
        assert number / len(blocks) >= allowed, (name, number / len(blocks))
