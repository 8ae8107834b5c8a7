"""A bar thrown against a rigid wall: a plane wave whose speed, stress and return are known in closed form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from validation.solid.bodies import SETTINGS, elastic, energy, grid, record, solver_on, wave_speed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["Bar", "bar_on_wall"]

_CFL = 0.5
_END = 1.9  # passages of the bar: at two all of it moves back and pulls at the wall
_QUIET = (0.2, 0.8)  # share of the plateau over which its stress is taken


@dataclass(frozen=True, eq=False)
class Bar:
    """What the bar showed.

    Attributes
    ----------
    time : (n,) float64
        After every step (s).
    stress : (n, 2) float64
        Longitudinal stress (Pa) at two stations.
    place : (2,) floats
        Their distances from the wall (m), centres of cells.
    velocity, exact_velocity : float
        Mean one at the end, away from the wall (m/s), computed and in closed form.
    speed : float
        Of the wave in closed form (m/s).
    plateau : float
        Stress behind the wave in closed form, compression positive (Pa).
    energy_error : float
        Of the ledger, relative to the energy that the bar starts with.
    length : float
        Of the bar (m).
    """

    time: NDArray[np.float64]
    stress: NDArray[np.float64]
    place: tuple[float, float]
    velocity: float
    exact_velocity: float
    speed: float
    plateau: float
    energy_error: float
    length: float

    @property
    def found_speed(self) -> float:
        """Speed (m/s) at which half the plateau passes from the first station to the second."""
        arrival = [np.interp(0.5 * self.plateau, *_rise(self.time, -self.stress[:, k], self.plateau)) for k in (0, 1)]
        return float((self.place[1] - self.place[0]) / (arrival[1] - arrival[0]))

    @property
    def found_plateau(self) -> float:
        """Mean stress (Pa) at the first station between the wave's passage and its return."""
        there, back = self.place[0] / self.speed, (2.0 * self.length - self.place[0]) / self.speed
        low, high = (there + share * (back - there) for share in _QUIET)
        during = (self.time > low) & (self.time < high)
        return float(-self.stress[during, 0].mean())


def _rise(
    time: NDArray[np.float64], stress: NDArray[np.float64], plateau: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The record up to the first time that it is above 0.9 of the plateau, as (stress, time)."""
    end = int(np.argmax(stress > 0.9 * plateau)) + 1
    return stress[:end], time[:end]


def bar_on_wall(values: Mapping[str, Any], cells: int) -> Bar:
    """Throw the bar of the reference's table against a wall at x = 0, with `cells` along its length."""
    length, width = values["length"], values["length"] / cells
    material = elastic(values)
    mesh = grid((cells, 1, 1), lambda points: points * [length, width, width])
    settings = replace(SETTINGS, cell_size=width, time_step=replace(SETTINGS.time_step, cfl=_CFL))
    solver = solver_on(mesh, material, settings)
    fields = solver.fields
    nodes, wall = np.arange(len(fields.start)), np.flatnonzero(fields.start[:, 0] < 1e-9 * length)
    solver.constraints = (
        NodalConstraint(nodes, np.eye(3)[1]),
        NodalConstraint(nodes, np.eye(3)[2]),
        NodalConstraint(wall, np.eye(3)[0]),
    )
    fields.nodes.velocity[:, 0] = -values["speed"]
    fields.nodes.velocity[wall] = 0.0
    # Held nodes carry no energy; half a cell's mass of the bar stands still from the beginning.
    start = energy(record(solver))
    centre = fields.start[fields.mesh.dofmap].mean(axis=1)[:, 0]
    watched = [int(np.argmin(np.abs(centre - share * length))) for share in values["stations"]]
    speed = wave_speed(material)
    times, stresses = [], []
    while solver.time < _END * length / speed:
        solver.step()
        times.append(solver.time)
        stresses.append(fields.solid.stress[watched, 0, 0].copy())
    free = np.setdiff1d(nodes, wall)
    mean = fields.mass[free] @ fields.nodes.velocity[free, 0] / fields.mass[free].sum()
    # With every passage the wall takes the momentum of the whole bar; the velocity lies half a step behind.
    passages = (solver.time - 0.5 * solver.time_step) * speed / length
    return Bar(
        time=np.array(times),
        stress=np.array(stresses),
        place=(float(centre[watched[0]]), float(centre[watched[1]])),
        velocity=float(mean),
        exact_velocity=values["speed"] * (passages - 1.0),
        speed=speed,
        plateau=material.density * speed * values["speed"],
        energy_error=energy(record(solver)) / start - 1.0,
        length=length,
    )
