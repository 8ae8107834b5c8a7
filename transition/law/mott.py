"""Mott's law of fragment numbers, its inverse and its moments in closed form.

N(m) = N0 exp(-(m/mu)^lambda) is the number of fragments heavier than m, with lambda = 1/i for break-up in
i dimensions (Mott 1943; Mott and Linfoot 1943; the paper's Eq. 19 is i = 2). It is a Weibull law of shape
1/i, so with x = (m/mu)^(1/i) every moment is an incomplete gamma function of x.

Two ways to draw the fragments of a segment from it:

`quantile` (the default) cuts the law's probability into as many equal strata as there are fragments and draws one
fragment from each, then scales all masses to close on the segment's. The number above any mass follows the law, and the
tail is kept: a fragment expected once in a thousand realisations comes once in a thousand, paid for by all others.

`graded` is the paper's (Eqs. 26 to 29). Its rule to stop where a grade holds less than one fragment drops the heaviest,
and their mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.special import gamma, gammaincc

from transition.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from transition.draws import Draws

    Array = NDArray[np.float64]


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

    def reduced(self, mass: ArrayLike) -> Array:
        """Reduced mass x = (m/mu)^(1/i), without dimension; masses in kg."""
        return np.asarray((np.asarray(mass, dtype=np.float64) / self.mu) ** (1.0 / self.dimension))

    def mass_of(self, reduced: ArrayLike) -> Array:
        """Mass m = mu x^i (kg)."""
        return np.asarray(self.mu * np.asarray(reduced, dtype=np.float64) ** self.dimension)


@dataclass(frozen=True)
class MottLaw:
    """Mott's law: one part, or a mixture of both whose parts have the same mean.

    Since the parts of a mixture have the same mean mass, their shares of the mass are their shares of the number.
    """

    parts: tuple[MottPart, ...]
    """The pure laws; their weights sum to one."""

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

    def survival(self, mass: ArrayLike) -> Array:
        """Share of the number in fragments heavier than `mass` (kg), N(m)/N0."""
        return np.asarray(sum(part.weight * np.exp(-part.reduced(mass)) for part in self.parts))

    def inverse(self, survival: ArrayLike) -> Array:
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

    def mass_fraction_above(self, mass: ArrayLike) -> Array:
        """Share of the total mass in fragments heavier than `mass` (kg): Q(1 + i, x), regularised gamma."""
        shares = (p.weight * p.mean * gammaincc(1.0 + p.dimension, p.reduced(mass)) for p in self.parts)
        return np.asarray(sum(shares) / self.mean)


_MIN_MASS = 1e-12  # kg: the law has pieces of any smallness, and a file of fragments has none below 1e-15 kg


@dataclass(frozen=True)
class Quantile:
    """Stratified inverse of the law, closed on the mass.

    The number of pieces is N0 = M/mean, at least one, rounded up or down at random so that its expectation is N0. Each
    piece takes one of n equal parts of the law's probability, a random position in it, and all are scaled to the
    segment's mass. For an end of a few pieces the scaling narrows the spread of masses; the law itself would put pieces
    heavier than the whole segment into one realisation of three.
    """

    def draw(self, law: MottLaw, mass: float, draws: Draws) -> Array:
        """Masses (n,) in kg, falling, of the fragments of a segment of `mass` (kg) by `law`."""
        whole = draws.rounded(max(1.0, mass / law.mean))
        survival = (np.arange(whole) + 1.0 - draws.uniform("mass", whole)) / whole
        drawn = np.maximum(law.inverse(survival), _MIN_MASS)
        return np.sort(drawn * (mass / drawn.sum()))[::-1]


@dataclass(frozen=True)
class Graded:
    """The paper's grades of equal step, Eqs. 26 to 29.

    Grade i holds fragments of m_i = m_0 + i dm, i = 1, 2, ... (Eq. 28 counts from the first grade), in the number
    [N(m_i - dm/2) - N(m_i + dm/2)], brackets meaning the whole number below, as Eq. 29 needs them; the printed
    Eq. 27 misplaces the division by mu. The grades end when one would hold less than one fragment, or when the
    segment's mass is reached and Eq. 29 corrects the last. Nothing is random.
    """

    m0: float
    dm: float
    """m_0 and the step (kg)."""

    def draw(self, law: MottLaw, mass: float, draws: Draws) -> Array:  # noqa: ARG002 - interface
        """The same; InputError: the first grade does not hold one fragment, or is heavier than the segment."""
        masses, counts = self.grades(law, mass / law.mean, mass)
        if not counts.any():
            raise InputError(
                f"sampler 'graded': the first grade (m_0 + dm = {(self.m0 + self.dm) * 1e3:g} g) holds less than one "
                f"of the {mass / law.mean:.1f} fragments expected, or is heavier than the {mass:g} kg of the segment; "
                "change graded_dm, or take the sampler 'quantile'"
            )
        return np.asarray(np.repeat(masses, counts)[::-1])

    def grades(self, law: MottLaw, number: float, mass: float) -> tuple[Array, NDArray[np.int64]]:
        """Masses (kg) of the grades and the fragments in each, for N0 = `number` and a segment of `mass` (kg).

        Eq. 29 acts only where N0 is larger than M/mean: counted by whole numbers, the grades never reach M.
        """
        possible = min(number, max(0.0, (mass - self.m0) / self.dm))  # every grade holds one fragment at least
        masses = self.m0 + self.dm * np.arange(1, 2 + int(possible))
        expected = number * (law.survival(masses - 0.5 * self.dm) - law.survival(masses + 0.5 * self.dm))
        small = np.flatnonzero(expected < 1.0)
        grades = int(small[0]) if small.size else expected.size
        counts = np.floor(expected[:grades]).astype(np.int64)
        total = np.cumsum(counts * masses[:grades])
        over = np.flatnonzero(total > mass)
        if over.size:
            last = int(over[0])
            counts = counts[: last + 1]
            counts[last] = int((mass - (total[last - 1] if last else 0.0)) / masses[last])
        return masses[: counts.size], counts


Sampler = Quantile | Graded
_LARGEST = 60.0  # reduced mass beyond which Mott's law has no mass
_STEPS = 60_000


def masses_at(law: MottLaw, sampler: Sampler, mass: float, quantiles: Array) -> tuple[Array, Array]:
    """Masses (kg) at quantiles of the distribution of the mass of a segment, and number per mass of it (1/kg) there.

    No fragment is heavier than the segment's `mass` (kg).
    """
    if isinstance(sampler, Graded):
        masses, counts = sampler.grades(law, mass / law.mean, mass)
        grade = np.searchsorted(np.cumsum(masses * counts), quantiles * mass)
        missing = grade == len(masses)  # mass that no grade carries
        found = masses[np.minimum(grade, len(masses) - 1)]
        return found, np.where(missing, 0.0, 1.0 / found)
    ends = np.concatenate([[0.0], np.cumsum([part.weight for part in law.parts])])
    found = np.zeros(len(quantiles))
    for part, begin, end in zip(law.parts, ends, ends[1:], strict=False):
        mine = (quantiles >= begin) & (quantiles < end)
        heaviest = float(gammaincc(1.0 + part.dimension, part.reduced(mass)))
        above = heaviest + (1.0 - heaviest) * (1.0 - (quantiles[mine] - begin) / (end - begin))
        found[mine] = part.mass_of(np.interp(above, *_fractions(part.dimension)))
    found = np.maximum(found, 1e-12)
    return found, 1.0 / found


@cache
def _fractions(dimension: int) -> tuple[Array, Array]:
    """Fractions of the mass that fragments hold above reduced masses (m/mu)^(1/i), and these."""
    reduced = np.linspace(0.0, _LARGEST, _STEPS + 1)
    return gammaincc(1.0 + dimension, reduced)[::-1], reduced[::-1]
