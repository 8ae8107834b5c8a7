"""The part of an arrangement that is computed, and which reflections of it make up the whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.problem import RigidPlane
from burst_fenicsx.symmetry.detection import find_planes
from burst_fenicsx.symmetry.words import plane_equation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.problem import BurstSettings, Round
    from burst_fenicsx.symmetry.detection import Refusal

    Vector = NDArray[np.float64]

__all__ = ["Cut", "SymmetricPart", "reflected", "smallest_part"]

_LENGTH = 1e-9  # m


def reflected(vectors: Vector, matrix: Vector) -> Vector:
    """Vectors (..., 3) after the transformation `matrix` (3, 3); where that only turns signs, by signs alone."""
    signs = np.diag(matrix)
    if np.array_equal(matrix, np.diag(signs)):
        return np.asarray(vectors * signs.astype(vectors.dtype))
    return np.asarray(vectors @ matrix.T)


@dataclass(frozen=True)
class Cut:
    """A plane of symmetry through a round's axis; `bit` is its number among the planes of the arrangement."""

    bit: int
    point: tuple[float, float, float]
    normal: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class SymmetricPart:
    """What is computed of an arrangement, and of which rounds it is an image.

    A set of the planes, at each of which one reflects, is a number whose bit k stands for plane k. All planes contain
    one point and are at right angles to each other, so the order of reflections does not matter.

    Attributes
    ----------
    whole : all rounds of the arrangement.
    normals : (planes, 3) unit normals, towards the part. point : (3,) m, in all planes.
    source : (all rounds,) index among `rounds` of the computed round of which each is an image.
    mirrors : (all rounds,) set of planes between the computed round and the image.
    rounds : the computed rounds. indices : (computed rounds,) their indices in the whole.
    cuts : planes that contain the computed rounds' axes, by round; one side of them is computed.
    refused : planes that the positions would allow, and why they were not used.
    """

    whole: tuple[Round, ...]
    normals: NDArray[np.float64]
    point: NDArray[np.float64]
    source: NDArray[np.int64]
    mirrors: NDArray[np.int64]
    rounds: tuple[Round, ...]
    indices: tuple[int, ...]
    cuts: tuple[tuple[Cut, ...], ...]
    refused: tuple[Refusal, ...] = ()

    @property
    def images(self) -> int:
        """How many times the part is contained in the whole."""
        return 1 << len(self.normals)

    @property
    def multiplicity(self) -> NDArray[np.float64]:
        """(computed rounds,) how many times a round is the part of it that is computed: 1, 2 or 4."""
        return np.array([1 << len(cuts) for cuts in self.cuts], dtype=float)

    def matrix(self, mirrors: int) -> NDArray[np.float64]:
        """(3, 3) matrix of the reflections at a set of planes."""
        result = np.eye(3)
        for bit, normal in enumerate(self.normals):
            if mirrors >> bit & 1:
                result -= 2.0 * np.outer(normal, normal)
        return result

    def place(self, points: Vector, mirrors: int) -> Vector:
        """Points (..., 3) in m after reflection at a set of planes."""
        if not mirrors:
            return np.asarray(points)
        moved: Vector = self.point + reflected(points - self.point, self.matrix(mirrors))
        return moved

    def planes(self) -> tuple[RigidPlane, ...]:
        """The planes as frictionless rigid ones that keep metal on the computed side.

        None for a single round that stands alone: nothing is pushed towards them then.
        """
        if len(self.whole) == 1:
            return ()
        point = _triple(self.point)
        return tuple(
            RigidPlane(_name(normal, self.point), point, _triple(normal), friction_angle=0.0) for normal in self.normals
        )

    @property
    def held_directions(self) -> NDArray[np.float64]:
        """(k, 3) normals of the planes that cut a round: across these, nodes are held and the images balance."""
        bits = sorted({cut.bit for cuts in self.cuts for cut in cuts})
        return self.normals[bits]

    def summary(self) -> dict[str, Any]:
        """Part of the burst's summary."""
        names = [item.name for item in self.whole]
        return {
            "planes": [
                {
                    "point": _triple(self.point),
                    "normal": _triple(normal),
                    "through_rounds": [
                        item.name
                        for item in self.whole
                        if abs(float((np.asarray(item.position) - self.point) @ normal)) < _LENGTH
                    ],
                }
                for normal in self.normals
            ],
            "computed_rounds": [
                {"name": item.name, "share": 0.5 ** len(cuts)}
                for item, cuts in zip(self.rounds, self.cuts, strict=True)
            ],
            "image_rounds": [
                {"name": names[index], "image_of": self.rounds[source].name}
                for index, source in enumerate(self.source)
                if index not in self.indices
            ],
            "share": 1.0 / self.images,
            "not_used": [{"normal": list(one.normal), "reason": one.reason} for one in self.refused],
        }


def smallest_part(rounds: Sequence[Round], settings: BurstSettings) -> SymmetricPart:
    """Find the smallest part of an arrangement that stands for the whole; the whole with `settings.symmetry` "off"."""
    whole = tuple(rounds)
    normals: list[Vector] = []
    point = np.zeros(3)
    refused: tuple[Refusal, ...] = ()
    if settings.symmetry == "auto" and whole:
        normals, point, found = find_planes(whole, settings.planes)
        refused = tuple(found)
    normals = [_towards_first(normal, whole, point) for normal in normals]
    position = np.array([item.position for item in whole], dtype=float).reshape(-1, 3)
    heights = (position - point) @ np.array(normals).reshape(-1, 3).T
    indices = [index for index in range(len(whole)) if (heights[index] > -_LENGTH).all()]
    cuts = tuple(
        tuple(
            Cut(bit, _triple(point), _triple(normals[bit]))
            for bit in range(len(normals))
            if abs(heights[index, bit]) < _LENGTH
        )
        for index in indices
    )
    # A round behind planes is the image at exactly these of the computed one.
    mirrors = ((heights < -_LENGTH) @ (1 << np.arange(len(normals)))).astype(np.int64)
    part = SymmetricPart(
        whole, np.array(normals).reshape(-1, 3), point, np.zeros(len(whole), dtype=np.int64), mirrors,
        tuple(whole[index] for index in indices), tuple(indices), cuts, refused,
    )  # fmt: skip
    for index in range(len(whole)):
        place = part.place(position[index], int(mirrors[index]))
        part.source[index] = int(np.argmin(np.linalg.norm(position[indices] - place, axis=1)))
    return part


def _towards_first(normal: Vector, whole: Sequence[Round], point: Vector) -> Vector:
    """The normal that points to the side of the first round that the plane does not cut."""
    for item in whole:
        height = float((np.asarray(item.position) - point) @ normal)
        if abs(height) > _LENGTH:
            return normal * np.sign(height) + 0.0
    return normal


def _triple(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z


def _name(normal: Vector, point: Vector) -> str:
    return f"symmetry, {plane_equation(normal, point)}"
