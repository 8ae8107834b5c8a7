"""Two ways to draw the fragments of a segment from Mott's law, behind one interface.

`quantile` (the default) cuts the law into strata of equal expected number and chooses among their means with
probabilities that add up to the law, balanced on number and mass (`kernels.choice`). Scaling all masses to
close on the segment would change mu from one realisation to the next, and most where a heavy fragment came; here
the closing factor is 1 to about 1e-6 from a hundred fragments on. The number above any mass follows the law in
expectation, and the tail is kept: a fragment expected once in a thousand realisations comes once in a thousand.

`graded` is the paper's (Eqs. 26 to 29). Its rule to stop where a grade holds less than one fragment drops the
heaviest; the mass that is missing is reported, not hidden.

A segment of only a few pieces (an end cap) follows the law by proportion only: see `few_pieces`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from scipy.special import gammainc, gammaincc

from transition.errors import InputError
from transition.kernels.choice import balanced_choice

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.law.mott import MottLaw, MottPart

__all__ = ["FEWEST_FOR_A_LAW", "Draw", "Graded", "Quantile", "Sampler", "few_pieces"]

FEWEST_FOR_A_LAW = 8.0  # expected pieces; below, one piece is a large part of the segment and a law has no meaning
_STRATA_PER_FRAGMENT = 8
_TAIL_STRATA = 30


@dataclass(frozen=True, eq=False)
class Draw:
    """Fragments drawn for one segment.

    Attributes
    ----------
    mass : (n,) float64
        Masses (kg), falling.
    deficit : float
        Mass of the segment that no fragment carries (kg).
    closure : float
        Factor by which the masses were multiplied to close on the segment's mass; 1 is none.
    method : str
        "quantile", "graded" or "few_pieces".
    """

    mass: NDArray[np.float64]
    deficit: float
    closure: float
    method: str


class Sampler(Protocol):
    """Draws the masses of a segment's fragments."""

    def draw(self, law: MottLaw, mass: float, generator: np.random.Generator) -> Draw:
        """Fragments of a segment of `mass` (kg) by `law`."""
        ...


@dataclass(frozen=True)
class Quantile:
    """Stratified inverse of the law, balanced on mass.

    A segment of mass M holds nothing heavier than M, so the law is cut there, with mu raised so that the number
    N0 = M/mean stays (`MottLaw.with_mean_below`; nothing to working precision for hundreds of fragments). Strata
    begin at a random position, so masses differ from one realisation to the next; towards the heavy end they shrink by
    halves. Below `FEWEST_FOR_A_LAW` expected pieces `few_pieces` takes over.
    """

    def draw(self, law: MottLaw, mass: float, generator: np.random.Generator) -> Draw:
        """Fragments of a segment of `mass` (kg) by `law`."""
        number = mass / law.mean
        if number < FEWEST_FOR_A_LAW:
            return few_pieces(law, mass, generator)
        law = law.with_mean_below(mass, law.mean)
        shares = np.array([part.weight * -np.expm1(-float(part.reduced(mass))) for part in law.parts])
        counts = number * shares / shares.sum()
        strata = [_strata(p, float(n), mass, generator) for p, n in zip(law.parts, counts, strict=True)]
        candidates = np.concatenate([m for m, _ in strata])
        probability = np.concatenate([p for _, p in strata])
        heavy_first = np.argsort(-candidates, kind="stable")
        candidates, probability = candidates[heavy_first], probability[heavy_first]
        chosen = candidates[balanced_choice(candidates, probability, mass, generator.random(candidates.size))]
        closure = mass / chosen.sum()
        return Draw(chosen * closure, 0.0, float(closure), "quantile")


def _strata(
    part: MottPart, number: float, heaviest: float, generator: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean mass (kg) and expected number of every stratum of a part of the law cut at `heaviest` (kg)."""
    width = 1.0 / _STRATA_PER_FRAGMENT
    first = width * (1.0 - generator.random())
    tail = first * 0.5 ** np.arange(_TAIL_STRATA, 0, -1)
    edges = np.concatenate([[0.0], tail, np.arange(first, number, width), [number]])
    edges = edges[np.concatenate([[True], np.diff(edges) > 0.0])]
    x_cut = float(part.reduced(heaviest))
    within = -np.expm1(-x_cut)
    # Expected number c above m, of `number` up to the cut: c = number (exp(-x) - exp(-x_cut)) / within. The two
    # halves are inverted in the form that keeps all digits there.
    heavy = 2.0 * edges <= number
    x = np.full(edges.size, x_cut)
    x[1:][heavy[1:]] = -np.log(np.exp(-x_cut) + within * edges[1:][heavy[1:]] / number)
    x[~heavy] = -np.log1p(-within * (1.0 - edges[~heavy] / number))
    x[0], x[-1] = x_cut, 0.0
    shape = 1.0 + part.dimension
    # Differences of the upper function lose the light end, those of the lower function the heavy end.
    share = np.where(x[:-1] > shape, np.diff(gammaincc(shape, x)), -np.diff(gammainc(shape, x)))
    expected = np.diff(edges)
    mean = np.minimum(part.mean * share * number / (within * expected), heaviest)
    kept = mean > 0.0
    return mean[kept], expected[kept]


def few_pieces(law: MottLaw, mass: float, generator: np.random.Generator) -> Draw:
    """Draw a few large pieces: never fewer than one, in the proportions of Mott's law, closing on the mass.

    The number is N0 = M/mean, at least one, rounded up or down at random so that its expectation is N0. Each piece
    takes one of n equal parts of the law's probability, a random position in it, and all are scaled to the segment's
    mass. With so few the scaling narrows the spread of masses; the law itself would put pieces heavier than the
    whole segment into one realisation of three.
    """
    number = max(1.0, mass / law.mean)
    whole = int(number)
    whole += int(generator.random() < number - whole)
    survival = (np.arange(whole) + 1.0 - generator.random(whole)) / whole
    drawn = law.inverse(survival)
    if not drawn.sum() > 0.0:
        drawn = np.ones(whole)
    closure = mass / drawn.sum()
    return Draw(np.sort(drawn * closure)[::-1], 0.0, float(closure), "few_pieces")


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

    def draw(self, law: MottLaw, mass: float, generator: np.random.Generator) -> Draw:  # noqa: ARG002 - interface
        """Fragments of a segment of `mass` (kg) by `law`.

        Raises
        ------
        InputError
            Not even the first grade holds one fragment, or the first is heavier than the segment.
        """
        masses, counts = self.grades(law, mass / law.mean, mass)
        if not counts.any():
            raise InputError(
                f"sampler 'graded': the first grade (m_0 + dm = {(self.m0 + self.dm) * 1e3:g} g) holds less than one "
                f"of the {mass / law.mean:.1f} fragments expected, or is heavier than the {mass:g} kg of the segment; "
                "change graded_dm, or take the sampler 'quantile'"
            )
        drawn = np.repeat(masses, counts)[::-1]
        return Draw(drawn, float(mass - drawn.sum()), 1.0, "graded")

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
