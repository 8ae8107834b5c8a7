"""Where rounds, planes, obstacles and exposed sites stand, for `fragfield check`."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.problem import RigidPlane
from fragfield.case.conversion.attitude import attitude_of
from fragfield.case.conversion.clearance import min_clearance
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.conversion.rounds import heights, placed
from fragfield.case.conversion.surroundings import air_words, altitude_of, bearing_of, surroundings, wind_words
from fragfield.case.problem import burst_settings, rigid_plane
from fragfield.results.check import (
    Arrangement,
    Clearance,
    FlatGround,
    GroundMap,
    PlacedObstacle,
    PlacedPlane,
    PlacedRound,
    PlacedSite,
    RicochetLaw,
    SettingsOfContact,
    Shock,
    Surroundings,
)
from fragfield.results.part import marks

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from flight import HeightMap
    from fragfield.case import CaseTable
    from fragfield.case.conversion.clearance import Body
    from fragfield.case.tables.round import PlaneTable


def arrangement(case: CaseTable) -> Arrangement:
    """Rounds, smallest clear distance, planes, surroundings and contact of a resolved case with a burst."""
    bodies = [placed(entry) for entry in case.round]
    contact = burst_settings(case).contact
    nearest = min_clearance(bodies)
    return Arrangement(
        attitude=attitude_of(case),
        rounds=tuple(
            PlacedRound(
                name=entry.name,
                position=entry.position,
                axis=entry.axis,
                ignition_points=len(entry.ignition or []),
                delays=(min(times), max(times)) if (times := [p.delay for p in entry.ignition or []]) else None,
                initiation=Shock(**entry.initiation.model_dump()) if entry.initiation else None,
            )
            for entry in case.round
        ),
        min_clearance=nearest
        and Clearance(
            rounds=(case.round[nearest[0]].name, case.round[nearest[1]].name), clearance=max(nearest[2], 0.0)
        ),
        planes=tuple(_plane(case, plane, bodies) for plane in case.plane),
        surroundings=describe_surroundings(case),
        contact=SettingsOfContact(
            charge_casing=contact.charge_casing,
            cohesion=contact.cohesion,
            tensile_strength=contact.tensile_strength,
            friction_angle_deg=contact.friction_angle,
            surfaces=contact.surfaces,
            surface_friction_angle_deg=contact.surface_friction_angle,
        ),
    )


def _plane(case: CaseTable, plane: PlaneTable, bodies: Sequence[Body]) -> PlacedPlane:
    low = [heights(body, plane)[0] for body in bodies]
    nearest = int(np.argmin(np.round(low, 9)))
    rigid = rigid_plane(plane)
    return PlacedPlane(
        name=plane.name, kind=plane.kind, point=rigid.point, normal=rigid.normal,
        friction_angle_deg=rigid.friction_angle if isinstance(rigid, RigidPlane) else None,
        nearest_round=case.round[nearest].name, clearance=max(low[nearest], 0.0),
    )  # fmt: skip


def describe_surroundings(case: CaseTable) -> Surroundings:
    """Ground, ricochet, obstacles and exposed sites in numbers, for `fragfield check` (m)."""
    from flight.scene.scene import Scene

    made = surroundings(case)
    ground, ricochet, scene = made["ground"], made["ricochet"], Scene(made["ground"])
    obstacles = []
    for obstacle, entry in zip(made["obstacles"], case.obstacle, strict=True):
        tops = obstacle.crest(scene.ground_at)[1]
        obstacles.append(
            PlacedObstacle(
                name=entry.name, kind=entry.kind, base=float(tops.min()) - obstacle.height, top=float(tops.max()),
                height=obstacle.height, follows=bool(np.ptp(tops) > 0.0), ricochet=entry.ricochet,
            )
        )  # fmt: skip
    return Surroundings(
        ground=FlatGround(height=ground) if isinstance(ground, float) else _map_extent(ground),
        altitude=altitude_of(case) if case.flight.air.model == "standard" else None,
        air=air_words(case),
        wind=wind_words(case),
        ricochet=ricochet and RicochetLaw(**asdict(ricochet)),
        obstacles=tuple(obstacles),
        exposed=tuple(describe_exposed(case)),
    )


def _map_extent(ground: HeightMap) -> GroundMap:
    (west, south), (east, north) = ground.corner, ground.end
    heights = ground.heights
    stated = {key: value for key, value in ground.facts.items() if key in marks(GroundMap)}
    return GroundMap(
        map=ground.name, nodes=(heights.shape[1], heights.shape[0]), cell=(ground.step[0], ground.step[1]),
        x=(west, east), y=(south, north), z=(float(heights.min()), float(heights.max())),
        datum=ground.datum, **stated,
    )  # fmt: skip


def describe_exposed(case: CaseTable) -> Iterator[PlacedSite]:
    """Distance and direction of the nearest edge of each exposed site."""
    for exposed in exposed_sites_of(case):
        away = exposed.edge() - np.asarray(case.flight.origin)
        distance = np.hypot(away[:, 0], away[:, 1])
        nearest = int(np.argmin(distance))
        azimuth = math.degrees(math.atan2(away[nearest, 1], away[nearest, 0])) % 360.0
        yield PlacedSite(
            name=exposed.table.name, kind=exposed.table.kind, distance=float(distance[nearest]), azimuth_deg=azimuth,
            bearing_deg=bearing_of(case, azimuth),
        )  # fmt: skip
