"""Rounds behind planes of symmetry: the burst stage computes one side, the break-up adds the images.

Mirrors facing each other at an angle show images of images: the isometries are the closure of the reflections, one
for one plane, three for two planes at right angles, seven for three.
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

__all__ = ["Image", "SymmetryPlane", "images"]

MOST_IMAGES = 119  # of a finite group of reflections in space (that of the icosahedron has 120 elements)
_SAME = 1e-9


@dataclass(frozen=True)
class SymmetryPlane:
    """A plane of symmetry: a point on it (m), and its unit normal towards the rounds that were computed."""

    name: str
    point: tuple[float, float, float]
    normal: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Image(Isometry):
    """One mirrored copy of everything computed.

    Attributes
    ----------
    planes : tuple of str
        Names of the planes that it is mirrored at, one after the other.
    """

    planes: tuple[str, ...]

    def name_of(self, name: str) -> str:
        """Name of the image of the round `name`."""
        *first, last = self.planes
        planes = f"{', '.join(first)} and {last}" if first else last
        return f"{name} mirrored at {planes}"


def images(planes: Sequence[SymmetryPlane], source: str = "planes") -> tuple[Image, ...]:
    """All images that planes of symmetry make, without the computed side itself.

    They are ordered by the number of reflections and then by the planes' names, whatever the order of the planes.

    Parameters
    ----------
    planes : sequence of SymmetryPlane
        Any number.
    source : str
        Where they come from, for messages.

    Raises
    ------
    InputError
        Planes whose images do not close: they are parallel, or do not meet at 180 degrees over a whole number.
    """
    planes = sorted(planes, key=lambda plane: plane.name)
    for first, second in combinations(planes, 2):
        _check_angle(first, second, source)
    mirrors = [_reflection(plane) for plane in planes]
    size = max((float(np.abs(mirror.shift).max()) for mirror in mirrors), default=0.0) or 1.0
    found = [Image(np.eye(3), np.zeros(3), ())]
    newest = found
    while newest:
        following: list[Image] = []
        for image in newest:
            for mirror in mirrors:
                product = _after(image, mirror)
                if not any(_same(product, other, size) for other in (*found, *following)):
                    following.append(product)
        found = [*found, *following]
        if len(found) > MOST_IMAGES + 1:
            names = ", ".join(repr(plane.name) for plane in planes)
            raise InputError(f"{source}: the planes {names} make rounds without end; their images must close")
        newest = following
    return tuple(found[1:])


def _check_angle(first: SymmetryPlane, second: SymmetryPlane, source: str) -> None:
    between = math.degrees(math.acos(float(np.clip(np.dot(first.normal, second.normal), -1.0, 1.0))))
    wedge = 180.0 - between  # that holds the rounds, as the normals point into it
    where = f"{source}: the planes of symmetry {first.name!r} and {second.name!r}"
    if wedge < 1e-6 or between < 1e-6:
        raise InputError(f"{where} are parallel; allowed: planes that meet")
    share = 180.0 / wedge
    if abs(share - round(share)) > 1e-6 * share:
        raise InputError(
            f"{where} meet at {wedge:.6g} degrees on the side of the rounds; their images close at 90, 60, 45, 36 ... "
            "degrees (180 over a whole number)"
        )


def _reflection(plane: SymmetryPlane) -> Image:
    normal = np.asarray(plane.normal)
    matrix = np.eye(3) - 2.0 * np.outer(normal, normal)
    return Image(matrix, 2.0 * float(normal @ plane.point) * normal, (plane.name,))


def _after(image: Image, mirror: Image) -> Image:
    """First `image`, then `mirror`."""
    return Image(mirror.matrix @ image.matrix, mirror.place(image.shift), (*image.planes, *mirror.planes))


def _same(one: Image, other: Image, size: float) -> bool:
    return bool(
        np.abs(one.matrix - other.matrix).max() < _SAME and np.abs(one.shift - other.shift).max() < _SAME * size
    )
