"""Estimated cost of a burst: first stable step, when it may end, and memory."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from transition.law.mean_mass import gurney_speed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.meshing.mesh import CellMesh
    from burst_fenicsx.problem import BurstSettings, Round


_EXPANSION_AT_END = 2.7  # of a casing, at which its acceleration is complete
# Memory of one process, by rows of one to four M107 with 6 and 8 mm cells, whole and as quarters (within a twentieth).
# Images of what symmetry leaves are joined to the whole at every output.
_BYTES_PER_CELL, _BYTES_PER_CELL_OF_WHOLE = 2_450.0, 1_050.0
_BYTES_AT_START = 272e6


def expected_cost(
    settings: BurstSettings, rounds: Sequence[Round], meshes: Sequence[CellMesh], cells: int, share: float
) -> dict[str, Any]:
    """Estimate what a burst will cost.

    Parameters
    ----------
    settings : BurstSettings
        How the burst is computed.
    rounds : sequence of Round
        The cased charges.
    meshes : sequence of CellMesh
        Of each round, or of its computed part.
    cells : int
        That are computed.
    share : float
        Their fraction of the whole.

    Returns
    -------
    dict
        `stable_time_step` (s), the first one; `end_time` (s), None where a round is from a mesh file and the case gives
        none; `memory_bytes`.
    """
    return {
        "stable_time_step": min(
            mesh.shortest_edge / max(_sound_speed(entry), entry.explosive.detonation_velocity)
            for entry, mesh in zip(rounds, meshes, strict=True)
        ),
        "end_time": expected_end(settings, rounds),
        "memory_bytes": _BYTES_AT_START + (_BYTES_PER_CELL + _BYTES_PER_CELL_OF_WHOLE / share) * cells,
    }


def expected_end(settings: BurstSettings, rounds: Sequence[Round]) -> float | None:
    """Time (s) at which a burst may end; None where a round is from a mesh file.

    A casing sets out when the front has passed half of its charge and grows at Gurney's speed until it has expanded as
    far as casings are accelerated. A round without ignition point is initiated when the casing of another reaches it;
    distances are those of the bases' centres less the radii, as for rounds that stand side by side.
    """
    if settings.end_time is not None:
        return settings.end_time
    profiles = [one.profile for one in rounds if one.profile is not None]
    if len(profiles) < len(rounds):
        return None
    front = np.array([one.explosive.detonation_velocity for one in rounds])
    ratio = [
        profile.charge_volume * one.explosive.density / (profile.casing_volume * one.casing.density)
        for one, profile in zip(rounds, profiles, strict=True)
    ]
    speed = np.array([gurney_speed(*pair) for pair in zip(front, ratio, strict=True)])
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
    complete = initiated + half + (_EXPANSION_AT_END - 1.0) * radius / speed
    return min(float(complete.max()), settings.time_limit)


def _sound_speed(entry: Round) -> float:
    """Speed (m/s) of longitudinal waves in the casing."""
    nu = entry.casing.poisson_ratio
    modulus = entry.casing.elastic_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return math.sqrt(modulus / entry.casing.density)
