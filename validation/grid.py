"""Convergence with the cell size: observed order and extrapolation, where the sequence is monotone."""

from __future__ import annotations

from dataclasses import dataclass
from math import log
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Convergence", "GridIndex", "convergence", "grid_index"]


@dataclass(frozen=True)
class Convergence:
    """What three cell sizes say about the limit.

    Attributes
    ----------
    monotone : whether the changes have one sign and a positive order fits them.
    order : observed order p, None where not monotone.
    limit : Richardson's extrapolation to cell size zero, None where not monotone.
    index : grid convergence index of the finest size (Roache 1994, factor 1.25), a fraction; None where not monotone.
    """

    monotone: bool
    order: float | None
    limit: float | None
    index: float | None


def convergence(sizes: Sequence[float], values: Sequence[float]) -> Convergence:
    """Observed order from the three finest of the sizes.

    Parameters
    ----------
    sizes : cell sizes, from coarse to fine. values : the quantity at each.

    Notes
    -----
    The order solves (f3 - f2)/(f2 - f1) = (h3^p - h2^p)/(h2^p - h1^p), found by bisection because the ratios of
    the sizes differ (Celik et al. 2008).
    """
    (h3, h2, h1), (f3, f2, f1) = sizes[-3:], values[-3:]
    coarse, fine = f3 - f2, f2 - f1
    if fine == 0.0 or coarse / fine <= 0.0:
        return Convergence(False, None, None, None)

    def mismatch(order: float) -> float:
        return (h3**order - h2**order) / (h2**order - h1**order) - coarse / fine

    low, high = 0.05, 12.0
    if mismatch(low) * mismatch(high) > 0.0:
        return Convergence(False, None, None, None)
    for _ in range(80):
        middle = 0.5 * (low + high)
        if mismatch(low) * mismatch(middle) <= 0.0:
            high = middle
        else:
            low = middle
    order = 0.5 * (low + high)
    ratio = (h2 / h1) ** order
    limit = f1 + (f1 - f2) / (ratio - 1.0)
    return Convergence(True, log(ratio) / log(h2 / h1), limit, 1.25 * abs((f1 - f2) / f1) / (ratio - 1.0))


@dataclass(frozen=True)
class GridIndex:
    """Grid convergence index of the finest of three sizes, also where no order can be observed.

    Attributes
    ----------
    kind : "monotone", "oscillatory", or "not converging" (the changes grow, or the last one is none).
    order : observed order, None where not monotone.
    limit : extrapolation to cell size zero, None where not monotone.
    index : fraction of the finest value.
    """

    kind: Literal["monotone", "oscillatory", "not converging"]
    order: float | None
    limit: float | None
    index: float


def grid_index(sizes: Sequence[float], values: Sequence[float], formal_order: float = 2.0) -> GridIndex:
    """Say how far the finest of three sizes may be from the limit.

    Parameters
    ----------
    sizes : cell sizes, from coarse to fine; only their ratios count. values : the quantity at each, the last not zero.
    formal_order : of the scheme. An observed order above it is luck, and is not used for the limit and the index.

    Notes
    -----
    Monotone: Roache (1994), factor 1.25, with the observed order up to the formal one. Otherwise there is neither order
    nor limit; the index is then that of the range of the values, with order 1 and Roache's factor 3 for studies whose
    order is assumed.
    """
    (h3, h2, h1), (f3, f2, f1) = sizes[-3:], values[-3:]
    found = convergence(sizes, values)
    if found.order is not None:
        gain = (h2 / h1) ** min(found.order, formal_order) - 1.0
        return GridIndex("monotone", found.order, f1 + (f1 - f2) / gain, 1.25 * abs((f1 - f2) / f1) / gain)
    spread = max(f1, f2, f3) - min(f1, f2, f3)
    turns = (f3 - f2) * (f2 - f1) < 0.0
    return GridIndex("oscillatory" if turns else "not converging", None, None, 3.0 * spread / abs(f1) / (h3 / h1 - 1.0))
