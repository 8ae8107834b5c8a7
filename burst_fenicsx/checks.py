"""What is refused before a burst begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import BurstSettings, Round

__all__ = ["check_planes", "check_problem"]

_PLANE_SLACK = 0.02  # of the cell size: the outline of the cells bulges a little over the circle


def check_problem(rounds: Sequence[Round], settings: BurstSettings) -> None:
    """Refuse what cannot be computed, before any work; raises InputError."""
    if not rounds:
        raise InputError("there is no round to burst")
    if not settings.cell_size > 0.0:
        raise InputError(f"cell_size = {settings.cell_size} m; it must be positive")
    for item in rounds:
        if not item.ignition and item.initiation is None:
            raise InputError(
                f"round '{item.name}' has no ignition point; give at least one, or let it be initiated by shock"
            )
    if not any(item.ignition for item in rounds):
        raise InputError("no round has an ignition point: nothing would burst")
    for plane in settings.planes:
        if not np.linalg.norm(plane.normal) > 0.0:
            raise InputError(f"plane '{plane.name}' has the normal {plane.normal}; it must not be zero")


def check_planes(rounds: Sequence[Round], settings: BurstSettings, mesh: HexahedralMesh) -> None:
    """Refuse rounds that a plane cuts or that stand behind it, of a mesh of all rounds (m); raises InputError."""
    slack = _PLANE_SLACK * settings.cell_size
    for plane in settings.planes:
        normal = np.asarray(plane.normal) / np.linalg.norm(plane.normal)
        height = (mesh.nodes - np.asarray(plane.point)) @ normal
        for index, item in enumerate(rounds):
            deepest = -float(height[mesh.cells[mesh.round == index]].min())
            if deepest > slack:
                raise InputError(
                    f"round '{item.name}' lies {1e3 * deepest:.3g} mm behind the plane '{plane.name}'; "
                    "every round must stand wholly on the side to which the plane's normal points"
                )
