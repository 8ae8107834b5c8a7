"""Symmetry of a case: a single round of revolution, alike directions, and the rounds turned as one body.

Only what is certain counts: where wind, a map, obstacles, a mesh file or a point of ignition off the axis may break a
symmetry, none is used.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from burst_fenicsx.meshing import mesh_round
from burst_fenicsx.meshing.mesh import cell_centres, cell_volumes
from burst_fenicsx.problem import Part
from flight import Fragments
from fragfield.case.conversion.rounds import burst_round, images, mirrored, placed, profile_of
from fragfield.case.conversion.stack import expanded
from fragfield.case.conversion.surroundings import ground_height
from fragfield.case.faults import Fault
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


Array = NDArray[np.float64]


_SLICES = 400  # of a profile, for the centre of mass of its casing
_NEAR = 0.5  # m in plan, from the origin of the distances to the centre of the casings


@dataclass(frozen=True, eq=False)
class Turned:
    """An arrangement in one attitude."""

    inclination: float
    roll: float
    azimuth: float
    """Degrees: of the arrangement's vertical from upright, towards the azimuth; and about its vertical, before."""
    case: CaseTable
    """With the rounds' axes and positions, and planes of symmetry, as turned."""
    matrix: Array
    shift: Array
    """(3, 3) and (3,) float64: the motion x -> matrix x + shift (m) from the arrangement as placed."""

    def fragments(self, placed: Fragments) -> Fragments:
        """Fragments after the motion: masses, speeds and shapes stay."""
        return replace(
            placed, position=placed.position @ self.matrix.T + self.shift, velocity=placed.velocity @ self.matrix.T
        )


class Arrangement:
    """The rounds of a resolved case with their images, which turn about the centre of mass of the casings.

    `case`: resolved; nothing but planes of symmetry stands beside its rounds.
    """

    def __init__(self, case: CaseTable) -> None:
        self.case, self.images = case, images(case)

    @cached_property
    def centre(self) -> Array:
        """Centre of mass (3,) of all casings (m)."""
        own = np.array([(mass, *(mass * place)) for mass, place in map(_casing, self.case.round)]).sum(axis=0)
        centre = own[1:] / own[0]
        return np.mean([matrix @ centre + shift for matrix, shift in self.images], axis=0)

    @property
    def even(self) -> bool:
        """Whether a roll about the vertical changes nothing: one upright round of revolution."""
        return len(self.images) == 1 and all_azimuths_alike(self.case)

    @cached_property
    def mirrors(self) -> tuple[float, ...]:
        """Azimuths (degrees) of vertical planes that mirror the arrangement on itself, as placed."""
        return mirror_planes(self.case)

    def roll(self, angle: float) -> float:
        """The smallest roll (degrees, 0 to 360) that gives the same distance, by the arrangement's mirror planes.

        Inclined towards +x, the arrangement with a mirror plane at azimuth a and rolled by r is the mirror image of
        the one rolled by -r - 2 a.
        """
        known, new = set(), {_full(angle)}
        while new:
            known |= new
            new = {_full(-one - 2.0 * mirror) for one in new for mirror in self.mirrors} - known
        return min(known)

    def turned(self, inclination: float, roll: float = 0.0, azimuth: float = 0.0) -> Turned:
        """The arrangement rolled about its vertical, inclined towards an azimuth (degrees), and lifted to the ground.

        The height of the centre of the casings stays unless a casing would reach below the ground.
        """
        matrix = _about(2, math.radians(azimuth)) @ _about(1, math.radians(inclination)) @ _about(2, math.radians(roll))
        shift = self.centre - matrix @ self.centre
        ground = ground_height(self.case, float(self.centre[0]), float(self.centre[1]))
        lowest = min(
            placed(entry).reach(mirror.T @ matrix[2])[0] + float(matrix[2] @ moved + shift[2])
            for entry in self.case.round
            for mirror, moved in self.images
        )
        shift[2] += max(0.0, ground - lowest)
        rounds = [
            entry.model_copy(
                update={
                    "attitude": None,
                    "axis": _tuple(matrix @ np.array(entry.axis)),
                    "position": _tuple(matrix @ np.array(entry.position) + shift),
                }
            )
            for entry in self.case.round
        ]
        planes = [
            plane.model_copy(
                update={
                    "normal": _tuple(matrix @ np.array(plane.normal)),
                    "point": _tuple(matrix @ np.array(plane.point) + shift),
                }
            )
            for plane in self.case.plane
        ]
        case = self.case.model_copy(update={"round": rounds, "plane": planes})
        return Turned(inclination, roll, azimuth, case, matrix, shift)


def origin_faults(case: CaseTable) -> Iterator[Fault]:
    """Fault of a resolved case of mixed attitudes whose distances are counted from beside the rounds."""
    x, y = Arrangement(case).centre[:2]
    apart = math.dist((x, y), case.flight.origin)
    if apart > _NEAR:
        yield Fault(
            "flight.origin",
            f"found {apart:.3g} m from the centre of the rounds, ({x:.3g} m, {y:.3g} m); allowed with "
            f'attitude = "any": at most {_NEAR:g} m, since its distance holds in every direction',
        )


def _casing(entry: RoundTable) -> tuple[float, Array]:
    density = burst_round(entry).casing.density
    if entry.profile is None:
        mesh = mesh_round(burst_round(entry), 1.0)
        weight = np.where(mesh.part == Part.CASING, cell_volumes(mesh), 0.0)
        return density * float(weight.sum()), weight @ cell_centres(mesh) / weight.sum()
    profile = profile_of(entry)
    edges = np.linspace(0.0, profile.length, _SLICES + 1)
    volume = np.array([profile.volumes(*ends).casing for ends in pairwise(edges)])
    station = float(volume @ (0.5 * (edges[:-1] + edges[1:]))) / float(volume.sum())
    axis = np.array(entry.axis) / np.linalg.norm(entry.axis)
    return density * float(volume.sum()), np.array(entry.position) + (profile.length - station) * axis


def _about(axis: int, angle: float) -> Array:
    """Right-handed rotation about a coordinate axis (rad), exact at multiples of a quarter turn."""
    sine, cosine = (round(value, 15) + 0.0 for value in (math.sin(angle), math.cos(angle)))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[[first, second], [first, second]] = cosine
    matrix[second, first], matrix[first, second] = sine, -sine
    return matrix


def _full(angle: float) -> float:
    return round(angle % 360.0, 9) % 360.0


def _tuple(vector: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
