"""The part `convergence` of the summary."""

from __future__ import annotations

from typing import Literal

from fragfield.results.part import Part, out


class ConvergedQuantity(Part):
    """Grid convergence of a quantity."""

    values: tuple[float | None, ...] = out("By size, as in `sizes`")
    standard_errors: tuple[float | None, ...] | None = out(
        "Statistical errors, of distances and counts alone", default=None
    )
    order: float | None = out("Observed order")
    order_used: float | None = out("Order of the uncertainty")
    extrapolated: float | None = out("Limit for cells of no size")
    uncertainty: float | None = out("Half-width by the grid, in the quantity's unit")
    factor: float | None = out("Safety factor in it")
    kind: Literal["monotone", "oscillating", "diverging", "two_sizes", "statistical", "constant", "one_size"] = out(
        "Kind of convergence"
    )


class Convergence(Part):
    """Grid convergence of the run's own results, see Theory, Grid convergence."""

    reason: str = out("What was left out, or why a run has none; empty otherwise")
    sizes: tuple[float, ...] | None = out("Cell sizes, ascending", "m", default=None)
    cells: tuple[int, ...] | None = out("Cells", default=None)
    representative_sizes: tuple[float, ...] | None = out("Sizes by the number of cells", "m", default=None)
    realisations: tuple[int, ...] | None = out("Realisations flown", default=None)
    seconds: float | None = out("Time taken", "s", default=None)
    quantities: dict[str, ConvergedQuantity] | None = out("By quantity", default=None)
