"""Distributions of uncertain inputs, by their quantile functions: from a point of the unit interval to a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray


_DIGITS = 12  # of a sampled value: what a case file, a table and a hash can repeat on every machine


@dataclass(frozen=True)
class Distribution:
    """A distribution in one dimension."""

    kind: str
    """"uniform", "normal", "lognormal", "triangular" or "discrete"."""
    parameters: Mapping[str, Any]
    """uniform: `low`, `high`; normal: `mean`, `standard_deviation`; lognormal: `median`, `factor`, the geometric
    standard deviation; triangular: `low`, `mode`, `high`; normal and lognormal are cut off at `low` and `high` where
    these are given, without a heap of probability there; discrete: `values`, `weights` (all alike where they are
    None)."""

    @property
    def is_continuous(self) -> bool:
        """Whether values are numbers of a continuum."""
        return self.kind != "discrete"

    def quantile(self, u: ArrayLike) -> NDArray[np.float64]:
        """Values (n,) at probabilities u in (0, 1); of a discrete distribution the positions in `values`.

        Notes
        -----
        A triangular distribution from a to b with mode c has F(c) = (c - a)/(b - a).
        """
        u = np.asarray(u, dtype=np.float64)
        p = self.parameters
        if self.kind == "uniform":
            return np.asarray(p["low"] + (p["high"] - p["low"]) * u)
        if self.kind == "triangular":
            return _triangular(u, p["low"], p["mode"], p["high"])
        if self.kind == "discrete":
            return np.searchsorted(self.edges()[1:-1], u, side="right").astype(np.float64)
        return self._normal(u)

    def values(self, u: ArrayLike) -> list[Any]:
        """As `quantile`, as Python's own numbers of twelve digits, or the entries of a discrete distribution."""
        if self.kind == "discrete":
            return [self.parameters["values"][int(place)] for place in self.quantile(u)]
        return [float(f"{value:.{_DIGITS}g}") for value in self.quantile(u)]

    def edges(self) -> NDArray[np.float64]:
        """Probabilities (k + 1,) between the values of a discrete distribution, from 0 to 1."""
        weights = self.parameters.get("weights")
        shares = np.ones(len(self.parameters["values"])) if weights is None else np.asarray(weights, dtype=np.float64)
        return np.concatenate([[0.0], np.cumsum(shares) / shares.sum()])

    def _normal(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Normal, or normal in the logarithm, between its cut-offs."""
        from scipy.special import ndtr, ndtri

        p = self.parameters
        in_log = self.kind == "lognormal"
        centre, spread = (np.log(p["median"]), np.log(p["factor"])) if in_log else (p["mean"], p["standard_deviation"])
        ends = []
        for name, end in (("low", 0.0), ("high", 1.0)):
            cut = p.get(name)
            if cut is None or (in_log and cut <= 0.0):
                ends.append(end)
            else:
                ends.append(float(ndtr(((np.log(cut) if in_log else cut) - centre) / spread)))
        found = centre + spread * ndtri(ends[0] + (ends[1] - ends[0]) * u)
        return np.asarray(np.exp(found) if in_log else found)

    def words(self) -> str:
        """The distribution in words, numbers as they are used."""
        p = self.parameters
        if self.kind == "uniform":
            return f"uniform, {p['low']:.5g} to {p['high']:.5g}"
        if self.kind == "triangular":
            return f"triangular, {p['low']:.5g}, {p['mode']:.5g}, {p['high']:.5g}"
        if self.kind == "discrete":
            shares = np.diff(self.edges())
            return ", ".join(f"{value} ({100 * share:.3g} %)" for value, share in zip(p["values"], shares, strict=True))
        cut = [f"{word} {p[name]:.5g}" for name, word in (("low", "from"), ("high", "to")) if p.get(name) is not None]
        within = f", cut off {' '.join(cut)}" if cut else ""
        if self.kind == "normal":
            return f"normal, {p['mean']:.5g} ± {p['standard_deviation']:.5g}{within}"
        return f"lognormal, {p['median']:.5g} within a factor of {p['factor']:.4g} (68 %){within}"


def _triangular(u: NDArray[np.float64], low: float, mode: float, high: float) -> NDArray[np.float64]:
    width = high - low
    rising = (mode - low) / width
    return np.where(
        u < rising,
        low + np.sqrt(u * width * (mode - low)),
        high - np.sqrt((1.0 - u) * width * (high - mode)),
    )
