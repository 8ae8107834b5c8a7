"""Whether an axisymmetric snapshot is one: nodes in one half plane, convex quadrilaterals, masses of whole rings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from transition.cells.meridian import ring_volumes
from transition.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from transition.cells.meridian import HalfPlane

__all__ = ["check_meridian"]

_IN_PLANE = 1e-9  # of the largest coordinate, or of the largest speed
_WHOLE_RING = 0.05  # the casing's mass may differ so much from density times ring volume


def check_meridian(
    where: str, half: HalfPlane, nodes: Mapping[str, NDArray[np.float64]], cells: NDArray[np.int64],
    mass: NDArray[np.float64], casing: NDArray[np.bool_], density: float,
) -> None:  # fmt: skip
    """Check what an axisymmetric snapshot says of its one round.

    Parameters
    ----------
    where : names the file in messages.
    half : its half plane.
    nodes : arrays (n, 3): reference and position (m), velocity (m/s).
    cells : (m, 4) nodes of the quadrilaterals.
    mass, casing : (m,) masses (kg), and which cells are of the casing.
    density : of the casing (kg/m3).

    Raises
    ------
    InputError
        Nodes or velocities that leave the half plane, quadrilaterals that are not convex and
        counter-clockwise, or masses that are not those of whole rings.
    """
    largest = float(np.abs(nodes["reference"]).max())
    for name in ("reference", "position"):
        out = np.abs((nodes[name] - half.origin) @ half.frame[1])
        if out.max() > _IN_PLANE * max(largest, float(np.abs(nodes[name]).max())):
            raise InputError(
                f"{where}: {name} of node {out.argmax()} lies {out.max():.3g} m outside the half plane of the meridian"
            )
    across = np.abs(nodes["velocity"] @ half.frame[1])
    if across.max() > _IN_PLANE * float(np.abs(nodes["velocity"]).max()):
        raise InputError(
            f"{where}: node {across.argmax()} has a velocity of {across.max():.3g} m/s across the half plane of the "
            "meridian; an axisymmetric burst does not turn about its axis"
        )
    flat = half.coordinates(nodes["reference"])
    if flat[:, 0].min() < -_IN_PLANE * largest:
        raise InputError(f"{where}: node {flat[:, 0].argmin()} lies beyond the axis before the burst")
    corners = flat[cells]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    turning = (ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]).min(axis=1)
    if not (turning > 0.0).all():
        raise InputError(
            f"{where}: cell {turning.argmin()} is not convex and counter-clockwise seen in (r, z) before the burst"
        )
    found = float(mass[casing].sum())
    rings = density * float(ring_volumes(corners[casing]).sum())
    if abs(found - rings) > _WHOLE_RING * rings:
        raise InputError(
            f"{where}: casing cells have {found:.6g} kg, their rings {rings:.6g} kg by volume and density; "
            "cells/mass must be that of whole rings"
        )
