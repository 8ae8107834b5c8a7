"""Rounds and planes of a case in space: the outer surface of each round, exact and as meshed."""

from __future__ import annotations

import json
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from fragfield.case.conversion.clearance import Body
    from fragfield.case.tables.plane import PlaneTable
    from fragfield.case.tables.round import RoundTable

__all__ = ["heights", "meshed", "placed", "profile_of"]


def placed(entry: RoundTable) -> Body:
    """Outside of a resolved round; of one from a mesh file, the convex hull of its nodes."""
    from burst_fenicsx.meshing import mesh_round
    from fragfield.case.conversion.burst import burst_round
    from fragfield.case.conversion.clearance import Hull, placed_body

    if isinstance(entry.profile, dict):
        return placed_body(profile_of(entry), entry.position, entry.axis)
    return Hull.of(mesh_round(burst_round(entry, entry.name), 1.0).nodes, entry.axis)


def meshed(entry: RoundTable, cell_size: float) -> Body:
    """Body that the mesh of a resolved round with this cell size (m) touches from within.

    The sections of the mesh are polygons with the area of the contour's circles, so that their corners lie outside.
    """
    from fragfield.case.conversion.clearance import placed_body

    if not isinstance(entry.profile, dict):
        return placed(entry)
    stations, factor = _grid(json.dumps(entry.profile), cell_size)
    return placed_body(profile_of(entry), entry.position, entry.axis, stations=stations, enlargement=factor)


def profile_of(entry: RoundTable) -> Profile:
    """Profile of a resolved round that has one."""
    return _profile(json.dumps(entry.profile))


@lru_cache(maxsize=64)  # the rounds of a stack have one
def _profile(table: str) -> Profile:
    from burst_fenicsx.geometry import profile_from_table

    return profile_from_table(json.loads(table), where="round.profile")


@lru_cache(maxsize=64)
def _grid(table: str, cell_size: float) -> tuple[NDArray[np.float64], float]:
    """Stations of the layers (m) of the mesh of a profile, and the factor on its radii."""
    from burst_fenicsx.meshing.disc import equal_area_factor
    from burst_fenicsx.meshing.sizing import grid_counts

    counts = grid_counts(_profile(table), cell_size)
    return counts.stations, equal_area_factor(4 * counts.core)


def heights(body: Body, plane: PlaneTable) -> tuple[float, float]:
    """Smallest and greatest height (m) of a body over a resolved plane."""
    assert plane.normal is not None  # resolved
    assert plane.point is not None
    low, high = body.reach(plane.normal)
    foot = float(np.dot(plane.normal, plane.point))
    return low - foot, high - foot
