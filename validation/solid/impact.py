"""A rod against a rigid plane (Taylor 1948): momentum, energy and the length that is left."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.problem import RigidPlane
from validation.solid.bodies import SETTINGS, elastic, energy, record, rod, solver_on

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["Impact", "final_length", "impact"]

_GAP = 1e-6  # m between rod and plane at the start
_RIGID_PART = 0.12  # of the length: how far from the plane the plastic front comes to stand


@dataclass(frozen=True, eq=False)
class Impact:
    """What the impact left.

    Attributes
    ----------
    length : float
        Of the rod at the end (m).
    momentum_error : float
        Change of the rod's momentum less the plane's impulse, over the momentum at the start.
    energy_error : float
        Of the ledger, relative to the kinetic energy at the start.
    moving : float
        Fraction of the kinetic energy that is left at the end.
    """

    length: float
    momentum_error: float
    energy_error: float
    moving: float


def final_length(values: Mapping[str, Any]) -> float:
    """Length that is left (m) by Wilkins and Guinan (1973).

    The plastic front comes to stand at a fixed share of the length, where Taylor lets it run; the rigid rest is stopped
    by the yield stress Y, so that ln((L - h)/(L0 - h)) = -rho v^2 / (2 Y), h = 0.12 L0.
    """
    decay = np.exp(-values["density"] * values["speed"] ** 2 / (2.0 * values["yield_stress"]))
    return float(values["length"] * (_RIGID_PART + (1.0 - _RIGID_PART) * decay))


def impact(values: Mapping[str, Any], core: int, *, local: bool = True) -> Impact:
    """Throw the rod of the reference's table on a plane, with `core` cells along the side of its section's core.

    `local`: with local time stepping.
    """
    strength = 0.5 * values["yield_stress"]
    material = elastic(values, shear_strength=strength, tensile_strength=8.0 * strength)
    plane = RigidPlane("anvil", (0.0, 0.0, -_GAP), (0.0, 0.0, 1.0), friction_angle=0.0)
    mesh = rod(values["radius"], values["length"], core)
    settings = replace(
        SETTINGS,
        cell_size=0.5 * np.pi * values["radius"] / core,
        planes=(plane,),
        time_step=replace(SETTINGS.time_step, subcycling=local),
    )
    solver = solver_on(mesh, material, settings)
    fields = solver.fields
    fields.nodes.velocity[:, 2] = -values["speed"]
    start_momentum, first = float(fields.mass @ fields.nodes.velocity[:, 2]), record(solver)
    while solver.time < values["end_time"]:
        solver.step(values["end_time"])
    last = record(solver)
    # The velocity belongs to the middle of the last step, the plane's impulse to its end.
    velocity = fields.nodes.velocity + 0.5 * solver.time_step * fields.inverse_mass[:, None] * solver.fields.nodes.force
    assert solver.contact is not None
    gained = float(fields.mass @ velocity[:, 2]) - start_momentum
    return Impact(
        length=float(np.ptp(fields.nodes.position[:, 2])),
        momentum_error=(gained - float(solver.contact.impulse[2])) / abs(start_momentum),
        energy_error=energy(last) / energy(first) - 1.0,
        moving=last.kinetic / first.kinetic,
    )
