"""Attitude of the rounds: from the words of the case to axes, and from axes to the words of a report.

A resolved case has `axis` alone, except for attitude = "any": its rounds are upright in the burst, and the flight turns
their fragments (`fragfield.pipeline.attitudes`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

from fragfield.case.conversion.surroundings import bearing_of, direction_words, ground_height
from fragfield.case.conversion.turned import all_azimuths_alike
from fragfield.case.faults import Fault
from fragfield.case.schema import CaseTable
from fragfield.results.hazard import Attitude

Vector = tuple[float, float, float]
UP: Vector = (0.0, 0.0, 1.0)
_SAME = 1e-6  # degrees
_INSTEAD = "or one run for each attitude: `fragfield sweep CASE 'round.*.attitude=upright,lying'`"


def axis_of(inclination: float, azimuth: float) -> Vector:
    """Unit vector from base to nose of a round whose axis is inclined from upright (rad) to an azimuth (rad)."""
    across = math.sin(inclination)
    components = (across * math.cos(azimuth), across * math.sin(azimuth), math.cos(inclination))
    x, y, z = (round(value, 14) + 0.0 for value in components)  # angles have 15 digits: "lying" is level
    return x, y, z


def is_mixed(case: CaseTable) -> bool:
    """Whether the attitude of the rounds is "any"."""
    return any(entry.attitude == "any" for entry in case.round)


def with_axes(case: CaseTable) -> CaseTable:
    """The case with `axis` in place of every attitude but "any"."""
    rounds = []
    for entry in case.round:
        changes: dict[str, object] = {"azimuth": None}
        if entry.attitude not in (None, "any"):
            inclination = {"upright": 0.0, "lying": 0.5 * math.pi}.get(str(entry.attitude), entry.attitude)
            changes |= {"attitude": None, "axis": axis_of(float(inclination or 0.0), entry.azimuth or 0.0)}
        is_given = entry.attitude is not None or entry.azimuth is not None
        rounds.append(entry.model_copy(update=changes) if is_given else entry)
    return case.model_copy(update={"round": rounds})


def attitude_faults(case: CaseTable) -> Iterator[Fault]:
    """Faults of attitude, azimuth and axis of a case as read, as lines `key: found ...; allowed: ...`."""
    for number, entry in enumerate(case.round, start=1):
        key = f"round[{number}]"
        if "axis" in entry.model_fields_set:
            # A run directory has the axis of its upright rounds beside "any".
            if entry.attitude is not None and not (entry.attitude == "any" and entry.axis == UP):
                yield Fault(
                    f"{key}.axis",
                    "found together with attitude; allowed: one of the two: attitude (and azimuth) for a "
                    "round that stands, lies or leans, axis for a vector",
                )
            elif entry.azimuth is not None and entry.attitude is None:
                yield Fault(f"{key}.azimuth", "found together with axis; allowed: with attitude instead of axis")
        elif entry.azimuth is not None and entry.attitude is None:
            yield Fault(
                f"{key}.azimuth",
                'found without attitude; allowed: together with it, for example attitude = "lying", azimuth = "90 deg"',
            )
    if is_mixed(case):
        yield from _mixed_faults(case)


def _mixed_faults(case: CaseTable) -> Iterator[Fault]:
    """What does not turn with the rounds, so that no envelope over attitudes can be computed with it."""
    first = next(number for number, entry in enumerate(case.round, start=1) if entry.attitude == "any")
    key, found = f"round[{first}].attitude", 'found "any"'
    for number, entry in enumerate(case.round, start=1):
        if entry.attitude != "any":
            yield Fault(
                key,
                f'{found}, but round[{number}] ("{entry.name}") has an attitude of its own; allowed: "any" for all '
                "rounds, which turn together as one body, or for none",
            )
            break
    yield from _site_faults(case, key, found)
    fixed = {
        "a ground plane or a wall in the burst (plane)": any(plane.kind != "symmetry" for plane in case.plane),
        "obstacles (obstacle)": bool(case.obstacle),
        "a map of heights (flight.ground.map)": case.flight.ground.map is not None,
    }
    for what, present in fixed.items():
        if present:
            yield Fault(
                key,
                f"{found} together with {what}, which does not turn with the rounds: the worst attitude is found for a "
                "burst in the open, over flat ground, and its distance holds in every direction; "
                f"allowed: without it, {_INSTEAD}",
            )
    if not case.flight.wind.is_still and (case.exposed or case.stack or not all_azimuths_alike(case)):
        what = "exposed sites" if case.exposed else "several rounds, or one that is not of revolution"
        yield Fault(
            key,
            f"{found} together with wind (flight.wind) and {what}, for which its attitudes are too many; allowed: one "
            f"round of revolution without exposed sites, or {_INSTEAD.removeprefix('or ')}",
        )


def _site_faults(case: CaseTable, key: str, found: str) -> Iterator[Fault]:
    for number, entry in enumerate(case.exposed, start=1):
        own = [name for name in ("energy", "height") if getattr(entry, name, None) is not None]
        if entry.kind == "building":
            what = "a building, whose walls and roof count hits of rounds that point one way"
        elif own:
            what = f"a site with its own {own[0]}, while densities in all directions are those of [hazard]"
        else:
            continue
        yield Fault(
            key,
            f"{found} together with exposed[{number}] ({entry.name}), {what}; allowed: persons, roads and areas with "
            f"the energy and height of [hazard], {_INSTEAD}",
        )


def attitude_of(case: CaseTable, *, given: bool = False) -> Attitude:
    """Attitude of the rounds of a resolved case; `given`: of fragments of a file, which have one of their own."""
    nothing = Attitude(
        kind="several", words="", inclination_deg=None, azimuth_deg=None, base_height=None,
        worst_inclination_deg=None, worst_roll_deg=None, curve=(),
    )  # fmt: skip
    if given or not case.round:
        return replace(nothing, kind="given", words="as in the file of fragments")
    part = replace(
        nothing, base_height=min(one.position[2] - ground_height(case, *one.position[:2]) for one in case.round)
    )
    if is_mixed(case):
        return replace(part, kind="any", words="mixed attitudes")
    angles: dict[tuple[float, float | None], list[str]] = {}
    for entry in case.round:
        angles.setdefault(_angles(entry.axis), []).append(entry.name)
    if len(angles) > 1:
        listed = [f"{_names(names)} {_words(case, *angle)}" for angle, names in angles.items()]
        return replace(part, words="; ".join(listed))
    ((inclination, azimuth),) = angles
    words = _words(case, inclination, azimuth)
    kind: Literal["upright", "lying", "inclined"] = "lying" if inclination == 90.0 else "inclined"
    if inclination == 0.0:
        kind = "upright"
    return replace(part, kind=kind, words=words, inclination_deg=inclination, azimuth_deg=azimuth)


def attitude_words(part: Attitude) -> str:
    """One line for terminal and report: the attitude, and how high the base stands over the ground."""
    words = part.words
    if part.kind == "any":
        words += ", the distance is that of the worst"
        if part.worst_inclination_deg is not None:
            words += f": inclined by {part.worst_inclination_deg:g} deg from upright"
            if part.worst_azimuth_deg is not None:
                words += f", nose to azimuth {part.worst_azimuth_deg:g} deg"
            if part.worst_roll_deg:
                words += f", rolled by {part.worst_roll_deg:g} deg"
    if part.base_height is not None:
        words += f"; base {'as placed ' if part.kind == 'any' else ''}{part.base_height:.4g} m over the ground"
    return words


def _angles(axis: Vector) -> tuple[float, float | None]:
    across = math.hypot(*axis[:2])
    inclination = _near(math.degrees(math.atan2(across, axis[2])))
    if inclination in (0.0, 180.0):
        return inclination, None
    return inclination, _near(math.degrees(math.atan2(axis[1], axis[0])) % 360.0) % 360.0


def _near(angle: float) -> float:
    return float(round(angle)) if abs(angle - round(angle)) < _SAME else angle


def _words(case: CaseTable, inclination: float, azimuth: float | None) -> str:
    if azimuth is None:
        return "upright, nose up" if inclination == 0.0 else "upright, nose down"
    how = "lying" if inclination == 90.0 else f"inclined by {inclination:.4g} deg from upright"
    return f"{how}, nose to {direction_words(azimuth, bearing_of(case, azimuth))}"


def _names(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{names[0]} to {names[-1]} ({len(names)} rounds)"
