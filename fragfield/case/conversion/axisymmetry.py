"""Whether a burst is computed in the meridian or in three dimensions, and what is alike in every direction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from fragfield.case.conversion.stack import expanded

if TYPE_CHECKING:
    from fragfield.case.schema import CaseTable
    from fragfield.case.tables.round import RoundTable

from fragfield.case.conversion.burst import burst_rounds, settings_in

__all__ = ["GeometryChoice", "all_azimuths_alike", "burst_geometry", "check_geometry", "is_axisymmetric", "is_brief"]


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


def burst_geometry(case: CaseTable) -> GeometryChoice:
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


def is_brief(case: CaseTable) -> bool:
    """Whether a run takes seconds, and has nothing to go on from: its burst is axisymmetric."""
    return case.burst is not None and bool(case.round) and burst_geometry(case).geometry == "axisymmetric"


def check_geometry(case: CaseTable) -> list[str]:
    """Faults of a resolved case that asks for an axisymmetric burst and cannot have it."""
    if case.burst is None or case.burst.geometry != "axisymmetric":
        return []
    reason = _obstacle(case)
    if reason is None:
        return []
    return [f'burst.geometry: found "axisymmetric", but {reason}; allowed here: "3d", or "auto", which chooses it']


def _obstacle(case: CaseTable) -> str | None:
    """Why the burst cannot be axisymmetric; None where it can."""
    from burst_fenicsx.axisymmetric.applicability import why_not_axisymmetric

    return why_not_axisymmetric(burst_rounds(case), settings_in(case, "3d"))


_PARALLEL = 1e-9  # 1 - |cosine| below which two directions are one


def is_axisymmetric(case: CaseTable) -> bool:
    """Whether a resolved case is a single round of revolution, initiated on its axis, with nothing beside it.

    A plane across the axis (the ground below an upright round) keeps the symmetry; any other plane breaks it.
    """
    rounds = expanded(case)
    if len(rounds) != 1:
        return False
    (only,) = rounds
    if only.profile is None or only.initiation is not None:
        return False
    if any(point.offset != (0.0, 0.0) for point in only.ignition or ()):
        return False
    return all(plane.normal is not None and _parallel(plane.normal, only.axis) for plane in case.plane)


def all_azimuths_alike(case: CaseTable) -> bool:
    """Whether every azimuth has the same expected hazard as far as the rounds go: one upright axisymmetric round."""
    return is_axisymmetric(case) and upright(expanded(case)[0])


def upright(item: RoundTable) -> bool:
    """Whether the round's axis is vertical."""
    return _parallel(item.axis, (0.0, 0.0, 1.0))


def _parallel(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / (math.hypot(*one) * math.hypot(*other))
    return 1.0 - abs(cosine) < _PARALLEL
