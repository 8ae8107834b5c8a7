"""The spread of a result over the samples, and the share of each input in its variance, by rank regression.

The ranks of the result are a linear function of the probabilities u of the inputs, fitted by least squares (Iman and
Conover, Technometrics 21 (1979) 499): exact for what is monotone in each input, blind to what rises and falls again and
to joint effects, which the part of the ranks' variance that the fit leaves shows. A share is the square of an input's
coefficient, less what its own variance adds, over the sum of all. Errors come from the wild bootstrap (Wu 1986):
residuals keep their sample, or their shared burst, and change signs at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flight.hazard.ensemble import quantiles
from fragfield.results.uncertainty import Bar, Estimator, Share, Spread

if TYPE_CHECKING:
    from fragfield.studies.uncertainty.inputs import Distribution


QUANTILES = (0.05, 0.5, 0.95)
_QUANTILE_DRAWS = 400
_SIGN_DRAWS = 1000
_TORNADO = (0.05, 0.95)


def without_statistical_error(values: NDArray[np.float64], noise: float) -> tuple[NDArray[np.float64], bool]:
    """Values drawn towards their mean until their variance is that of the inputs alone; and whether that was done.

    `values` (n,); `noise`: variance of the values' own errors, independent of the inputs.
    """
    variance = float(values.var(ddof=1))
    caused = variance - noise
    if caused <= noise:
        return values, noise == 0.0
    mean = values.mean()
    return mean + (values - mean) * np.sqrt(caused / variance), True


def spread_of(
    values: NDArray[np.float64],
    errors: NDArray[np.float64] | None,
    rng: np.random.Generator,
    burst: NDArray[np.int64] | None = None,
) -> Spread:
    """Spread over samples.

    `values` (n,); `errors` (n,): standard errors of the values; `rng`: of the bootstrap; `burst` (n,): shared bursts,
    which the bootstrap then draws whole.
    """
    noise = 0.0 if errors is None else float((errors**2).mean())
    own, resolved = without_statistical_error(values, noise)
    drawn = np.array([quantiles(own[_drawn(len(own), burst, rng)], QUANTILES) for _ in range(_QUANTILE_DRAWS)])
    error = drawn.std(axis=0, ddof=1)
    names = ("low", "median", "high")
    return Spread(
        **dict(zip(names, quantiles(own, QUANTILES).tolist(), strict=True)),
        **{f"{name}_standard_error": one for name, one in zip(names, error.tolist(), strict=True)},
        mean=float(own.mean()),
        standard_deviation=float(own.std(ddof=1)),
        statistical_error=float(np.sqrt(noise)),
        resolved=resolved,
        samples=len(values),
    )


def _drawn(number: int, burst: NDArray[np.int64] | None, rng: np.random.Generator) -> NDArray[np.int64]:
    if burst is None:
        return rng.integers(0, number, number)
    names = np.unique(burst)
    return np.concatenate([np.flatnonzero(burst == one) for one in rng.choice(names, len(names))])


class Analysis(NamedTuple):
    """What the samples say of one result, by input."""

    estimator: Estimator
    shares: tuple[Share, ...] = ()
    tornado: tuple[Bar, ...] = ()


def columns_of(distribution: Distribution, u: NDArray[np.float64]) -> NDArray[np.float64]:
    """Columns (n, k) of an input at probabilities u, with mean 0, variance 1 and no correlation over its distribution.

    One of a continuous input; of a discrete one, whose steps have no order, as many as it has steps but one.
    """
    if distribution.is_continuous:
        return np.sqrt(12.0) * (u[:, None] - 0.5)
    weights = np.diff(distribution.edges())
    kept = weights > 0.0
    step, weight = (np.cumsum(kept) - 1)[distribution.quantile(u).astype(np.int64)], np.sqrt(weights[kept])
    q, r = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, len(weight)), increasing=True) * weight[:, None])
    return np.asarray((q * np.sign(np.diag(r)) / weight[:, None])[step, 1:])


def analyse(
    inputs: Sequence[tuple[str, Distribution]],
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    *,
    seed: int,
    burst: NDArray[np.int64] | None = None,
) -> Analysis:
    """Shares and tornado of one result over all samples; without them where the estimator has a reason.

    `inputs`: d names and distributions; `points` (n, d) in the unit cube; `values` (n,), NaN where a sample gave none;
    `seed` of the bootstrap; `burst` (n,): which shared burst a sample used.
    """
    distributions = [one for _, one in inputs]
    known = np.isfinite(values)
    number = int(known.sum())
    if number < 2 or not np.ptp(values[known]) > 0.0:
        return Analysis(Estimator(reason="the samples do not differ"))
    parts = [columns_of(one, points[known, i]) for i, one in enumerate(distributions)]
    matrix = np.hstack([np.ones((number, 1)), *parts])
    if number < matrix.shape[1] + 2:
        few = f"{number} samples are too few for {len(distributions)} inputs; needed: {matrix.shape[1] + 2}"
        return Analysis(Estimator(reason=few))
    order = np.argsort(np.argsort(values[known], kind="stable"), kind="stable")
    ranks = (order + 0.5) / number
    q, r = np.linalg.qr(matrix)
    operator = np.linalg.solve(r, q.T)
    fitted = matrix @ operator @ ranks
    enlarged = (ranks - fitted) / np.sqrt(np.maximum(1.0 - (q**2).sum(axis=1), 1e-12))  # for leverage
    group = np.arange(number) if burst is None else np.unique(burst[known], return_inverse=True)[1]
    rng = np.random.default_rng(np.random.SeedSequence([seed, 2]))
    signs = rng.choice([-1.0, 1.0], size=(_SIGN_DRAWS, int(group.max()) + 1))
    coefficients, draws = operator @ ranks, (fitted + enlarged * signs[:, group]) @ operator.T
    own, linear = draws.var(axis=0, ddof=1), operator @ values[known]
    ends = np.cumsum([1, *(part.shape[1] for part in parts)])
    places = [slice(first, last) for first, last in pairwise(ends.tolist())]
    # A draw's squares are too large twice over: by its own variance and by that of the coefficients it began with.
    share, of_draws = (_shares(found**2 - times * own, places) for found, times in ((coefficients, 1.0), (draws, 2.0)))
    low, high = np.quantile(of_draws, [0.025, 0.975], axis=0)
    error = of_draws.std(axis=0, ddof=1)
    shares = np.column_stack([share, error, low, high]).tolist()
    names = ("share", "share_standard_error", "share_low", "share_high")
    return Analysis(
        Estimator(explained=float(fitted.var() / ranks.var()), samples=number),
        tuple(
            Share(name=name, **dict(zip(names, row, strict=True)))
            for (name, _), row in zip(inputs, shares, strict=True)
        ),
        tuple(_bar(*entry, linear[place], linear[0]) for entry, place in zip(inputs, places, strict=True)),
    )


def _shares(squares: NDArray[np.float64], places: Sequence[slice]) -> NDArray[np.float64]:
    each = np.stack([np.maximum(squares[..., place].sum(axis=-1), 0.0) for place in places], axis=-1)
    total = each.sum(axis=-1, keepdims=True)
    return np.asarray(each / np.where(total > 0.0, total, 1.0))


def _bar(name: str, distribution: Distribution, coefficients: NDArray[np.float64], mean: float) -> Bar:
    u = np.array(_TORNADO) if distribution.is_continuous else np.linspace(1e-9, 1.0 - 1e-9, 401)
    effect = mean + columns_of(distribution, u) @ coefficients
    low, high = effect if distribution.is_continuous else (effect.min(), effect.max())
    return Bar(name=name, low=float(low), high=float(high))
