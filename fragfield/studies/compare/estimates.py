"""Means over realisations with standard errors, and their ratios."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Estimates", "compared", "estimate"]


@dataclass(frozen=True, eq=False)
class Estimates:
    """Values (k,) with their standard errors (k,); NaN where there is no value, or no error to be known."""

    value: NDArray[np.float64]
    error: NDArray[np.float64]

    def over(self, other: Estimates) -> Estimates:
        """Ratios to independent estimates, the errors taken to first order; NaN over zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(other.value != 0.0, self.value / other.value, np.nan)
            return Estimates(ratio, np.hypot(self.error, ratio * other.error) / np.abs(other.value))


def estimate(each: NDArray[np.float64]) -> Estimates:
    """Mean over the realisations and its standard error.

    Parameters
    ----------
    each : (n, k) float64
        One row a realisation; NaN where a realisation says nothing, which then does not count.
    """
    known = ~np.isnan(each)
    number = known.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(known, each, 0.0).sum(axis=0) / number
        variance = (np.where(known, each - mean, 0.0) ** 2).sum(axis=0) / (number - 1)
        error = np.where(number > 1, np.sqrt(variance / number), np.nan)
    return Estimates(mean, error)


def compared(run: Estimates, reference: Estimates) -> list[dict[str, float | None]]:
    """One row a value: run, reference and ratio, each with its standard error; None where there is none."""
    ratio = run.over(reference)
    columns = {
        name: np.broadcast_to(values, ratio.value.shape)
        for key, found in (("run", run), ("reference", reference), ("ratio", ratio))
        for name, values in ((key, found.value), (f"{key}_error", found.error))
    }
    return [
        {name: None if math.isnan(values[i]) else float(values[i]) for name, values in columns.items()}
        for i in range(ratio.value.size)
    ]
