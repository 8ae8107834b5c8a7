"""Settings of the integration: steps, tolerances, and the end of a flight."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from flight.arguments import require_number, require_numbers
from flight.errors import InputError
from fragfield_base.bounds import Bounds, OnlyWith
from fragfield_base.inputs import Time


@dataclass(frozen=True)
class Adaptive:
    """Dormand-Prince 5(4) with a step that keeps the error per step below `tolerance` of the velocity.

    The default, that of the case file too, keeps the range within 1e-6 of itself with the rough digitised drag tables;
    a smooth drag law comes out far closer. Of 20,000 fragments of 0.1 g to 0.5 kg at 300 to 2000 m/s the largest error
    was 6e-7; with 1e-6 it was 4e-5, in half the time.

    `longest_step` (s) bounds the step where the air has layers thinner than a step would see.
    """

    tolerance: float = 3e-8
    longest_step: float = math.inf

    def __post_init__(self) -> None:
        """Refuse what cannot be stepped."""
        require_number("integrator", "tolerance", self.tolerance, "", low=1e-14, high=1e-2)
        require_number("integrator", "longest_step", self.longest_step, "s")
        if not self.longest_step > 0.0:
            raise InputError(f"integrator: longest step is {self.longest_step} s, needed: above zero")


@dataclass(frozen=True)
class FixedStep:
    """The same formula of fifth order with one step size (s); the paper's is 1e-4 s."""

    step: float = 1e-4

    def __post_init__(self) -> None:
        """Refuse what cannot be stepped."""
        require_number("integrator", "step", self.step, "s", above=0.0)


Integrator = Adaptive | FixedStep


@dataclass(frozen=True)
class Steps:
    """How trajectories are integrated, as a case says it."""

    method: Literal["adaptive", "fixed"] = "adaptive"
    """Embedded Runge-Kutta with a step of its own for every fragment, or a fixed step."""
    tolerance: Annotated[
        float, Bounds(1e-14, 1e-2, "between the digits of a number and a per cent"), OnlyWith("method", ("adaptive",))
    ] = Adaptive.tolerance
    """Relative error of a step, for method = "adaptive"; 3e-8 keeps a range within 1e-6 of itself, 1e-6 within 4e-5."""
    step: Annotated[
        Time, Bounds(1e-8, 1.0, "a fragment stops within seconds", usual=(1e-6, 0.01)), OnlyWith("method", ("fixed",))
    ] = FixedStep.step
    """For method = "fixed" (the paper: 0.1 ms)."""

    def integrator(self) -> Integrator:
        """The integrator."""
        return Adaptive(self.tolerance) if self.method == "adaptive" else FixedStep(self.step)


@dataclass(frozen=True)
class Domain:
    """Where a fragment counts as gone: beyond a radius from the origin, above a ceiling, below a floor (m)."""

    radius: float = math.inf
    ceiling: float = math.inf
    floor: float = -math.inf

    def __post_init__(self) -> None:
        """Refuse an empty domain."""
        require_numbers("domain", self, {"radius": "m", "ceiling": "m", "floor": "m"})
        if not self.radius > 0.0:
            raise InputError(f"domain: radius is {self.radius} m, needed: above zero")
        if not self.floor < self.ceiling:
            raise InputError(f"domain: floor {self.floor} m is not below ceiling {self.ceiling} m")
