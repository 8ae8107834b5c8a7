"""The part of an arrangement that is computed, and which reflections of it make up the whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.problem import Mirror
from burst_fenicsx.symmetry.detection import SAME_LENGTH, find_planes, triple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.problem import BurstSettings, Round
    from burst_fenicsx.symmetry.detection import Refusal

    Vector = NDArray[np.float64]


def reflected(vectors: Vector, matrix: Vector) -> Vector:
    """Vectors (..., 3) after the transformation `matrix` (3, 3); where that only turns signs, by signs alone."""
    signs = np.diag(matrix)
    if np.array_equal(matrix, np.diag(signs)):
        return np.asarray(vectors * signs.astype(vectors.dtype))
    return np.asarray(vectors @ matrix.T)


@dataclass(frozen=True, eq=False)
class SymmetricPart:
    """What is computed of an arrangement, and of which rounds it is an image.

    A set of the planes, at each of which one reflects, is a number whose bit k stands for plane k. All planes contain
    one point and are at right angles to each other, so the order of reflections does not matter.

    Attributes
    ----------
    whole : all rounds of the arrangement.
    planes : of symmetry, with unit normals towards the part. point : (3,) m, in all of them.
    source : (all rounds,) index among `rounds` of the computed round of which each is an image.
    mirrors : (all rounds,) set of planes between the computed round and the image.
    rounds : the computed rounds. indices : (computed rounds,) their indices in the whole.
    cuts : planes that contain the computed rounds' axes, by round; one side of them is computed.
    refused : planes that the positions would allow, and why they were not used.
    """

    whole: tuple[Round, ...]
    planes: tuple[Mirror, ...]
    point: NDArray[np.float64]
    source: NDArray[np.int64]
    mirrors: NDArray[np.int64]
    rounds: tuple[Round, ...]
    indices: tuple[int, ...]
    cuts: tuple[tuple[Mirror, ...], ...]
    refused: tuple[Refusal, ...] = ()

    @property
    def images(self) -> int:
        """How many times the part is contained in the whole."""
        return 1 << len(self.planes)

    @property
    def multiplicity(self) -> NDArray[np.float64]:
        """(computed rounds,) how many times a round is the part of it that is computed: 1, 2 or 4."""
        return np.array([1 << len(cuts) for cuts in self.cuts], dtype=float)

    @property
    def rigid(self) -> tuple[Mirror, ...]:
        """The planes that keep metal on the computed side: none for a round that stands alone, which nothing pushes."""
        return self.planes if len(self.whole) > 1 else ()

    @property
    def held_directions(self) -> NDArray[np.float64]:
        """(k, 3) normals of the planes that cut a round: across these, nodes are held and the images balance."""
        cutting = {plane.bit for cuts in self.cuts for plane in cuts}
        return np.array([plane.normal for plane in self.planes if plane.bit in cutting]).reshape(-1, 3)

    def matrix(self, mirrors: int) -> NDArray[np.float64]:
        """(3, 3) matrix of the reflections at a set of planes."""
        result = np.eye(3)
        for plane in self.planes:
            if mirrors >> plane.bit & 1:
                result -= 2.0 * np.outer(plane.normal, plane.normal)
        return result

    def place(self, points: Vector, mirrors: int) -> Vector:
        """Points (..., 3) in m after reflection at a set of planes."""
        if not mirrors:
            return np.asarray(points)
        moved: Vector = self.point + reflected(points - self.point, self.matrix(mirrors))
        return moved

    def summary(self) -> dict[str, Any]:
        """Part of the burst's summary."""
        names = [item.name for item in self.whole]
        heights = _heights(self.whole, self.point, [plane.normal for plane in self.planes])
        return {
            "planes": [
                {
                    "point": plane.point,
                    "normal": plane.normal,
                    "through_rounds": [names[k] for k in np.flatnonzero(np.abs(heights[:, plane.bit]) < SAME_LENGTH)],
                }
                for plane in self.planes
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
    refused: list[Refusal] = []
    if settings.symmetry == "auto" and whole:
        normals, point, refused = find_planes(whole, settings.planes)
    heights = _heights(whole, point, normals)
    planes = []
    for bit, normal in enumerate(normals):
        # Towards the side of the first round that the plane does not cut.
        off = heights[np.abs(heights[:, bit]) > SAME_LENGTH, bit]
        side = float(np.sign(off[0])) if len(off) else 1.0
        heights[:, bit] *= side
        towards = triple(normal * side + 0.0)
        planes.append(Mirror(f"symmetry, {_equation(towards, point)}", triple(point), towards, bit))
    indices = np.flatnonzero((heights > -SAME_LENGTH).all(axis=1)).tolist()
    # A round behind planes is the image at exactly these of the computed one.
    mirrors = ((heights < -SAME_LENGTH) @ (1 << np.arange(len(planes)))).astype(np.int64)
    part = SymmetricPart(
        whole, tuple(planes), point, np.zeros(len(whole), dtype=np.int64), mirrors,
        tuple(whole[index] for index in indices), tuple(indices),
        tuple(tuple(plane for plane in planes if abs(heights[k, plane.bit]) < SAME_LENGTH) for k in indices),
        tuple(refused),
    )  # fmt: skip
    position = np.array([item.position for item in whole], dtype=float).reshape(-1, 3)
    for index in range(len(whole)):
        origin = part.place(position[index], int(mirrors[index]))
        part.source[index] = int(np.argmin(np.linalg.norm(position[indices] - origin, axis=1)))
    return part


def _heights(rounds: Sequence[Round], point: Vector, normals: Sequence[Sequence[float] | Vector]) -> Vector:
    """Distances (rounds, planes) in m of the rounds' positions from planes through `point` (3,)."""
    position = np.array([item.position for item in rounds], dtype=float).reshape(-1, 3)
    heights: Vector = (position - point) @ np.array(normals, dtype=float).reshape(-1, 3).T
    return heights


def symmetry_words(found: Mapping[str, Any]) -> list[str]:
    """Lines in words on a summary of `SymmetricPart.summary`, for log, check and report.

    Empty where every round is computed in full and no plane was refused.
    """
    lines = []
    if found["planes"]:
        computed = [
            f"{_fraction(one['share'])} of {one['name']}" if one["share"] < 1.0 else one["name"]
            for one in found["computed_rounds"]
        ]
        planes = []
        for one in found["planes"]:
            through = f"through {_listed(one['through_rounds'])}" if one["through_rounds"] else "between rounds"
            planes.append(f"{_equation(one['normal'], one['point'])} ({through})")
        lines.append(
            f"symmetry: {_fraction(found['share'])} of the arrangement is computed ({_listed(computed)}), bounded by "
            f"{_listed(planes)}; the rest are its images, joined to whole rounds before the break-up"
        )
    lines += [f"no symmetry about the plane normal to {_direction(one['normal'])}: {one['reason']}"
              for one in found["not_used"]]  # fmt: skip
    return lines


def _equation(normal: Sequence[float], point: Sequence[float] | Vector) -> str:
    """For example "x = 0 mm", or the normal where it is along no axis."""
    direction = _direction(normal)
    if direction in "xyz":
        return f"{direction} = {round(1e3 * point['xyz'.index(direction)], 6) + 0.0:.6g} mm"
    return f"normal {direction}"


def _direction(normal: Sequence[float]) -> str:
    for index in range(3):
        if abs(abs(normal[index]) - 1.0) < 1e-9:
            return "xyz"[index]
    return "(" + ", ".join(f"{value:.3g}" for value in normal) + ")"


def _fraction(value: float) -> str:
    return {1.0: "all", 0.5: "a half", 0.25: "a quarter", 0.125: "an eighth"}[value]


def _listed(words: Sequence[str]) -> str:
    if len(words) > 4:
        return f"{words[0]}, {words[1]}, ... {words[-1]} ({len(words)})"
    return " and ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else words[0]
