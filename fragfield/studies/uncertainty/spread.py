"""The spread of a result over the samples, with the statistical error of the samples taken out."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.hazard.ensemble import quantiles

if TYPE_CHECKING:
    from numpy.typing import NDArray


QUANTILES = (0.05, 0.5, 0.95)
_DRAWS = 400


@dataclass(frozen=True)
class Spread:
    """Quantiles of a result as the inputs alone spread it."""

    low: float
    median: float
    high: float
    """5, 50 and 95 %."""
    low_standard_error: float
    median_standard_error: float
    high_standard_error: float
    """For the number of samples, by the bootstrap."""
    mean: float
    standard_deviation: float
    """Of the inputs' spread."""
    statistical_error: float
    """Standard deviation that the statistical errors of the samples add; taken out of the above."""
    resolved: bool
    """Whether the inputs' variance exceeds that of the statistical errors; where not, nothing is taken out and the
    quantiles are too wide."""
    samples: int
    """How many."""

    def as_dict(self) -> dict[str, Any]:
        """As uncertainty.json has it."""
        return asdict(self)


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
    drawn = np.array([quantiles(own[_drawn(len(own), burst, rng)], QUANTILES) for _ in range(_DRAWS)])
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
