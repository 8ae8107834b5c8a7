"""One cell strained until it has no strength left, in shear and in tension, and pressed afterwards."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import quad

from burst_fenicsx.problem import Hourglass, TimeStep, Viscosity
from validation.solid.bodies import SETTINGS, elastic, grid, solver_on

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from burst_fenicsx.problem import CasingMaterial

__all__ = ["Softening", "in_shear", "in_tension"]

_EDGE = 1e-2  # m
_BEYOND = 1.3  # times the strain at which the strength is gone


@dataclass(frozen=True, eq=False)
class Softening:
    """A strained cell.

    Attributes
    ----------
    strain : (n,) float64
        Logarithmic: of the stretched edge in shear, of the volume in tension.
    stress, exact : (n,) float64
        Shear stress, or mean stress (Pa), computed and in closed form.
    strength : float
        Initial one (Pa).
    dissipated, exact_dissipated : float
        Plastic work per volume until the strength is gone (J/m3).
    pressure, exact_pressure : float
        After the squeeze that follows (Pa).
    """

    strain: NDArray[np.float64]
    stress: NDArray[np.float64]
    exact: NDArray[np.float64]
    strength: float
    dissipated: float
    exact_dissipated: float
    pressure: float
    exact_pressure: float

    @property
    def largest_error(self) -> float:
        """Largest difference from the closed form, over the strength."""
        return float(np.abs(self.stress - self.exact).max() / self.strength)

    @property
    def left(self) -> float:
        """Stress that is left at the end, over the strength."""
        return float(abs(self.stress[-1]) / self.strength)


def in_shear(values: Mapping[str, Any]) -> Softening:
    """Stretch along x and shorten along y by the same, at constant volume: the shear strength falls to zero.

    With the logarithmic strain e and its plastic part p, tau = 2 G (e - p) = tau_c (1 - sqrt(2) p / gamma_lim): the
    equivalent plastic strain is the norm of the deviator. The work until tau = 0 is tau_c gamma_lim / sqrt(2).
    """
    strength, limit = values["shear_strength"], values["softening_strain"]
    material = elastic(values, shear_strength=strength, shear_softening_strain=limit)
    stiffness = material.elastic_modulus / (1.0 + material.poisson_ratio)  # 2 G
    end = _BEYOND * limit / np.sqrt(2.0)

    def edges(strain: float) -> NDArray[Any]:
        return np.exp(np.array([strain, -strain, 0.0]))

    cell = _Cell(material, end / values["steps"])
    strains = np.linspace(0.0, end, values["steps"] + 1)[1:]
    stress = np.array([0.5 * (s[0] - s[1]) for s in cell.strain(strains, edges)])
    dissipated = cell.dissipated
    exact = _softened(strains, stiffness, strength, limit / np.sqrt(2.0))
    return _squeezed(
        cell, material, values["squeeze"], edges(end), strains, stress, exact, strength,
        dissipated, strength * limit / np.sqrt(2.0),
    )  # fmt: skip


def in_tension(values: Mapping[str, Any]) -> Softening:
    """Stretch alike in all directions: the tensile strength falls to zero.

    With the volumetric strain e and its plastic part p, the mean stress is s = K (e - p) = sigma_t (1 - p / eps_lim);
    the work until it is zero is that of s exp(e) dp, per volume at the start.
    """
    strength, limit = values["tensile_strength"], values["softening_strain"]
    material = elastic(values, tensile_strength=strength, tensile_softening_strain=limit)
    bulk = material.elastic_modulus / (3.0 * (1.0 - 2.0 * material.poisson_ratio))
    end = _BEYOND * limit

    def edges(strain: float) -> NDArray[Any]:
        return np.full(3, np.exp(strain / 3.0))

    cell = _Cell(material, end / values["steps"])
    strains = np.linspace(0.0, end, values["steps"] + 1)[1:]
    stress = np.array([s[:3].mean() for s in cell.strain(strains, edges)])
    dissipated = cell.dissipated
    exact = _softened(strains, bulk, strength, limit)
    return _squeezed(
        cell, material, values["squeeze"], edges(end), strains, stress, exact, strength,
        dissipated, _work_in_tension(bulk, strength, limit),
    )  # fmt: skip


def _work_in_tension(bulk: float, strength: float, limit: float) -> float:
    def power(plastic: float) -> float:
        stress = strength * (1.0 - plastic / limit)
        return float(stress * np.exp(plastic + stress / bulk))

    work, _ = quad(power, 0.0, limit)
    return float(work)


def _softened(strain: NDArray[Any], stiffness: float, strength: float, limit: float) -> NDArray[np.float64]:
    """Stress of s = stiffness (e - p) = strength (1 - p / limit), elastic before, zero after."""
    plastic = (strain - strength / stiffness) / (1.0 - strength / (stiffness * limit))
    return np.where(plastic <= 0.0, stiffness * strain, strength * np.maximum(1.0 - plastic / limit, 0.0))


def _squeezed(
    cell: _Cell,
    material: CasingMaterial,
    squeeze: float,
    edges: NDArray[Any],
    strains: NDArray[Any],
    stress: NDArray[Any],
    exact: NDArray[Any],
    strength: float,
    dissipated: float,
    exact_dissipated: float,
) -> Softening:
    """Press the cell from where it has arrived; it must carry K times the volumetric strain."""
    bulk = material.elastic_modulus / (3.0 * (1.0 - 2.0 * material.poisson_ratio))
    steps = np.linspace(0.0, squeeze, 100)[1:]
    *_, last = cell.strain(steps, lambda strain: edges * np.exp(-strain / 3.0))
    return Softening(
        strains, stress, exact, strength, dissipated, exact_dissipated, float(-last[:3].mean()), bulk * squeeze
    )


class _Cell:
    """One cell whose nodes follow prescribed paths."""

    def __init__(self, material: CasingMaterial, step: float) -> None:
        # Any step does where places are prescribed; that of a strain rate of one keeps the speeds small.
        settings = replace(
            SETTINGS,
            cell_size=_EDGE,
            time_step=TimeStep(fixed=step),
            viscosity=Viscosity(0.0, 0.0),
            hourglass=Hourglass(0.0, 0.0, 0.0),
        )
        self._solver = solver_on(grid((1, 1, 1), lambda points: _EDGE * points), material, settings)
        self._solver.fields.inverse_mass[:] = 0.0
        self._step = step

    def strain(self, strains: NDArray[Any], edges: Callable[[float], NDArray[Any]]) -> list[NDArray[Any]]:
        """Stresses (6,) after each of the strains, to which `edges` gives the ratios of the edges to the first ones."""
        solver, found = self._solver, []
        nodes, start = solver.fields.nodes, solver.fields.start
        for strain in strains.tolist():
            nodes.velocity[:] = (start * edges(strain) - nodes.position) / self._step
            solver.step()
            found.append(solver.fields.solid.stress[0, 0].copy())
        return found

    @property
    def dissipated(self) -> float:
        """Plastic work per initial volume so far (J/m3)."""
        return float(self._solver.ledger.sums[0]) / _EDGE**3
