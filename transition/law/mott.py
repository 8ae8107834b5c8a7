"""Mott's law of fragment numbers, its inverse and its moments in closed form.

N(m) = N0 exp(-(m/mu)^lambda) is the number of fragments heavier than m, with lambda = 1/i for break-up in
i dimensions (Mott 1943; Mott and Linfoot 1943; the paper's Eq. 19 is i = 2). It is a Weibull law of shape
1/i, so with x = (m/mu)^(1/i) every moment is an incomplete gamma function of x.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.special import gamma, gammaincc

from transition.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


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

    def mass_fraction_above(self, mass: ArrayLike) -> NDArray[np.float64]:
        """Share of the total mass in fragments heavier than `mass` (kg): Q(1 + i, x), regularised gamma."""
        shares = (p.weight * p.mean * gammaincc(1.0 + p.dimension, p.reduced(mass)) for p in self.parts)
        return np.asarray(sum(shares) / self.mean)
