"""Random numbers of the break-up, each addressed by what it is for: a further piece changes none of the others'.

Every quantity of every segment in every realisation has a counter-based stream of its own, and the numbers of a stream
belong to the pieces from the heaviest on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.special import ndtri

if TYPE_CHECKING:
    from numpy.typing import NDArray

Quantity = Literal["attitude", "number", "mass", "points", "curve", "order", "chosen", "scatter"]
_NUMBERS: dict[Quantity, int] = {
    "attitude": 0, "number": 1, "mass": 2, "points": 3, "curve": 4, "order": 5, "chosen": 6, "scatter": 7,
}  # fmt: skip
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)


@dataclass(frozen=True)
class Draws:
    """The random numbers of one segment, or of its image, in one realisation."""

    seed: int
    realisation: int = 0
    """Of the ensemble, and the number of the realisation therein."""
    segment: tuple[int, ...] = ()
    """What the numbers are drawn for: round, segment and image; empty for a realisation as a whole."""

    def generator(self, quantity: Quantity) -> np.random.Generator:
        """A generator of a quantity of its own, always at its beginning."""
        return self._generator(quantity, self.realisation)

    def uniform(self, quantity: Quantity, *shape: int) -> NDArray[np.float64]:
        """Uniform numbers in (0, 1) of a shape; the rows of fewer are the first of more."""
        return self.generator(quantity).random(shape) + 2.0**-54

    def normal(self, quantity: Quantity, *shape: int) -> NDArray[np.float64]:
        """Standard normal numbers, one for each uniform number."""
        return np.asarray(ndtri(self.uniform(quantity, *shape)))

    def rounded(self, expected: float) -> int:
        """A number of pieces whose expectation is `expected`: over realisations the roundings follow a lattice."""
        shift = self._generator("number").random()
        return int(expected + (shift + self.realisation * _GOLDEN) % 1.0)

    def _generator(self, quantity: Quantity, *realisation: int) -> np.random.Generator:
        key = (_NUMBERS[quantity], *self.segment, *realisation)
        return np.random.Generator(np.random.Philox(np.random.SeedSequence(self.seed, spawn_key=key)))
