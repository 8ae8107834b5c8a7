"""Grid convergence index of a quantity over cell sizes, also where no order can be observed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["GridIndex", "grid_index"]


@dataclass(frozen=True)
class GridIndex:
    """How far the finest of three sizes may be from the limit.

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
    """Index of the finest size, from the three finest.

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
    order = _observed_order((h3, h2, h1), (f3, f2, f1))
    if order is not None:
        gain = (h2 / h1) ** min(order, formal_order) - 1.0
        return GridIndex("monotone", order, f1 + (f1 - f2) / gain, 1.25 * abs((f1 - f2) / f1) / gain)
    spread = max(f1, f2, f3) - min(f1, f2, f3)
    turns = (f3 - f2) * (f2 - f1) < 0.0
    return GridIndex("oscillatory" if turns else "not converging", None, None, 3.0 * spread / abs(f1) / (h3 / h1 - 1.0))


def _observed_order(sizes: tuple[float, ...], values: tuple[float, ...]) -> float | None:
    """Root p of (f3 - f2)/(f2 - f1) = (h3^p - h2^p)/(h2^p - h1^p), for any ratios of the sizes (Celik et al. 2008)."""
    (h3, h2, h1), (f3, f2, f1) = sizes, values
    coarse, fine = f3 - f2, f2 - f1
    if fine == 0.0 or coarse / fine <= 0.0:
        return None

    def mismatch(order: float) -> float:
        return (h3**order - h2**order) / (h2**order - h1**order) - coarse / fine

    low, high = 0.05, 12.0
    if mismatch(low) * mismatch(high) > 0.0:
        return None
    for _ in range(80):
        centre = 0.5 * (low + high)
        if mismatch(low) * mismatch(centre) <= 0.0:
            high = centre
        else:
            low = centre
    return 0.5 * (low + high)
