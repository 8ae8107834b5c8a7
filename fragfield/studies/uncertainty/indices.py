"""Share of each input in the variance of a result: total effects with errors, by a polynomial expansion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.studies.uncertainty.expansion import Expansion, discrete_basis, fit, legendre_basis

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fragfield.studies.uncertainty.distributions import Distribution


_MOST_DEGREE = 12
_TORNADO = (0.05, 0.95)


@dataclass(frozen=True, eq=False)
class Analysis:
    """What the samples say of one result."""

    indices: list[dict[str, float]]
    """For each input `total` and `first`, with `total_standard_error`, `total_low`, `total_high` (95 %) and alike."""
    tornado: list[dict[str, float]]
    """For each input the mean result with it at 5 % and 95 % of its probability, `low` and `high`; of a discrete input
    the smallest and the largest over its steps."""
    estimator: dict[str, Any]
    """`degree`, `terms`, `unexplained`, `samples` of the expansion."""


def basis_of(distribution: Distribution, u: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    """Orthonormal functions (n, k) of an input at probabilities u."""
    if distribution.is_continuous:
        return legendre_basis(u, degree)
    shares = np.diff(distribution.edges())
    kept = shares > 0.0
    place = (np.cumsum(kept) - 1)[distribution.quantile(u).astype(np.int64)]
    return discrete_basis(place, shares[kept])[:, : degree + 1]


def analyse(
    distributions: Sequence[Distribution],
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    *,
    seed: int,
    burst: NDArray[np.int64] | None = None,
    in_burst: Sequence[bool] = (),
) -> Analysis | str:
    """Indices and tornado of one result over all samples.

    Parameters
    ----------
    distributions : d Distributions
    points : (n, d) float64
        In the unit cube.
    values : (n,) float64
        NaN where a sample gave none.
    seed : int
        Of the bootstrap.
    burst : (n,) int64, optional
        Which shared burst a sample used.
    in_burst : d bools
        Whether the burst depends on an input.

    Returns
    -------
    Analysis, or why there is none, in words
    """
    known = np.isfinite(values)
    if known.sum() < 2 or not np.ptp(values[known]) > 0.0:
        return "the samples do not differ"
    rng = np.random.default_rng(np.random.SeedSequence([seed, 2]))
    shared = burst is not None
    degrees = [1 if shared and inside else _MOST_DEGREE for inside in in_burst] or [_MOST_DEGREE] * len(distributions)
    bases = [
        basis_of(one, points[known, i], degree)
        for i, (one, degree) in enumerate(zip(distributions, degrees, strict=True))
    ]
    alone = [i for i, inside in enumerate(in_burst) if inside] if shared else []
    try:
        found = fit(bases, values[known], groups=_numbered(burst, known), alone=alone, rng=rng)
    except ValueError as error:
        return str(error)
    tornado = _tornado(distributions, degrees, found)
    estimator = {
        "degree": found.degree, "terms": len(found.terms), "unexplained": found.unexplained,
        "samples": int(known.sum()),
    }  # fmt: skip
    indices = [_index(found, i) for i in range(len(distributions))]
    return Analysis(indices, tornado, estimator)


def _numbered(burst: NDArray[np.int64] | None, known: NDArray[np.bool_]) -> NDArray[np.int64] | None:
    return None if burst is None else np.unique(burst[known], return_inverse=True)[1]


def _index(found: Expansion, number: int) -> dict[str, float]:
    entry: dict[str, float] = {}
    for name, alone in (("total", False), ("first", True)):
        value, error, (low, high) = found.share([number], alone=alone)
        entry |= {name: value, f"{name}_standard_error": error, f"{name}_low": low, f"{name}_high": high}
    return entry


def _tornado(distributions: Sequence[Distribution], degrees: Sequence[int], found: Expansion) -> list[dict[str, float]]:
    rows = []
    for i, one in enumerate(distributions):
        u = np.array(_TORNADO) if one.is_continuous else np.linspace(1e-9, 1.0 - 1e-9, 401)
        effect = found.main_effect(i, basis_of(one, u, degrees[i]))
        ends = effect if one.is_continuous else np.array([effect.min(), effect.max()])
        rows.append({"low": float(ends[0]), "high": float(ends[1])})
    return rows
