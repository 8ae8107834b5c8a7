"""Choice of the burst's geometry, with its reason: meridian of one round, three dimensions, or a section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from fragfield.case.conversion.burst import burst_rounds, settings_in
from fragfield.errors import InputError

if TYPE_CHECKING:
    from fragfield.case.schema import Case

__all__ = ["GeometryChoice", "burst_geometry", "check_geometry", "refuse_section"]


_NAMES = {
    "axisymmetric": "axisymmetric (the meridian of the round)",
    "3d": "three dimensions",
    "plane": "plane section: no axial flow",
}


@dataclass(frozen=True)
class GeometryChoice:
    """What was chosen, and the reason in words."""

    geometry: Literal["axisymmetric", "3d", "plane"]
    reason: str

    @property
    def words(self) -> str:
        """For log, `check` and report."""
        return f"{_NAMES[self.geometry]}: {self.reason}"


def burst_geometry(case: Case) -> GeometryChoice:
    """Choose the geometry of a resolved case with a burst.

    An `auto` that can be axisymmetric is: one round of revolution, initiated on its axis, with no plane within reach.
    """
    assert case.burst is not None
    wanted = case.burst.geometry
    if wanted in ("3d", "plane"):
        return GeometryChoice(wanted, f'asked for by burst.geometry = "{wanted}"')
    reason = _obstacle(case)
    if reason is not None:
        return GeometryChoice("3d", reason)
    return GeometryChoice("axisymmetric", "one round of revolution, initiated on its axis, out of reach of any plane")


def check_geometry(case: Case) -> list[str]:
    """Faults of a resolved case that asks for an axisymmetric burst or a section and cannot have it."""
    if case.burst is None:
        return []
    if case.burst.geometry == "plane":
        return _section_faults(case)
    if case.burst.section_station is not None:
        found = f'{1e3 * case.burst.section_station:g} mm with burst.geometry = "{case.burst.geometry}"'
        return [f'burst.section_station: found {found}; allowed with geometry = "plane" alone, which is cut there']
    if case.burst.geometry != "axisymmetric":
        return []
    reason = _obstacle(case)
    if reason is None:
        return []
    return [f'burst.geometry: found "axisymmetric", but {reason}; allowed here: "3d", or "auto", which chooses it']


def refuse_section(case: Case, stage: str) -> None:
    """Refuse what cannot be done from a plane section.

    Raises
    ------
    InputError
        The case's burst is a plane section, and `stage` needs whole rounds.
    """
    if case.burst is None or case.burst.geometry != "plane":
        return
    raise InputError(
        f'burst.geometry: found "plane"; {stage} cannot be computed from a plane section, which has no ends, no axial '
        "flow and masses per metre: no break-up, flight or hazard distance follows from it; `fragfield burst` runs it, "
        'for whole rounds use "auto", "axisymmetric" or "3d"'
    )


def _section_faults(case: Case) -> list[str]:
    """Why a case has no plane section."""
    from burst_fenicsx.plane_section.section import find_section

    _, reason = find_section(burst_rounds(case), settings_in(case, "plane"))
    if reason is None:
        return []
    assert case.burst is not None
    key = (
        "burst.section_station"
        if case.burst.section_station is not None and "no charge" in reason
        else "burst.geometry"
    )
    return [f'{key}: found geometry = "plane", but {reason}; allowed here: "3d", or "auto"']


def _obstacle(case: Case) -> str | None:
    """Why the burst cannot be axisymmetric; None where it can."""
    from burst_fenicsx.axisymmetric.applicability import why_not_axisymmetric

    return why_not_axisymmetric(burst_rounds(case), settings_in(case, "3d"))
