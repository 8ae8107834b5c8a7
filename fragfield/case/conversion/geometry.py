"""Choice of the burst's geometry, with its reason: meridian of one round, or three dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from fragfield.case.conversion.burst import burst_rounds, settings_in

if TYPE_CHECKING:
    from fragfield.case.schema import Case

__all__ = ["GeometryChoice", "burst_geometry", "check_geometry"]


_NAMES = {
    "axisymmetric": "axisymmetric (the meridian of the round)",
    "3d": "three dimensions",
}


@dataclass(frozen=True)
class GeometryChoice:
    """What was chosen, and the reason in words."""

    geometry: Literal["axisymmetric", "3d"]
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
    if wanted == "3d":
        return GeometryChoice("3d", 'asked for by burst.geometry = "3d"')
    reason = _obstacle(case)
    if reason is not None:
        return GeometryChoice("3d", reason)
    return GeometryChoice("axisymmetric", "one round of revolution, initiated on its axis, out of reach of any plane")


def check_geometry(case: Case) -> list[str]:
    """Faults of a resolved case that asks for an axisymmetric burst and cannot have it."""
    if case.burst is None or case.burst.geometry != "axisymmetric":
        return []
    reason = _obstacle(case)
    if reason is None:
        return []
    return [f'burst.geometry: found "axisymmetric", but {reason}; allowed here: "3d", or "auto", which chooses it']


def _obstacle(case: Case) -> str | None:
    """Why the burst cannot be axisymmetric; None where it can."""
    from burst_fenicsx.axisymmetric.applicability import why_not_axisymmetric

    return why_not_axisymmetric(burst_rounds(case), settings_in(case, "3d"))
