"""Rebound of a fragment from the ground or an obstacle, and its slide."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_numbers
from flight.errors import InputError, nearest

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["SURFACES", "Bounce"]


@dataclass(frozen=True)
class Bounce:
    """Rebound and slide on one kind of surface.

    Attributes
    ----------
    normal, tangential : float
        Share of the velocity along the normal, and along the surface, that is left after an impact (0 to 1).
    friction : float
        Coefficient of sliding friction once it bounces no more.
    rest_speed : float
        Speed off the surface (m/s) below which it bounces no more; 0.1 m/s rises by 0.5 mm.
    name, source : str
        For reports.

    Notes
    -----
    The built-in coefficients were found with rocks of some metres to tens of metres per second. Steel fragments come
    faster and dig in, so bounce and roll are rather too long than too short.
    """

    normal: float
    tangential: float
    friction: float
    rest_speed: float = 0.1
    name: str = "own"
    source: str = ""

    def __post_init__(self) -> None:
        """Refuse coefficients that mean nothing."""
        units = {"normal": "", "tangential": "", "friction": "", "rest_speed": "m/s"}
        require_numbers(f"bounce {self.name}", self, units)
        for what in ("normal", "tangential"):
            value = getattr(self, what)
            if not 0.0 <= value <= 1.0:
                raise InputError(f"bounce {self.name}: {what} restitution is {value}, allowed: 0 to 1")
        if not (math.isfinite(self.friction) and self.friction >= 0.0):
            raise InputError(f"bounce {self.name}: friction is {self.friction}, needed: zero or more")
        if not (math.isfinite(self.rest_speed) and self.rest_speed > 0.0):
            raise InputError(f"bounce {self.name}: rest speed is {self.rest_speed} m/s, needed: above zero")

    @classmethod
    def of(cls, value: Bounce | str | None) -> Bounce | None:
        """Return the bounce that a user means by a Bounce, a name of `SURFACES`, or None: no bounce."""
        if value is None or isinstance(value, Bounce):
            return value
        if value not in SURFACES:
            raise InputError(f"bounce: unknown surface {value!r}{nearest(value, SURFACES)}")
        return SURFACES[value]

    @staticmethod
    def table(surfaces: list[Bounce | None]) -> NDArray[np.float64]:
        """Rows for the kernels: normal, tangential, friction, rest speed; not a number where nothing bounces."""
        return np.array(
            [[np.nan] * 4 if s is None else [s.normal, s.tangential, s.friction, s.rest_speed] for s in surfaces]
        )


_HOEK = (
    "restitution of rocks falling on it: Hoek (1987), the table of rockfall programs (original not checked); "
    "friction assumed"
)
SURFACES = {
    "rock": Bounce(0.53, 0.99, 0.6, name="rock", source=_HOEK + " (clean hard bedrock)"),
    "asphalt": Bounce(0.40, 0.90, 0.6, name="asphalt", source=_HOEK + " (asphalt roadway)"),
    "concrete": Bounce(
        0.45, 0.90, 0.57, name="concrete",
        source="restitution assumed, between bedrock and asphalt; friction of steel on concrete: Rabbat and Russell "
        "(1985, not checked against the original)",
    ),
    "soft_soil": Bounce(0.30, 0.80, 0.6, name="soft_soil", source=_HOEK + " (soft soil, some vegetation)"),
    "hard_soil": Bounce(0.32, 0.82, 0.6, name="hard_soil", source=_HOEK + " (talus)"),
    "sand": Bounce(0.10, 0.50, 0.67, name="sand", source="assumed"),
}  # fmt: skip
