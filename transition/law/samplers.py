"""Two ways to draw the fragments of a segment from Mott's law, behind one interface.

`quantile` (the default) cuts the law's probability into as many equal strata as there are fragments and draws one
fragment from each, then scales all masses to close on the segment's. The number above any mass follows the law, and the
tail is kept: a fragment expected once in a thousand realisations comes once in a thousand, paid for by all others.

`graded` is the paper's (Eqs. 26 to 29). Its rule to stop where a grade holds less than one fragment drops the
heaviest, and their mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Protocol

import numpy as np
from scipy.special import gammaincc

from transition.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.draws import Draws
    from transition.law.mott import MottLaw

    Array = NDArray[np.float64]


_MIN_MASS = 1e-12  # kg: the law has pieces of any smallness, and a file of fragments has none below 1e-15 kg


class Sampler(Protocol):
    """Draws the masses of a segment's fragments."""

    def draw(self, law: MottLaw, mass: float, draws: Draws) -> Array:
        """Masses (n,) in kg, falling, of the fragments of a segment of `mass` (kg) by `law`."""
        ...


@dataclass(frozen=True)
class Quantile:
    """Stratified inverse of the law, closed on the mass.

    The number of pieces is N0 = M/mean, at least one, rounded up or down at random so that its expectation is N0. Each
    piece takes one of n equal parts of the law's probability, a random position in it, and all are scaled to the
    segment's mass. For an end of a few pieces the scaling narrows the spread of masses; the law itself would put pieces
    heavier than the whole segment into one realisation of three.
    """

    def draw(self, law: MottLaw, mass: float, draws: Draws) -> Array:
        """See `Sampler`."""
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

    Attributes
    ----------
    m0, dm : float
        m_0 and the step (kg).
    """

    m0: float
    dm: float

    def draw(self, law: MottLaw, mass: float, draws: Draws) -> Array:  # noqa: ARG002 - interface
        """See `Sampler`; InputError: the first grade does not hold one fragment, or is heavier than the segment."""
        masses, counts = self.grades(law, mass / law.mean, mass)
        if not counts.any():
            raise InputError(
                f"sampler 'graded': the first grade (m_0 + dm = {(self.m0 + self.dm) * 1e3:g} g) holds less than one "
                f"of the {mass / law.mean:.1f} fragments expected, or is heavier than the {mass:g} kg of the segment; "
                "change graded_dm, or take the sampler 'quantile'"
            )
        return np.asarray(np.repeat(masses, counts)[::-1])

    def grades(self, law: MottLaw, number: float, mass: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
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
        found[mine] = part.mass_of(_reduced(part.dimension, above))
    found = np.maximum(found, 1e-12)
    return found, 1.0 / found


@cache
def _fractions(dimension: int) -> tuple[Array, Array]:
    reduced = np.linspace(0.0, _LARGEST, _STEPS + 1)
    return gammaincc(1.0 + dimension, reduced)[::-1], reduced[::-1]


def _reduced(dimension: int, above: Array) -> Array:
    """Reduced masses (m/mu)^(1/i) that fragments with the fraction `above` of the mass exceed."""
    return np.asarray(np.interp(above, *_fractions(dimension)))
