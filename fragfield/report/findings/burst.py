"""Findings on the burst: ledger, hourglass energy, lost and folded cells, walls, unreacted rounds, contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.hazard.verdict import exposed_rounds, exposure_words
from fragfield.numbers import number
from fragfield.report.findings.finding import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.interface.results import Run
    from fragfield.results.burst import Burst


_MOST_HOURGLASS = 0.1
_MOST_IMBALANCE = 0.05
_MOST_PASSED = 1e-3  # of the casings' mass, through planes or into other rounds
# Overlaps in contact: name in the summary, what overlaps, and the aim in parts of a cell.
_OVERLAPS = (
    ("max_interface_penetration_at_front", "Charge and casing overlap while a front passes", 0.05),
    ("max_interface_penetration", "Charge and casing overlap after the front has passed", 0.01),
    ("max_collision_penetration", "Colliding surfaces overlap", 0.05),
    ("max_plane_penetration", "Casings penetrate a plane", 0.05),
)


def _limit(run: Run) -> tuple[float, str]:
    """Imbalance of energy above which a burst is not to be used, and its words.

    That at which the burst stops, `burst.energy_tolerance`, but never more than 5 %: a tolerance that was raised so
    that a run ends does not make its numbers right.
    """
    tolerance = run.values.burst.energy_tolerance if run.values is not None and run.values.burst is not None else 1.0
    if tolerance < _MOST_IMBALANCE:
        return tolerance, f"above {number(100 * tolerance, 2)} % (`burst.energy_tolerance`)"
    return _MOST_IMBALANCE, f"above {100 * _MOST_IMBALANCE:g} %"


def ledger_findings(run: Run) -> Iterator[Finding]:
    """How well the energy ledger closes, and what the products gave."""
    if (burst := run.summary.burst) is None:
        return
    limit, above = _limit(run)
    error = abs(burst.energy_error)
    text = (
        f"The energy ledger closes within {number(error * 100, 3)} % of the products' work at most, and within "
        f"{number(abs(burst.energy_error_at_end) * 100, 2)} % at the end"
    )
    if not error <= limit:
        yield Finding("stop", f"{text}; {above} the burst is not computed correctly.")
    elif error > 0.01:
        yield Finding("warning", f"{text}; 1 % is the aim.")
    else:
        yield Finding("good", f"{text} (aim: 1 %).")
    yield from _energy_of_contact(burst, limit, above)
    share = burst.products_balance
    text = (
        f"Work done by the products and energy left in them are {number(share * 100, 4)} % of the charges' heat of "
        "detonation"
    )
    if share > 1.01:
        text += (
            ": more than the charges hold, so that speeds are overestimated (known of the product model `landau`; "
            "compare with `landau_cj` or `jwl`)"
        )
    yield Finding("warning" if share > 1.01 else "good", f"{text}.")
    yield from _hourglass(run)
    if abs(burst.momentum_error) > 1e-9:
        yield Finding("warning", f"Total momentum drifts by {burst.momentum_error:.1e} of the momentum summed.")


def _energy_of_contact(burst: Burst, limit: float, above: str) -> Iterator[Finding]:
    """What contact has made or lost, which nothing physical supplies or takes: part of the ledger's imbalance."""
    largest, at_end = burst.contact_error, burst.contact_error_at_end
    verb, nothing = ("lost", "took") if burst.contact.gain < 0.0 else ("made", "supplied")
    text = (
        f"Contact has {verb} {number(100 * at_end, 2)} % of the products' work at the end, and at most "
        f"{number(100 * largest, 2)} % of the work done until then: energy that nothing {nothing}"
    )
    if not largest <= limit:
        yield Finding("stop", f"{text}; {above} the burst is not computed correctly.")
    elif at_end > 0.01:
        yield Finding("warning", f"{text}; 1 % is the aim: repeat with smaller cells and compare.")
    elif largest > 0.01:
        yield Finding("note", f"{text}. It was above 1 % for a time, and is not at the end.")
    else:
        yield Finding("good", f"{text} (aim: 1 %).")


def _hourglass(run: Run) -> Iterator[Finding]:
    """Whether the control of hourglass modes, no physics, took a share of the work that shows in the speeds."""
    taken, work = (run.history.get(name) for name in ("hourglass", "products_work"))
    if taken is None or work is None or not len(work) or not work[-1] > 0.0:
        return
    share = float(taken[-1] / work[-1])
    if share > _MOST_HOURGLASS:
        yield Finding(
            "warning",
            f"Hourglass control took {number(100 * share, 2)} % of the products' work; above 10 % cells fold where "
            "casings meet, and speeds are underestimated: repeat with smaller cells or quadrature = “full”.",
        )


def burst_findings(run: Run) -> Iterator[Finding]:
    """Lost and folded cells, torn metal, thin walls, contact, and an end of the burst that comes too early."""
    if (burst := run.summary.burst) is None:
        return
    folded, casing = burst.folded_casing_mass, burst.casing_mass
    if lost := burst.lost_cells:
        cells = burst.symmetry.all_cells or burst.cells
        were = "was" if lost == 1 else "were"
        text = f"{number(lost)} of {number(cells)} cells {were} lost ({100 * lost / cells:.2g} %)"
        yield Finding("stop" if lost > 0.01 * cells else "warning", f"{text}: they became too distorted.")
    elif not folded:
        inner = burst.folded_cells
        lie = "cell lies" if inner == 1 else "cells lie"
        beside = f"; {number(inner)} folded {lie} in the products" if inner else ""
        yield Finding("good", f"No cell was lost, and no cell of a casing is folded{beside}.")
    if folded and casing:
        yield Finding(
            "warning",
            f"{number(folded, 3)} kg of the casings ({100 * folded / casing:.2g} %) is folded at the end of the burst "
            "(inverted at a corner), eroded metal apart; results there are not reliable.",
        )
    if (released := burst.released_casing_mass) and casing:
        yield Finding(
            "note",
            f"{number(released, 3)} kg of the casings ({100 * released / casing:.2g} %) is torn metal at the end: "
            "without strength, and folded, flattened or expanded to more than twice its volume. Its stresses were "
            "set to zero; it keeps its mass and momentum; single speeds in it are not reliable.",
        )
    yield from _contact_findings(run, burst)
    yield from _passed_findings(run, burst)
    yield from _unreacted(burst)
    if burst.acceleration_complete is None:
        left = burst.acceleration_left
        how = f": {number(100 * left, 2)} % of its kinetic energy would still come" if left is not None else ""
        yield Finding(
            "warning",
            f"The acceleration of the casings is not complete at the end of the burst{how}. Speeds are those at that "
            "time: underestimated, or those of casings that still collide.",
        )


def _unreacted(burst: Burst) -> Iterator[Finding]:
    """Rounds that were never initiated, that a shock initiated, or whose products gave less than half its heat."""
    ignitions = {one.name: one.ignition for one in burst.rounds}
    for name, found in ignitions.items():
        if not found:
            yield Finding(
                "warning",
                f"Round “{name}” was never initiated: its charge did not detonate within the computed time, and its "
                "casing is not that of a detonated round.",
            )
    for name, exposure, initiated in exposed_rounds(burst.rounds):
        if not initiated:
            yield Finding(
                "note" if exposure.verdict == "below" and exposure.resolved else "warning",
                f"Round “{name}” was not initiated: {exposure_words(exposure)}. The criterion of critical energy is "
                "one of short plane shocks; it does not cover fragments, friction, fire and delayed reaction: a round "
                "below it is not therefore safe.",
            )
    for one in burst.rounds:
        share = one.products_balance
        if share < 0.5 and one.ignition:
            yield Finding(
                "warning",
                f"Round “{one.name}” gave {number(100 * share, 2)} % of its charge's heat of detonation: it was "
                "initiated late, in part, or not at all, and its casing is not that of a detonated round.",
            )
    for name, found in ignitions.items():
        if found and found[0].by == "shock":
            yield Finding(
                "note",
                f"Round “{name}” was initiated by shock, at {number(1e6 * found[0].time, 3)} µs. Whether and "
                "when a shock initiates a charge depends on `initiation` and on the cell size: repeat with other "
                "values of both.",
            )


def _contact_findings(run: Run, burst: Burst) -> Iterator[Finding]:
    """How far surfaces in contact overlap, and whether rounds are in contact at all."""
    overlaps = [(words, float(getattr(burst.contact, name)), aim) for name, words, aim in _OVERLAPS]
    size = burst.cell_size
    if run.values is not None and not run.values.plane:
        own = "a plane of symmetry (found by the program)"
        overlaps = [(words.replace("a plane", own), value, aim) for words, value, aim in overlaps]
    deep = [(words, value / size, aim) for words, value, aim in overlaps if value > aim * size]
    for words, share, aim in deep:
        yield Finding("warning", f"{words} by up to {100 * share:.1f} % of a cell; {100 * aim:g} % is the aim.")
    largest = max(value for _, value, _ in overlaps) / size
    if not deep and largest > 0:
        yield Finding("good", f"Surfaces in contact overlap by at most {100 * largest:.2g} % of a cell.")


def _passed_findings(run: Run, burst: Burst) -> Iterator[Finding]:
    """Whether metal of the casings has passed through planes or into other rounds."""
    if run.values is None or not (run.values.plane or len(run.values.round) > 1):
        return
    passed = burst.passed_through
    planes, rounds = passed.largest_beyond_planes, passed.largest_in_other_rounds
    share = passed.largest_together / burst.casing_mass
    if share > _MOST_PASSED:
        yield Finding(
            "warning",
            f"{100 * share:.2g} % of the casings' mass passed through contact: up to {number(1e3 * planes, 2)} g lay "
            f"behind a plane and {number(1e3 * rounds, 2)} g within another round; at 1 % the burst stops.",
        )
    else:
        words = "No metal" if not planes + rounds else f"No more than {100 * share:.2g} % of the metal"
        yield Finding("good", f"{words} of the casings passed through a plane or into another round.")
