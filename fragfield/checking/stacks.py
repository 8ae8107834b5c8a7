"""Large stacks: a block of them that stands for the whole, and the cost on many ranks.

A casing feels the rounds next to it, which keep from it what comes from beyond: that changes its mean speed by 0.05 %
in a row and by about 1 % in a pallet (docs/theory/symmetry.md). Four rounds along each axis have corner, edge and inner
rounds as the whole, and planes of symmetry that cut none of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.placing import first_alike
from fragfield.checking.cost import BYTES_AT_START, EXPANSION_AT_END

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fragfield.case import CaseTable

__all__ = ["RANKS", "block_of", "on_cores"]

_ALONG = 4  # rounds along an axis of a block
RANKS = 64
_EFFICIENCY = 0.82  # of two ranks that have a round each, `benchmarks/README.md`; more have not been measured


def block_of(case: CaseTable, clearance: float, diameter: float) -> tuple[CaseTable, tuple[int, ...]] | None:
    """The smallest block of a row or a pallet in which every round stands as in the whole.

    Parameters
    ----------
    case : CaseTable
        Resolved, with a burst.
    clearance, diameter : float
        Smallest clear distance of two rounds, and their diameter (m): casings farther apart are accelerated before they
        meet, and one round stands for all.

    Returns
    -------
    The case of the block, and its numbers of rounds along x, y and z. None where the rounds are no grid, differ, or are
    not all initiated at once, and where the block is the whole.
    """
    rounds = case.round
    if len({(entry.axis, tuple(entry.ignition or ())) for entry in rounds}) != 1 or not rounds[0].ignition:
        return None
    if any(first_alike(case)):
        return None
    places = np.round([entry.position for entry in rounds], 6)
    levels = [np.unique(along, return_inverse=True) for along in places.T]
    counts = [len(values) for values, _ in levels]
    along = _ALONG if clearance < (EXPANSION_AT_END - 1.0) * diameter else 1
    if int(np.prod(counts)) != len(rounds) or max(counts) <= along:
        return None
    inside = np.all([place < along for _, place in levels], axis=0)
    within = [entry for entry, kept in zip(rounds, inside.tolist(), strict=True) if kept]
    return case.model_copy(update={"round": within}), tuple(min(count, along) for count in counts)


def on_cores(expected: Mapping[str, Any], cores: int, *, ranks: bool) -> dict[str, Any]:
    """Seconds and memory of a burst on several cores: as so many threads, or as so many ranks."""
    return {
        "cores": cores,
        "seconds": expected["core_seconds"] / (cores * (_EFFICIENCY if cores > 1 else 1.0)),
        "memory_bytes": expected["memory_bytes"] + (cores - 1) * BYTES_AT_START * ranks,
    }
