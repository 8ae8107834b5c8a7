"""A thick-walled tube in plane strain under inner pressure, fully plastic (Tresca)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from validation.solid.bodies import SETTINGS, elastic, grid, solver_on

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from burst_fenicsx.mechanics.solver import BurstSolver
    from burst_fenicsx.problem import BurstSettings, CasingMaterial

__all__ = ["PlasticTube", "plastic_tube"]

_START, _RAMP = 0.05, 0.2  # the drive begins at this share of its speed and has it after this share of the way
_FLOWS = 0.8  # of the way; from there on the whole wall flows


@dataclass(frozen=True, eq=False)
class PlasticTube:
    """Inner pressure (Pa) and limit pressure 2 tau_c ln(b/a) at the radii of the moment, over the inner radius (m)."""

    inner_radius: NDArray[np.float64]
    pressure: NDArray[np.float64]
    limit: NDArray[np.float64]
    yielded: bool

    @property
    def ratio(self) -> float:
        """Pressure over the limit while the whole wall flows."""
        way = self.inner_radius - self.inner_radius[0]
        flows = way > _FLOWS * way[-1]
        return float((self.pressure[flows] / self.limit[flows]).mean())


class _Sector:
    """A sector of the tube, one cell along azimuth and axis, held in plane strain between its two planes."""

    def __init__(
        self, values: Mapping[str, Any], cells: int, material: CasingMaterial, settings: BurstSettings, **options: Any
    ) -> None:
        inner, outer = values["inner_radius"], values["outer_radius"]
        self.height = (outer - inner) / cells
        self.angle = 2.0 * self.height / (inner + outer)

        def carry(points: NDArray[Any]) -> NDArray[Any]:
            radius, azimuth = inner + (outer - inner) * points[:, 0], self.angle * points[:, 1]
            return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), self.height * points[:, 2]], axis=1)

        self.solver: BurstSolver = solver_on(
            grid((cells, 1, 1), carry), material, replace(settings, cell_size=self.height), **options
        )
        start = self.solver.fields.start
        radius, azimuth = np.hypot(start[:, 0], start[:, 1]), np.arctan2(start[:, 1], start[:, 0])
        self.inner = np.flatnonzero(radius < inner * (1.0 + 1e-9))
        self.outer = np.flatnonzero(radius > outer * (1.0 - 1e-9))
        self.outward = start[self.inner] * [1.0, 1.0, 0.0] / radius[self.inner, None]
        turned = np.array([-np.sin(self.angle), np.cos(self.angle), 0.0])
        self.solver.constraints = (
            NodalConstraint(np.arange(len(start)), np.eye(3)[2]),
            NodalConstraint(np.flatnonzero(azimuth < 1e-9), np.eye(3)[1]),
            NodalConstraint(np.flatnonzero(azimuth > self.angle - 1e-9), turned),
        )

    def radius(self, nodes: NDArray[Any]) -> float:
        """Mean radius of nodes now (m)."""
        place = self.solver.fields.nodes.position[nodes]
        return float(np.hypot(place[:, 0], place[:, 1]).mean())

    def face(self, radius: float) -> float:
        """Area (m2) of the flat inner face, as the held planes let it be felt along the radii through its edges."""
        return 2.0 * radius * np.sin(0.5 * self.angle) * self.height * np.cos(0.5 * self.angle)


def plastic_tube(values: Mapping[str, Any], cells: int) -> PlasticTube:
    """Drive the inner surface outward slowly, until the whole wall has flowed; its reaction is the pressure."""
    strength = values["shear_strength"]
    material = elastic(values, shear_strength=strength, tensile_strength=4.0 * strength)
    sector = _Sector(values, cells, material, SETTINGS)
    solver, start, way = sector.solver, values["inner_radius"], values["moved"]
    solver.fields.inverse_mass[sector.inner] = 0.0
    radii, pressures, limits = [], [], []
    inner = start
    while inner < start + way:
        share = min(1.0, _START + solver.time * values["drive"] / (_RAMP * way))
        solver.fields.nodes.velocity[sector.inner] = values["drive"] * share * sector.outward
        solver.step()
        inner, outer = sector.radius(sector.inner), sector.radius(sector.outer)
        reaction = -np.einsum("ij,ij->", solver.fields.nodes.force[sector.inner], sector.outward)
        radii.append(inner)
        pressures.append(reaction / sector.face(inner))
        limits.append(2.0 * strength * np.log(outer / inner))
    yielded = bool(solver.fields.solid.shear_strain.min() > 0.0)
    return PlasticTube(np.array(radii), np.array(pressures), np.array(limits), yielded)
