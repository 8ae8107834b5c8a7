"""What is read off the state from time to time: diameters by station, speeds along each round, segments' speeds."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.meshing.distributed import gather_rows
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.materials.products import Products
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing.mesh import CellMesh
    from burst_fenicsx.records.surfaces import RadialSurfaces


_log = logging.getLogger(__name__)

SPEED_QUANTILES = (90, 99)
"""Percentages of the casing's mass for which the speed is given that they do not exceed."""


@dataclass(frozen=True, eq=False)
class RoundMeasures:
    """One round's casing at one time, or with the speeds that its fragments start with.

    Attributes
    ----------
    station, mean_speed, max_speed, outer_diameter, casing_mass : by station bin (m, m/s, m/s, m, kg).
    speed, mass : of every casing cell of the computed part of the round, in ascending order of speed (m/s, kg).
    """

    station: np.ndarray
    mean_speed: np.ndarray
    max_speed: np.ndarray
    outer_diameter: np.ndarray
    casing_mass: np.ndarray
    speed: np.ndarray
    mass: np.ndarray

    @property
    def mean(self) -> float:
        """Mass-weighted speed of the casing (m/s)."""
        total = self.casing_mass.sum()
        return float((self.mean_speed * self.casing_mass).sum() / total) if total > 0.0 else 0.0

    @property
    def largest(self) -> float:
        """Largest mean speed of a casing cell (m/s)."""
        return float(self.max_speed.max(initial=0.0))

    def times(self, factor: float) -> RoundMeasures:
        """The same with all speeds times a factor."""
        names = ("mean_speed", "max_speed", "speed")
        return replace(self, **{name: factor * getattr(self, name) for name in names})

    @property
    def fastest(self) -> float:
        """Station of the fastest bin by mean speed (m from the nose)."""
        return float(self.station[np.argmax(self.mean_speed)]) if len(self.station) else 0.0


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

    What is summed is gathered first, in the order of the mesh that was given.

    Parameters
    ----------
    state : the fields. surfaces : bins of the whole mesh. mesh : the whole mesh.
    multiplicity : (rounds,) how many times a round is the computed part of it; masses are those of whole rounds.
    images : how many times the arrangement is the computed part of it; so many times cells are counted.
    """

    def __init__(
        self,
        state: BurstFields,
        surfaces: RadialSurfaces,
        mesh: CellMesh,
        *,
        multiplicity: np.ndarray | None = None,
        images: int = 1,
    ) -> None:
        self._state = state
        self._surfaces = surfaces
        self._mesh = mesh
        self._multiplicity = np.ones(len(mesh.lengths)) if multiplicity is None else multiplicity
        self._images = images
        nodes = np.flatnonzero(surfaces.casing_bin >= 0)
        self._bin, self._weight = surfaces.casing_bin[nodes], mesh.node_weight[nodes]
        self._bins = len(surfaces.bin_station)
        self._count = np.bincount(self._bin, weights=self._weight, minlength=self._bins)
        # This rank's own ones of these nodes, and their rows among all.
        own = state.mesh.node[: state.mesh.owned_nodes]
        self._own = np.flatnonzero(surfaces.casing_bin[own] >= 0)
        self._row = np.searchsorted(nodes, own[self._own])
        self._outward, self._radius = surfaces.outward[own[self._own]], surfaces.radius[own[self._own]]

    def outer_radii(self) -> np.ndarray:
        """Azimuthal mean of the casing's outer radius in every bin (m); not a number in empty bins. Collective."""
        moved = self._state.nodes.position[self._own] - self._state.start[self._own]
        own = self._radius + np.einsum("ij,ij->i", moved, self._outward)
        radius = gather_rows(self._state.mesh.comm, self._row, own, everywhere=True)
        total = np.bincount(self._bin, weights=self._weight * radius, minlength=self._bins)
        return np.divide(total, self._count, where=self._count > 0, out=np.full(self._bins, np.nan))

    @staticmethod
    def outer_diameter(radii: np.ndarray) -> float:
        """Largest over rounds and stations of the azimuthal mean diameter (m), by `outer_radii`."""
        return float(2.0 * np.nanmax(radii)) if np.isfinite(radii).any() else 0.0

    def distortion(self) -> Distortion:
        """Count lost and folded cells; collective."""
        state, casing = self._state, self._state.mesh.part == Part.CASING
        folded, released = state.folded(), state.eroded
        of_cells = np.column_stack(
            [
                state.volumes() <= 0.0,
                folded,
                released,
                (folded & casing) * state.cell_mass,
                (released & casing) * state.cell_mass,
            ]
        )
        lost, folds, eroded, folded_mass, released_mass = self._images * state.mesh.cell_sums(of_cells)
        return Distortion(int(lost), int(folds), float(folded_mass), float(released_mass), int(eroded))

    def _casing(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Casing cells of the whole mesh, their masses (kg) and speeds (m/s); collective."""
        state, cells = self._state, np.flatnonzero(self._mesh.part == Part.CASING)
        own, speed = state.casing_speeds()
        values = np.column_stack([state.cell_mass, np.zeros(state.mesh.cells)])
        values[own, 1] = speed
        mass, speed = state.mesh.all_cells(values)[cells].T
        return cells, mass, speed

    def rounds(self) -> list[RoundMeasures]:
        """Speeds and diameters along every round; collective."""
        mesh, per_round = self._mesh, self._bins // max(len(self._mesh.lengths), 1)
        cells, own_mass, speed = self._casing()
        of_round = mesh.round[cells]
        mass = own_mass * self._multiplicity[of_round]
        along = (mesh.station[cells] / np.asarray(mesh.lengths)[of_round] * per_round).astype(int)
        bins = of_round * per_round + np.clip(along, 0, per_round - 1)
        largest = np.zeros(self._bins)
        np.maximum.at(largest, bins, speed)
        total = np.bincount(bins, weights=mass, minlength=self._bins)
        weighted = np.bincount(bins, weights=mass * speed, minlength=self._bins)
        mean, diameter = weighted / np.where(total > 0.0, total, 1.0), 2.0 * self.outer_radii()
        result = []
        for index in range(len(mesh.lengths)):
            own, mine = self._surfaces.bin_round == index, np.flatnonzero(of_round == index)
            mine = mine[np.lexsort((mass[mine], speed[mine]))]
            station = self._surfaces.bin_station[own]
            columns = (mean[own], largest[own], diameter[own], total[own], speed[mine], mass[mine])
            result.append(RoundMeasures(station, *columns))
        return result

    def segment_masses_and_speeds(self) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Casing mass (kg) and mass-weighted casing speed (m/s) of every round's segments; collective."""
        mesh = self._mesh
        cells, mass, speed = self._casing()
        masses, speeds = [], []
        for index, segments in enumerate(mesh.segments):
            own = (mesh.round[cells] == index) & (mesh.segment[cells] >= 0)
            segment, count = mesh.segment[cells[own]], len(segments)
            total = np.bincount(segment, weights=mass[own], minlength=count)
            weighted = np.bincount(segment, weights=mass[own] * speed[own], minlength=count)
            masses.append(self._multiplicity[index] * total)
            speeds.append(weighted / np.where(total > 0.0, total, 1.0))
        return masses, speeds


def escape_speed(products: Sequence[Products]) -> float:
    """Largest speed (m/s) at which any of the `products` expands into a vacuum from behind a plane front.

    On its own isentrope, see `LandauProducts.escape_speed`; metal that it pushes is slower.
    """
    return max(item.escape_speed for item in products)


def speeds_and_bound(fields: BurstFields, images: int) -> dict[str, Any]:
    """The fastest node of any casing beside `escape_speed`, and the casings' mass above it; collective.

    Metal that rounds squeeze between them may be thrown as a jet; above the bound no products have pushed it there, and
    a warning is logged. `images` is how many times the arrangement is the computed part.
    """
    mesh, bound = fields.mesh, escape_speed(fields.products)
    of_casings = np.zeros(len(fields.mass), dtype=bool)
    of_casings[mesh.all_dofmap[mesh.all_part != Part.CHARGE]] = True
    speed = np.where(of_casings, np.linalg.norm(fields.nodes.velocity, axis=1), 0.0)
    fastest = mesh.comm.allreduce(float(speed[: mesh.owned_nodes].max(initial=0.0)), op=MPI.MAX)
    above = float(images * mesh.node_sums(np.where(speed > bound, fields.mass, 0.0)))
    if above > 0.0 and mesh.comm.rank == 0:
        _log.warning(
            "%.3g kg of the casings are faster than products expand into a vacuum: up to %.0f m/s, the bound: %.0f m/s",
            above,
            fastest,
            bound,
            extra={"code": "faster_than_products"},
        )
    return {"fastest_casing_node": fastest, "escape_speed_of_products": bound, "casing_mass_above_escape_speed": above}
