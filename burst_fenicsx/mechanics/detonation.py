"""Ignition and burn (Eqs. 4-5), and leakage of the products through the opened casing (Eqs. 6-7)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.kernels.constants import FRONT_REACH, GREATEST_GROWTH
from burst_fenicsx.kernels.geometry.faces import FACES, area_vectors
from burst_fenicsx.kernels.vectors.exact import quantise, rounding_constant
from burst_fenicsx.meshing.placement import frame
from burst_fenicsx.problem import Part
from fragfield_base.elementary import power

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from burst_fenicsx.materials.products import Products
    from burst_fenicsx.meshing.distributed import DistributedMesh
    from burst_fenicsx.problem import Leakage, Round


def place_ignition(item: Round, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (points, 3) in m and delays (points,) in s of a round's ignition points; `length` is the round's (m)."""
    axes = frame(item.axis)
    base = np.asarray(item.position, dtype=float)
    positions = [
        base + (length - point.station) * axes[2] + point.offset[0] * axes[0] + point.offset[1] * axes[1]
        for point in item.ignition
    ]
    return np.array(positions).reshape(-1, 3), np.array([point.delay for point in item.ignition])


def ignition_times(centres: np.ndarray, positions: np.ndarray, delays: np.ndarray, velocity: float) -> np.ndarray:
    """Time at which each cell ignites, min over the points of t0 + d/D (s).

    `centres` (cells, 3) and `positions` (points, 3) in m, `delays` (points,) in s, `velocity` D in m/s.
    """
    times = np.full(len(centres), np.inf)
    for position, delay in zip(positions, delays, strict=True):
        times = np.minimum(times, delay + np.linalg.norm(centres - position, axis=1) / velocity)
    return times


def largest_faces(corners: np.ndarray) -> np.ndarray:
    """Area of each cell's largest face (m2); `corners` (cells, 8, 3) m."""
    areas = np.zeros(len(corners))
    for face in FACES:
        np.maximum(areas, np.linalg.norm(area_vectors(corners[:, face]), axis=1), out=areas)
    return areas


def burn_rates(corners: np.ndarray, volumes: np.ndarray, velocity: float) -> np.ndarray:
    """Rate of the burn fraction 2 D A_max / (3 V_e) (1/s), Eq. 5; `volumes` (cells,) m3."""
    return 2.0 * velocity * largest_faces(corners) / (3.0 * volumes)


def compression_burn_start(arrival: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Time from which a cell may burn by compression (s).

    A few cells ahead of the front. Before, compression is a neighbour's shock, which must not burn what it does not
    initiate, or round-off: burnt for good, it presses, compresses and burns more, and grows until the far end of a
    finely meshed charge is initiated by it. `arrival` (cells,) s of the front, infinite where there is none yet;
    `rates` (cells,) 1/s.
    """
    return arrival - FRONT_REACH / rates


def earliest_motion(
    centres: np.ndarray, rounds: Sequence[Round], lengths: Sequence[float], fastest: float
) -> np.ndarray:
    """Time (s) before which nothing that any ignition point sets off can have reached each of the `centres` (cells, 3).

    `lengths` of the rounds in m; nothing is faster than `fastest` (m/s). Without ignition points it is not known.
    """
    places = [place_ignition(item, length) for item, length in zip(rounds, lengths, strict=True)]
    positions, delays = (np.concatenate(columns) for columns in zip(*places, strict=True))
    return ignition_times(centres, positions, delays, fastest) if len(delays) else np.full(len(centres), -np.inf)


@dataclass
class AxialSlices:
    """Axial slices of all charges, which vent each for itself, with the nodes on their outer surface.

    Attributes
    ----------
    settings : coefficients of Eq. 7 and the critical ratio r_cr/r0.
    slice_of_node : (nodes,) int32, slice of each outermost node of this rank's own nodes.
    node : (nodes,) int32, local node.
    outward : (nodes, 3), initial radial direction, times the node's weight in the mean.
    start : (nodes, 3), the node's initial position (m).
    initial_radius : (slices,) mean initial radius r0 (m).
    count : (slices,) outermost nodes of the slice over all ranks, those in a plane of symmetry counted half.
    source : (slices,) the slice whose nodes stand for it: itself, or, in coarse meshes, the nearest that has any.
    rounding : constant (m) of `kernels.vectors.exact.quantise` for the sums over nodes, which ranks share.
    widest : (slices,) largest mean radius so far (m).
    factor : (slices + 1,) factor on the products' pressure; the last entry is 1, for cells without a slice.
    """

    settings: Leakage
    comm: MPI.Comm
    slice_of_node: np.ndarray
    node: np.ndarray
    outward: np.ndarray
    start: np.ndarray
    initial_radius: np.ndarray
    count: np.ndarray
    source: np.ndarray
    rounding: float
    widest: np.ndarray
    factor: np.ndarray

    @classmethod
    def of_charges(
        cls,
        settings: Leakage,
        comm: MPI.Comm,
        node_slice: np.ndarray,
        start: np.ndarray,
        radius: np.ndarray,
        outward: np.ndarray,
        slices: int,
        weight: np.ndarray | None = None,
    ) -> AxialSlices:
        """Build from the slices of this rank's own nodes.

        `node_slice` (own nodes,) is -1 off the charge's outer surface; `start` their positions (m), `radius` their
        distances from the round's axis (m), `outward` the unit vectors away from it. `weight` is the fraction of each
        node that belongs to what is computed, a half in a plane of symmetry; left out: 1.
        """
        node = np.flatnonzero(node_slice >= 0).astype(np.int32)
        own = node_slice[node].astype(np.int32)
        fraction = np.ones(len(node)) if weight is None else weight[node]
        count = comm.allreduce(np.bincount(own, weights=fraction, minlength=slices))
        largest = comm.allreduce(float(radius[node].max(initial=0.0)), op=MPI.MAX) * count.max(initial=0.0)
        rounding = rounding_constant(GREATEST_GROWTH * largest or 1.0)
        total = comm.allreduce(np.bincount(own, weights=quantise(fraction * radius[node], rounding), minlength=slices))
        source = _nearest_with_nodes(count, settings.parts)
        return cls(
            settings=settings,
            comm=comm,
            slice_of_node=own,
            node=node,
            outward=np.ascontiguousarray(fraction[:, None] * outward[node]),
            start=np.ascontiguousarray(start[node]),
            initial_radius=(initial := (total / np.maximum(count, 1.0))[source]),
            count=count,
            source=source,
            rounding=rounding,
            widest=initial.copy(),
            factor=np.ones(slices + 1),
        )

    def radii(self, position: np.ndarray) -> np.ndarray:
        """Current mean radius of every slice, r0 + mean radial displacement (m), Eq. 6."""
        moved = position[self.node]
        moved -= self.start
        moved *= self.outward
        x, y, z = moved.T
        terms = quantise(x + y + z, self.rounding)
        moved = np.bincount(self.slice_of_node, weights=terms, minlength=len(self.initial_radius))
        if self.comm.size > 1:
            moved = self.comm.allreduce(moved)
        return self.initial_radius + (moved / self._weight)[self.source]

    def mean_radii(self, radii: np.ndarray, rounds: int) -> np.ndarray:
        """Mean over each round (rounds,) of radii of all slices (m), weighted by the slices' charge."""
        weights = (self.initial_radius**2).reshape(rounds, -1)
        means: np.ndarray = (radii.reshape(weights.shape) * weights).sum(axis=1) / weights.sum(axis=1)
        return means

    @cached_property
    def _weight(self) -> np.ndarray:
        return np.maximum(self.count, 1.0)

    @cached_property
    def _critical(self) -> np.ndarray:
        """Radii (slices,) m from which the slices vent; infinite where no node shows them."""
        return np.where(self.count[self.source] > 0, self.settings.radius_ratio * self.initial_radius, np.inf)

    def update(self, position: np.ndarray) -> None:
        """Set the pressure factors, Eq. 7: alpha (r_cr/r_i)^beta once r_i > r_cr, 1 before; none goes back.

        r_i is the largest so far: where a round is squeezed, what has vented does not return.
        """
        if not self.settings.enabled or not len(self.initial_radius):
            return
        np.maximum(self.widest, self.radii(position), out=self.widest)
        opened = np.flatnonzero(self.widest > self._critical)
        if len(opened):
            ratio = self._critical[opened] / self.widest[opened]
            self.factor[opened] = self.settings.alpha * power(ratio, self.settings.beta)


def _nearest_with_nodes(count: np.ndarray, per_round: int) -> np.ndarray:
    """Nearest slice of the same round that has nodes, for every slice; itself in a round that has none."""
    source = np.arange(len(count))
    for empty in np.flatnonzero(count == 0):
        first = empty // per_round * per_round
        filled = first + np.flatnonzero(count[first : first + per_round] > 0)
        if len(filled):
            source[empty] = filled[np.argmin(np.abs(filled - empty))]
    return source


def cell_ignition(
    mesh: DistributedMesh,
    rounds: Sequence[Round],
    products: Sequence[Products],
    lengths: Sequence[float],
    position: np.ndarray,
    volume: np.ndarray,
    rates: Callable[[np.ndarray, np.ndarray, float], np.ndarray],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times at which the cells ignite, burn rates, times from which compression burns them; infinite where never.

    `position` (nodes, 3) m, `volume` (cells,) m3; `rates` as those of `Element`.
    """
    ignition, compression = np.full(mesh.cells, np.inf), np.full(mesh.cells, np.inf)
    burn = np.zeros(mesh.cells)
    for index, item in enumerate(rounds):
        own = np.flatnonzero((mesh.round == index) & (mesh.part == Part.CHARGE))
        corners = position[mesh.dofmap[own]]
        positions, delays = place_ignition(item, lengths[index])
        ignition[own] = ignition_times(corners.mean(axis=1), positions, delays, item.explosive.detonation_velocity)
        burn[own] = rates(corners, volume[own], item.explosive.detonation_velocity)
        # The products' own front may be faster than the timed one, and may burn what it comes to first.
        fastest = max(products[index].front_speed, item.explosive.detonation_velocity)
        compression[own] = compression_burn_start(
            ignition_times(corners.mean(axis=1), positions, delays, fastest), burn[own]
        )
    return ignition, burn, compression
