"""Estimated cost of a burst: first stable step, when it may end, and memory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from burst_fenicsx.problem import BurstSettings, Round
from fragfield.case.conversion.rounds import masses_of
from fragfield.results.check import ExpectedCost
from transition.law.mean_mass import gurney_speed

if TYPE_CHECKING:
    from burst_fenicsx.meshing.mesh import CellMesh


_EXPANSION_AT_END = 2.7  # of a casing, at which its acceleration is complete
# Memory of one process, by rows of one to four M107 with 6 and 8 mm cells, whole and as quarters (within a twentieth).
# Images of what symmetry leaves are joined to the whole at every output.
_BYTES_PER_CELL, _BYTES_PER_CELL_OF_WHOLE = 2_450.0, 1_050.0
_BYTES_AT_START = 272e6


def expected_cost(
    settings: BurstSettings,
    rounds: Sequence[Round],
    meshes: Sequence[CellMesh],
    cells: int,
    share: float,
    attitudes: int | None,
) -> ExpectedCost:
    """Estimate what a burst will cost: `meshes` of the computed parts of rounds, `cells` a `share` of the whole."""
    return ExpectedCost(
        stable_time_step=min(
            mesh.shortest_edge / max(_sound_speed(entry), entry.explosive.detonation_velocity)
            for entry, mesh in zip(rounds, meshes, strict=True)
        ),
        end_time=expected_end(settings, rounds),
        memory_bytes=_BYTES_AT_START + (_BYTES_PER_CELL + _BYTES_PER_CELL_OF_WHOLE / share) * cells,
        attitudes=attitudes,
    )


def expected_end(settings: BurstSettings, rounds: Sequence[Round]) -> float | None:
    """Time (s) at which a burst may end; None where a round is from a mesh file.

    A casing sets out when the front has passed half of its charge and grows at Gurney's speed until it has expanded as
    far as casings are accelerated. Casings that reach each other until then go on as one, from the area that they take
    to as many times their own as for a single one: the gas of inner rounds pushes until the outer ones have gone. A
    round without ignition point is initiated when the casing of another reaches it; distances are those of the bases'
    centres less the radii, as for rounds that stand side by side.
    """
    if settings.end_time is not None:
        return settings.end_time
    profiles = [one.profile for one in rounds if one.profile is not None]
    if len(profiles) < len(rounds):
        return None
    front = np.array([one.explosive.detonation_velocity for one in rounds])
    speed = np.array([gurney_speed(one.explosive.detonation_velocity, masses_of(one).ratio) for one in rounds])
    radius = np.array([profile.max_radius for profile in profiles])
    half = np.array([0.5 * (profile.charge_end - profile.charge_front) for profile in profiles]) / front
    initiated = np.array([max((point.delay for point in one.ignition), default=np.inf) for one in rounds])
    position, waiting = np.array([one.position for one in rounds]), np.isinf(initiated)
    done = np.zeros(len(rounds), dtype=bool)
    for _ in rounds:  # in the order in which they are initiated: each may be the donor of those that still wait
        donor = int(np.argmin(np.where(done, np.inf, initiated)))
        done[donor] = True
        distance = np.linalg.norm(position - position[donor], axis=1) - radius - radius[donor]
        arrival = initiated[donor] + half[donor] + np.maximum(distance, 0.0) / speed[donor]
        initiated = np.where(waiting & ~done, np.minimum(initiated, arrival), initiated)
    travel = (_EXPANSION_AT_END - 1.0) * radius
    if len(rounds) == 1:
        return min(float((initiated + half + travel / speed)[0]), settings.time_limit)
    from scipy.sparse.csgraph import connected_components

    apart = np.linalg.norm(position[:, None] - position[None, :], axis=2) - radius[:, None] - radius[None, :]
    groups, group = connected_components(apart < travel[:, None] + travel[None, :], directed=False)
    complete = [
        (initiated + half)[members].max() + _growth(position[members], radius[members]) / speed[members].mean()
        for members in (np.flatnonzero(group == index) for index in range(groups))
    ]
    return min(float(max(complete)), settings.time_limit)


def _growth(position: NDArray[np.float64], radius: NDArray[np.float64]) -> float:
    """Growth of the radius (m) of rounds at `position` (rounds, 3) m that expand as one until their end.

    They begin as the disc of the area of their convex hull, seen from above, and end as that of their own areas, at
    most the hull's, times the square of a casing's expansion.
    """
    from scipy.spatial import ConvexHull

    rim = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    corners = position[:, None, :2] + radius[:, None, None] * np.column_stack([np.cos(rim), np.sin(rim)])
    hull = ConvexHull(corners.reshape(-1, 2)).volume  # of a plane figure its area
    end = _EXPANSION_AT_END * np.sqrt(min(np.pi * (radius**2).sum(), hull) / np.pi)
    return float(max(end - np.sqrt(hull / np.pi), (_EXPANSION_AT_END - 1.0) * radius.max()))


def _sound_speed(entry: Round) -> float:
    nu = entry.casing.poisson_ratio
    modulus = entry.casing.elastic_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return math.sqrt(modulus / entry.casing.density)
