"""Masses of the fragments that the mass of a segment is in, by quantiles of that mass."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import gammaincc

from transition.law.samplers import Graded

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.law.mott import MottLaw
    from transition.law.samplers import Sampler

    Array = NDArray[np.float64]


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
