"""Giving the mass of the cells to the fragments that cover them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["flood"]


@njit(cache=True, nogil=True)
def flood(
    remaining: NDArray[np.float64],
    neighbours: NDArray[np.int64],
    order: NDArray[np.int64],
    fragment_mass: NDArray[np.float64],
    take_all: bool,
    seed: NDArray[np.int64],
    contiguous: NDArray[np.bool_],
    offset: NDArray[np.int64],
    piece_cell: NDArray[np.int64],
    piece_mass: NDArray[np.float64],
) -> int:
    """Give the cells' mass to fragments: each floods from a cell over face neighbours until its mass is covered.

    A flood first keeps to cells that still have mass. Where these end before the fragment is covered, it goes on
    over emptied cells as well, so that the missing mass comes from near by, and at last to any cell in `order`.

    Parameters
    ----------
    remaining : (m,) float64
        Mass left in the cells (kg); emptied here.
    neighbours : (m, 6) int64
        Face neighbours, -1 where there is none.
    order : (m,) int64
        Cells in random order; a fragment starts from the next one with mass left, round and round.
    fragment_mass : (n,) float64
        Masses of the fragments in the order of placing (kg).
    take_all : bool
        The last fragment also takes what round-off has left anywhere.
    seed, contiguous : (n,)
        Written: the fragment's first cell, and whether one flood over cells with mass covered it.
    offset : (n + 1,) int64
        Written: pieces `offset[f]` to `offset[f + 1]` belong to fragment f.
    piece_cell, piece_mass : (m + n,)
        Written: cell and mass (kg) of every piece. Each piece empties a cell or completes a fragment: m + n suffice.

    Returns
    -------
    int
        Number of fragments placed; fewer than n only if the cells' mass ran out.
    """
    cells = remaining.size
    fragments = fragment_mass.size
    queue = np.empty(cells, dtype=np.int64)
    stamp = np.zeros(cells, dtype=np.int64)
    left = order.copy()
    number_left = cells
    place = 0
    pieces = 0
    offset[0] = 0
    for fragment in range(fragments):
        start = -1
        while number_left > 0:
            if place == number_left:  # once round: drop the emptied cells from the list
                kept = 0
                for index in range(number_left):
                    if remaining[left[index]] > 0.0:
                        left[kept] = left[index]
                        kept += 1
                number_left = kept
                place = 0
                continue
            start = left[place]
            place += 1
            if remaining[start] > 0.0:
                break
            start = -1
        if start < 0:
            return fragment
        seed[fragment] = start
        contiguous[fragment] = True
        need = fragment_mass[fragment]
        for attempt in range(2):
            mark = 2 * fragment + attempt + 1
            stamp[start] = mark
            queue[0] = start
            head, tail = 0, 1
            while head < tail and need > 0.0:
                cell = queue[head]
                head += 1
                if remaining[cell] > 0.0:
                    if attempt == 1:
                        contiguous[fragment] = False
                    taken = min(need, remaining[cell])
                    need = need - taken
                    remaining[cell] = remaining[cell] - taken
                    piece_cell[pieces] = cell
                    piece_mass[pieces] = taken
                    pieces += 1
                for side in range(6):
                    other = neighbours[cell, side]
                    if other >= 0 and stamp[other] != mark and (attempt == 1 or remaining[other] > 0.0):
                        stamp[other] = mark
                        queue[tail] = other
                        tail += 1
            if need <= 0.0:
                break
        last = take_all and fragment == fragments - 1
        if need > 0.0 or last:
            for index in range(number_left):
                cell = left[index]
                if (need > 0.0 or last) and remaining[cell] > 0.0:
                    taken = remaining[cell] if last else min(need, remaining[cell])
                    contiguous[fragment] = contiguous[fragment] and taken < 1e-9 * fragment_mass[fragment]
                    need -= taken
                    remaining[cell] = remaining[cell] - taken
                    piece_cell[pieces] = cell
                    piece_mass[pieces] = taken
                    pieces += 1
        offset[fragment + 1] = pieces
    return fragments
