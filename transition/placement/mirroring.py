"""Rounds behind planes of symmetry: the burst stage computes one side, the break-up adds the images.

Planes stand at right angles to each other, as the burst stage finds them, so that reflections at them commute: one
image for one plane, three for two planes, seven for three.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from transition.errors import InputError
from transition.placement.isometry import Isometry

if TYPE_CHECKING:
    from collections.abc import Sequence


_RIGHT = 1e-6  # cosine up to which two planes stand at right angles


@dataclass(frozen=True)
class SymmetryPlane:
    """A plane of symmetry: a point on it (m), and its unit normal towards the rounds that were computed."""

    name: str
    point: tuple[float, float, float]
    normal: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Image(Isometry):
    """One mirrored copy of everything computed."""

    planes: tuple[str, ...]
    """Names of the planes that it is mirrored at, one after the other."""

    def name_of(self, name: str) -> str:
        """Name of the image of the round `name`."""
        *first, last = self.planes
        planes = f"{', '.join(first)} and {last}" if first else last
        return f"{name} mirrored at {planes}"


def images(planes: Sequence[SymmetryPlane], source: str = "planes") -> tuple[Image, ...]:
    """All images that planes of symmetry make, without the computed side itself.

    They are ordered by the number of reflections and then by the planes' names, whatever the order of the planes.

    `planes`: none, one, two or three; `source`: where they come from, for messages. Raises InputError: planes that do
    not stand at right angles to each other.
    """
    planes = sorted(planes, key=lambda plane: plane.name)
    for first, second in combinations(planes, 2):
        cosine = float(np.dot(first.normal, second.normal))
        if abs(cosine) > _RIGHT:
            angle = math.degrees(math.acos(min(abs(cosine), 1.0)))
            raise InputError(
                f"{source}: the planes of symmetry {first.name!r} and {second.name!r} "
                f"{f'meet at {angle:.6g} degrees' if angle > 1e-4 else 'are parallel'}; allowed: planes at right angles"
            )
    made = []
    for number in range(1, len(planes) + 1):
        for chosen in combinations(planes, number):
            image = Image(np.eye(3), np.zeros(3), ())
            for plane in chosen:
                image = _mirrored(image, plane)
            made.append(image)
    return tuple(made)


def _mirrored(image: Image, plane: SymmetryPlane) -> Image:
    normal = np.asarray(plane.normal)
    matrix = np.eye(3) - 2.0 * np.outer(normal, normal)
    shift = matrix @ image.shift + 2.0 * float(normal @ plane.point) * normal
    return Image(matrix @ image.matrix, shift, (*image.planes, plane.name))
