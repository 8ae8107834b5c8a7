"""Checks of the positions of rounds and planes: rounds in each other, in a plane, in the ground."""

from __future__ import annotations

import math
from itertools import combinations
from typing import TYPE_CHECKING

from fragfield.case.conversion.surroundings import ground_height
from fragfield_base.inputs import show

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fragfield.case.conversion.clearance import Body
    from fragfield.case.schema import CaseTable
    from fragfield.case.tables.stack import PlaneTable

__all__ = ["check_places", "check_planes"]

_TOUCHING = 1e-6  # what only touches does not overlap (m)
_RIGHT_ANGLE = 1e-6  # cosine up to which planes count as perpendicular
_MOST_SYMMETRIES = 3
_DIRECTION = "the direction from the plane to the rounds, for example normal = [1, 0, 0]"
_NEAR_CELLS, _NEAR_RADII = 0.2, 0.02  # more than the corners of any mesh lie outside of the contour


def check_planes(case: CaseTable) -> Iterator[str]:
    """Faults of the tables [[plane]] that show before they are resolved."""
    faultless = []
    for number, entry in enumerate(case.plane, start=1):
        faults = list(_plane(f"plane[{number}]", entry))
        yield from faults
        if not faults and entry.kind == "symmetry" and entry.normal is not None:
            faultless.append((number, entry.name, entry.normal))
    if len(faultless) > _MOST_SYMMETRIES:
        yield f"plane: found {len(faultless)} planes of symmetry; allowed: at most {_MOST_SYMMETRIES}"
        return
    for (_, first, normal), (number, name, other) in combinations(faultless, 2):
        cosine = sum(a * b for a, b in zip(normal, other, strict=True)) / math.hypot(*normal) / math.hypot(*other)
        if abs(cosine) > _RIGHT_ANGLE:
            angle = math.degrees(math.acos(min(abs(cosine), 1.0)))
            yield (
                f"plane[{number}].normal: {show(name)} stands at {angle:.4g} degrees to {show(first)}; "
                "allowed: planes of symmetry that are perpendicular to each other"
            )


def _plane(key: str, entry: PlaneTable) -> Iterator[str]:
    if entry.height is not None and entry.point is not None:
        yield f"{key}.height: found together with point; allowed: one of the two"
    if entry.normal is None and entry.kind != "ground":
        yield f"{key}.normal: missing; needed: {_DIRECTION}"
    if entry.normal is not None and not any(entry.normal):
        yield f"{key}.normal: found [0, 0, 0]; allowed: {_DIRECTION}"


def check_places(case: CaseTable, stacked: Sequence[str] = ()) -> Iterator[str]:
    """Faults of a resolved case; `stacked` are the rounds that come from [stack]."""
    from fragfield.case.conversion.placing import placed

    bodies = [placed(entry) for entry in case.round]
    keys = [
        "stack" if entry.name in stacked else f"round[{number}].position"
        for number, entry in enumerate(case.round, start=1)
    ]
    yield from _overlaps(case, bodies, keys, stacked)
    for plane in case.plane:
        yield from _behind(case, plane, bodies, keys)
    yield from _buried(case, bodies, keys)


def _overlaps(case: CaseTable, bodies: Sequence[Body], keys: Sequence[str], stacked: Sequence[str]) -> Iterator[str]:
    from fragfield.case.conversion.clearance import clearance, near_pairs
    from fragfield.case.conversion.placing import meshed

    size = case.burst.cell_size if case.burst is not None and case.burst.contact.surfaces else None
    for first, second, found in near_pairs(bodies, _near(size, bodies)):
        one, other = case.round[first], case.round[second]
        if found < -_TOUCHING:
            yield (
                f"{keys[second]}: {show(other.name)} reaches {_mm(-found)} into {keys[first].partition('.')[0]} "
                f"{show(one.name)}; allowed: rounds that do not overlap"
            )
        elif size is not None:
            in_mesh = clearance(meshed(one, size), meshed(other, size))
            if in_mesh < -_TOUCHING:
                both = one.name in stacked and other.name in stacked
                yield (
                    f"{'stack.gap' if both else keys[second]}: {show(one.name)} and {show(other.name)} stand "
                    f"{_mm(max(found, 0.0))} apart, and the corners of their meshes with cells of {_mm(size)} reach "
                    f"{_mm(found - in_mesh)} farther; allowed: at least {_mm_up(found - in_mesh)} apart, smaller "
                    "cells, or burst.contact.surfaces = false"
                )


def _behind(case: CaseTable, plane: PlaneTable, bodies: Sequence[Body], keys: Sequence[str]) -> Iterator[str]:
    from fragfield.case.conversion.placing import heights, meshed

    assert plane.normal is not None  # resolved
    size = case.burst.cell_size if case.burst is not None else None
    number = case.plane.index(plane) + 1
    for entry, body, key in zip(case.round, bodies, keys, strict=True):
        low, high = heights(body, plane)
        if high <= _TOUCHING:
            opposite = [-value + 0.0 for value in plane.normal]
            yield (
                f"plane[{number}].normal: round {show(entry.name)} stands behind {show(plane.name)}, {_mm(-low)} deep; "
                f"allowed: rounds on the side to which the normal points ({opposite} is the other one)"
            )
        elif low < -_TOUCHING:
            yield (
                f"{key}: {show(entry.name)} reaches {_mm(-low)} through plane[{number}] {show(plane.name)}; "
                "allowed: rounds on one side of it"
            )
        elif size is not None and low < _near(size, [body]):
            in_mesh = heights(meshed(entry, size), plane)[0]
            if in_mesh < -_TOUCHING:
                yield (
                    f"{key}: {show(entry.name)} stands {_mm(max(low, 0.0))} from plane[{number}] {show(plane.name)}, "
                    f"and the corners of its mesh with cells of {_mm(size)} reach {_mm(low - in_mesh)} farther; "
                    f"allowed: at least {_mm_up(low - in_mesh)} away, or smaller cells"
                )


def _near(size: float | None, bodies: Sequence[Body]) -> float:
    """Distance (m) beyond which no mesh with cells of this size (m) can make rounds overlap."""
    if size is None:
        return 0.0
    widest = max((sum(abs(end) for end in _span(body)) for body in bodies), default=0.0)
    return _NEAR_CELLS * size + _NEAR_RADII * widest


def _span(body: Body) -> tuple[float, float]:
    """Reach of a body about its centre across its axis (m)."""
    import numpy as np

    across = np.linalg.svd(body.axis[None, :])[2][1]
    low, high = body.reach(across)
    return 0.5 * (low - high), 0.5 * (high - low)


def _buried(case: CaseTable, bodies: Sequence[Body], keys: Sequence[str]) -> Iterator[str]:
    for entry, body, key in zip(case.round, bodies, keys, strict=True):
        ground = ground_height(case, *entry.position[:2])
        lowest = body.reach((0.0, 0.0, 1.0))[0]
        if lowest < ground - _TOUCHING:
            yield (
                f"{key}: the round lies {_mm(ground - lowest)} below the ground, z = {ground:g} m; "
                "allowed: on or above it (position is the centre of the base)"
            )


def _mm(value: float) -> str:
    return f"{round(value * 1e3, 6) + 0.0:.6g} mm"


def _mm_up(value: float) -> str:
    """A length rounded up, so that keeping to it is enough."""
    return f"{math.ceil(value * 1e6 + 1.0) * 1e-3:.6g} mm"
