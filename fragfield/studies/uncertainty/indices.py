"""Share of each input in the variance of a result: total effects with errors, by the estimator of the design.

Latin hypercube: a polynomial expansion, `fragfield.studies.uncertainty.expansion`. Saltelli's design: the estimators of
Jansen (total effect) and Saltelli (first order) with bootstrap errors by SALib, from which the statistical error of the
samples is taken out: their independent errors of variance s^2 add s^2 to half the mean square of a difference and to
the variance, so that ST = (ST' V - s^2) / (V - s^2).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.studies.uncertainty.design import problem_of
from fragfield.studies.uncertainty.expansion import Expansion, discrete_basis, fit, legendre_basis

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fragfield.studies.uncertainty.distributions import Distribution

__all__ = ["Analysis", "analyse", "basis_of", "saltelli_indices"]

_NORMAL_95 = 1.959963984540054
_MOST_DEGREE = 12
_DRAWS = 1000
_TORNADO = (0.05, 0.95)


@dataclass(frozen=True, eq=False)
class Analysis:
    """What the samples say of one result.

    Attributes
    ----------
    indices : list of dict
        For each input `total` and `first`, with `total_standard_error`, `total_low`, `total_high` (95 %) and alike.
    tornado : list of dict
        For each input the mean result with it at 5 % and 95 % of its probability, `low` and `high`; of a discrete
        input the smallest and the largest over its steps.
    estimator : dict
        Which one; `degree`, `terms`, `unexplained` of the expansion; `blocks` of Saltelli's design.
    """

    indices: list[dict[str, float]]
    tornado: list[dict[str, float]]
    estimator: dict[str, Any]


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
    noise: float,
    method: str,
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
    noise : float
        Mean square of the values' own standard errors.
    method : "latin_hypercube" or "sobol"
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
    if method == "sobol":
        made = saltelli_indices(len(distributions), values, noise=noise, seed=seed)
        if isinstance(made, str):
            return made
        return Analysis(made[0], tornado, {"name": "saltelli", "blocks": made[1], **estimator})
    indices = [_index(found, i) for i in range(len(distributions))]
    return Analysis(indices, tornado, {"name": "expansion", **estimator})


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


def saltelli_indices(
    dimensions: int, values: NDArray[np.float64], *, noise: float, seed: int
) -> tuple[list[dict[str, float]], int] | str:
    """Indices from values in the order of Saltelli's design, and how many whole blocks there were.

    Blocks with a sample that gave nothing are left out.
    """
    from SALib.analyze import sobol

    blocks = values.reshape(-1, dimensions + 2)
    whole = blocks[np.isfinite(blocks).all(axis=1)]
    if len(whole) < 2:
        return "fewer than two blocks of samples are whole"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # of SALib's own use of pandas
        found = sobol.analyze(
            problem_of(dimensions), whole.reshape(-1), calc_second_order=False, num_resamples=_DRAWS, conf_level=0.95,
            seed=seed % 2**32,
        )  # fmt: skip
    variance = float(np.concatenate([whole[:, 0], whole[:, -1]]).var())
    caused = variance - noise
    if not caused > 0.0:
        return "the samples differ by no more than their statistical error"
    rows = []
    for i in range(dimensions):
        entry: dict[str, float] = {}
        for name, key, added in (("total", "ST", noise), ("first", "S1", 0.0)):
            value = (float(found[key][i]) * variance - added) / caused
            error = float(found[f"{key}_conf"][i]) / _NORMAL_95 * variance / caused
            low, high = value - _NORMAL_95 * error, value + _NORMAL_95 * error
            entry |= {
                name: float(np.clip(value, 0.0, 1.0)), f"{name}_standard_error": error,
                f"{name}_low": float(np.clip(low, 0.0, 1.0)), f"{name}_high": float(np.clip(high, 0.0, 1.0)),
            }  # fmt: skip
        rows.append(entry)
    return rows, len(whole)
