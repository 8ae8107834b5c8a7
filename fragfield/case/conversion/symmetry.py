"""Symmetry of a case: a single round of revolution, and directions whose hazard is alike.

Only what is certain counts: where wind, a map, obstacles, a mesh file or a point of ignition off the axis may break a
symmetry, none is used.
"""

from __future__ import annotations

import json
import math
from typing import Any, Literal

import numpy as np

from fragfield.case.conversion.rounds import mirrored
from fragfield.case.conversion.stack import expanded
from fragfield.case.schema import CaseTable
from fragfield.case.tables.round import RoundTable

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


_TOLERANCE = 1e-9  # m, and of unit vectors
_STEP = 15.0  # degrees between the planes that are tried

Basis = Literal["all_azimuths", "worst_direction"]


def hazard_basis(case: CaseTable) -> Basis:
    """Whether all azimuths have the same expected hazard: one upright axisymmetric round over level, empty ground."""
    if not all_azimuths_alike(case) or not even_surroundings(case):
        return "worst_direction"
    (only,) = expanded(case)
    centred = math.dist(only.position[:2], case.flight.origin) < _TOLERANCE
    return "all_azimuths" if centred else "worst_direction"


def mirror_planes(case: CaseTable) -> tuple[float, ...]:
    """Azimuths (degrees, from 0 to 180) of vertical planes through the origin that mirror a resolved case on itself.

    Rounds with their images behind planes of symmetry, axes, contents, ignition points and delays, and rigid planes are
    compared; planes at multiples of 15 degrees are tried.
    """
    rounds = expanded(case)
    if not rounds or not even_surroundings(case):
        return ()
    if any(one.profile is None or any(p.offset != (0.0, 0.0) for p in one.ignition or ()) for one in rounds):
        return ()
    bodies = _bodies(case)
    planes = [
        (np.array(plane.point), np.array(plane.normal), f"{plane.kind} {plane.friction_angle}")
        for plane in case.plane
        if plane.kind != "symmetry"
    ]
    origin = np.array([*case.flight.origin, 0.0])
    found = []
    for azimuth in np.arange(0.0, 180.0, _STEP):
        turn = math.radians(azimuth)
        normal = np.array([-math.sin(turn), math.cos(turn), 0.0])
        mirror = np.eye(3) - 2.0 * np.outer(normal, normal)
        if all(_has(bodies, origin + mirror @ (place - origin), mirror @ axis, what) for place, axis, what in bodies):
            images = [(origin + mirror @ (point - origin), mirror @ across, what) for point, across, what in planes]
            if all(any(_same_plane(image, plane) for plane in planes) for image in images):
                found.append(float(azimuth))
    return tuple(found)


def even_surroundings(case: CaseTable) -> bool:
    """Whether air and ground are the same in every direction."""
    return case.flight.wind.is_still and case.flight.ground.map is None and not case.obstacle


def _bodies(case: CaseTable) -> list[tuple[Any, Any, str]]:
    bodies: list[tuple[Any, Any, str]] = []
    for one in expanded(case):
        contents = one.model_dump(mode="json", exclude={"name", "position", "axis"})
        axis = np.array(one.axis) / math.hypot(*one.axis)
        bodies.append((np.array(one.position), axis, json.dumps(contents, sort_keys=True)))
    return mirrored(case, bodies)


def _has(bodies: list[tuple[Any, Any, str]], place: Any, axis: Any, what: str) -> bool:  # noqa: ANN401 - arrays
    return any(
        what == other and np.abs(place - at).max() < _TOLERANCE and np.abs(axis - along).max() < _TOLERANCE
        for at, along, other in bodies
    )


def _same_plane(one: tuple[Any, Any, str], other: tuple[Any, Any, str]) -> bool:
    return (
        one[2] == other[2]
        and np.abs(one[1] - other[1]).max() < _TOLERANCE
        and abs((one[0] - other[0]) @ other[1]) < _TOLERANCE
    )
