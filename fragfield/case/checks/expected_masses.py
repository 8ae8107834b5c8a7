"""Masses that a drawing gives, `round.expected`, against those that the contours and materials of a case give."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.case.conversion.placing import first_alike, masses_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case.schema import Case

__all__ = ["TOLERANCE", "check_expected", "likely_cause"]

TOLERANCE = 0.01
"""Difference from the expected mass that is allowed, as a fraction of it."""

_NEAR = 0.06  # of a factor, by which a cause is recognised
_CAUSES = (
    (4.0, "were diameters given for radii?"),
    (0.25, "were radii halved, or given for diameters?"),
    (8.0, "are all lengths twice too long?"),
    (0.125, "are all lengths half as long as they should be?"),
    (25.4**3, "were millimetres read as inches?"),
    (25.4**-3, "were inches read as millimetres?"),
    (1e3, "were millimetres read as centimetres?"),
    (1e-3, "were centimetres read as millimetres?"),
    (1e9, "were millimetres read as metres?"),
    (1e-9, "were metres read as millimetres?"),
    (0.45359237, "was a mass in pounds expected in kg?"),
)


def likely_cause(factor: float) -> str:
    """The mistake by which a mass comes out `factor` times as large as it should; empty where none is known."""
    return next((words for known, words in _CAUSES if abs(factor / known - 1.0) < _NEAR), "")


def check_expected(case: Case) -> Iterator[str]:
    """Faults of a resolved case: masses that are off by more than `TOLERANCE`, one line for rounds that are alike."""
    seen = set()
    for number, (entry, first) in enumerate(zip(case.round, first_alike(case), strict=True), start=1):
        expected, key = entry.expected, f"round[{number}].expected"
        if expected is None or (first, expected) in seen:
            continue
        seen.add((first, expected))
        if expected.casing is None and expected.charge is None:
            yield f'{key}: found no mass; allowed: casing, charge or both, for example {{ casing = "34.5 kg" }}'
            continue
        masses = masses_of(entry)
        for name, wanted, found in (
            ("casing", expected.casing, masses.casing),
            ("charge", expected.charge, masses.charge),
        ):
            if wanted is None or abs(found - wanted) <= TOLERANCE * wanted:
                continue
            factor = found / wanted
            yield (
                f"{key}.{name}: found {wanted:.4g} kg, and the {'mesh' if entry.mesh is not None else 'contours'} with "
                f"{_density(entry, name)} give {found:.4g} kg, {_times(factor)}"
                f"{f' ({cause})' if (cause := likely_cause(factor)) else ''}; allowed: within {100.0 * TOLERANCE:g} %: "
                "correct the contours, the material or the expected mass"
            )


def _density(entry: object, name: str) -> str:
    material = getattr(entry, "casing" if name == "casing" else "explosive")
    return f"{material.name} of {material.density:g} kg/m^3"


def _times(factor: float) -> str:
    if abs(factor - 1.0) < 0.5:
        return f"{abs(factor - 1.0):.1%} {'more' if factor > 1.0 else 'less'}".replace("%", " %")
    return f"{factor:.4g} times as much" if factor > 1.0 else f"{1.0 / factor:.4g} times less"
