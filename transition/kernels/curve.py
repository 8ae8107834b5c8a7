"""Positions along a space-filling curve over a sheet: a chain of Hilbert's curves, flat and then in three axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from transition.kernels.compiling import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["curve_positions"]


@kernel
def curve_positions(unit: NDArray[np.float64], blocks: int, flat: int, deep: int) -> NDArray[np.int64]:
    """Number (p,) along the curve of the cell that every point lies in.

    The sheet is a row of square `blocks` along its first axis. Each is divided `flat` times into four across its whole
    depth, and what this leaves `deep` times into eight. The curve enters every cell at a corner and leaves it at a
    neighbouring one, where the next begins, so that neighbours along it are neighbours in the sheet (D. Hilbert 1891;
    states of corner and direction as in Hamilton and Rau-Chaplin 2008).

    Parameters
    ----------
    unit : (p, 3) float64
        Coordinates in [0, 1] along the three sides of the sheet.
    blocks, flat, deep : int
        The bits of a number are those of `blocks`, 2 `flat` and 3 `deep`: 63 in all at most.
    """
    key = np.empty(len(unit), dtype=np.int64)
    fine, thin = 1 << (flat + deep), 1 << deep
    for i in range(len(unit)):
        along = unit[i, 0] * blocks
        h = min(int(along), blocks - 1)
        x = min(int((along - h) * fine), fine - 1)
        y, z = min(int(unit[i, 1] * fine), fine - 1), min(int(unit[i, 2] * thin), thin - 1)
        entry, direction = 0, 0
        for level in range(flat + deep - 1, -1, -1):
            corner = ((x >> level) & 1) | (((y >> level) & 1) << 1)
            n = 2
            if level < deep:
                n, corner = 3, corner | (((z >> level) & 1) << 2)
            mask, turn = (1 << n) - 1, direction + 1
            corner ^= entry
            corner = ((corner >> turn) | (corner << (n - turn))) & mask
            w = corner ^ (corner >> 1) ^ (corner >> 2)  # inverse of the Gray code
            h = (h << n) | w
            if w > 0:
                even = (w - 1) & ~1
                gray = even ^ (even >> 1)
                entry ^= ((gray << turn) | (gray >> (n - turn))) & mask
                ones = w if w & 1 else w - 1
                while ones & 1:  # as many as trailing ones
                    direction += 1
                    ones >>= 1
            direction = (direction + 1) % n
        key[i] = h
    return key
