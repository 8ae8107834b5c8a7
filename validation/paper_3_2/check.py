"""Rows of case 3.2: the pair of M107 against the single round, and both against the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from validation.files import reference_beside
from validation.paper_3_2.ratios import (
    FOCUS,
    Estimate,
    beyond,
    fastest_ratio,
    half_width_of,
    integral_above_one,
    number_by_half_width,
    number_ratio,
    peaks,
    sector,
    speed_ratio,
)
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from collections.abc import Mapping

    from validation.ensembles import RingEnsemble
    from validation.ring_counts import RingCounts

__all__ = ["NAME", "PANEL", "REFERENCE", "Finding", "compare_with_mirrored", "compare_with_paper", "sound"]

NAME = "paper_3_2"
REFERENCE = reference_beside(__file__)
PANEL = 5.0
"""Width of the wider bins (degrees): the largest speed of a bin grows with the hits in it."""


@dataclass(frozen=True)
class Finding:
    """What one surface shows: its rows, the half-width at which the number ratio is the paper's, and what follows."""

    rows: list[Row]
    half_width: Estimate | None
    sentence: str


def sound(summaries: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """Whether runs may be compared at all: ledgers closed, no cell lost; one cell size, end and product model.

    Parameters
    ----------
    summaries : mapping from what the run is ("single", "pair", ...) to its summary.json
        The first is the one that the others are compared with.
    """
    allowed = REFERENCE["allowed"]["energy_error"]
    rows = []
    for name, summary in summaries.items():
        burst = summary["burst"]
        rows.append(
            within(
                NAME,
                f"{name}: energy error at the outputs",
                burst["energy_error_at_outputs"],
                0.0,
                allowed,
                "own bound",
            )
        )
        rows.append(within(NAME, f"{name}: lost cells", float(burst["lost_cells"]), 0.0, 0.0, "own bound"))
    first, *others = summaries
    base = summaries[first]["burst"]
    for name in others:
        burst = summaries[name]["burst"]
        what = f"{name}: cell size as of the {first}"
        rows.append(compare(NAME, what, 1e3 * burst["cell_size"], 1e3 * base["cell_size"], 1e-9, "own bound", "mm"))
        what = f"{name}: end of the burst as of the {first}"
        rows.append(compare(NAME, what, 1e6 * burst["end_time"], 1e6 * base["end_time"], 0.02, "own bound", "us"))
        alike = float(burst["products"] == base["products"])
        rows.append(within(NAME, f"{name}: product model as of the {first}", alike, 1.0, 1.0, "own bound"))
    return rows


def compare_with_paper(pair: RingEnsemble, single: RingEnsemble, surface: str) -> Finding:
    """Rows of one surface.

    Parameters
    ----------
    pair, single : RingEnsemble
        Ensembles with seeds of their own.
    surface : "every_height" or "band"
        Which part of the ring.
    """
    ours, base = getattr(pair, surface), getattr(single, surface)
    words = {"every_height": "ring", "band": "band of 2.4 m"}[surface]
    rows = _sector_rows(ours, base, words)
    rows += _peak_rows(ours, base, words)
    half_widths, ratios = number_by_half_width(ours, base)
    met = half_width_of(half_widths, ratios, REFERENCE["number_ratio"])
    rows += _at_the_collision(ours, base, met, ratios, words)
    rows += _undisturbed(ours, base, words)
    rows += _conservation(pair, single, surface, words)
    return Finding(rows, met, _sentence(met, ratios, words))


def _row(quantity: str, found: Estimate, reference: float, tolerance: float | None, unit: str = "") -> Row:
    named = f"{quantity} (standard error {found.error:.2g})"
    return compare(NAME, named, found.value, reference, tolerance, REFERENCE["source"], unit)


def _sector_rows(ours: RingCounts, base: RingCounts, words: str) -> list[Row]:
    rows = []
    for half_width in REFERENCE["half_widths"]:
        for centres in ((90.0,), (270.0,), FOCUS):
            where = sector(ours, half_width, centres)
            place = " and ".join(f"{centre:g}" for centre in centres)
            quantity = f"{words}: number ratio within {half_width:g} deg of {place}"
            rows.append(_row(quantity, number_ratio(ours, base, where), REFERENCE["number_ratio"], None))
        where, reference = sector(ours, half_width), REFERENCE["speed_ratio"]
        place = f"within {half_width:g} deg of 90 and 270"
        wide, wide_base = ours.in_bins_of(PANEL), base.in_bins_of(PANEL)
        largest = speed_ratio(ours, base, where, "largest")
        panel = speed_ratio(wide, wide_base, sector(wide, half_width), "largest")
        mean = speed_ratio(ours, base, where, "mean")
        rows.append(_row(f"{words}: ratio of largest initial speeds in 1 deg, {place}", largest, reference, None))
        rows.append(_row(f"{words}: ratio of largest initial speeds in 5 deg, {place}", panel, reference, None))
        fastest = fastest_ratio(ours, base, half_width)
        rows.append(_row(f"{words}: ratio of largest initial speeds in the sector, {place}", fastest, reference, None))
        rows.append(_row(f"{words}: ratio of mean initial speeds, {place}", mean, reference, None))
    return rows


def _peak_rows(ours: RingCounts, base: RingCounts, words: str) -> list[Row]:
    """The curves' peaks, as the paper reads its own; it states no width of its bins."""
    rows = []
    for width in REFERENCE["bins"]:
        number, speed = peaks(ours, base, width)
        what = f"{words}: peak of the %s by azimuth, bins of {width:g} deg"
        rows.append(_row(what % "number", number, REFERENCE["number_ratio"], None))
        rows.append(_row(what % "largest initial speed", speed, REFERENCE["speed_ratio"], None))
    return rows


def _at_the_collision(
    ours: RingCounts, base: RingCounts, met: Estimate | None, ratios: list[Estimate], words: str
) -> list[Row]:
    """The paper states no sector. Where its number ratio is met, its speed ratio must be met too."""
    allowed, wanted = REFERENCE["allowed"], REFERENCE["number_ratio"]
    if met is None:
        highest = max(ratios, key=lambda ratio: ratio.value)
        return [_row(f"{words}: highest number ratio of any half-width", highest, wanted, allowed["number"])]
    where = sector(ours, max(met.value, ours.width))
    place = f"within {met.value:.1f} deg, where the number ratio is the paper's"
    largest = speed_ratio(ours, base, where, "largest")
    return [
        _row(f"{words}: half-width of the number ratio {wanted:g}", met, _equal_lobes(), None, "deg"),
        _row(f"{words}: ratio of largest initial speeds {place}", largest, REFERENCE["speed_ratio"], allowed["speed"]),
    ]


def _equal_lobes() -> float:
    """Half-width (degrees) of two lobes with the paper's number ratio that leave 1 elsewhere, all hits kept."""
    return 360.0 / (REFERENCE["number_ratio"] - 1.0) / 4.0


def _undisturbed(ours: RingCounts, base: RingCounts, words: str) -> list[Row]:
    limit, allowed = REFERENCE["undisturbed_beyond"], REFERENCE["allowed"]["undisturbed"]
    where = beyond(ours, limit)
    found = {
        "number ratio": number_ratio(ours, base, where),
        "ratio of largest initial speeds in 1 deg": speed_ratio(ours, base, where, "largest"),
        "ratio of mean initial speeds": speed_ratio(ours, base, where, "mean"),
    }
    return [_row(f"{words}: {name} beyond {limit:g} deg", value, 1.0, allowed) for name, value in found.items()]


def _conservation(pair: RingEnsemble, single: RingEnsemble, surface: str, words: str) -> list[Row]:
    """Integral of the number ratio less one against a count that knows no azimuth.

    Two rounds give twice the fragments, an integral of 360 degrees, less what misses and less what a slower casing
    breaks coarser (Eq. 21).
    """
    caught = [float((ring.fragments - ring.missed[surface]).mean()) for ring in (pair, single)]
    expected = 360.0 * (caught[0] / caught[1] - 1.0)
    integral = integral_above_one(getattr(pair, surface), getattr(single, surface))
    quantity = f"{words}: integral of the number ratio less 1 (all caught and as fine: 360)"
    flown = [float(ring.fragments.mean()) for ring in (pair, single)]
    source = f"hits: {caught[0]:.0f} of the pair's {flown[0]:.0f}, {caught[1]:.0f} of {flown[1]:.0f}"
    finer = 0.5 * flown[0] / flown[1]
    return [
        compare(NAME, quantity, integral, expected, REFERENCE["allowed"]["conservation"], source, "deg"),
        compare(NAME, f"{words}: fragments of the pair over those of two single rounds", finer, 1.0, None, "the law"),
    ]


def _sentence(met: Estimate | None, ratios: list[Estimate], words: str) -> str:
    wanted = REFERENCE["number_ratio"]
    if met is None:
        highest = max(ratio.value for ratio in ratios)
        return (
            f"On the {words} no sector about the focus holds {wanted:g} times the single round's number: the highest "
            f"ratio is {highest:.2f}."
        )
    return (
        f"On the {words} the number ratio of {wanted:g} is met by sectors of {met.value:.1f} ± {met.error:.1f} degrees "
        "on either side of the focus; narrower sectors hold more, wider ones less. The paper states no sector, so its "
        "figure fixes the half-width, not the ratio; if the density elsewhere stayed as for a single round and no "
        f"hit were lost, the half-width would be {_equal_lobes():.0f} degrees."
    )


def compare_with_mirrored(pair: RingEnsemble, mirrored: RingEnsemble, single: RingEnsemble) -> list[Row]:
    """Rows of the pair in full against one round with a plane of symmetry: the same ratios."""
    tolerance = REFERENCE["allowed"]["mirrored"]
    full, half, base = pair.every_height, mirrored.every_height, single.every_height
    rows = []
    for half_width in (10.0, 25.0):
        where = sector(full, half_width)
        found = {
            "number ratio": [number_ratio(counts, base, where) for counts in (half, full)],
            "ratio of largest initial speeds in 1 deg": [speed_ratio(c, base, where, "largest") for c in (half, full)],
            "ratio of mean initial speeds": [speed_ratio(c, base, where, "mean") for c in (half, full)],
        }
        for name, (one, other) in found.items():
            error = one.over(other).error
            quantity = (
                f"one round with a plane of symmetry: {name} within {half_width:g} deg (standard error {error:.2g})"
            )
            rows.append(compare(NAME, quantity, one.value, other.value, tolerance, "the pair in full"))
    return rows
