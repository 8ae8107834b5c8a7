"""What stands there: images of rounds, net explosive quantity and masses for the rules."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from burst_fenicsx.geometry import Profile
from fragfield.case import CaseTable
from fragfield.case.conversion.clearance import Body, min_clearance, placed_body
from fragfield.case.conversion.rounds import are_alike, burst_round, first_alike, images, masses_of, mirrored
from fragfield.case.conversion.surroundings import ground_height
from fragfield.case.tables.round import RoundTable
from fragfield.results.rules import Contents
from fragfield_base.substances import substance, substance_key, substance_title, substances_with

_SAME_HEIGHT = 1e-6  # of the ground in the burst and in flight (m)


def with_images(case: CaseTable) -> NDArray[np.float64]:
    """Positions (m) of the rounds and of all their mirror images, shape (n, 3)."""
    places = np.array([entry.position for entry in case.round], dtype=np.float64)
    return np.concatenate([places @ mirror.T + shift for mirror, shift in images(case)])


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
    if not case.round:
        return None
    positions = with_images(case)
    times = len(positions) // len(case.round)
    explosive = tnt = all_up = heaviest = 0.0
    words, profiles, first = [], [], first_alike(case)
    masses = {index: masses_of(case.round[index]) for index in set(first)}
    for number, entry in enumerate(case.round):
        one, mass = burst_round(entry), masses[first[number]]
        if one.profile is not None:
            profiles.append(one.profile)
        factor, said = tnt_equivalent(one.explosive.name)
        if said:
            words.append(said)
        explosive, all_up = explosive + times * mass.charge, all_up + times * mass.whole
        tnt, heaviest = tnt + times * mass.charge * factor, max(heaviest, mass.whole)
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
    from_first = positions - positions[0]
    farthest = from_first[np.argmax(np.linalg.norm(from_first, axis=1))]
    if not farthest.any():  # a single one
        return False
    beside = np.linalg.norm(np.cross(from_first, farthest), axis=1) / np.linalg.norm(farthest)
    return bool(beside.max() <= _ON_A_LINE)


def _clearance(case: CaseTable, profiles: Sequence[Profile]) -> float | None:
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
    stations = np.linspace(profile.charge_front, profile.charge_end, 2001)
    corners = [at for at in profile.cavity.stations if profile.charge_front <= at <= profile.charge_end]
    return 2.0 * float(np.max(profile.section(np.concatenate([stations, corners])).charge_radius))


def _ignited_at_once(rounds: Sequence[RoundTable]) -> bool:
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
