"""What a neighbour's shock does to a charge that is not initiated: pressure, how long it is held, energy per area.

The criterion of critical energy (Walker and Wasley 1969, Explosivstoffe 17, 9): a plane shock of pressure p that lasts
for the time tau brings p u tau = p^2 tau / (rho0 U) per area, and initiates where that exceeds a constant of the
explosive. For a pulse of any shape the integral of p^2 / (rho0 U) over its time is taken, cell by cell. U follows from
the Hugoniot of the unreacted explosive, U = c0 + s u, with p = rho0 U u.

The criterion is one of plane, short shocks. Long, weak pressure brings any energy in the end and initiates nothing, so
a pulse is the time for which a cell's pressure stays above a floor. Energies that are published for one explosive
differ by a factor of up to three with how it was made: a charge below them all is not thereby safe.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.kernels.constants import FRONT_CELLS, LONGEST_FRONT
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.problem import Round


COLUMNS = ("peak", "energy", "square", "impulse", "pulse_energy", "pulse_square", "pulse_impulse", "time")
"""Of each watched cell: largest pressure so far (Pa); energy (J/m2), integrals of p^2 (Pa2 s) and of p (Pa s) of the
pulse of most energy; the same of the present pulse; when the former had that energy (s)."""


@dataclass(frozen=True)
class Exposure:
    """The strongest pulse that a charge got before it was initiated, if it was.

    Attributes
    ----------
    peak_pressure : Pa, the largest anywhere in the charge.
    energy : J/m2, largest over cells and pulses.
    pulse_pressure, held_time : constant pressure (Pa) and duration (s) of the pulse that has the same integrals of p
        and of p^2 as that one.
    place, time : of that cell at rest (m), and when its pulse had this energy (s).
    floor : Pa, below which a pulse does not count.
    resolved_cell : edge (m) of the largest cells that resolve the pulse: a shock spread over four of them passes in a
        third of `held_time`. 0 where nothing reached the floor.
    """

    peak_pressure: float
    energy: float
    pulse_pressure: float
    held_time: float
    place: tuple[float, float, float]
    time: float
    floor: float
    resolved_cell: float


class ShockExposures:
    """Watches the charges that have no ignition points of their own, until a front reaches their cells.

    Parameters
    ----------
    rounds : of the problem. fields : the state.

    Attributes
    ----------
    values : (watched cells, len(COLUMNS)) float64.
    """

    def __init__(self, rounds: Sequence[Round], fields: BurstFields) -> None:
        mesh = fields.mesh
        self._fields = fields
        self._count = len(rounds)
        self.waits = np.array([not item.ignition for item in rounds])
        watched = self.waits[mesh.round] & (mesh.part == Part.CHARGE)
        self._cell = np.flatnonzero(watched).astype(np.int32)
        self._round = mesh.round[self._cell]
        floors = np.array([item.initiation.floor if item.initiation else np.inf for item in rounds])
        self._floors = floors
        self._floor = floors[self._round]
        self._explosives = [item.explosive for item in rounds]
        impedance = np.array([item.density * item.known("sound_speed") for item in self._explosives])
        slope = np.array([item.hugoniot_slope * item.density for item in self._explosives])
        self._impedance = impedance[self._round]
        self._slope = slope[self._round]
        self.values: NDArray[np.float64] = np.zeros((len(self._cell), len(COLUMNS)))

    @property
    def any(self) -> bool:
        """Whether any round waits for a shock; the same on every rank."""
        return bool(self.waits.any())

    def update(self, time: float, step: float) -> None:
        """Add the step (s) that led to the state at `time` (s); cells that a front has reached have products."""
        if not len(self._cell):
            return
        charge = self._fields.charge
        ahead = np.flatnonzero(time < charge.ignition_time[self._cell])
        pressure, values = charge.pressure[self._cell[ahead]], self.values[ahead]
        values[:, 0] = np.maximum(values[:, 0], pressure)
        high = pressure >= self._floor[ahead]
        impedance, square = self._impedance[ahead], pressure * pressure * step
        # rho0 U of the shock, by its Hugoniot.
        steep = 4.0 * self._slope[ahead] * np.maximum(pressure, 0.0)
        speed = 0.5 * (impedance + np.sqrt(impedance * impedance + steep))
        pulse = values[:, 4:7] + np.stack([square / speed, square, pressure * step], axis=1)
        values[:, 4:7] = np.where(high[:, None], pulse, 0.0)
        strongest = values[:, 4] > values[:, 1]
        values[strongest, 1:4] = values[strongest, 4:7]
        values[strongest, 7] = time
        self.values[ahead] = values

    def found(self) -> list[Exposure | None]:
        """Exposure of each round; None for those with ignition points of their own. Collective."""
        mesh = self._fields.mesh
        own: list[tuple[int, float, int, list[float], list[float]]] = []
        for index in np.unique(self._round).tolist():
            rows = np.flatnonzero(self._round == index)
            number = mesh.cell[self._cell[rows]]
            # Of equal energies the first cell of the whole mesh: the same on any number of ranks.
            best = rows[np.lexsort((number, -self.values[rows, 1]))[0]]
            centre = self._fields.start[mesh.dofmap[self._cell[best]]].mean(axis=0)
            peak = float(self.values[rows, 0].max())
            own.append((index, peak, int(mesh.cell[self._cell[best]]), self.values[best].tolist(), centre.tolist()))
        several = mesh.comm.size > 1
        every = [one for piece in mesh.comm.allgather(own) for one in piece] if several else own
        result: list[Exposure | None] = [None] * self._count
        for index in np.flatnonzero(self.waits).tolist():
            of_round = [one for one in every if one[0] == index]
            peak = max((one[1] for one in of_round), default=0.0)
            strongest = min(of_round, key=lambda one: (-one[3][1], one[2]), default=None)
            values, centre = (strongest[3], strongest[4]) if strongest else ([0.0] * len(COLUMNS), [0.0] * 3)
            result[index] = self._exposure(index, peak, values, centre)
        return result

    def _exposure(self, index: int, peak: float, values: Sequence[float], centre: Sequence[float]) -> Exposure:
        row = dict(zip(COLUMNS, values, strict=True))
        held = row["impulse"] ** 2 / row["square"] if row["square"] > 0.0 else 0.0
        pressure = row["square"] / row["impulse"] if row["impulse"] > 0.0 else 0.0
        speed = self._explosives[index].shock_speed(pressure)
        x, y, z = (float(value) for value in centre)
        return Exposure(
            peak_pressure=peak,
            energy=row["energy"],
            pulse_pressure=pressure,
            held_time=held,
            place=(x, y, z),
            time=row["time"],
            floor=float(self._floors[index]),
            resolved_cell=float(LONGEST_FRONT * held * speed / FRONT_CELLS),
        )


def verdict(exposure: Exposure, critical: tuple[float, float] | None, cell_size: float) -> dict[str, Any]:
    """Summary of an exposure against the published critical energies of its explosive.

    Parameters
    ----------
    exposure : of a round. critical : smallest and largest published critical energy (J/m2), None where there is none.
    cell_size : of the mesh (m).

    Returns
    -------
    dict
        The exposure's values, `critical_energy`, `ratio` (energy over the smallest and over the largest of them),
        `verdict` ("below", "within", "above" or "no critical energy") and whether the pulse is `resolved` by the cells.
    """
    resolved = exposure.energy > 0.0 and cell_size <= exposure.resolved_cell
    found: dict[str, Any] = {
        "peak_pressure": exposure.peak_pressure,
        "energy": exposure.energy,
        "pulse_pressure": exposure.pulse_pressure,
        "held_time": exposure.held_time,
        "place": list(exposure.place),
        "time": exposure.time,
        "floor": exposure.floor,
        "resolved_cell": exposure.resolved_cell,
        "resolved": resolved,
        "critical_energy": list(critical) if critical else None,
        "ratio": None,
        "verdict": "no critical energy",
    }
    if critical:
        low, high = critical
        found["ratio"] = [exposure.energy / low, exposure.energy / high]
        found["verdict"] = "below" if exposure.energy < low else "within" if exposure.energy <= high else "above"
    return found
