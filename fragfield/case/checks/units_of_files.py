"""Units of mesh files and drawings: a casing that is no casing shows that a length was read in the wrong one."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case.tables.round import RoundTable

__all__ = ["unit_faults"]

_LIMITS = 1e-3, 1e3  # kg: no casing that bursts is lighter or heavier
_USUAL = 0.03, 600.0  # kg: from the smallest shells to bombs
_MUCH = 25.0  # times: masses that differ by less are no matter of units
_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}


def unit_faults(given: RoundTable, mass: float, unit: float) -> Iterator[str]:
    """Faults of a round from a mesh file or a drawing: a mass of the casing that another unit makes plausible.

    Parameters
    ----------
    given : RoundTable
        The round as the case has it.
    mass : float
        Of its casing, by its mesh or its contours (kg).
    unit : float
        In which the file's numbers were read (m).
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
