"""Estimated cost of a burst: steps, time step, memory and time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from transition.law.mean_mass import gurney_speed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.meshing.mesh import CellMesh
    from burst_fenicsx.problem import BurstSettings, Round


# Fitted to ten bursts: tube with 9 mm cells and the 155 mm projectile with 3, 4, 6, 8 and 12 mm to 120 us, M107 with
# 8, 10, 12 and 14 mm until it had a tenth of its energy to gain; the estimate was 0.6 to 1.2 times their steps. The
# finer the cells, the thinner the thinnest becomes: against the first stable step the mean one falls with the cell's
# size over the round's radius, times this factor, and with one over the casing's expansion; acceleration is complete
# at about this expansion.
_THINNING = 8.5
# Where cells take steps of their own, the mean one over the time in which a wave runs through the mean cell, by the
# projectile with 3 and 8 mm cells (0.35 and 0.29).
_OWN_STEP = 0.32
_EXPANSION_AT_END = 2.7
# Memory of one process, by rows of one to four M107 with 6 and 8 mm cells, whole and as quarters (within a twentieth).
# Images of what symmetry leaves are joined to the whole at every output.
_BYTES_PER_CELL, _BYTES_PER_CELL_OF_WHOLE = 2_450.0, 1_050.0
_BYTES_AT_START = 272e6
# Time of a core, within a factor of two from machine to machine; what contact adds is that of a M107 with 8 mm cells.
_SECONDS_PER_CELL_STEP = 0.3e-6
_BONDS, _SURFACES = 0.1, 0.7  # shares that bonds and the search for surfaces that meet add


@dataclass(frozen=True)
class _Shell:
    """A casing that rests until the front has passed half of its charge (s), then grows at Gurney's speed (1/s)."""

    start: float
    growth: float

    @classmethod
    def of(cls, entry: Round, found: dict[str, Any], initiated: float) -> _Shell:
        passage = found["charge_length"] / entry.explosive.detonation_velocity
        return cls(initiated + 0.5 * passage, 2.0 * found["gurney_speed"] / found["outer_diameter"])

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
    meshes: Sequence[CellMesh],
    *,
    computed_cells: int | None = None,
    share: float = 1.0,
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
    meshes : sequence of CellMesh
        Of each round, or of its computed part.
    computed_cells : int, optional
        Number of cells that are computed, where rounds are images of others; left out: those of all meshes.
    share : float
        Their fraction of the whole.

    Returns
    -------
    dict
        `stable_time_step` (the first one), `mean_time_step` of a cell, `end_time` (s), `steps` of a cell on average,
        `cell_steps`, `memory_bytes`, `core_seconds`.
    """
    shells = _shells(rounds, described)
    different = {id(mesh): mesh for mesh in meshes}  # a stack has one
    sizes = {key: (mesh.shortest_edge, mesh.mean_edge) for key, mesh in different.items()}
    shortest, mean = zip(*(sizes[id(mesh)] for mesh in meshes), strict=True)
    stable = [_stable_step(entry, edge) for entry, edge in zip(rounds, shortest, strict=True)]
    fine = [edge / (0.5 * found["outer_diameter"]) for edge, found in zip(mean, described, strict=True)]
    end = _end(settings, shells)
    stepping = min(
        step * min(_THINNING * edge * end / shell.stretched(end), 1.0)
        for step, edge, shell in zip(stable, fine, shells, strict=True)
    )
    own = min(
        _OWN_STEP * edge / max(_sound_speed(entry), entry.explosive.detonation_velocity)
        for entry, edge in zip(rounds, mean, strict=True)
    )
    together = settings.time_step.cfl * stepping
    subcycles = settings.time_step.subcycling and settings.damping == 0.0
    step = settings.time_step.fixed or (max(own, together) if subcycles else together)
    cells = sum(len(mesh.cells) for mesh in meshes) if computed_cells is None else computed_cells
    steps = math.ceil(end / step)
    memory = (_BYTES_PER_CELL + _BYTES_PER_CELL_OF_WHOLE / share) * cells
    contact, rings = settings.contact, settings.geometry == "axisymmetric"
    dearer = 1.0 + _BONDS * (contact.charge_casing == "sliding") + _SURFACES * (contact.surfaces and not rings)
    seconds = _SECONDS_PER_CELL_STEP * dearer * steps * cells
    return {
        "stable_time_step": min(stable),
        "mean_time_step": step,
        "end_time": end,
        "steps": steps,
        "cell_steps": steps * cells,
        "memory_bytes": _BYTES_AT_START + memory,
        "core_seconds": seconds,
    }


def expected_end(settings: BurstSettings, rounds: Sequence[Round]) -> float | None:
    """Time (s) at which a burst may end; None where a round is from a mesh file."""
    described = []
    for one in rounds:
        if one.profile is None:
            return None
        velocity = one.explosive.detonation_velocity
        charge, casing = one.profile.charge_volume, one.profile.casing_volume
        ratio = charge * one.explosive.density / (casing * one.casing.density)
        described.append(
            {
                "charge_length": one.profile.charge_end - one.profile.charge_front,
                "outer_diameter": 2.0 * one.profile.max_radius,
                "detonation_velocity": velocity,
                "gurney_speed": gurney_speed(velocity, ratio),
            }
        )
    return _end(settings, _shells(rounds, described))


def _end(settings: BurstSettings, shells: Sequence[_Shell]) -> float:
    return settings.end_time or min(max(shell.complete for shell in shells), settings.time_limit)


def _shells(rounds: Sequence[Round], described: Sequence[dict[str, Any]]) -> list[_Shell]:
    times = _times_initiated(rounds, described)
    return [_Shell.of(entry, found, time) for entry, found, time in zip(rounds, described, times, strict=True)]


def _times_initiated(rounds: Sequence[Round], described: Sequence[dict[str, Any]]) -> NDArray[np.float64]:
    """When the last ignition point of each round fires (s); without one, when a neighbour's casing reaches it.

    Casings set out when the front has passed half of the charge and fly at Gurney's speed. Distances are those of the
    bases' centres less the radii, so that this is an estimate for rounds that stand side by side.
    """
    initiated = np.array([max((point.delay for point in entry.ignition), default=np.inf) for entry in rounds])
    place = np.array([entry.position for entry in rounds])
    radius = np.array([0.5 * found["outer_diameter"] for found in described])
    speed = np.array([found["gurney_speed"] for found in described])
    half = [0.5 * found["charge_length"] / found["detonation_velocity"] for found in described]
    # In the order in which they are initiated: each may be the donor of those that still wait.
    waiting = np.isinf(initiated)
    done = np.zeros(len(rounds), dtype=bool)
    for _ in rounds:
        donor = int(np.argmin(np.where(done, np.inf, initiated)))
        done[donor] = True
        distance = np.linalg.norm(place - place[donor], axis=1) - radius - radius[donor]
        arrival = initiated[donor] + half[donor] + np.maximum(distance, 0.0) / speed[donor]
        initiated = np.where(waiting & ~done, np.minimum(initiated, arrival), initiated)
    return initiated


def _stable_step(entry: Round, shortest: float) -> float:
    """Stable step (s) before the burst: the shortest edge (m) over the fastest of the waves."""
    return shortest / max(_sound_speed(entry), entry.explosive.detonation_velocity)


def _sound_speed(entry: Round) -> float:
    """Speed (m/s) of longitudinal waves in the casing."""
    nu = entry.casing.poisson_ratio
    modulus = entry.casing.elastic_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return math.sqrt(modulus / entry.casing.density)
