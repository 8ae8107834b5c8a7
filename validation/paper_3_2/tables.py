"""Case 3.2 in the README: the ratios by half-width beside the paper's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.paper_3_2.check import PANEL, REFERENCE
from validation.paper_3_2.ratios import Estimate, beyond, fastest_ratio, number_ratio, sector, speed_ratio
from validation.rows import markdown_table

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from validation.ensembles import RingEnsemble
    from validation.ring_counts import RingCounts

__all__ = ["ratio_table", "sentences", "versions"]

# words, surface, width of the bins, and the ratio in given bins; None where it is that of a whole sector
_Quantity = tuple[str, str, float, "Callable[[RingCounts, RingCounts, NDArray[Any]], Estimate] | None"]


def _largest(ours: RingCounts, base: RingCounts, where: NDArray[Any]) -> Estimate:
    return speed_ratio(ours, base, where, "largest")


def _mean(ours: RingCounts, base: RingCounts, where: NDArray[Any]) -> Estimate:
    return speed_ratio(ours, base, where, "mean")


_QUANTITIES: tuple[_Quantity, ...] = (
    ("number, every height", "every_height", 1.0, number_ratio),
    ("number, band of 2.4 m", "band", 1.0, number_ratio),
    ("largest speed in 1°, every height", "every_height", 1.0, _largest),
    ("largest speed in 5°, every height", "every_height", PANEL, _largest),
    ("largest speed in the sector, every height", "every_height", 1.0, None),
    ("mean speed, every height", "every_height", 1.0, _mean),
    ("largest speed in 1°, band of 2.4 m", "band", 1.0, _largest),
)


def ratio_table(pair: RingEnsemble, single: RingEnsemble) -> str:
    """Pair over single round within every half-width of 90 and 270 degrees, and beyond them, with standard errors."""
    limit = REFERENCE["undisturbed_beyond"]
    head = ["pair over single", *(f"±{half_width:g}°" for half_width in REFERENCE["half_widths"])]
    head += [f"beyond {limit:g}°", "the paper"]
    body = []
    for words, surface, width, ratio in _QUANTITIES:
        ours, base = (getattr(ensemble, surface).in_bins_of(width) for ensemble in (pair, single))
        half_widths = REFERENCE["half_widths"]
        if ratio is None:
            found = [_shown(fastest_ratio(ours, base, half_width), 3) for half_width in half_widths] + ["-"]
        else:
            sectors = [sector(ours, half_width) for half_width in half_widths]
            digits = 2 if ratio is number_ratio else 3
            found = [_shown(ratio(ours, base, where), digits) for where in (*sectors, beyond(ours, limit))]
        paper = REFERENCE["number_ratio"] if "number" in words else REFERENCE["speed_ratio"]
        stated = "1.83 in the focus" if paper < 2.0 else f"{paper:g} in the focus"
        body.append([words, *found, stated])
    return markdown_table(head, body)


def _shown(ratio: Estimate, digits: int) -> str:
    return f"{ratio.value:.{digits}f} ± {ratio.error:.{digits}f}"


def sentences(found: Sequence[str]) -> str:
    """What follows from the half-widths, one paragraph."""
    return " ".join(found)


def versions(summary: Mapping[str, Any]) -> str:
    """What it was computed with."""
    wanted = ("fragfield", "dolfinx", "numpy", "numba", "python")
    known = ", ".join(f"{name} {summary['versions'][name]}" for name in wanted if name in summary["versions"])
    burst = summary["burst"]
    return f"Computed with {known}; cells of {1e3 * burst['cell_size']:g} mm, products {burst['products']}."
