"""Sample points in the unit cube: a Latin hypercube, and few bursts for many samples."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


_EDGE = 1e-12  # normal distributions have no quantile at 0 and 1
_SEEDS = 2**32


def latin_hypercube(dimensions: int, samples: int, seed: int) -> NDArray[np.float64]:
    """Points (n, d): every input has one point in each n-th of its probability (McKay, Beckman and Conover 1979)."""
    generator = np.random.RandomState(seed % _SEEDS)
    edges = np.arange(samples + 1) * (1.0 / samples)
    points = generator.uniform(edges[:-1, None], edges[1:, None], size=(samples, dimensions))
    for column in points.T:
        generator.shuffle(column)
    return np.clip(points, _EDGE, 1.0 - _EDGE)


def shared_bursts(
    in_burst: NDArray[np.bool_], samples: int, bursts: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points (n, d) of which groups share the coordinates of the burst's inputs, and each point's burst (n,).

    Coordinates of burst inputs are a Latin hypercube of so many points; the others one of n points. Bursts are dealt
    out evenly and at random.
    """
    points = np.empty((samples, len(in_burst)))
    rng = np.random.default_rng(np.random.SeedSequence([seed, 1]))
    burst = rng.permutation(np.arange(samples) % bursts)
    if in_burst.any():
        points[:, in_burst] = latin_hypercube(int(in_burst.sum()), bursts, seed)[burst]
    if not in_burst.all():
        points[:, ~in_burst] = latin_hypercube(int((~in_burst).sum()), samples, seed + 1)
    return points, burst


def seed_of(study: int, sample: int) -> int:
    """Seed of one sample's random numbers, whichever worker makes it and when."""
    state = np.random.SeedSequence([study, sample]).generate_state(1, np.uint64)
    return int(state[0] >> np.uint64(1))
