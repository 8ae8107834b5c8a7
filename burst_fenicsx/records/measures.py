"""What is read off the state from time to time: diameters by station, speeds along each round, segments' speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.mechanics.exact_sums import exact_sums
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.problem import Round
    from burst_fenicsx.records.surfaces import RadialSurfaces

__all__ = ["SPEED_QUANTILES", "Distortion", "Measures", "RoundMeasures", "speed_quantiles"]

SPEED_QUANTILES = (90, 99)
"""Percentages of the casing's mass for which the speed is given that they do not exceed."""


class RoundMeasures:
    """One round's casing at one time.

    Attributes
    ----------
    station, mean_speed, max_speed, outer_diameter, casing_mass : by station bin (m, m/s, m/s, m, kg).
    speed, mass : of every casing cell of the computed part of the round, in ascending order of speed (m/s, kg).
    mean, largest : mass-weighted speed and largest cell mean of the casing (m/s).
    fastest : station of the fastest bin by mean speed (m from the nose).
    """

    def __init__(
        self,
        station: np.ndarray,
        mean_speed: np.ndarray,
        max_speed: np.ndarray,
        outer_diameter: np.ndarray,
        casing_mass: np.ndarray,
        speed: np.ndarray,
        mass: np.ndarray,
    ) -> None:
        self.speed = speed
        self.mass = mass
        self.station = station
        self.mean_speed = mean_speed
        self.max_speed = max_speed
        self.outer_diameter = outer_diameter
        self.casing_mass = casing_mass
        total = casing_mass.sum()
        self.mean = float((mean_speed * casing_mass).sum() / total) if total > 0.0 else 0.0
        self.largest = float(max_speed.max(initial=0.0))
        self.fastest = float(station[np.argmax(mean_speed)]) if len(station) else 0.0


def speed_quantiles(rounds: Sequence[RoundMeasures]) -> dict[str, float]:
    """Speeds (m/s) that 90 and 99 % of the casings' mass do not exceed, by percentage.

    Unlike the largest mean of a cell, which is that of ever less mass as cells get smaller, they converge.
    """
    speed, mass = (np.concatenate([getattr(item, name) for item in rounds]) for name in ("speed", "mass"))
    order = np.argsort(speed, kind="stable")
    total = np.cumsum(mass[order])
    if not len(total) or not total[-1] > 0.0:
        return {str(percent): 0.0 for percent in SPEED_QUANTILES}
    # Each cell's mass at the middle of its step, between cells along the line: a quantile does not jump by cells.
    part = (total - 0.5 * mass[order]) / total[-1]
    return {str(percent): float(np.interp(percent / 100.0, part, speed[order])) for percent in SPEED_QUANTILES}


@dataclass(frozen=True)
class Distortion:
    """How many cells have left their shape: `lost` have no volume any more, `folded` have a corner turned inside out.

    A folded cell still has its volume and carries pressure; one finds them where the wall tears off base or fuze, which
    the continuum cannot do. `folded_casing_mass` (kg) is the casing's share. `released_casing_mass` (kg) is that of
    cells which have been taken out as torn metal, whose mass flies on.
    """

    lost: int
    folded: int
    folded_casing_mass: float
    released_casing_mass: float = 0.0
    released: int = 0


class Measures:
    """Reads diameters and speeds off the distributed state, the same to the last bit on any number of ranks.

    Parameters
    ----------
    state : the fields. surfaces : bins of the whole mesh. rounds : in order. lengths : of each round (m).
    multiplicity : (rounds,) how many times a round is the computed part of it; masses are those of whole rounds.
    images : how many times the arrangement is the computed part of it; so many times cells are counted.
    weight : (nodes of the mesh,) of each node in azimuthal means; left out: 1.
    """

    def __init__(
        self,
        state: BurstFields,
        surfaces: RadialSurfaces,
        rounds: Sequence[Round],
        lengths: Sequence[float],
        *,
        multiplicity: np.ndarray | None = None,
        images: int = 1,
        weight: np.ndarray | None = None,
    ) -> None:
        self._state = state
        self._comm = state.mesh.comm
        self._rounds = len(rounds)
        self._bin_round = surfaces.bin_round
        self._bin_station = surfaces.bin_station
        self._bins = len(surfaces.bin_station)
        per_round = self._bins // max(len(rounds), 1)
        mesh = state.mesh
        own = mesh.node[: mesh.owned_nodes]
        bins = surfaces.casing_bin[own]
        self._multiplicity = np.ones(len(rounds)) if multiplicity is None else multiplicity
        self._images = images
        self._node = np.flatnonzero(bins >= 0)
        self._weight = np.ones(len(self._node)) if weight is None else weight[own][self._node]
        self._bin = bins[self._node]
        self._outward = surfaces.outward[own][self._node]
        self._radius = surfaces.radius[own][self._node]
        self._start = state.start[self._node]
        self._count = self._sum(np.bincount(self._bin, weights=self._weight, minlength=self._bins))
        casing = np.flatnonzero(mesh.part == Part.CASING)
        fraction = mesh.station[casing] / np.asarray(lengths)[mesh.round[casing]]
        place = np.clip((fraction * per_round).astype(int), 0, per_round - 1)
        self._casing = casing
        self._casing_bin = mesh.round[casing] * per_round + place

    def _sum(self, values: np.ndarray) -> np.ndarray:
        """Counts, or halves of them, of all ranks; collective."""
        return self._comm.allreduce(values) if self._comm.size > 1 else values

    def _sums(self, values: np.ndarray, bins: np.ndarray, number: int) -> np.ndarray:
        """Exact sums (number,) of all ranks' values (n,) by bin; collective."""
        return exact_sums(self._comm, values[:, None], bins, number)[:, 0]

    def outer_radii(self) -> np.ndarray:
        """Azimuthal mean of the casing's outer radius in every bin (m); not a number in empty bins."""
        moved = self._state.nodes.position[self._node] - self._start
        radius = self._radius + np.einsum("ij,ij->i", moved, self._outward)
        total = self._sums(self._weight * radius, self._bin, self._bins)
        return np.where(self._count > 0, total / np.where(self._count > 0, self._count, 1.0), np.nan)

    @staticmethod
    def outer_diameter(radii: np.ndarray) -> float:
        """Largest over rounds and stations of the azimuthal mean diameter (m), by `outer_radii`."""
        return float(2.0 * np.nanmax(radii)) if np.isfinite(radii).any() else 0.0

    def distortion(self) -> Distortion:
        """Count lost and folded cells over all ranks."""
        state = self._state
        folded = state.folded()
        lost = state.volumes() <= 0.0
        casing = folded & (state.mesh.part == Part.CASING)
        released = state.eroded & (state.mesh.part == Part.CASING)
        masses = self._images * exact_sums(self._comm, np.stack([casing, released], axis=1) * state.cell_mass[:, None])
        counts = self._images * self._sum(np.array([lost.sum(), folded.sum(), state.eroded.sum()]))
        return Distortion(int(counts[0]), int(counts[1]), float(masses[0, 0]), float(masses[0, 1]), int(counts[2]))

    def rounds(self) -> list[RoundMeasures]:
        """Speeds and diameters along every round."""
        state = self._state
        mass = state.cell_mass[self._casing] * self._multiplicity[state.mesh.round[self._casing]]
        speed = np.linalg.norm(state.cell_velocities(), axis=1)[self._casing]
        largest = np.zeros(self._bins)
        np.maximum.at(largest, self._casing_bin, speed)
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        total = self._sums(mass, self._casing_bin, self._bins)
        weighted = self._sums(mass * speed, self._casing_bin, self._bins)
        diameter = 2.0 * self.outer_radii()
        mean = weighted / np.where(total > 0.0, total, 1.0)
        result = []
        every = self._every(np.stack([state.mesh.round[self._casing].astype(float), speed, mass], axis=1))
        for index in range(self._rounds):
            own = self._bin_round == index
            cells = every[every[:, 0] == index, 1:]
            cells = cells[np.lexsort(cells.T[::-1])]  # by speed, then mass: not by rank
            result.append(
                RoundMeasures(
                    self._bin_station[own], mean[own], largest[own], diameter[own], total[own], cells[:, 0], cells[:, 1]
                )
            )
        return result

    def _every(self, rows: np.ndarray) -> np.ndarray:
        """Rows of all ranks on all ranks."""
        return np.concatenate(self._comm.allgather(rows)) if self._comm.size > 1 else rows

    def segment_masses_and_speeds(self, segments: Sequence[int]) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Casing mass (kg) and mass-weighted casing speed (m/s) of every round's segments; `segments` counts them."""
        state = self._state
        mesh = state.mesh
        speed = np.linalg.norm(state.cell_velocities(), axis=1)
        masses, speeds = [], []
        for index, count in enumerate(segments):
            own = np.flatnonzero((mesh.part == Part.CASING) & (mesh.round == index) & (mesh.segment >= 0))
            where = mesh.segment[own]
            mass = self._sums(state.cell_mass[own], where, count)
            weighted = self._sums(state.cell_mass[own] * speed[own], where, count)
            masses.append(self._multiplicity[index] * mass)
            speeds.append(weighted / np.where(mass > 0.0, mass, 1.0))
        return masses, speeds
