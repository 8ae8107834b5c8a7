"""Relative positions of the rounds and planes of a case, for `fragfield check`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.attitude import attitude_of
from fragfield.case.conversion.exposed_sites import describe_exposed
from fragfield.case.conversion.placing import heights, placed
from fragfield.case.conversion.surroundings import describe_surroundings, ground_height

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from fragfield.case import CaseTable
    from fragfield.case.conversion.clearance import Body
    from fragfield.case.tables.round import PlaneTable


_SAME_HEIGHT = 1e-6  # of the ground in the burst and in flight (m)


def arrangement(case: CaseTable) -> dict[str, Any]:
    """Rounds, smallest clear distance, planes and contact of a resolved case with a burst; SI, angles in degrees.

    `attitude` (as `hazard.attitude` of summary.json), `rounds` (name, position, axis, number of ignition points, first
    and last delay, `initiation`), `min_clearance` (two names and the clear distance, or None for a single round),
    `planes` (name, kind, the nearest round and its clear distance), `surroundings` (of the flight) and `contact`.
    """
    from fragfield.case.conversion.stages import burst_settings

    bodies = [placed(entry) for entry in case.round]
    contact = burst_settings(case).contact
    return {
        "attitude": attitude_of(case),
        "rounds": [
            {
                "name": entry.name,
                "position": list(entry.position),
                "axis": list(entry.axis),
                "ignition_points": len(entry.ignition or []),
                "delays": [min(times), max(times)] if (times := [p.delay for p in entry.ignition or []]) else None,
                "initiation": entry.initiation.model_dump() if entry.initiation else None,
            }
            for entry in case.round
        ],
        "min_clearance": _min_clearance(case, bodies),
        "planes": [_plane(case, plane, bodies) for plane in case.plane],
        "surroundings": {**describe_surroundings(case), "exposed": describe_exposed(case)},
        "contact": {
            "charge_casing": contact.charge_casing,
            "cohesion": contact.cohesion,
            "tensile_strength": contact.tensile_strength,
            "friction_angle_deg": contact.friction_angle,
            "surfaces": contact.surfaces,
            "surface_friction_angle_deg": contact.surface_friction_angle,
        },
    }


def _min_clearance(case: CaseTable, bodies: Sequence[Body]) -> dict[str, Any] | None:
    from fragfield.case.conversion.clearance import min_clearance

    found = min_clearance(bodies)
    if found is None:
        return None
    first, second, gap = found
    return {"rounds": [case.round[first].name, case.round[second].name], "clearance": max(gap, 0.0)}


def _plane(case: CaseTable, plane: PlaneTable, bodies: Sequence[Body]) -> dict[str, Any]:
    from fragfield.case.conversion.burst import rigid_plane

    low = [heights(body, plane)[0] for body in bodies]
    nearest = int(np.argmin(np.round(low, 9)))
    rigid = rigid_plane(plane)
    return {
        "name": plane.name,
        "kind": plane.kind,
        "point": list(rigid.point),
        "normal": list(rigid.normal),
        "friction_angle_deg": None if plane.kind == "symmetry" else rigid.friction_angle,
        "nearest_round": case.round[nearest].name,
        "clearance": max(low[nearest], 0.0),
    }


def with_images(case: CaseTable) -> NDArray[np.float64]:
    """Positions (m) of the rounds and of all their mirror images, shape (n, 3)."""
    places = np.array([entry.position for entry in case.round], dtype=np.float64)
    for plane in case.plane:
        if plane.kind == "symmetry":
            normal, point = np.array(plane.normal), np.array(plane.point)
            images = places - 2.0 * ((places - point) @ normal)[:, None] * normal
            places = np.concatenate([places, images])
    return places


def image_names(case: CaseTable) -> list[str]:
    """Names of the rounds and of all their mirror images, in the order of `with_images`."""
    names = [entry.name for entry in case.round]
    for plane in case.plane:
        if plane.kind == "symmetry":
            names += [f"{name}, mirrored at {plane.name}" for name in names]
    return names


def arrangement_warnings(case: CaseTable) -> Iterator[str]:
    """What looks doubtful in the places of rounds and planes, and in what passes between them."""
    assert case.burst is not None  # the caller's choice
    waiting = [entry.name for entry in case.round if not entry.ignition]
    if not case.burst.contact.surfaces:
        if len(case.round) > 1:
            yield (
                f"burst.contact.surfaces = false: {len(case.round)} rounds are computed as if each stood alone, their "
                "casings pass through each other, and the distances are not those of a stack"
            )
        if waiting:
            yield (
                f"burst.contact.surfaces = false: no shock reaches {waiting[0]}"
                + (f" and {len(waiting) - 1} more" if len(waiting) > 1 else "")
                + " without ignition points, so nothing initiates the charge"
            )
    for number, plane in enumerate(case.plane, start=1):
        assert plane.normal is not None  # resolved
        assert plane.point is not None
        ground = ground_height(case, *plane.point[:2])
        if plane.kind == "ground" and plane.normal[2] > 1.0 - 1e-12 and abs(plane.point[2] - ground) > _SAME_HEIGHT:
            yield (
                f"plane[{number}] ({plane.name}) is ground at z = {plane.point[2]:g} m in the burst, and "
                f"flight.ground is at {ground:g} m there in flight: give the same height, or make the plane a wall"
            )
