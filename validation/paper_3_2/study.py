"""Section 3.2 of the paper: two M107 side by side on a witness ring, beside the single round."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.paper_3_2.ring import Estimate, Ring, mean_of, ratio_of_means, ring_of_run
from validation.runs import reference_beside

if TYPE_CHECKING:
    from collections.abc import Mapping

    from validation.rows import Rows
    from validation.runs import Geometry, Runs

__all__ = ["REFERENCE", "check_forms", "check_pair", "check_ring", "study"]

REFERENCE = reference_beside(__file__)
LOBE = 60.0
"""Degrees from the focus beyond which the pair is undisturbed."""
_SEEDS = {"quarter": 1, "single": 2, "mirrored": 3, "full": 4}
"""Ensembles that are compared have seeds of their own."""
_FRACTION = 0.99
_SECTORS = {f"within {width:g} deg": (0.0, width) for width in (5.0, 10.0, 20.0, 35.0)}
_SECTORS |= {f"beyond {LOBE:g} deg": (LOBE, 90.0)}


def study(runs: Runs, rows: Rows) -> None:
    """Compare the pair, a quarter of it computed, with the single round at every cell size; once with more of it."""
    sizes = REFERENCE["quick_sizes" if rows.quick else "sizes"]
    rings = {size: _ring(runs, rows, "quarter", size) for size in sizes}
    for size, pair in rings.items():
        single = _ring(runs, rows, "single", size)
        check_pair(rows, size, pair, single)
        check_ring(rows, size, pair, single)
    size = sizes[0]
    check_forms(rows, size, rings[size], {form: _ring(runs, rows, form, size) for form in ("mirrored", "full")})


def _ring(runs: Runs, rows: Rows, form: str, size: str) -> Ring:
    """Realisations of one form of the burst on the ring."""
    case, symmetry, geometry = REFERENCE["forms"][form]
    shape: Geometry = geometry
    changes: dict[str, Any] = {"burst.symmetry": symmetry}
    folder, _ = runs.burst(f"paper_3_2_{form}", case, size, changes, shape)
    count = REFERENCE["quick_realisations" if rows.quick else "realisations"]
    count *= REFERENCE["more"] if size == REFERENCE["quick_sizes" if rows.quick else "sizes"][0] else 1
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


def check_ring(rows: Rows, size: str, pair: Ring, single: Ring) -> None:
    """Integral of the number ratio less one over the azimuth, against the hits, which know no azimuth."""
    mean = float(single.per_degree((0.0, 90.0)).mean())
    bins = [(low, low + 10.0) for low in range(0, 90, 10)]
    integral = sum(40.0 * (float(pair.per_degree(one).mean()) / mean - 1.0) for one in bins)
    hits, of_single = (len(ring.hits) / ring.fragments.size for ring in (pair, single))
    rows.verify(f"{size}: integral of the number ratio less 1", integral, 360.0 * (hits / of_single - 1.0),
                REFERENCE["conserved"], "all hits, whatever their azimuth", "deg")  # fmt: skip


def check_forms(rows: Rows, size: str, quarter: Ring, others: Mapping[str, Ring]) -> None:
    """Other forms of the pair beside the quarter: of every kind of quantity the sector that is farthest off.

    The grid of all forms is one, so that a round and its mirror image must be alike, to three standard errors at least.
    In the full pair two surfaces touch in place of one and a plane: another contact, whose difference is shown.
    """
    base = _profile(quarter)
    for form, ring in others.items():
        found = _profile(ring)
        for kind, allowed in REFERENCE["alike"].items():
            apart = {place: found[kind, place].over(base[kind, place]) for place in _SECTORS}
            place = max(apart, key=lambda one: abs(apart[one].value - 1.0))
            quantity = (f"{size}, {form}: {kind} {place}, the sector farthest off (standard error "
                        f"{100.0 * apart[place].error:.2g} %)")  # fmt: skip
            unit = {"number": "per degree", "mass": "kg per degree"}.get(kind, "m/s")
            ours, reference, source = found[kind, place].value, base[kind, place].value, "a quarter of the pair"
            if form == "full":
                rows.compare(quantity, ours, reference, source, unit)
            else:
                rows.verify(quantity, ours, reference, max(allowed, 3.0 * apart[place].error), source, unit)


def _profile(ring: Ring) -> dict[tuple[str, str], Estimate]:
    found = {}
    for place, angles in _SECTORS.items():
        found["number", place] = mean_of(ring.per_degree(angles))
        found["mass", place] = mean_of(ring.per_degree(angles, "mass"))
        found["mean speed", place] = mean_of(ring.mean_speed(angles))
        found["99 % of speeds", place] = mean_of(ring.fast_speed(angles, _FRACTION))
    return found
