"""Giving the mass of the cells to the fragments that cover them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["flood"]

_TRIES = 30


@njit(cache=True, nogil=True)
def _reach(
    start: int,
    need: float,
    over_emptied: bool,
    remaining: NDArray[np.float64],
    neighbours: NDArray[np.int64],
    mark: int,
    stamp: NDArray[np.int64],
    queue: NDArray[np.int64],
) -> tuple[int, float]:
    """Cells from `start` outwards, nearest first, until they hold the mass `need` (kg).

    Writes them into `queue` and returns their number and the mass still missing. `over_emptied` lets the search
    cross cells without mass; `mark` is a number that `stamp` does not hold yet.
    """
    stamp[start] = mark
    queue[0] = start
    head, tail = 0, 1
    while head < tail and need > 0.0:
        cell = queue[head]
        head += 1
        need -= remaining[cell]
        for side in range(6):
            other = neighbours[cell, side]
            if other >= 0 and stamp[other] != mark and (over_emptied or remaining[other] > 0.0):
                stamp[other] = mark
                queue[tail] = other
                tail += 1
    return head, need


@njit(cache=True, nogil=True)
def _take(
    cells: NDArray[np.int64],
    need: float,
    remaining: NDArray[np.float64],
    pieces: int,
    piece_cell: NDArray[np.int64],
    piece_mass: NDArray[np.float64],
) -> tuple[int, float]:
    """Take the mass `need` (kg) from `cells` in turn; returns the number of pieces so far and what is missing."""
    for cell in cells:
        if need <= 0.0:
            break
        taken = min(need, remaining[cell])
        if taken > 0.0:
            need = need - taken
            remaining[cell] = remaining[cell] - taken
            piece_cell[pieces] = cell
            piece_mass[pieces] = taken
            pieces += 1
    return pieces, need


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

    A flood keeps to cells that still have mass. Where a pocket of them is too small for the fragment, it tries the
    next random cell and leaves the pocket to a lighter one. If thirty cells in turn are too small, it goes on over
    emptied cells, so that the missing mass comes from near by, and at last to any cell in `order`.

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
    fragments = fragment_mass.size
    queue = np.empty(remaining.size, dtype=np.int64)
    stamp = np.zeros(remaining.size, dtype=np.int64)
    left = order.copy()
    number_left, place, pieces, mark = left.size, 0, 0, 0
    offset[0] = 0
    for fragment in range(fragments):
        found, missing, tries = 0, 1.0, 0
        while number_left > 0 and missing > 0.0 and tries < _TRIES:
            if place == number_left:  # once round: drop the emptied cells from the list
                kept = 0
                for index in range(number_left):
                    if remaining[left[index]] > 0.0:
                        left[kept] = left[index]
                        kept += 1
                number_left, place = kept, 0
                continue
            start = left[place]
            place += 1
            if remaining[start] > 0.0:
                tries += 1
                mark += 1
                seed[fragment] = start
                found, missing = _reach(
                    start, fragment_mass[fragment], False, remaining, neighbours, mark, stamp, queue
                )
        if tries == 0:
            return fragment
        contiguous[fragment] = missing <= 1e-9 * fragment_mass[fragment]  # round-off aside
        if missing > 0.0:
            mark += 1
            start = seed[fragment]
            found, missing = _reach(start, fragment_mass[fragment], True, remaining, neighbours, mark, stamp, queue)
        pieces, missing = _take(queue[:found], fragment_mass[fragment], remaining, pieces, piece_cell, piece_mass)
        if take_all and fragment == fragments - 1:
            missing = np.inf
        if missing > 0.0:
            pieces, missing = _take(left[:number_left], missing, remaining, pieces, piece_cell, piece_mass)
        offset[fragment + 1] = pieces
    return fragments
