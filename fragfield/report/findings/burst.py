"""Findings on the burst: ledger, hourglass energy, lost and folded cells, walls, unreacted rounds, contact."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fragfield.hazard.verdict import exposed_rounds, exposure_words
from fragfield.numbers import number
from fragfield.report.blocks import Finding
from fragfield.report.findings.hazard import value_of
from fragfield.report.tables.ignition import initiated_by_shock, never_initiated

if TYPE_CHECKING:
    from fragfield.report.reading.run_files import RunFiles


_MOST_HOURGLASS = 0.1
_MOST_IMBALANCE = 0.05
_MOST_PASSED = 1e-3  # of the casings' mass, through planes or into other rounds
# Overlaps in contact: key of the summary, what overlaps, and the aim in parts of a cell.
_OVERLAPS = (
    ("max_interface_penetration_at_front", "Charge and casing overlap while a front passes", 0.05),
    ("max_interface_penetration", "Charge and casing overlap after the front has passed", 0.01),
    ("max_collision_penetration", "Colliding surfaces overlap", 0.05),
    ("max_plane_penetration", "Casings penetrate a plane", 0.05),
)


_OWN_PLANE = "a plane of symmetry (found by the program)"


def _limit(run: RunFiles) -> tuple[float, str]:
    """Imbalance of energy above which a burst is not to be used, and its words.

    That at which the burst stops, `burst.energy_tolerance`, but never more than 5 %: a tolerance that was raised so
    that a run ends does not make its numbers right.
    """
    tolerance = run.case.burst.energy_tolerance if run.case is not None and run.case.burst is not None else 1.0
    if tolerance < _MOST_IMBALANCE:
        return tolerance, f"above {number(100 * tolerance, 2)} % (`burst.energy_tolerance`)"
    return _MOST_IMBALANCE, f"above {100 * _MOST_IMBALANCE:g} %"


def ledger_findings(run: RunFiles) -> list[Finding]:
    """How well the energy ledger closes, and what the products gave."""
    part = run.part("burst")
    found: list[Finding] = []
    error = value_of(part, "energy_error")
    if error is not None:
        text = f"The energy ledger closes within {number(abs(error) * 100, 3)} % of the products' work"
        at_end = value_of(part, "energy_error_at_end")
        if at_end is not None:
            text += f" at most, and within {number(abs(at_end) * 100, 2)} % at the end"
        limit, above = _limit(run)
        if not abs(error) <= limit:
            found.append(Finding("stop", f"{text}; {above} the burst is not computed correctly."))
        elif abs(error) > 0.01:
            found.append(Finding("warning", f"{text}; 1 % is the aim."))
        else:
            found.append(Finding("good", f"{text} (aim: 1 %)."))
    found += _energy_of_contact(run)
    share = value_of(part, "products_balance")
    if share is not None:
        text = f"Work done by the products and energy left in them are {number(share * 100, 4)} % of the charges' heat"
        if share > 1.01:
            found.append(
                Finding(
                    "warning",
                    f"{text} of detonation: more than the charges hold, so that speeds are overestimated "
                    "(known of the product model `landau`; compare with `landau_cj` or `jwl`).",
                )
            )
        else:
            found.append(Finding("good", f"{text} of detonation."))
    found += _hourglass(run)
    momentum = value_of(part, "momentum_error")
    if momentum is not None and abs(momentum) > 1e-9:
        found.append(Finding("warning", f"Total momentum drifts by {momentum:.1e} of the momentum summed."))
    return found


def _energy_of_contact(run: RunFiles) -> list[Finding]:
    """What contact has made or lost, which nothing physical supplies or takes: part of the ledger's imbalance."""
    part = run.part("burst")
    largest, at_end = value_of(part, "contact_error"), value_of(part, "contact_error_at_end")
    if largest is None or at_end is None:
        return []
    contact = part.get("contact")
    gain = None if contact is None else value_of(contact, "gain")
    verb, nothing = ("lost", "took") if gain is not None and gain < 0.0 else ("made", "supplied")
    text = (
        f"Contact has {verb} {number(100 * at_end, 2)} % of the products' work at the end, and at most "
        f"{number(100 * largest, 2)} % of the work done until then: energy that nothing {nothing}"
    )
    limit, above = _limit(run)
    if not largest <= limit:
        return [Finding("stop", f"{text}; {above} the burst is not computed correctly.")]
    if at_end > 0.01:
        return [Finding("warning", f"{text}; 1 % is the aim: repeat with smaller cells and compare.")]
    if largest > 0.01:
        return [Finding("note", f"{text}. It was above 1 % for a time, and is not at the end.")]
    return [Finding("good", f"{text} (aim: 1 %).")]


def _hourglass(run: RunFiles) -> list[Finding]:
    """Whether the control of hourglass modes, no physics, took a share of the work that shows in the speeds."""
    taken, work = (run.history.get(name) for name in ("hourglass", "products_work"))
    if taken is None or work is None or not len(work) or not work[-1] > 0.0:
        return []
    share = float(taken[-1] / work[-1])
    if not share > _MOST_HOURGLASS:
        return []
    return [
        Finding(
            "warning",
            f"Hourglass control took {number(100 * share, 2)} % of the products' work; above 10 % cells fold where "
            "casings meet, and speeds are underestimated: repeat with smaller cells or quadrature = “full”.",
        )
    ]


def burst_findings(run: RunFiles) -> list[Finding]:
    """Lost and folded cells, torn metal, thin walls, contact, and an end of the burst that comes too early."""
    part = run.part("burst")
    found: list[Finding] = []
    folded = value_of(part, "folded_casing_mass")
    lost, cells = (
        value_of(part, "lost_cells"),
        value_of(part.get("symmetry") or part, "all_cells") or value_of(part, "cells"),
    )
    if lost is not None and cells:
        if lost:
            were = "was" if lost == 1 else "were"
            text = f"{number(int(lost))} of {number(int(cells))} cells {were} lost ({100 * lost / cells:.2g} %)"
            found.append(Finding("stop" if lost > 0.01 * cells else "warning", f"{text}: they became too distorted."))
        elif not folded:
            inner = value_of(part, "folded_cells")
            beside = (
                f"; {number(int(inner))} folded {'cell lies' if inner == 1 else 'cells lie'} in the products"
                if inner
                else ""
            )
            found.append(Finding("good", f"No cell was lost, and no cell of a casing is folded{beside}."))
    if folded and (casing := value_of(part, "casing_mass")):
        text = (
            f"{number(folded, 3)} kg of the casings ({100 * folded / casing:.2g} %) is folded at the end of the burst "
            "(inverted at a corner), eroded metal apart; results there are not reliable."
        )
        found.append(Finding("warning", text))
    released, casing = value_of(part, "released_casing_mass"), value_of(part, "casing_mass")
    if released and casing:
        found.append(
            Finding(
                "note",
                f"{number(released, 3)} kg of the casings ({100 * released / casing:.2g} %) is torn metal at the end: "
                "without strength, and folded, flattened or expanded to more than twice its volume. Its stresses were "
                "set to zero; it keeps its mass and momentum; single speeds in it are not reliable.",
            )
        )
    size = run.cell_size or math.nan
    found += [*_contact_findings(run, size), *_passed_findings(run), *_unreacted(run)]
    if "acceleration_complete" in part and part["acceleration_complete"] is None:
        left = value_of(part, "acceleration_left")
        how = f": {number(100 * left, 2)} % of its kinetic energy would still come" if left is not None else ""
        found.append(
            Finding(
                "warning",
                f"The acceleration of the casings is not complete at the end of the burst{how}. Speeds are those at "
                "that time: underestimated, or those of casings that still collide.",
            )
        )
    return found


def _unreacted(run: RunFiles) -> list[Finding]:
    """Rounds that were never initiated, that a shock initiated, or whose products gave less than half its heat."""
    unreacted = never_initiated(run)
    found = [
        Finding(
            "warning",
            f"Round “{name}” was never initiated: its charge did not detonate within the computed time, and its "
            "casing is "
            "not that of a detonated round.",
        )
        for name in unreacted
    ]
    found += [
        Finding(
            "note" if exposure.verdict == "below" and exposure.resolved else "warning",
            f"Round “{name}” was not initiated: {exposure_words(exposure)}. The criterion of critical energy is one of "
            "short plane shocks; it does not cover fragments, friction, fire and delayed reaction: a round below it "
            "is not therefore safe.",
        )
        for name, exposure, initiated in exposed_rounds(run.burst_rounds)
        if not initiated
    ]
    shares = [
        (str(one.get("name")), value_of(one, "products_balance")) for one in run.part("burst").get("rounds") or []
    ]
    found += [
        Finding(
            "warning",
            f"Round “{name}” gave {number(100 * share, 2)} % of its charge's heat of detonation: it was initiated "
            "late, in part, or not at all, and its casing is not that of a detonated round.",
        )
        for name, share in shares
        if share is not None and share < 0.5 and name not in unreacted
    ]
    found += [
        Finding(
            "note",
            f"Round “{name}” was initiated by shock, at {number(1e6 * time, 3)} µs. Whether and when a "
            "shock initiates a charge depends on `initiation` and on the cell size: repeat with other values of both.",
        )
        for name, time in initiated_by_shock(run)
    ]
    return found


def _contact_findings(run: RunFiles, size: float) -> list[Finding]:
    """How far surfaces in contact overlap, and whether rounds are in contact at all."""
    part = run.part("burst")
    found: list[Finding] = []
    contact = part.get("contact") or {}
    overlaps = [(words, value, aim) for key, words, aim in _OVERLAPS if (value := value_of(contact, key)) is not None]
    if run.case is not None and not run.case.plane:
        overlaps = [(words.replace("a plane", _OWN_PLANE), value, aim) for words, value, aim in overlaps]
    if not overlaps or not size > 0:
        return found
    deep = [(words, value / size, aim) for words, value, aim in overlaps if value > aim * size]
    found += [
        Finding("warning", f"{words} by up to {100 * share:.1f} % of a cell; {100 * aim:g} % is the aim.")
        for words, share, aim in deep
    ]
    largest = max(value for _, value, _ in overlaps) / size
    if not deep and largest > 0:
        found.append(Finding("good", f"Surfaces in contact overlap by at most {100 * largest:.2g} % of a cell."))
    return found


def _passed_findings(run: RunFiles) -> list[Finding]:
    """Whether metal of the casings has passed through planes or into other rounds."""
    part = run.part("burst")
    passed, casing = part.get("passed_through"), value_of(part, "casing_mass")
    if not passed or not casing or run.case is None or not (run.case.plane or len(run.case.round) > 1):
        return []
    planes, rounds = (value_of(passed, key) or 0.0 for key in ("largest_beyond_planes", "largest_in_other_rounds"))
    share = (value_of(passed, "largest_together") or 0.0) / casing
    if share > _MOST_PASSED:
        text = (
            f"{100 * share:.2g} % of the casings' mass passed through contact: up to {number(1e3 * planes, 2)} g lay "
            f"behind a plane and {number(1e3 * rounds, 2)} g within another round; at 1 % the burst stops."
        )
        return [Finding("warning", text)]
    words = "No metal" if not planes + rounds else f"No more than {100 * share:.2g} % of the metal"
    return [Finding("good", f"{words} of the casings passed through a plane or into another round.")]
