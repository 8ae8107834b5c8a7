"""Whether a hazard distance can be determined, from the end of every potentially hazardous fragment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.constants import STANDARD_GRAVITY
from flight.result import Status

if TYPE_CHECKING:
    from flight.fragments import Fragments
    from flight.result import FlightResult

__all__ = ["LARGEST_MISSING", "Completeness"]

LARGEST_MISSING = 1e-3  # of the mass that could be hazardous
_UNENDED = (Status.TIME_OUT, Status.LEFT_DOMAIN, Status.STEP_LIMIT, Status.NOT_A_NUMBER)
_WORDS = {
    Status.TIME_OUT: "ran out of time",
    Status.LEFT_DOMAIN: "left the domain",
    Status.STEP_LIMIT: "ran out of steps",
    Status.NOT_A_NUMBER: "have no path (NaN)",
}


@dataclass(frozen=True)
class Completeness:
    """Fragments of one or many realisations by how their flights ended; sums with `+`.

    A fragment could be hazardous whose kinetic energy at launch, with that of its fall from there to the lowest ground,
    is that of the criterion or more, or is NaN.

    Attributes
    ----------
    fragments, landed, stopped, hits : int
        Fragments, those that landed, those that an obstacle stopped, and crossings of witness surfaces.
    possible, missing : float
        Mass of fragments that could be hazardous, and of those of them whose flight has not ended on the ground or at
        an obstacle (kg).
    ended : tuple of int
        Number of those missing by status: out of time, left the domain, out of steps, NaN.
    """

    fragments: int = 0
    landed: int = 0
    stopped: int = 0
    hits: int = 0
    possible: float = 0.0
    missing: float = 0.0
    ended: tuple[int, ...] = (0, 0, 0, 0)

    @classmethod
    def of(
        cls, result: FlightResult, fragments: Fragments, energy: float, *, lowest: float | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> Completeness:  # fmt: skip
        """Count one flight; hazardous from `energy` (J) on; `lowest` is the lowest ground (m), None: there is none."""
        rows, mass = result.landing, fragments.mass
        fall = np.maximum(fragments.position[:, 2] - (0.0 if lowest is None else lowest), 0.0)
        at_ground = mass * (0.5 * rows["initial_speed"] ** 2 + gravity * fall)
        could = ~(at_ground < energy)
        gone = [could & (rows["status"] == status) for status in _UNENDED]
        return cls(
            len(rows), int((rows["status"] == Status.LANDED).sum()), int((rows["status"] == Status.STOPPED).sum()),
            len(result.hits), float(mass[could].sum()), float(mass[np.logical_or.reduce(gone)].sum()),
            tuple(int(one.sum()) for one in gone),
        )  # fmt: skip

    def __add__(self, other: Completeness) -> Completeness:
        """Both together."""
        return Completeness(
            self.fragments + other.fragments, self.landed + other.landed, self.stopped + other.stopped,
            self.hits + other.hits, self.possible + other.possible, self.missing + other.missing,
            tuple(one + two for one, two in zip(self.ended, other.ended, strict=True)),
        )  # fmt: skip

    @property
    def reason(self) -> str:
        """Why no distance can be determined; empty where it can."""
        if not self.fragments:
            return "there are no fragments"
        if self.missing > LARGEST_MISSING * self.possible:
            how = ", ".join(
                f"{number} {_WORDS[status]}" for number, status in zip(self.ended, _UNENDED, strict=True) if number
            )
            return (
                f"{100.0 * self.missing / self.possible:.3g} % of the mass that could be hazardous neither landed nor "
                f"was stopped ({how}); at most {100.0 * LARGEST_MISSING:g} % is allowed"
            )
        if not self.landed:
            met = f", {self.hits} crossings of witness surfaces" if self.hits else ""
            held = f", obstacles stopped {self.stopped}" if self.stopped else ""
            return f"none of {self.fragments} fragments landed{held}{met}"
        return ""
