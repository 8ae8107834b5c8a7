"""Masses of rounds against those that the drawing gives (`round.expected`), and against what a casing may weigh at all.

The second shows that the numbers of a mesh file or a drawing were read in the wrong unit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.case.conversion.placing import first_alike, masses_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case.schema import CaseTable
    from fragfield.case.tables.round import RoundTable


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

_LIMITS = 1e-3, 1e3  # kg: no casing that bursts is lighter or heavier
_USUAL = 0.03, 600.0  # kg: from the smallest shells to bombs
_MUCH = 25.0  # times: masses that differ by less are no matter of units
_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}


def likely_cause(factor: float) -> str:
    """The mistake by which a mass comes out `factor` times as large as it should; empty where none is known."""
    return next((words for known, words in _CAUSES if abs(factor / known - 1.0) < _NEAR), "")


def check_expected(case: CaseTable) -> Iterator[str]:
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


def unit_faults(given: RoundTable, mass: float, unit: float) -> Iterator[str]:
    """Faults of a round from a mesh file or a drawing: a mass of the casing that another unit makes plausible.

    `mass` (kg) is that of its casing by its mesh or its contours, `unit` (m) that in which the file's numbers were
    read.
    """
    low, high = _LIMITS
    inside = low <= mass <= high
    if given.expected is not None and given.expected.casing is not None and inside:
        return  # the drawing's own mass decides
    if inside and _USUAL[0] <= mass <= _USUAL[1]:
        return
    others = {name: mass * (scale / unit) ** 3 for name, scale in _UNITS.items()}
    likely = " or ".join(
        f"{name} ({_mass(other)})"
        for name, other in others.items()
        if _USUAL[0] <= other <= _USUAL[1] and max(other / mass, mass / other) >= _MUCH
    )
    if inside and not likely:
        return
    key = "mesh_unit" if given.mesh is not None else "contour.unit"
    yield (
        f"the casing has {_mass(mass)}{f'; the numbers of the file look like {likely}' if likely else ''}; "
        f"allowed: {_mass(low)} to {_mass(high)}; give {key}, or the mass as expected, which confirms it"
    )


def _mass(mass: float) -> str:
    if mass < 1e-3:
        return f"{1e6 * mass:.3g} mg"
    if mass < 1.0:
        return f"{1e3 * mass:.3g} g"
    return f"{mass:.4g} kg" if mass < 1e3 else f"{1e-3 * mass:.4g} t"
