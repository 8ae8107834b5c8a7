"""Checks across keys, and of the positions of rounds, planes and protective works."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from burst_fenicsx.problem import ProductModel
from flight.scene.obstacles import FACES, FIRST_FACE, pack_obstacles
from flight.scene.scene import Scene
from fragfield.case.checks.expected_masses import check_expected
from fragfield.case.checks.uncertain_inputs import check_uncertainty
from fragfield.case.conversion.clearance import Body, clearance, near_pairs
from fragfield.case.conversion.exposed_sites import check_exposed
from fragfield.case.conversion.rounds import heights, meshed, placed, profile_of
from fragfield.case.conversion.stack import check_stack
from fragfield.case.conversion.surroundings import ground_height, ground_of, surroundings
from fragfield.case.faults import Fault, choice_faults, outside_hard
from fragfield.case.schema import CaseTable
from fragfield.case.tables.burst import BurstTable
from fragfield.case.tables.round import UP, ExplosiveTable, PlaneTable, RoundTable
from fragfield.case.tables.surroundings import check_official
from fragfield.errors import nearest
from fragfield_base.errors import show

_MOST_STATES = 100_000


def check_case(case: CaseTable, *, burst: bool = True) -> list[Fault]:
    """Faults of a case as read, that show before names are resolved; `burst`: it must describe one."""
    return list(outside_hard(case)) or list(_as_read(case, burst=burst))  # which would stumble over such numbers


def _as_read(case: CaseTable, *, burst: bool) -> Iterator[Fault]:
    if burst and case.burst is None:
        yield Fault("burst", 'missing; needed: a table [burst] with cell_size, for example cell_size = "6 mm"')
    if burst and not case.round:
        yield Fault("round", "missing; needed: at least one table [[round]]")
    if case.burst is not None:
        yield from _stop_rules(case.burst)
    for key in ("round", "plane", "obstacle", "witness", "exposed"):
        names = [entry.name for entry in getattr(case, key)]
        for number, name in enumerate(names, start=1):
            if number > (first := names.index(name) + 1):
                words = f"found {show(name)}, the name of {key}[{first}]; allowed: a name of its own"
                yield Fault(f"{key}[{number}].name", words)
    yield from check_exposed(case)
    yield from check_uncertainty(case)
    yield from check_planes(case)
    for number, entry in enumerate(case.round, start=1):
        yield from _round(f"round[{number}]", entry)
    yield from check_stack(case)
    yield from choice_faults(case)
    yield from (Fault(f"flight.wind.{key}", words) for key, words in case.flight.wind.faults())
    ground = case.flight.ground
    if ground.map is not None and ground.height != 0.0:
        words = f"found {ground.height:g} m together with a map; allowed: one of the two; datum shifts the map"
        yield Fault("flight.ground.height", words)
    for number, surface in enumerate(case.witness, start=1):
        bottom, top = getattr(surface, "bottom", None), getattr(surface, "top", None)
        if bottom is not None and top is not None and not top > bottom:
            yield Fault(f"witness[{number}].top", f"found {top:g} m; allowed: above bottom, {bottom:g} m")
    stations = case.break_up.segments or []
    if any(after <= before for before, after in pairwise(stations)):
        yield Fault("break_up.segments", f"found {show(stations)} (m); allowed: values that rise")
    if case.official is not None:
        yield from check_official(case.official)


def check_charges(case: CaseTable, stacked: Sequence[str] = ()) -> list[Fault]:
    """Faults of a resolved case: heat of detonation, product constants, ignition, masses, positions of the rounds.

    `stacked` are the names of the rounds that stand for [stack].
    """
    faults: list[Fault] = []
    for number, entry in enumerate(case.round, start=1):
        if case.burst is not None and isinstance(entry.explosive, ExplosiveTable):
            faults += _products(f"round[{number}].explosive", case.burst.products, entry.explosive)
        faults += _delays(case, f"round[{number}]", entry)
        if isinstance(entry.profile, dict):
            faults += _ignition(f"round[{number}]", entry)
    if case.round and not any(entry.ignition for entry in case.round):
        words = (
            "found no ignition point in any round, so nothing makes the shock that initiates them; allowed: at least "
            "one round with an ignition point"
        )
        faults.append(Fault("round", words))
    faults += check_expected(case)
    return faults or list(check_places(case, stacked))


def _stop_rules(burst: BurstTable) -> Iterator[Fault]:
    if burst.stop == "time" and burst.end_time is None:
        yield Fault("burst.end_time", 'missing; stop = "time" needs it, for example end_time = "120 us"')
    if burst.stop == "acceleration" and burst.end_time is not None:
        yield Fault(
            "burst.end_time",
            f'found {burst.end_time:g} s together with stop = "acceleration", which contradict '
            'each other; allowed: stop = "time" with end_time, or stop = "acceleration" without (time_limit bounds it)',
        )
    if burst.end_time is not None and burst.end_time > burst.time_limit:
        yield Fault(
            "burst.end_time", f"found {burst.end_time:g} s; allowed: at most burst.time_limit, {burst.time_limit:g} s"
        )
    end = burst.end_time if burst.end_time is not None else burst.time_limit
    if burst.output.interval * _MOST_STATES < end:
        yield Fault(
            "burst.output.interval",
            f"found {burst.output.interval:g} s; allowed: at least {end / _MOST_STATES:g} s, "
            f"for {_MOST_STATES} states up to {end:g} s",
        )


def _round(key: str, entry: RoundTable) -> Iterator[Fault]:
    given = [name for name in ("profile", "contour", "mesh") if getattr(entry, name) is not None]
    if len(given) != 1:
        found = " and ".join(given) or "none of profile, contour and mesh"
        yield Fault(f"{key}.profile", f"found {found}; allowed: one of the three")
    if entry.mesh_unit is not None and entry.mesh is None:
        yield Fault(f"{key}.mesh_unit", "found without mesh; allowed: only with it")
    if not any(entry.axis):
        yield Fault(f"{key}.axis", "found [0, 0, 0]; allowed: a vector from base to nose, for example [0, 0, 1]")
    if entry.ignition is not None and not entry.ignition and entry.initiation is None:
        yield Fault(
            f"{key}.ignition",
            "found no ignition point, so nothing initiates the charge; allowed: at least one point, "
            'for example ignition = [{ station = "nose" }], or leave the key out for that one; or '
            'initiation = { pressure = "5 GPa", duration = "0.2 us" } by a neighbour\'s shock',
        )


def _products(key: str, products: ProductModel, explosive: ExplosiveTable) -> Iterator[Fault]:
    for lack in explosive.lacks(products):
        needs = " A, B, R1, R2, omega and E0" if lack == "jwl" else " it"
        rest = [f"burst.products = {show(model)}" for model in explosive.models]
        rest = rest or [
            f"{key} as a table with it; without it there is no burst, only TNT equivalents and Gurney's speed"
        ]
        yield Fault(
            f"{key}.{lack}",
            f'missing for "{explosive.name}"; burst.products = {show(products)} needs{needs}; '
            f"allowed: {' or '.join(rest)}",
        )
    heat, minimum = explosive.heat_of_detonation, explosive.detonation_velocity**2 / 16.0
    if products != "jwl" and heat is not None and not heat > minimum:
        yield Fault(
            f"{key}.heat_of_detonation",
            f"found Q = {heat / 1e6:.4g} MJ/kg for {explosive.name}; "
            f"allowed with burst.products = {show(products)}: more than D^2/16 = {minimum / 1e6:.4g} MJ/kg "
            f'(D = {explosive.detonation_velocity:g} m/s), or choose burst.products = "jwl"',
        )


def _delays(case: CaseTable, key: str, entry: RoundTable) -> Iterator[Fault]:
    """Points that would ignite only after the burst is over: nothing would burst, or not what the case says."""
    if case.burst is None:
        return
    name, end = "burst.end_time", case.burst.end_time
    if end is None:
        name, end = "burst.time_limit", case.burst.time_limit
    for number, point in enumerate(entry.ignition or [], start=1):
        if not point.delay < end:
            yield Fault(f"{key}.ignition[{number}].delay", f"found {point.delay:g} s; allowed: below {name}, {end:g} s")


def _ignition(key: str, entry: RoundTable) -> Iterator[Fault]:
    profile = profile_of(entry)
    for number, point in enumerate(entry.ignition or [], start=1):
        station = min(max(float(point.station), profile.charge_front), profile.charge_end)
        radius, distance = float(profile.section(station).charge_radius), math.hypot(*point.offset)
        if distance > radius * (1.0 + 1e-9):
            yield Fault(
                f"{key}.ignition[{number}].offset",
                f"found {_mm(distance)} from the axis, outside the charge; allowed: "
                f"at most {_mm(radius)}, the charge's radius at station {_mm(float(point.station))}",
            )


_TOUCHING = 1e-6  # what only touches does not overlap (m)
_RIGHT_ANGLE = 1e-6  # cosine up to which planes count as perpendicular
_MOST_SYMMETRIES = 3
_DIRECTION = "the direction from the plane to the rounds, for example normal = [1, 0, 0]"
_NEAR_CELLS, _NEAR_RADII = 0.2, 0.02  # more than the corners of any mesh lie outside of the contour


def check_planes(case: CaseTable) -> Iterator[Fault]:
    """Faults of the tables [[plane]] that show before they are resolved."""
    faultless = []
    for number, entry in enumerate(case.plane, start=1):
        faults = list(_plane(f"plane[{number}]", entry))
        yield from faults
        if not faults and entry.kind == "symmetry" and entry.normal is not None:
            faultless.append((number, entry.name, entry.normal))
    if len(faultless) > _MOST_SYMMETRIES:
        yield Fault("plane", f"found {len(faultless)} planes of symmetry; allowed: at most {_MOST_SYMMETRIES}")
        return
    for (_, first, normal), (number, name, other) in combinations(faultless, 2):
        cosine = sum(a * b for a, b in zip(normal, other, strict=True)) / math.hypot(*normal) / math.hypot(*other)
        if abs(cosine) > _RIGHT_ANGLE:
            angle = math.degrees(math.acos(min(abs(cosine), 1.0)))
            yield Fault(
                f"plane[{number}].normal",
                f"{show(name)} stands at {angle:.4g} degrees to {show(first)}; "
                "allowed: planes of symmetry that are perpendicular to each other",
            )


def _plane(key: str, entry: PlaneTable) -> Iterator[Fault]:
    if entry.height is not None and entry.point is not None:
        yield Fault(f"{key}.height", "found together with point; allowed: one of the two")
    if entry.normal is None and entry.kind != "ground":
        yield Fault(f"{key}.normal", f"missing; needed: {_DIRECTION}")
    if entry.normal is not None and not any(entry.normal):
        yield Fault(f"{key}.normal", f"found [0, 0, 0]; allowed: {_DIRECTION}")


def check_places(case: CaseTable, stacked: Sequence[str] = ()) -> Iterator[Fault]:
    """Faults of a resolved case; `stacked` are the rounds that come from [stack]."""
    bodies = [placed(entry) for entry in case.round]
    keys = [
        "stack" if entry.name in stacked else f"round[{number}].position"
        for number, entry in enumerate(case.round, start=1)
    ]
    yield from _overlaps(case, bodies, keys, stacked)
    for plane in case.plane:
        yield from _behind(case, plane, bodies, keys)
    yield from _buried(case, bodies, keys)


def _overlaps(case: CaseTable, bodies: Sequence[Body], keys: Sequence[str], stacked: Sequence[str]) -> Iterator[Fault]:
    size = case.burst.cell_size if case.burst is not None and case.burst.contact.surfaces else None
    for first, second, found in near_pairs(bodies, _near(size, bodies)):
        one, other = case.round[first], case.round[second]
        if found < -_TOUCHING:
            yield Fault(
                f"{keys[second]}",
                f"{show(other.name)} reaches {_mm(-found)} into {keys[first].partition('.')[0]} "
                f"{show(one.name)}; allowed: rounds that do not overlap",
            )
        elif size is not None:
            in_mesh = clearance(meshed(one, size), meshed(other, size))
            if in_mesh < -_TOUCHING:
                both = one.name in stacked and other.name in stacked
                yield Fault(
                    f"{'stack.gap' if both else keys[second]}",
                    f"{show(one.name)} and {show(other.name)} stand {_mm(max(found, 0.0))} apart, and the corners of "
                    f"their meshes with cells of {_mm(size)} reach {_mm(found - in_mesh)} farther; allowed: at least "
                    f"{_mm_up(found - in_mesh)} apart, smaller cells, or burst.contact.surfaces = false",
                )


def _behind(case: CaseTable, plane: PlaneTable, bodies: Sequence[Body], keys: Sequence[str]) -> Iterator[Fault]:
    assert plane.normal is not None  # resolved
    size = case.burst.cell_size if case.burst is not None else None
    number = case.plane.index(plane) + 1
    for entry, body, key in zip(case.round, bodies, keys, strict=True):
        low, high = heights(body, plane)
        if high <= _TOUCHING:
            opposite = [-value + 0.0 for value in plane.normal]
            yield Fault(
                f"plane[{number}].normal",
                f"round {show(entry.name)} stands behind {show(plane.name)}, {_mm(-low)} deep; "
                f"allowed: rounds on the side to which the normal points ({opposite} is the other one)",
            )
        elif low < -_TOUCHING:
            yield Fault(
                key,
                f"{show(entry.name)} reaches {_mm(-low)} through plane[{number}] {show(plane.name)}; "
                "allowed: rounds on one side of it",
            )
        elif size is not None and low < _near(size, [body]):
            in_mesh = heights(meshed(entry, size), plane)[0]
            if in_mesh < -_TOUCHING:
                yield Fault(
                    key,
                    f"{show(entry.name)} stands {_mm(max(low, 0.0))} from plane[{number}] {show(plane.name)}, "
                    f"and the corners of its mesh with cells of {_mm(size)} reach {_mm(low - in_mesh)} farther; "
                    f"allowed: at least {_mm_up(low - in_mesh)} away, or smaller cells",
                )


def _near(size: float | None, bodies: Sequence[Body]) -> float:
    """Distance (m) beyond which no mesh with cells of this size (m) can make rounds overlap."""
    if size is None:
        return 0.0
    widest = max((float(np.ptp(body.reach(np.linalg.svd(body.axis[None, :])[2][1]))) for body in bodies), default=0.0)
    return _NEAR_CELLS * size + _NEAR_RADII * widest


def _buried(case: CaseTable, bodies: Sequence[Body], keys: Sequence[str]) -> Iterator[Fault]:
    for entry, body, key in zip(case.round, bodies, keys, strict=True):
        ground = ground_height(case, *entry.position[:2])
        lowest = body.reach((0.0, 0.0, 1.0))[0]
        if lowest < ground - _TOUCHING:
            yield Fault(
                key,
                f"the round lies {_mm(ground - lowest)} below the ground, z = {ground:g} m; "
                "allowed: on or above it (position is the centre of the base)",
            )


def _mm(value: float) -> str:
    return f"{round(value * 1e3, 6) + 0.0:.6g} mm"


def _mm_up(value: float) -> str:
    """A length rounded up, so that keeping to it is enough."""
    return f"{math.ceil(value * 1e6 + 1.0) * 1e-3:.6g} mm"


_CLOSED = 270.0  # degrees: three sides, and an entrance on the fourth
_ELEVATION = 30.0  # degrees over the top of the rounds; the fragments that fly farthest leave at 20 to 40
_NEAR_WALL = 3.0  # m to a plane, which has no height
_UPRIGHT = 0.5  # largest vertical part of a wall's normal: 30 degrees from plumb


def check_protective_works(case: CaseTable) -> Iterator[Fault]:
    """Faults of `hazard.protective_works` of a resolved case: unknown names, floors, works that leave the rounds open.

    Seen from the top of every round, all that is named together must close 270 degrees of the directions, up to 30
    degrees over the horizontal: a single wall, works far off and low ones do not stop what flies farthest.
    """
    key, names = "hazard.protective_works", case.hazard.protective_works
    planes = {one.name: one for one in case.plane if one.kind == "wall"}
    known = [*(one.name for one in case.obstacle), *planes]
    for name in names:
        if name not in known:
            allowed = ", ".join(map(show, known)) or "none: the case has no [[obstacle]] and no [[plane]] of kind wall"
            yield Fault(key, f"found {show(name)}; allowed: {allowed}{nearest(name, known)}")
            return
    walls = []  # of the planes, a point and the unit normal
    for one in (planes[name] for name in names if name in planes):
        normal = np.array(one.normal, dtype=np.float64) / np.linalg.norm(np.array(one.normal))
        if abs(normal[2]) > _UPRIGHT:
            yield Fault(key, f"found {show(one.name)}, a plane under or over the rounds; allowed: upright walls")
            return
        walls.append((np.array(one.point, dtype=np.float64), normal))
    if not names:
        return
    ground = ground_of(case)
    lowest = ground if isinstance(ground, float) else float(ground.heights.min())
    standing = [one for one in surroundings(case)["obstacles"] if one.name in names]
    bodies = pack_obstacles(standing, lowest, Scene(ground).ground_at)[:, FIRST_FACE:].reshape(-1, FACES, 2, 3)
    azimuth, rise = np.radians(np.arange(0.5, 360.0)), np.tan(np.radians(_ELEVATION))
    ahead = np.stack([np.cos(azimuth), np.sin(azimuth), np.full(len(azimuth), rise)], axis=1)
    origin = (*case.flight.origin, ground_height(case, *case.flight.origin))
    tops = [(*one.position[:2], placed(one).reach(UP)[1]) for one in case.round] or [origin]
    degrees = min(_closed(np.array(top), ahead, bodies, walls) for top in tops)
    if degrees < _CLOSED:
        yield Fault(
            key,
            f"found {', '.join(map(show, names))}, which close {degrees} of 360 degrees around the rounds up to "
            f"{_ELEVATION:g} degrees over them; allowed: works that enclose them, on {_CLOSED:g} degrees or more, as "
            f"high as that or, of planes, within {_NEAR_WALL:g} m",
        )


def _closed(
    top: NDArray[np.float64], ahead: NDArray[np.float64], bodies: NDArray[np.float64],
    walls: list[tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> int:  # fmt: skip
    """How many rays `ahead` (n, 3) from `top` (3,) meet a convex body (k, faces, 2, 3) or a near wall."""
    point, normal = bodies[:, :, 0], bodies[:, :, 1]
    outside = ((top - point) * normal).sum(axis=2)  # (k, faces)
    away = np.einsum("kfj,nj->nkf", normal, ahead)
    with np.errstate(divide="ignore", invalid="ignore"):
        met = -outside / away
    entry = np.where(away < 0.0, met, -np.inf).max(axis=2, initial=0.0)
    leaving = np.where(away > 0.0, met, np.inf).min(axis=2, initial=np.inf)
    beside = ((away == 0.0) & (outside > 0.0)).any(axis=2)
    closed = ((entry <= leaving) & ~beside).any(axis=1)
    for at, out in walls:
        towards = ahead[:, :2] @ out[:2]
        closed |= (towards < 0.0) & (float((top - at) @ out) <= -_NEAR_WALL * towards)
    return int(closed.sum())
