"""What a run must meet to count as allowed: exposed sites, and a distance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.hazard.certainty import metres
from fragfield.results.rules import DistanceOfUse, DistanceToApply
from fragfield_base.inputs import NotAllowedError, Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fragfield.case import CaseTable


_DISTANCE = Quantity("m", "300 m", above=0.0)


@dataclass(frozen=True)
class LimitCriteria:
    """What every allowed number of rounds meets."""

    distance: float | None
    """The distance to apply for storage and handling is at most this (m); None: not asked for."""
    exposed: bool
    """The criterion of every exposed site is met."""

    @classmethod
    def of(cls, case: CaseTable, distance: str | None) -> LimitCriteria:
        """The criteria of a case, and a distance with its unit.

        Raises InputError: the distance is none, or there is nothing to meet.
        """
        metres_given = None
        if distance is not None:
            try:
                metres_given = float(_DISTANCE.parse(distance))
            except NotAllowedError as error:
                raise InputError(f"--distance: {error}") from None
        if metres_given is None and not case.exposed:
            raise InputError(
                "nothing to meet: the case has no exposed sites and no distance is asked for; needed: at least one "
                'table [[exposed]], or --distance "300 m"'
            )
        return cls(metres_given, bool(case.exposed))

    @property
    def words(self) -> str:
        """What is asked for, in words."""
        parts = ["the criterion of every exposed site is met"] if self.exposed else []
        if self.distance is not None:
            parts.append(f"the distance to apply for storage and handling is at most {metres(self.distance)}")
        return " and ".join(parts)


def judged(summary: Mapping[str, Any], criteria: LimitCriteria) -> dict[str, Any]:
    """A run's quantities and whether it meets the criteria.

    Returns
    -------
    dict
        `explosive` (kg; None where it is not known), `recommended` (m: the recommended distance, None where it is not
        determined), `standard_error` (m), `to_apply` (m: for storage and handling, the largest of the recommended, the
        official and the prescribed ones), `not_met` (names of exposed sites) and `reasons`, empty where all is met. A
        rule that is left out for its range counts by its formula.
    """
    hazard = summary.get("hazard") or {}
    distance = hazard.get("recommended")
    found = summary.get("distance_to_apply")
    nothing = DistanceOfUse(distance=None, by=None, left_out=())
    siting = DistanceToApply.read(found).siting if found else nothing
    sites = [entry for entry in summary.get("exposed") or [] if entry["verdict"] != "met"] if criteria.exposed else []
    reasons = [f"{entry['name']}: {entry['verdict']}" for entry in sites]
    if distance is None:
        reasons.append("the distance is not determined")
    if criteria.distance is not None:
        if siting.distance is not None and siting.distance > criteria.distance:
            reasons.append(f"{metres(siting.distance)} by {siting.by}")
        reasons += [
            f"{metres(one.distance)} by the formula of “{one.name}”, which does not apply because {one.reason}"
            for one in siting.left_out
            if one.missing and one.distance is not None and one.distance > criteria.distance
        ]
    return {
        "explosive": ((summary.get("rules") or {}).get("contents") or {}).get("explosive"),
        "to_apply": siting.distance,
        "recommended": distance,
        "standard_error": hazard.get("standard_error"),
        "not_met": [entry["name"] for entry in sites],
        "reasons": reasons,
    }
