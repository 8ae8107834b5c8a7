"""Mott's law of fragment numbers, its inverse and its moments in closed form.

N(m) = N0 exp(-(m/mu)^lambda) is the number of fragments heavier than m, with lambda = 1/i for break-up in
i dimensions (Mott 1943; Mott and Linfoot 1943; the paper's Eq. 19 is i = 2). It is a Weibull law of shape
1/i, so with x = (m/mu)^(1/i) every moment is an incomplete gamma function of x.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.optimize import brentq
from scipy.special import gamma, gammainc, gammaincc

from transition.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["MottLaw", "MottPart"]

Dimension = Literal[2, 3]


@dataclass(frozen=True)
class MottPart:
    """Break-up in one dimension number: exponent 1/`dimension`, scale `mu` (kg), share `weight` of the number."""

    dimension: Dimension
    mu: float
    weight: float = 1.0

    @property
    def mean(self) -> float:
        """Mean mass mu Gamma(1 + i) (kg): 2 mu in two dimensions, 6 mu in three."""
        return float(self.mu * gamma(1.0 + self.dimension))

    def reduced(self, mass: ArrayLike) -> NDArray[np.float64]:
        """Reduced mass x = (m/mu)^(1/i), without dimension; masses in kg."""
        return np.asarray((np.asarray(mass, dtype=np.float64) / self.mu) ** (1.0 / self.dimension))

    def mass_of(self, reduced: ArrayLike) -> NDArray[np.float64]:
        """Mass m = mu x^i (kg)."""
        return np.asarray(self.mu * np.asarray(reduced, dtype=np.float64) ** self.dimension)


@dataclass(frozen=True)
class MottLaw:
    """Mott's law: one part, or a mixture of both whose parts have the same mean.

    Since the parts of a mixture have the same mean mass, their shares of the mass are their shares of the number.

    Attributes
    ----------
    parts : tuple of MottPart
        The pure laws; their weights sum to one.
    """

    parts: tuple[MottPart, ...]

    @classmethod
    def from_mean(cls, mean: float, dimension: Literal[2, 3, "mixed"] = 2, mixed_fraction: float = 0.5) -> MottLaw:
        """Law with a given mean mass (kg).

        mu = mean/2 in two dimensions (Eq. 25) and mean/6 in three, where Eq. 25's mean/3 would not give the mean
        back. `mixed_fraction` is the share of the mass that breaks in three dimensions.
        """
        if not (np.isfinite(mean) and mean > 0.0):
            raise InputError(f"mean fragment mass: found {mean:g} kg; a finite mass above zero is needed")
        if dimension == 2:
            return cls((MottPart(2, mean / 2.0),))
        if dimension == 3:
            return cls((MottPart(3, mean / 6.0),))
        two = MottPart(2, mean / 2.0, 1.0 - mixed_fraction)
        three = MottPart(3, mean / 6.0, mixed_fraction)
        return cls(tuple(part for part in (two, three) if part.weight > 0.0))

    @property
    def mean(self) -> float:
        """Mean mass of a fragment (kg)."""
        return float(sum(part.weight * part.mean for part in self.parts))

    def survival(self, mass: ArrayLike) -> NDArray[np.float64]:
        """Share of the number in fragments heavier than `mass` (kg), N(m)/N0."""
        return np.asarray(sum(part.weight * np.exp(-part.reduced(mass)) for part in self.parts))

    def inverse(self, survival: ArrayLike) -> NDArray[np.float64]:
        """Mass (kg) that the share `survival` (0 to 1] of the number exceeds; exact to round-off.

        A pure law is inverted in closed form, mu (-ln s)^i; a mixture by bisection between its parts' inverses.
        """
        share = np.asarray(survival, dtype=np.float64)
        if np.any(~((share > 0.0) & (share <= 1.0))):
            raise InputError("inverse of Mott's law: shares above 0 and up to 1 are needed")
        pure = [part.mass_of(-np.log(share)) for part in self.parts]
        low, high = np.minimum.reduce(pure), np.maximum.reduce(pure)
        if len(pure) == 1:
            return low
        for _ in range(100):
            middle = 0.5 * (low + high)
            above = self.survival(middle) > share
            low, high = np.where(above, middle, low), np.where(above, high, middle)
        return np.asarray(0.5 * (low + high))

    def moment(self, order: float) -> float:
        """E[m^q] over the fragments (kg^q): mu^q Gamma(1 + i q), q above -1/i."""
        return float(sum(part.weight * part.mu**order * gamma(1.0 + part.dimension * order) for part in self.parts))

    def mass_weighted_moment(self, order: float) -> float:
        """Mean of m^q with every fragment weighted by its mass (kg^q): E[m^(q+1)]/E[m]."""
        return self.moment(order + 1.0) / self.mean

    def mass_fraction_above(self, mass: ArrayLike) -> NDArray[np.float64]:
        """Share of the total mass in fragments heavier than `mass` (kg): Q(1 + i, x), regularised gamma."""
        shares = (p.weight * p.mean * gammaincc(1.0 + p.dimension, p.reduced(mass)) for p in self.parts)
        return np.asarray(sum(shares) / self.mean)

    def mean_below(self, heaviest: float) -> float:
        """Mean mass (kg) of the fragments not heavier than `heaviest` (kg)."""
        mass = sum(p.weight * p.mean * gammainc(1.0 + p.dimension, p.reduced(heaviest)) for p in self.parts)
        return float(mass / (1.0 - self.survival(heaviest)))

    def stretched(self, factor: float) -> MottLaw:
        """Return the law with every mu multiplied by `factor`."""
        return MottLaw(tuple(replace(part, mu=part.mu * factor) for part in self.parts))

    def with_mean_below(self, heaviest: float, mean: float) -> MottLaw:
        """Return the law stretched so that its fragments up to `heaviest` (kg) have the mean mass `mean` (kg).

        A casing of mass M holds no fragment heavier than M. The law cut there keeps its number only if mu is
        raised; the raise is below 1e-4 from about 100 fragments (two dimensions) or 700 (three) upwards.

        Raises
        ------
        InputError
            No mu gives this mean: cut at M, the mean stays below M/(1 + i).
        """
        limit = heaviest / (1.0 + max(part.dimension for part in self.parts))
        if not 0.0 < mean < limit:
            raise InputError(
                f"Mott's law cut at {heaviest:g} kg cannot have a mean of {mean:g} kg; it stays below {limit:g} kg"
            )

        def excess(logarithm: float) -> float:
            return self.stretched(np.exp(logarithm)).mean_below(heaviest) / mean - 1.0

        lower = np.log(mean / self.mean)
        if excess(lower) >= 0.0:  # nothing is cut to working precision
            return self.stretched(float(np.exp(lower)))
        upper = lower + 1.0
        while excess(upper) < 0.0:
            upper += 2.0
        return self.stretched(float(np.exp(brentq(excess, lower, upper, xtol=1e-14, rtol=1e-14))))
