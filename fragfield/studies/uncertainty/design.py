"""Sample points in the unit cube, by SALib: Latin hypercube, Saltelli's design, and few bursts for many samples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["blocks_of", "latin_hypercube", "problem_of", "saltelli", "seed_of", "shared_bursts"]

_EDGE = 1e-12  # normal distributions have no quantile at 0 and 1
_SEEDS = 2**32


def problem_of(dimensions: int) -> dict[str, Any]:
    """SALib's description of a unit cube."""
    return {
        "num_vars": dimensions,
        "names": [f"x{i}" for i in range(dimensions)],
        "bounds": [[0.0, 1.0]] * dimensions,
    }


def latin_hypercube(dimensions: int, samples: int, seed: int) -> NDArray[np.float64]:
    """Points (n, d): every input has one point in each n-th of its probability (McKay, Beckman and Conover 1979)."""
    from SALib.sample import latin

    return _inside(latin.sample(problem_of(dimensions), samples, seed=seed % _SEEDS))


def saltelli(dimensions: int, samples: int, seed: int) -> NDArray[np.float64]:
    """Saltelli's design for indices of first order and total effects, of at most so many points.

    Blocks of d + 2 points: one of the matrix A, its d neighbours with one coordinate of B each, and that of B, from a
    scrambled Sobol sequence of a power of two of points (Saltelli et al., Comput. Phys. Commun. 181 (2010) 259).

    Raises
    ------
    ValueError
        Fewer than two blocks fit into that many samples.
    """
    from SALib.sample import sobol

    blocks = blocks_of(dimensions, samples)
    if blocks < 2:
        raise ValueError(f"{2 * (dimensions + 2)} samples are needed for {dimensions} inputs")
    points = sobol.sample(problem_of(dimensions), blocks, calc_second_order=False, seed=seed % _SEEDS)
    return _inside(points)


def blocks_of(dimensions: int, samples: int) -> int:
    """Largest power of two of blocks of d + 2 points within so many samples; 0 where none fits."""
    most = samples // (dimensions + 2)
    return 1 << (most.bit_length() - 1) if most else 0


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


def _inside(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.clip(points, _EDGE, 1.0 - _EDGE)
