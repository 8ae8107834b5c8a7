"""Whether a burst can be computed in the meridian, and why not; needs neither dolfinx nor MPI."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.problem import Mirror

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.problem import BurstSettings, RigidPlane, Round


CLEARANCE = 4.0
"""Largest outer radii between a round and a plane beyond which the casing is taken not to reach it while it is
accelerated; the burst checks it and stops where it does."""


def why_not_axisymmetric(rounds: Sequence[Round], settings: BurstSettings) -> str | None:
    """Why a burst cannot be computed in the meridian, in words; None where it can."""
    if len(rounds) != 1:
        return f"{len(rounds)} rounds may meet"
    (item,) = rounds
    if item.profile is None:
        return f"round '{item.name}' comes from a mesh file"
    if item.initiation is not None or not item.ignition:
        return f"round '{item.name}' may be initiated by shock"
    if any(any(point.offset) for point in item.ignition):
        return f"round '{item.name}' is initiated off its axis"
    if settings.quadrature != "one_point":
        return "full quadrature belongs to hexahedra"
    for plane in settings.planes:
        if isinstance(plane, Mirror):
            return f"plane '{plane.name}' mirrors the round"
        if clearance(item, plane) < CLEARANCE * item.profile.max_radius:
            return f"the casing may reach plane '{plane.name}'"
    return None


def clearance(item: Round, plane: RigidPlane) -> float:
    """Distance (m) between a round with a profile and a plane, negative where the round lies behind it."""
    assert item.profile is not None
    stations = np.linspace(0.0, item.profile.length, 401)
    return lowest_height(item, plane, item.profile.outer.radius(stations), item.profile.length - stations)


def lowest_height(item: Round, plane: RigidPlane | Mirror, radius: np.ndarray, height: np.ndarray) -> float:
    """Smallest distance (m) of a plane from rings around a round's axis, of `radius` and `height` over its base (m)."""
    normal = np.asarray(plane.normal, dtype=float) / np.linalg.norm(plane.normal)
    axis = np.asarray(item.axis, dtype=float) / np.linalg.norm(item.axis)
    along = float(axis @ normal)
    base = float((np.asarray(item.position) - np.asarray(plane.point)) @ normal)
    return float(np.min(base + along * height - np.sqrt(max(1.0 - along**2, 0.0)) * radius))
