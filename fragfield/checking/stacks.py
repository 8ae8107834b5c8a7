"""Large stacks: which rounds need be computed together, and the cost on many ranks.

In rows and pallets of M107 with gaps of 0 to 1 calibre the speeds of a round's casing, by mass and by side, change by
less than 0.6 % with rounds that do not stand next to it: the one between stops what comes from there. Three rounds
along each axis therefore have a corner, an edge and an inner round as in the whole. See docs/theory/symmetry.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.placing import first_alike
from fragfield.checking.cost import BYTES_AT_START

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fragfield.case import Case

__all__ = ["RANKS", "block_of", "on_cores"]

_ALONG = 3  # rounds along an axis of a block
RANKS = 64
_EFFICIENCY = 0.82  # of two ranks that have a round each, `benchmarks/README.md`; more have not been measured


def block_of(case: Case) -> tuple[Case, tuple[int, ...]] | None:
    """The smallest block of a row or a pallet in which every round stands as in the whole.

    Parameters
    ----------
    case : Case
        Resolved, with a burst.

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
    if int(np.prod(counts)) != len(rounds) or max(counts) <= _ALONG:
        return None
    inside = np.all([place < _ALONG for _, place in levels], axis=0)
    within = [entry for entry, kept in zip(rounds, inside.tolist(), strict=True) if kept]
    return case.model_copy(update={"round": within}), tuple(min(count, _ALONG) for count in counts)


def on_cores(expected: Mapping[str, Any], cores: int, *, ranks: bool) -> dict[str, Any]:
    """Seconds and memory of a burst on several cores: as so many threads, or as so many ranks."""
    return {
        "cores": cores,
        "seconds": expected["core_seconds"] / (cores * (_EFFICIENCY if cores > 1 else 1.0)),
        "memory_bytes": expected["memory_bytes"] + (cores - 1) * BYTES_AT_START * ranks,
    }
