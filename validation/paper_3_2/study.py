"""Section 3.2 of the paper: two M107 side by side on a witness ring, beside the single round."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from validation.paper_3_2.ring import Estimate, Ring, mean_of, ratio_of_means, ring_of_run
from validation.runs import reference_beside

if TYPE_CHECKING:
    from validation.rows import Rows
    from validation.runs import Geometry, Runs

__all__ = ["REFERENCE", "check_pair", "study"]

REFERENCE = reference_beside(__file__)
LOBE = 60.0
"""Degrees from the focus beyond which the pair is undisturbed."""
_SEEDS = {"quarter": 1, "single": 2, "full": 4}
"""Ensembles that are compared have seeds of their own."""
_FRACTION = 0.99


def study(runs: Runs, rows: Rows) -> None:
    """Compare the pair, a quarter of it computed, with the single round at every cell size, and once with the whole."""
    sizes = REFERENCE["quick_sizes" if rows.quick else "sizes"]
    rings = {size: _ring(runs, rows, "quarter", size) for size in sizes}
    for size, pair in rings.items():
        check_pair(rows, size, pair, _ring(runs, rows, "single", size))
    size = sizes[0]
    whole, quarter = _ring(runs, rows, "full", size), rings[size]
    kinds: tuple[tuple[Literal["number", "mass"], str], ...] = (("number", ""), ("mass", "kg"))
    for kind, unit in kinds:
        ours, base = (mean_of(ring.per_degree((0.0, 10.0), kind)) for ring in (whole, quarter))
        rows.trend(f"{size}, both rounds in full: {kind} a degree within 10 deg", ours.value, base.value,
                   "a quarter of the pair", unit, standard_error=ours.error)  # fmt: skip


def _ring(runs: Runs, rows: Rows, form: str, size: str) -> Ring:
    """Realisations of one form of the burst on the ring."""
    case, symmetry, geometry = REFERENCE["forms"][form]
    shape: Geometry = geometry
    changes: dict[str, Any] = {"burst.symmetry": symmetry}
    folder, _ = runs.burst(f"paper_3_2_{form}", case, size, changes, shape)
    count = REFERENCE["quick_realisations" if rows.quick else "realisations"]
    return ring_of_run(folder, 1 if form == "single" else 2, seed=_SEEDS[form], realisations=count,
                       threads=runs.threads)  # fmt: skip


def check_pair(rows: Rows, size: str, pair: Ring, single: Ring) -> None:
    """Numbers and speeds about the focus over the single round's, which is alike at all azimuths."""
    everywhere, source = (0.0, 90.0), REFERENCE["source"]
    number = mean_of(single.per_degree(everywhere))

    def beside(quantity: str, found: Estimate, reference: float) -> None:
        rows.compare(f"{size}: {quantity}", found.value, reference, source, standard_error=found.error)

    for width in REFERENCE["half_widths"]:
        ratio = mean_of(pair.per_degree((0.0, width))).over(number)
        beside(f"number within {width:g} deg of the focus over the single round's", ratio, REFERENCE["number_ratio"])
    fast = mean_of(pair.fast_speed((0.0, 10.0), _FRACTION))
    ratio = fast.over(mean_of(single.fast_speed(everywhere, _FRACTION)))
    beside("speed of 99 % of the fragments within 10 deg over the single round's", ratio, REFERENCE["speed_ratio"])
    ratio = mean_of(pair.per_degree((LOBE, 90.0))).over(number)
    beside(f"number beyond {LOBE:g} deg over the single round's", ratio, 1.0)
    ratio = mean_of(pair.mean_speed((LOBE, 90.0))).over(mean_of(single.mean_speed(everywhere)))
    beside(f"mean speed beyond {LOBE:g} deg over the single round's", ratio, 1.0)
    mass = ratio_of_means(pair.per_degree((0.0, 10.0), "mass"), pair.per_degree((LOBE, 90.0), "mass"))
    rows.trend(f"{size}: mass a degree within 10 deg over that beyond {LOBE:g} deg", mass.value, None, "cells",
               standard_error=mass.error)  # fmt: skip
