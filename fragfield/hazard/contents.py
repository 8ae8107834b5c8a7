"""What stands there: relative positions of rounds and planes, net explosive quantity and masses for the rules."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fragfield.case.conversion.attitude import attitude_of
from fragfield.case.conversion.exposed_sites import describe_exposed
from fragfield.case.conversion.rounds import are_alike, heights, mirrored, placed
from fragfield.case.conversion.surroundings import describe_surroundings, ground_height
from fragfield.results.part import to_json
from fragfield.results.rules import Contents
from fragfield_base.substances import substance, substance_key, substance_title, substances_with

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from fragfield.case import CaseTable
    from fragfield.case.conversion.clearance import Body
    from fragfield.case.tables.round import PlaneTable, RoundTable


_SAME_HEIGHT = 1e-6  # of the ground in the burst and in flight (m)


def arrangement(case: CaseTable) -> dict[str, Any]:
    """Rounds, smallest clear distance, planes and contact of a resolved case with a burst; SI, angles in degrees.

    `attitude` (as `hazard.attitude` of summary.json), `rounds` (name, position, axis, number of ignition points, first
    and last delay, `initiation`), `min_clearance` (two names and the clear distance, or None for a single round),
    `planes` (name, kind, the nearest round and its clear distance), `surroundings` (of the flight) and `contact`.
    """
    from fragfield.case.problem import burst_settings

    bodies = [placed(entry) for entry in case.round]
    contact = burst_settings(case).contact
    return {
        "attitude": to_json(attitude_of(case)),
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
    from fragfield.case.problem import rigid_plane

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


_ON_A_LINE = 1e-3  # m beside a straight line
_AT_ONCE = 1e-9  # s between initiations


def quantity_words(explosive: float, tnt: float, equivalents: Sequence[str]) -> str:
    """The net explosive quantity (kg) and its equivalent in TNT (kg), in words."""
    return "; ".join(
        (f"net explosive quantity {explosive:.3g} kg, TNT equivalent for peak pressure {tnt:.3g} kg", *equivalents)
    )


def contents_of(case: CaseTable) -> Contents | None:
    """What a resolved case's rounds hold, images behind planes of symmetry too; None of a case without rounds."""
    from fragfield.case.conversion.rounds import burst_round, first_alike, masses_of

    if not case.round:
        return None
    positions = with_images(case)
    images = len(positions) // len(case.round)
    explosive = tnt = all_up = heaviest = 0.0
    words, profiles, first = [], [], first_alike(case)
    masses = {index: masses_of(case.round[index]) for index in set(first)}
    for number, entry in enumerate(case.round):
        one, mass = burst_round(entry, f"round[{number + 1}]"), masses[first[number]]
        if one.profile is not None:
            profiles.append(one.profile)
        whole = mass.charge + mass.casing + mass.fuze
        factor, said = tnt_equivalent(one.explosive.name)
        if said:
            words.append(said)
        explosive, all_up = explosive + images * mass.charge, all_up + images * whole
        tnt, heaviest = tnt + images * mass.charge * factor, max(heaviest, whole)
    known = len(profiles) == len(case.round)
    in_a_row = _on_a_line(positions)
    return Contents(
        explosive=explosive, tnt=tnt, all_up=all_up, largest_round=heaviest, rounds=len(positions),
        equivalents=tuple(dict.fromkeys(words)), in_a_row=in_a_row,
        clearance=_clearance(case, profiles) if known and in_a_row else None,
        charge_diameter=max(_charge_diameter(profile) for profile in profiles) if known else None,
        at_once=_ignited_at_once(case.round), protective_works=tuple(case.hazard.protective_works),
        alike=are_alike(case),
    )  # fmt: skip


def _on_a_line(positions: NDArray[np.float64]) -> bool:
    """Whether two or more positions lie on one straight line."""
    if len(positions) < 2:
        return False
    from_first = positions - positions[0]
    farthest = from_first[np.argmax(np.linalg.norm(from_first, axis=1))]
    length = float(np.linalg.norm(farthest))
    if length == 0.0:
        return False
    along = (from_first @ farthest / length)[:, None] * farthest / length
    return bool(np.linalg.norm(from_first - along, axis=1).max() <= _ON_A_LINE)


def _clearance(case: CaseTable, profiles: Sequence[Profile]) -> float | None:
    """Smallest clear distance (m) between the rounds of a row and their images."""
    from fragfield.case.conversion.clearance import min_clearance, placed_body

    placed = [
        (np.array(entry.position, dtype=np.float64), np.array(entry.axis, dtype=np.float64), profile)
        for profile, entry in zip(profiles, case.round, strict=True)
    ]
    bodies: list[Body] = [
        placed_body(profile, place.tolist(), axis.tolist()) for place, axis, profile in mirrored(case, placed)
    ]
    nearest = min_clearance(bodies)
    return None if nearest is None else max(nearest[2], 0.0)


def _charge_diameter(profile: Profile) -> float:
    """Largest diameter of a charge (m), at 2,001 stations and the corners of the cavity."""
    stations = np.linspace(profile.charge_front, profile.charge_end, 2001)
    corners = [at for at in profile.cavity.stations if profile.charge_front <= at <= profile.charge_end]
    return 2.0 * float(np.max(profile.section(np.concatenate([stations, corners])).charge_radius))


def _ignited_at_once(rounds: Sequence[RoundTable]) -> bool:
    """Whether every round has ignition points, and the first of each is ignited at the same time."""
    if not all(entry.ignition for entry in rounds):
        return False
    first = [min(point.delay for point in entry.ignition or ()) for entry in rounds]
    return max(first) - min(first) <= _AT_ONCE


@cache
def tnt_equivalents() -> dict[str, tuple[float, str]]:
    """Factor for peak incident overpressure and its source, by built-in name of the explosive."""
    factors = substances_with("explosive", "tnt_equivalent", "pressure")
    return {
        name: (factor, substance("explosive", name).groups["tnt_equivalent"].source) for name, factor in factors.items()
    }


def tnt_equivalent(explosive: str) -> tuple[float, str]:
    """Equivalent of an explosive in TNT for peak pressure, and words on it with the source (empty for TNT itself).

    An explosive that is not in the table has the largest equivalent that is: its blast distances are then rather too
    long.
    """
    table = tnt_equivalents()
    known = table.get(substance_key(explosive))
    if known is None:
        strongest = max(table, key=lambda name: table[name][0])
        factor, source = table[strongest]
        return factor, (
            f"{factor:g} for {explosive}, whose equivalent is not known: the largest known one, of "
            f"{substance_title(strongest)} ({source})"
        )
    factor, source = known
    return factor, f"{factor:g} for {explosive} ({source})" if factor != 1.0 else ""


SITING: Final = "siting"
DISPOSAL: Final = "disposal"
COMPARISON: Final = "comparison"
"""What a rule is for: distances for storage and handling, for disposal in the open, or none that is prescribed."""
