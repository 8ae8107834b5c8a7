"""Units of mesh files and drawings: a casing that is no casing shows that a length was read in the wrong one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.case.conversion.placing import masses_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case.tables.round import RoundTable

__all__ = ["unit_faults"]

_LIMITS = 1e-3, 1e3  # kg: no casing that bursts is lighter or heavier
_USUAL = 0.03, 600.0  # kg: from small grenades to bombs
_MUCH = 25.0  # times: masses that differ by less are no matter of units
_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}


def unit_faults(given: RoundTable, resolved: RoundTable) -> Iterator[str]:
    """Faults of a round from a mesh file or a drawing: a mass of the casing that another unit makes plausible.

    Parameters
    ----------
    given, resolved : RoundTable
        The round as the case has it, and with its materials and contour.
    """
    mass = masses_of(resolved).casing
    low, high = _LIMITS
    inside = low <= mass <= high
    if given.expected is not None and given.expected.casing is not None and inside:
        return  # the drawing's own mass decides
    unit, key = (None, "unit") if given.mesh is None else (_UNITS[given.mesh_unit or "m"], "mesh_unit")
    if inside and _USUAL[0] <= mass <= _USUAL[1]:
        return
    likely = [
        f"{words} ({_mass(other)})"
        for words, other in _other_masses(mass, unit)
        if _USUAL[0] <= other <= _USUAL[1] and max(other / mass, mass / other) >= _MUCH
    ]
    if inside and not likely:
        return
    guess = ""
    if likely:
        start = "the file's numbers look like" if unit is not None else "were"
        guess = f"; {start} {' or '.join(likely)}{'' if unit is not None else '?'}"
    yield (
        f"the casing has {_mass(mass)}{guess}; allowed: {_mass(low)} to {_mass(high)}; give {key}, or the mass as "
        "expected, which confirms it"
    )


def _other_masses(mass: float, unit: float | None) -> Iterator[tuple[str, float]]:
    """What the numbers of the file may be, and the mass of the casing then (kg)."""
    if unit is not None:
        yield from ((name, mass * (scale / unit) ** 3) for name, scale in _UNITS.items() if scale != unit)
        return
    names = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "metres": 1.0}
    for true, here in names.items():
        for read, there in names.items():
            if true != read and "millimetres" in (true, read):
                yield f"{true} read as {read}", mass * (here / there) ** 3


def _mass(mass: float) -> str:
    if mass < 1e-3:
        return f"{1e6 * mass:.3g} mg"
    if mass < 1.0:
        return f"{1e3 * mass:.3g} g"
    return f"{mass:.4g} kg" if mass < 1e3 else f"{1e-3 * mass:.4g} t"
