"""What a burst will cost, estimated before it is computed: steps, time step, memory, time, in all and by round."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import BurstSettings, Round

__all__ = ["expected_cost"]

# Fitted to six bursts: tube with 6 and 9 mm cells and grenade with 10 mm to 120 us, M107 with 8 and 10 mm far out and
# until it gained less than 1 % in 10 us. The estimate was 0.84 to 1.5 times their steps. In the front a step falls to
# this share of the first one, then with one over the casing's expansion, since walls thin; acceleration is complete at
# about this expansion.
_STEP_IN_FRONT = 0.55
_EXPANSION_AT_END = 2.9
_BYTES_PER_CELL = 1_300.0  # of one process, by the same bursts
_BYTES_AT_START = 255e6
_SECONDS_PER_CELL_STEP = 0.24e-6  # on one core


@dataclass(frozen=True)
class _Shell:
    """A casing that rests until the front has passed half of its charge (s), then grows at Gurney's speed (1/s)."""

    start: float
    growth: float

    @classmethod
    def of(cls, entry: Round, found: dict[str, Any], lit: float) -> _Shell:
        passage = found["charge_length"] / entry.explosive.detonation_velocity
        return cls(lit + 0.5 * passage, 2.0 * found["gurney_speed"] / found["outer_diameter"])

    @property
    def complete(self) -> float:
        """Time (s) at which acceleration may be complete."""
        return self.start + (_EXPANSION_AT_END - 1.0) / self.growth

    def stretched(self, end: float) -> float:
        """Integral of the expansion, 1 before the start, over the time to `end` (s)."""
        moving = max(end - self.start, 0.0)
        return end + 0.5 * self.growth * moving**2


def expected_cost(
    settings: BurstSettings,
    rounds: Sequence[Round],
    described: Sequence[dict[str, Any]],
    meshes: Sequence[HexahedralMesh],
) -> dict[str, Any]:
    """Estimate what a burst will cost.

    Parameters
    ----------
    settings : BurstSettings
        How the burst is computed.
    rounds : sequence of Round
        The cased charges.
    described : sequence of dict
        Of each round `charge_length`, `outer_diameter` (m) and `gurney_speed` (m/s).
    meshes : sequence of HexahedralMesh
        Of each round.

    Returns
    -------
    dict
        `stable_time_step` (the first one), `mean_time_step`, `end_time` (s), `steps`, `cell_steps`, `memory_bytes`,
        `core_seconds`, and `per_round` with the mean of `cells`, `memory_bytes` and `core_seconds` over the rounds.
    """
    lit = _times_lit(rounds, described)
    shells = [_Shell.of(entry, found, time) for entry, found, time in zip(rounds, described, lit, strict=True)]
    stable = [_stable_steps(entry, mesh) for entry, mesh in zip(rounds, meshes, strict=True)]
    end = settings.end_time or min(max(shell.complete for shell in shells), settings.time_limit)
    moving = min(
        _STEP_IN_FRONT * step * end / shell.stretched(end) for (step, _), shell in zip(stable, shells, strict=True)
    )
    resting = min(step for _, step in stable)
    step = settings.time_step.fixed or settings.time_step.cfl * min(moving, resting)
    cells, steps = sum(len(mesh.cells) for mesh in meshes), math.ceil(end / step)
    memory = _BYTES_AT_START + _BYTES_PER_CELL * cells
    seconds = _SECONDS_PER_CELL_STEP * steps * cells
    return {
        "stable_time_step": min(min(pair) for pair in stable),
        "mean_time_step": step,
        "end_time": end,
        "steps": steps,
        "cell_steps": steps * cells,
        "memory_bytes": memory,
        "core_seconds": seconds,
        "per_round": {
            "cells": cells / len(rounds),
            "memory_bytes": _BYTES_PER_CELL * cells / len(rounds),
            "core_seconds": seconds / len(rounds),
        },
    }


def _times_lit(rounds: Sequence[Round], described: Sequence[dict[str, Any]]) -> NDArray[np.float64]:
    """When the last ignition point of each round lights (s); without one, when a neighbour's casing reaches it.

    Casings set out when the front has passed half of the charge and fly at Gurney's speed. Distances are those of the
    bases' centres less the radii, so that this is an estimate for rounds that stand side by side.
    """
    import numpy as np

    lit = np.array([max((point.delay for point in entry.ignition), default=np.inf) for entry in rounds])
    place = np.array([entry.position for entry in rounds])
    radius = np.array([0.5 * found["outer_diameter"] for found in described])
    speed = np.array([found["gurney_speed"] for found in described])
    half = [0.5 * found["charge_length"] / found["detonation_velocity"] for found in described]
    # In the order in which they light: each may be the donor of those that still wait.
    waiting = np.isinf(lit)
    done = np.zeros(len(rounds), dtype=bool)
    for _ in rounds:
        donor = int(np.argmin(np.where(done, np.inf, lit)))
        done[donor] = True
        distance = np.linalg.norm(place - place[donor], axis=1) - radius - radius[donor]
        arrival = lit[donor] + half[donor] + np.maximum(distance, 0.0) / speed[donor]
        lit = np.where(waiting & ~done, np.minimum(lit, arrival), lit)
    return lit


def _stable_steps(entry: Round, mesh: HexahedralMesh) -> tuple[float, float]:
    """Stable steps (s) before the burst: of charge and walls, which deform, and of solid ends, which hardly do."""
    import numpy as np

    from burst_fenicsx.meshing import edge_lengths

    shortest, _ = edge_lengths(mesh)
    ends = [index for index, segment in enumerate(mesh.segments[0]) if segment.kind != "wall"]
    solid = np.isin(mesh.segment, ends)
    speed = max(_sound_speed(entry), entry.explosive.detonation_velocity)
    return float(shortest[~solid].min()) / speed, float(shortest[solid].min(initial=np.inf)) / speed


def _sound_speed(entry: Round) -> float:
    """Speed (m/s) of longitudinal waves in the casing."""
    nu = entry.casing.poisson_ratio
    modulus = entry.casing.elastic_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return math.sqrt(modulus / entry.casing.density)
