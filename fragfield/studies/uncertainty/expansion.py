"""A polynomial expansion of a result over the unit cube, its indices, and their errors.

The result is written as a sum of products of orthonormal polynomials, one for each input: shifted Legendre
polynomials of the probability u of a continuous input, or polynomials orthonormal over the steps of a discrete one. The
coefficients follow by least squares (Sudret, Reliability Engineering and System Safety 93 (2008) 964); variances are
then sums of squares of coefficients, and the total effect of an input is the share of all terms that contain it. A
squared coefficient is on average too large by its own variance, which is taken off. The degree is the one whose
leave-one-out error is smallest. Errors come from the wild bootstrap (Wu 1986) by groups: residuals, enlarged for
leverage, keep their sample or their burst and change signs at random.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray


DRAWS = 1000
_MOST_DEGREE = 12
_SAMPLES_PER_TERM = 3.0
_MOST_TERMS = 1500


def legendre_basis(u: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    """Orthonormal Legendre polynomials of degrees 0 to `degree` on the unit interval (n, degree + 1)."""
    values = np.polynomial.legendre.legvander(2.0 * u - 1.0, degree)
    return np.asarray(values * np.sqrt(2.0 * np.arange(degree + 1) + 1.0))


def discrete_basis(place: NDArray[np.int64], shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Functions of the steps of a discrete input, orthonormal for their probabilities (n, steps)."""
    weight = np.sqrt(shares)
    powers = np.vander(np.linspace(-1.0, 1.0, len(shares)), increasing=True)
    q, r = np.linalg.qr(powers * weight[:, None])
    functions = q * np.sign(np.diag(r)) / weight[:, None]
    return np.asarray(functions[place])


def terms_of(degrees: Sequence[int], total: int, alone: Sequence[int] = ()) -> NDArray[np.int64]:
    """Degrees (t, d) of all products up to a total degree.

    `degrees`: highest degree of each input; `total`: highest sum of degrees; `alone`: inputs of which no two stand in
    one product: those of shared bursts, of which there are few.
    """
    rows = [row for sum_ in range(total + 1) for row in _rows(degrees, sum_)]
    apart = [row for row in rows if sum(row[i] > 0 for i in alone) <= 1]
    return np.array(apart, dtype=np.int64)


def _rows(degrees: Sequence[int], total: int) -> Iterator[tuple[int, ...]]:
    """Degrees that add up to `total`, by the places of the bars between the stars."""
    d = len(degrees)
    for bars in combinations(range(total + d - 1), d - 1):
        ends = (-1, *bars, total + d - 1)
        row = tuple(ends[i + 1] - ends[i] - 1 for i in range(d))
        if all(one <= most for one, most in zip(row, degrees, strict=True)):
            yield row


@dataclass(frozen=True, eq=False)
class Expansion:
    """A fitted expansion."""

    terms: NDArray[np.int64]
    """(t, d) int64: degrees of each product; the first is the mean."""
    coefficients: NDArray[np.float64]
    variances: NDArray[np.float64]
    """(t,) float64: with their own variances."""
    unexplained: float
    """Leave-one-out error over the variance of the values: 0 is perfect, 1 is no better than the mean."""
    draws: tuple[NDArray[np.float64], NDArray[np.float64]]
    """(b, t), (b, t) float64: coefficients in the bootstrap, and what their squares are too large by."""

    @property
    def degree(self) -> int:
        """Total degree."""
        return int(self.terms.sum(axis=1).max())

    def share(self, inputs: Sequence[int], *, alone: bool = False) -> tuple[float, float, tuple[float, float]]:
        """Share of the variance by a group of inputs: estimate, standard error, and 2.5 and 97.5 % of the bootstrap.

        The total effect, of every term that contains one of them; or with `alone` the effect of first order, of the
        terms that contain nothing else.
        """
        active = self.terms[1:] > 0
        within = np.zeros(active.shape[1], dtype=bool)
        within[list(inputs)] = True
        chosen = active[:, within].any(axis=1)
        if alone:
            chosen &= ~active[:, ~within].any(axis=1)
        everything = np.ones(len(active), dtype=bool)
        parts = [
            self._variances(one, *numbers)
            for numbers in ((self.coefficients, self.variances), self.draws)
            for one in (chosen, everything)
        ]
        own, total, of_draws, totals = parts
        if not total > 0.0:
            return 0.0, 0.0, (0.0, 0.0)
        shares = np.clip(of_draws / np.where(totals > 0.0, totals, np.inf), 0.0, 1.0)
        low, high = np.quantile(shares, [0.025, 0.975])
        value = float(np.clip(own / total, 0.0, 1.0))
        return value, float(shares.std(ddof=1)), (float(low), float(high))

    @staticmethod
    def _variances(
        chosen: NDArray[np.bool_], coefficients: NDArray[np.float64], variances: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Sums of squares of chosen coefficients less what their own variances add; not below zero."""
        squares = (coefficients**2 - variances)[..., 1:]
        return np.asarray(np.maximum((squares * chosen).sum(axis=-1), 0.0))

    def main_effect(self, number: int, basis: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean result (n,) with one input held where its functions have the values `basis`, the others at random."""
        active = self.terms > 0
        others = np.delete(active, number, axis=1).any(axis=1)
        found = np.zeros(len(basis))
        for term in np.flatnonzero(~others):
            found += self.coefficients[term] * basis[:, self.terms[term, number]]
        return found


def fit(
    bases: Sequence[NDArray[np.float64]],
    values: NDArray[np.float64],
    *,
    groups: NDArray[np.int64] | None = None,
    alone: Sequence[int] = (),
    rng: np.random.Generator,
) -> Expansion:
    """Fit an expansion whose degree the samples choose.

    Parameters
    ----------
    bases : d arrays (n, degree_i + 1)
        Orthonormal functions of each input at the samples; the number of columns bounds its degree.
    values : (n,) float64
        Results.
    groups : (n,) int64, optional
        Samples whose errors belong together: those of one shared burst.
    alone : sequence of int
        See `terms_of`.
    rng : numpy.random.Generator
        Of the bootstrap.

    Raises
    ------
    ValueError
        Too few samples for an expansion of first degree.
    """
    n, most = len(values), [basis.shape[1] - 1 for basis in bases]
    best: tuple[float, NDArray[np.int64]] | None = None
    worse = 0
    for total in range(1, _MOST_DEGREE + 1):
        terms = terms_of(most, total, alone)
        enough = n >= _SAMPLES_PER_TERM * len(terms) or (total == 1 and n >= len(terms) + 2)
        if not enough or len(terms) > _MOST_TERMS or (best is not None and len(terms) == len(best[1])):
            break
        error = _leave_one_out(_matrix(bases, terms), values)
        if best is None or error < best[0]:
            best, worse = (error, terms), 0
        else:
            worse += 1
            if worse == 2:
                break
    if best is None:
        raise ValueError(f"{n} samples are too few for {len(bases)} inputs; needed: {len(bases) + 3}")
    return _fitted(bases, values, best, groups, rng)


def _matrix(bases: Sequence[NDArray[np.float64]], terms: NDArray[np.int64]) -> NDArray[np.float64]:
    found = np.ones((len(bases[0]), len(terms)))
    for i, basis in enumerate(bases):
        found *= basis[:, terms[:, i]]
    return found


def _leave_one_out(matrix: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Mean square of leave-one-out errors over the variance of the values."""
    q = np.linalg.qr(matrix)[0]
    left = values - q @ (q.T @ values)
    room = np.maximum(1.0 - (q**2).sum(axis=1), 1e-12)
    spread = float(values.var(ddof=1))
    return float(((left / room) ** 2).mean()) / spread if spread > 0.0 else 0.0


def _fitted(
    bases: Sequence[NDArray[np.float64]],
    values: NDArray[np.float64],
    best: tuple[float, NDArray[np.int64]],
    groups: NDArray[np.int64] | None,
    rng: np.random.Generator,
) -> Expansion:
    error, terms = best
    matrix = _matrix(bases, terms)
    q, r = np.linalg.qr(matrix)
    operator = np.linalg.solve(r, q.T)  # coefficients from values
    coefficients = operator @ values
    fitted = matrix @ coefficients
    left, free = values - fitted, len(values) - len(terms)
    variance = float((left**2).sum()) / free
    weight = (operator**2).sum(axis=1)
    enlarged = left / np.sqrt(np.maximum(1.0 - (q**2).sum(axis=1), 1e-12))
    group = np.arange(len(values)) if groups is None else groups
    signs = rng.choice([-1.0, 1.0], size=(DRAWS, int(group.max()) + 1))
    again = fitted + enlarged * signs[:, group]
    of_draws = again @ operator.T
    remaining = again - of_draws @ matrix.T
    variances = (remaining**2).sum(axis=1)[:, None] / free * weight
    own = variance * weight
    if groups is not None:  # residuals of a burst belong together, which the usual formula does not know
        own = of_draws.var(axis=0, ddof=1)
        variances = np.broadcast_to(own, of_draws.shape)
    # A draw's squares are too large twice over: by its own variance and by that of the coefficients it began with.
    return Expansion(terms, coefficients, own, error, (of_draws, 2.0 * variances))
