"""Warnings on witness surfaces: casings that reach them, obstacles that cut them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fragfield.case.conversion.exposed_sites import outline_of
from fragfield.case.tables.flight import CylinderTable
from fragfield.hazard.arrangement import with_images

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fragfield.case import Case

__all__ = ["witness_warnings"]


def witness_warnings(case: Case, largest_diameter: float) -> Iterator[str]:
    """Cylinders that a casing may reach before it breaks up, or that cut the foot of an obstacle.

    Parameters
    ----------
    case : Case
        Resolved, with a burst.
    largest_diameter : float
        Of the rounds (m).
    """
    for number, surface in enumerate(case.witness, start=1):
        if not isinstance(surface, CylinderTable):
            continue
        key = f"witness[{number}].radius = {surface.radius:g} m"
        reach = max(math.hypot(x - surface.centre[0], y - surface.centre[1]) for x, y, _ in with_images(case))
        if surface.radius < 2.0 * (reach + largest_diameter):
            yield f"{key}: so close that casings may reach it before break-up"
        for obstacle in case.obstacle:
            nearest, farthest = _distances(np.asarray(surface.centre), outline_of(obstacle))
            if nearest < surface.radius < farthest:
                yield (
                    f'{key}: {surface.name} cuts {obstacle.kind} "{obstacle.name}", whose foot lies {nearest:.3g} to '
                    f"{farthest:.3g} m from its centre: part of the surface lies in front of the obstacle and part "
                    f"behind it; use less than {nearest:.3g} m or more than {farthest:.3g} m"
                )


def _distances(centre: NDArray[np.float64], corners: NDArray[np.float64]) -> tuple[float, float]:
    """Smallest and largest distance (m) of a point from a convex polygon (n, 2)."""
    ways = np.roll(corners, -1, axis=0) - corners
    away = centre - corners
    turn = ways[:, 0] * away[:, 1] - ways[:, 1] * away[:, 0]
    along = np.clip((away * ways).sum(axis=1) / (ways**2).sum(axis=1), 0.0, 1.0)
    nearest = np.linalg.norm(away - along[:, None] * ways, axis=1).min()
    inside = bool((turn >= 0.0).all() or (turn <= 0.0).all())
    return 0.0 if inside else float(nearest), float(np.linalg.norm(away, axis=1).max())
