"""Findings on contact: overlap of surfaces, and metal that passed through planes or other rounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.numbers import number
from fragfield.report.blocks import Finding
from fragfield.report.findings.values import value_of

if TYPE_CHECKING:
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["contact_findings", "passed_findings"]

_MOST_PASSED = 1e-3  # of the casings' mass, through planes or into other rounds
# Overlaps in contact: key of the summary, what overlaps, and the aim in parts of a cell.
_OVERLAPS = (
    ("max_interface_penetration_at_front", "Charge and casing overlap while a front passes", 0.05),
    ("max_interface_penetration", "Charge and casing overlap after the front has passed", 0.01),
    ("max_collision_penetration", "Colliding surfaces overlap", 0.05),
    ("max_plane_penetration", "Casings penetrate a plane", 0.05),
)


def contact_findings(run: RunFiles, size: float) -> list[Finding]:
    """How far surfaces in contact overlap, and whether rounds are in contact at all."""
    part = run.part("burst")
    found: list[Finding] = []
    case = run.case
    if case is not None and case.burst is not None and len(case.round) > 1 and not case.burst.contact.surfaces:
        found.append(
            Finding(
                "warning",
                "Contact of surfaces is switched off: every round is computed as if it were alone, casings pass "
                "through each other, and the distances are not those of a stack.",
            )
        )
    contact = part.get("contact")
    overlaps = [
        (words, value, aim)
        for key, words, aim in _OVERLAPS
        if isinstance(contact, dict) and (value := value_of(contact, key)) is not None
    ]
    if not overlaps:
        deepest = part.get("max_penetration")
        keyed = deepest if isinstance(deepest, dict) else None
        values = [value_of(keyed, key) for key in keyed] if keyed is not None else [value_of(part, "max_penetration")]
        overlaps = [("Surfaces in contact overlap", value, 0.05) for value in values if value is not None]
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


def passed_findings(run: RunFiles) -> list[Finding]:
    """Whether metal of the casings has passed through planes or into other rounds."""
    part = run.part("burst")
    passed, casing = part.get("passed_through"), value_of(part, "casing_mass")
    if (
        not isinstance(passed, dict)
        or not casing
        or run.case is None
        or not (run.case.plane or len(run.case.round) > 1)
    ):
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
