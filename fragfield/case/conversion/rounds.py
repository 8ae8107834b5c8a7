"""Rounds and planes of a case as the burst takes them, and in space: outer surfaces, as meshed too, and masses."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from burst_fenicsx.geometry import Profile, profile_from_table
from burst_fenicsx.meshing import mesh_round, part_volumes
from burst_fenicsx.meshing.disc import equal_area_factor
from burst_fenicsx.meshing.sizing import grid_counts
from burst_fenicsx.problem import Part, Round
from fragfield.case.conversion.clearance import Body, Hull, placed_body
from fragfield.case.conversion.surroundings import ground_height
from fragfield.case.faults import Fault
from fragfield.case.schema import CaseTable
from fragfield.case.tables.round import PlaneTable, RoundTable

Array = NDArray[np.float64]


def burst_rounds(case: CaseTable) -> list[Round]:
    """Rounds of the burst stage, in the order of the file."""
    return [burst_round(entry) for entry in case.round]


def burst_round(entry: RoundTable) -> Round:
    """One resolved round."""
    return Round(
        name=entry.name,
        explosive=entry.material("explosive"),
        casing=entry.material("casing"),
        profile=profile_of(entry) if isinstance(entry.profile, dict) else None,
        mesh_file=Path(entry.mesh) if entry.mesh is not None else None,
        mesh_unit=entry.mesh_unit or "m",
        position=entry.position,
        axis=entry.axis,
        ignition=tuple(point.made() for point in entry.ignition or ()),
        initiation=entry.initiation and entry.initiation.made(),
    )


Held = TypeVar("Held")


def placed(entry: RoundTable) -> Body:
    """Outside of a resolved round; of one from a mesh file, the convex hull of its nodes."""
    if isinstance(entry.profile, dict):
        return placed_body(profile_of(entry), entry.position, entry.axis)
    return Hull.of(mesh_round(burst_round(entry), 1.0).nodes, entry.axis)


def meshed(entry: RoundTable, cell_size: float) -> Body:
    """Body that the mesh of a resolved round with this cell size (m) touches from within.

    The sections of the mesh are polygons with the area of the contour's circles, so that their corners lie outside.
    """
    if not isinstance(entry.profile, dict):
        return placed(entry)
    stations, factor = _grid(json.dumps(entry.profile), cell_size)
    return placed_body(profile_of(entry), entry.position, entry.axis, stations=stations, enlargement=factor)


def outsides(entry: RoundTable, case: CaseTable) -> tuple[Body, Body]:
    """Outside of a resolved round, and that which its mesh touches from within where surfaces meet in the burst."""
    exact = placed(entry)
    meets = case.burst is not None and case.burst.contact.surfaces
    return exact, meshed(entry, case.burst.cell_size) if case.burst is not None and meets else exact


def lift_to(base: float | str | None, entry: RoundTable, case: CaseTable) -> float:
    """Height (m) by which a resolved round is lifted so that it stands on a z or on the "ground".

    Where a plane is in the burst its mesh does.
    """
    if base is None:
        return 0.0
    solid = case.burst is not None and any(plane.kind != "symmetry" for plane in case.plane)
    bodies = (placed(entry), meshed(entry, case.burst.cell_size)) if case.burst and solid else (placed(entry),)
    lowest = min(body.reach((0.0, 0.0, 1.0))[0] for body in bodies)
    return (ground_height(case, *entry.position[:2]) if isinstance(base, str) else base) - lowest


def on_base(entry: RoundTable, case: CaseTable) -> RoundTable:
    """A resolved round with `base` spelt out in its position."""
    if entry.base is None:
        return entry
    x, y, z = entry.position
    height = round(z + lift_to(entry.base, entry, case), 12) + 0.0
    return entry.model_copy(update={"position": (x, y, height), "base": None})


def base_faults(case: CaseTable) -> Iterator[Fault]:
    """Faults of the keys `base` of a case as read."""
    for number, entry in enumerate(case.round, start=1):
        if entry.base is not None and entry.position[2] != 0.0:
            yield Fault(
                f"round[{number}].base",
                f"found together with z = {entry.position[2]:g} m of position; allowed: one of "
                "the two, with z left at 0 m",
            )


def profile_of(entry: RoundTable) -> Profile:
    """Profile of a resolved round that has one."""
    assert isinstance(entry.profile, dict)
    return profile_of_table(entry.profile)


def profile_of_table(table: dict[str, Any]) -> Profile:
    """Profile of the content of a profile file; one for all tables of the same content."""
    return _profile(json.dumps(table, default=str))  # a date of TOML, which the profile refuses


def charge_centre(entry: RoundTable) -> tuple[float, float, float]:
    """Middle of the charge of a resolved round (m); of one from a mesh file the middle of the round."""
    centre = placed(entry).centre
    if isinstance(entry.profile, dict):
        profile = profile_of(entry)
        above = profile.length - 0.5 * (profile.charge_front + profile.charge_end)
        centre = np.add(entry.position, above * np.asarray(entry.axis) / np.linalg.norm(entry.axis))
    x, y, z = centre.tolist()
    return x, y, z


@lru_cache(maxsize=64)  # the rounds of a stack, and of a study, have one
def _profile(table: str) -> Profile:
    return profile_from_table(json.loads(table), where="")


@lru_cache(maxsize=64)
def _grid(table: str, cell_size: float) -> tuple[NDArray[np.float64], float]:
    counts = grid_counts(_profile(table), cell_size)
    return counts.stations, equal_area_factor(4 * counts.core)


def heights(body: Body, plane: PlaneTable) -> tuple[float, float]:
    """Smallest and greatest height (m) of a body over a resolved plane."""
    assert plane.normal is not None  # resolved
    assert plane.point is not None
    low, high = body.reach(plane.normal)
    foot = float(np.dot(plane.normal, plane.point))
    return low - foot, high - foot


def images(case: CaseTable) -> list[tuple[Array, Array]]:
    """The reflections x -> Q x + s (m) at planes of symmetry that make all rounds of the case's; the identity first."""
    found: list[tuple[Array, Array]] = [(np.eye(3), np.zeros(3))]
    for plane in case.plane:
        if plane.kind == "symmetry":
            normal = np.array(plane.normal, dtype=np.float64)
            normal = normal / np.linalg.norm(normal)
            mirror = np.eye(3) - 2.0 * np.outer(normal, normal)
            shift = 2.0 * (np.array(plane.point) @ normal) * normal
            found += [(mirror @ matrix, mirror @ s + shift) for matrix, s in found]
    return found


def mirrored(case: CaseTable, bodies: list[tuple[Array, Array, Held]]) -> list[tuple[Array, Array, Held]]:
    """Positions, axes and contents of rounds, followed by those of their images behind planes of symmetry."""
    return [(matrix @ at + s, matrix @ axis, what) for matrix, s in images(case) for at, axis, what in bodies]


_CONTENTS = {"profile", "mesh", "mesh_unit", "explosive", "casing"}


@dataclass(frozen=True)
class SegmentMass:
    """An axial segment of a casing: its kind ("nose", "wall" or "base"), and masses of casing and charge in it (kg)."""

    name: str
    kind: str
    casing: float
    charge: float


@dataclass(frozen=True)
class RoundMasses:
    """Masses of a round as its contours or its mesh and its materials give them (kg)."""

    casing: float
    charge: float
    segments: tuple[SegmentMass, ...] = ()
    """Of its profile; none where it is from a mesh file."""
    fuze: float = 0.0

    @property
    def whole(self) -> float:
        """All of it."""
        return self.casing + self.charge + self.fuze

    @property
    def ratio(self) -> float:
        """Charge over casing."""
        return self.charge / self.casing


def masses_of(entry: RoundTable | Round) -> RoundMasses:
    """Masses of a round, resolved or as the burst has it."""
    item = burst_round(entry) if isinstance(entry, RoundTable) else entry
    casing, charge = item.casing.density, item.explosive.density
    profile = profile_of(entry) if isinstance(entry, RoundTable) and entry.mesh is None else item.profile
    if profile is None:
        volumes = part_volumes(mesh_round(item, 1.0))
        return RoundMasses(volumes[Part.CASING] * casing, volumes[Part.CHARGE] * charge)
    parts = ((one, profile.volumes(one.start, one.end)) for one in profile.segments)
    segments = tuple(SegmentMass(one.name, one.kind, casing * of.casing, charge * of.charge) for one, of in parts)
    return RoundMasses(profile.casing_volume * casing, profile.charge_volume * charge, segments, profile.fuze_mass)


def contents_text(entry: RoundTable) -> str:
    """Shape and materials of a round as text: rounds that differ in their place or their initiation alone have one."""
    return json.dumps(entry.model_dump(mode="json", include=_CONTENTS), sort_keys=True)


def first_alike(case: CaseTable) -> list[int]:
    """For every round the index of the first one of the same contents."""
    keys = [contents_text(entry) for entry in case.round]
    return [keys.index(key) for key in keys]


def are_alike(case: CaseTable) -> bool:
    """Whether all rounds of a case have the same contents: the data of a test hold the fragments of one kind."""
    return len({contents_text(entry) for entry in case.round}) <= 1
