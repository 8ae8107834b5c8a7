"""Masses against what they should be: of rounds as the drawing gives them (`round.expected`), of an arena table.

A mass that no casing has shows that the numbers of a mesh file or a drawing were read in the wrong unit.
"""

from __future__ import annotations

from collections.abc import Iterator

from flight.arena import ArenaTable
from fragfield.case.conversion.rounds import are_alike, first_alike, masses_of
from fragfield.case.faults import Fault
from fragfield.case.schema import CaseTable
from fragfield.case.tables.round import RoundTable
from fragfield.errors import InputError
from fragfield.results.flight import Recovered

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


def check_expected(case: CaseTable) -> Iterator[Fault]:
    """Faults of a resolved case: masses that are off by more than `TOLERANCE`, one line for rounds that are alike."""
    seen = set()
    for number, (entry, first) in enumerate(zip(case.round, first_alike(case), strict=True), start=1):
        expected, key = entry.expected, f"round[{number}].expected"
        if expected is None or (first, expected) in seen:
            continue
        seen.add((first, expected))
        if expected.casing is None and expected.charge is None:
            yield Fault(key, 'found no mass; allowed: casing, charge or both, for example { casing = "34.5 kg" }')
            continue
        masses = masses_of(entry)
        for name, wanted, found in (
            ("casing", expected.casing, masses.casing),
            ("charge", expected.charge, masses.charge),
        ):
            if wanted is None or abs(found - wanted) <= TOLERANCE * wanted:
                continue
            factor = found / wanted
            yield Fault(
                f"{key}.{name}",
                f"found {wanted:.4g} kg, and the {'mesh' if entry.mesh is not None else 'contours'} with "
                f"{_density(entry, name)} give {found:.4g} kg, {_times(factor)}"
                f"{f' ({cause})' if (cause := likely_cause(factor)) else ''}; allowed: within {100.0 * TOLERANCE:g} %: "
                "correct the contours, the material or the expected mass",
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


_WARNED = 0.9
RECOVERED = (0.5, 1.1)
"""Mass of an arena table over the casing's with which it is flown."""


def _recovered(mass: float, casing: float | None, arena_mass: str) -> Recovered:
    """What a table holds of one round (kg), and how it is flown, in words for terminal, log and report."""
    fraction, factor = None if casing is None else mass / casing, 1.0
    words = f"the arena table holds {mass:.4g} kg of fragments"
    if fraction is None:
        words += (
            "; without a table [[round]] the mass of the casing is not known, nor the fraction of it that was recovered"
        )
    else:
        words += f", {100.0 * fraction:.3g} % of the {casing:.4g} kg of the casing"
        if arena_mass == "scaled":
            factor = 1.0 / fraction
            words += f"; its numbers are flown times {factor:.4g}, scaled to the casing"
    return Recovered(
        mass=mass, casing_mass=casing, arena_mass=arena_mass, fraction=fraction, factor=factor, words=words
    )


def recovered_warning(found: Recovered) -> str:
    """What is doubtful in it; empty where all is well."""
    if found.fraction is None or _WARNED <= found.fraction <= RECOVERED[1]:
        return ""
    if found.arena_mass == "scaled":
        return f"{found.words}: what was not recovered is taken to have flown as what was"
    if found.fraction < _WARNED:
        return (
            f"{found.words}: fragments that were not recovered are not flown, so that densities and distances are "
            'too small; flight.arena_mass = "scaled" scales the numbers to the casing'
        )
    return f"{found.words}: more than the round has"


def recovered_mass(case: CaseTable, table: ArenaTable, name: str) -> Recovered:
    """Compare an arena table, from a file `name`, with the casing of the resolved case's rounds.

    Raises InputError: the rounds of the case differ, so that one table cannot stand for all; a fragment is heavier than
    the casing; or the mass is below 50 % or above 110 % of the casing's and `flight.arena_mass` does not say that this
    is meant.
    """
    meant = case.flight.arena_mass
    if not table.total_mass > 0.0:
        raise InputError(f"{name}: found no fragment; allowed: an arena table of a round that burst")
    if not case.round:
        if meant == "scaled":
            raise InputError(
                f'{name}: flight.arena_mass: found "scaled" without a table [[round]], so that the mass of the casing '
                'is not known; allowed: "checked" or "as_given", or a round with its profile and casing'
            )
        return _recovered(table.total_mass, None, meant)
    if not are_alike(case):
        raise InputError(
            f"{name}: an arena table holds the fragments of one kind of round, and those of the case differ; allowed: "
            "rounds alike"
        )
    casing = masses_of(case.round[0]).casing
    heaviest = float(table.mass[table.number > 0.0].max(initial=0.0))
    if heaviest > RECOVERED[1] * casing:
        raise InputError(
            f"{name}: mean_mass_kg: found {heaviest:.4g}, more than the casing of round[1], {casing:.4g} kg; allowed: "
            "fragments of that round (is it in kg?)"
        )
    found = _recovered(table.total_mass, casing, meant)
    low, high = RECOVERED
    fraction = found.mass / casing
    if meant == "checked" and not low <= fraction <= high:
        raise InputError(
            f'{name}: {found.words} of round[1]; allowed with flight.arena_mass = "checked": {100.0 * low:g} to '
            f'{100.0 * high:g} %. Are its numbers those of one round, and all zones in it? "scaled" scales the numbers '
            'to the casing, "as_given" flies them as they are'
        )
    return found
