"""An arrangement turned as one rigid body: its fragments, its directions of symmetry, its place over the ground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flight import Fragments
from fragfield.case.conversion.rounds import burst_round, images, placed, profile_of
from fragfield.case.conversion.surroundings import ground_height
from fragfield.case.conversion.symmetry import all_azimuths_alike, mirror_planes
from fragfield.case.faults import Fault
from fragfield.case.schema import CaseTable
from fragfield.case.tables.round import RoundTable

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

    Parameters
    ----------
    case : CaseTable
        Resolved; nothing but planes of symmetry stands beside its rounds.
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
        shift[2] += max(0.0, ground - self._lowest(matrix, shift))
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

    def _lowest(self, matrix: Array, shift: Array) -> float:
        return min(
            placed(entry).reach(mirror.T @ matrix[2])[0] + float(matrix[2] @ moved) + float(shift[2])
            for entry in self.case.round
            for mirror, moved in self.images
        )


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
    density = burst_round(entry, entry.name).casing.density
    if entry.profile is None:
        from burst_fenicsx.meshing import mesh_round
        from burst_fenicsx.meshing.mesh import cell_centres, cell_volumes
        from burst_fenicsx.problem import Part

        mesh = mesh_round(burst_round(entry, entry.name), 1.0)
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
