"""The single round of a case whose rounds are all alike: the case of one of them, alone and upright."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.case.conversion.placing import are_alike
from fragfield.case.conversion.stages import burst_geometry

if TYPE_CHECKING:
    from fragfield.case.schema import Case
    from fragfield.case.tables.round import IgnitionTable

__all__ = ["single_round_case"]


def single_round_case(case: Case) -> tuple[Case | None, str]:
    """The case of one round alone, burst in its meridian with the same settings and cells.

    Rounds may differ in name, position, axis and delay, and those that wait for the shock of a neighbour are taken to
    be initiated as the others are.

    Returns
    -------
    case, reason
        None, and why, where the rounds differ, come from mesh files, or are not initiated on their axes.
    """
    if case.burst is None or not case.round:
        return None, "the case has no rounds"
    if not are_alike(case):
        return None, "the rounds differ in contents or casing"
    points = {_stations(entry.ignition) for entry in case.round if entry.ignition}
    if len(points) != 1:
        return None, "the rounds are initiated at different points" if points else "no round has an ignition point"
    first = next(entry for entry in case.round if entry.ignition)
    began = min(point.delay for point in first.ignition or [])
    ignition = [point.model_copy(update={"delay": point.delay - began}) for point in first.ignition or []]
    alone = first.model_copy(
        update={"position": (0.0, 0.0, 0.0), "axis": (0.0, 0.0, 1.0), "ignition": ignition, "initiation": None}
    )
    output = case.burst.output.model_copy(update={"interval": case.burst.time_limit})
    burst = case.burst.model_copy(update={"convergence": "off", "geometry": "auto", "output": output})
    made = case.model_copy(update={"round": [alone], "stack": None, "plane": [], "burst": burst})
    choice = burst_geometry(made)
    return (made, "") if choice.geometry == "axisymmetric" else (None, choice.reason)


def _stations(points: list[IgnitionTable] | None) -> tuple[tuple[object, ...], ...]:
    """Ignition points of a round with their delays after its first one."""
    began = min(point.delay for point in points or [])
    return tuple(sorted((point.station, point.offset, round(point.delay - began, 12)) for point in points or []))
