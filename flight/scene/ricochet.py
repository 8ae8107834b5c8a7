"""Ricochet of a fragment off the ground or an obstacle: critical angle, share of speed kept, angle of departure.

A fragment that meets a surface at the angle b (between its path and the mean surface) meets a facet at a, with
a^2 = b^2 + s^2 and s the slope of the facet. Slopes are normal with the roughness q as their standard deviation, one
for each impact: a flight draws them, the integral of the expected density (`flight.hazard.integral`) runs over them.
Only facets that face the path are met, so that a is not less than b. It goes on where a is at most the critical angle
a_c, and is embedded above it. It leaves in the same plane with

    speed after / speed before = k ** ((a / a_c) ** (4/3)),    angle of departure = r a.

Without roughness a path that grazes ground at a fraction of a degree would lose nothing.

The form is deduced from the impact of a sphere on a medium that resists by its inertia, as Birkhoff and others (1944)
and Johnson and Reid (1975) take it: the pressure 1/2 rho v_n^2 on the wetted cap of a sphere of radius R lifts it with
pi/4 rho v^2 h^2 at a depth h, so that it sinks to h = 2 R (s a^2)^(1/3), s the ratio of the densities of sphere and
medium, leaves at the angle at which it came (r = 1), and keeps exp(-2.47 s^(1/6) a^(4/3)) of its speed. It turns back
while the cap is less than half the sphere: a_c = 1 / sqrt(8 s), or 20 degrees / sqrt(s). Johnson and Reid's own
18 degrees / sqrt(s) is taken; at it the inertia alone leaves exp(-0.53 / sqrt(s)). Friction mu takes exp(-2 mu a) more.

Sources, and how far they were read. The law of 18 degrees / sqrt(s) for spheres on water: Johnson and Reid, "Ricochet
of spheres off water", J. Mech. Eng. Sci. 17 (1975), at second hand (quoted in public programs); Birkhoff et al. (1944)
and Soliman, Reid and Johnson, "The effect of spherical projectile speed in ricochet off water and sand", Int. J. Mech.
Sci. 18 (1976), were not read. That bullets lose up to 35 % of their speed: Heard, "Handbook of Firearms and
Ballistics", at second hand. That the critical angle on sand increases with speed below some metres a second, where
weight matters: Wright et al., arXiv 2002.01468 (2020), abstract read. No measurement of steel fragments on soil was
found that could be read: McCleskey's FRAGHAZ (NAVSWC TR 87-59, 1988) has such a model and was not available. So the
numbers for soil are deduced from its density, those for hard ground are judgements, and `RANGE` is wide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError
from fragfield_base.errors import names_allowed

if TYPE_CHECKING:
    from numpy.typing import NDArray


EXPONENT = 4.0 / 3.0
"""Of the angle over the critical one, in the logarithm of the share of speed kept; as in flight.kernels.events."""
STEEPEST = 60.0  # degrees: no critical angle and no departure is steeper
ROUGHEST = 20.0  # degrees


@dataclass(frozen=True)
class Ricochet:
    """The law of one kind of surface.

    Attributes
    ----------
    critical_angle : float
        Largest angle between path and surface at which fragments ricochet (degrees, above 0 to 60).
    speed_kept : float
        Speed after over speed before at the critical angle (above 0 to 1); more is kept at smaller angles.
    departure : float
        Angle of departure over angle of impact (above 0).
    roughness : float
        Standard deviation of the surface's slopes (degrees, 0 to 20).
    name, source : str
        For reports.

    Raises
    ------
    InputError
        A number is out of its range, or the departure at the critical angle is steeper than 60 degrees.
    """

    critical_angle: float
    speed_kept: float
    departure: float = 1.0
    roughness: float = 0.0
    name: str = "own"
    source: str = ""

    def __post_init__(self) -> None:
        what = f"ricochet {self.name}"
        require_number(what, "critical_angle", self.critical_angle, "degrees", above=0.0, high=STEEPEST)
        require_number(what, "speed_kept", self.speed_kept, "", above=0.0, high=1.0)
        require_number(what, "roughness", self.roughness, "degrees", low=0.0, high=ROUGHEST)
        require_number(what, "departure", self.departure, "")
        if not 0.0 < self.departure * self.critical_angle <= STEEPEST:
            raise InputError(
                f"{what}: departure is {self.departure}, allowed: above 0, and with the critical angle of "
                f"{self.critical_angle:g} degrees at most {STEEPEST / self.critical_angle:.3g}"
            )

    @classmethod
    def of(cls, value: Ricochet | str | None) -> Ricochet | None:
        """Return the law that a user means by a Ricochet, a kind of ground of `KINDS`, or "none" or None: no ricochet.

        Raises
        ------
        InputError
            There is no such kind.
        """
        if value is None or isinstance(value, Ricochet):
            return value
        if value == "none":
            return None
        if value not in KINDS:
            raise InputError(f"ricochet: unknown kind of surface {value!r}{names_allowed(value, [*KINDS, 'none'])}")
        return KINDS[value]

    def scaled(
        self, critical_angle: float = 1.0, speed_kept: float = 1.0, departure: float = 1.0, roughness: float = 1.0
    ) -> Ricochet:
        """The law with factors on its numbers: to vary them within `RANGE`.

        A speed kept of more than 1 is 1, and angles end at 60 degrees, roughness at 20.
        """
        factors = {"critical_angle": critical_angle, "speed_kept": speed_kept, "departure": departure}
        for name, factor in factors.items():
            require_number(f"ricochet {self.name}", f"factor of {name}", factor, "", above=0.0)
        require_number(f"ricochet {self.name}", "factor of roughness", roughness, "", low=0.0)
        if critical_angle == speed_kept == departure == roughness == 1.0:
            return self
        critical = min(critical_angle * self.critical_angle, STEEPEST)
        return replace(
            self, critical_angle=critical, speed_kept=min(speed_kept * self.speed_kept, 1.0),
            departure=min(departure * self.departure, STEEPEST / critical),
            roughness=min(roughness * self.roughness, ROUGHEST),
        )  # fmt: skip

    def after(self, angle: float, slope: float = 0.0) -> tuple[float, float]:
        """Share of the speed kept and angle of departure (degrees) at an angle of impact (degrees).

        `slope`: of the facet (degrees). (0, 0) above the critical angle: embedded.
        """
        require_number(f"ricochet {self.name}", "angle", angle, "degrees", low=0.0, high=90.0)
        facet = math.hypot(angle, slope)
        if facet > self.critical_angle:
            return 0.0, 0.0
        return self.speed_kept ** ((facet / self.critical_angle) ** EXPONENT), self.departure * facet

    @staticmethod
    def table(laws: list[Ricochet | None]) -> NDArray[np.float64]:
        """Rows for the kernels: critical angle (rad), ln of the speed kept, departure, roughness (rad); NaN: none."""
        return np.array(
            [
                [np.nan] * 4
                if law is None
                else [
                    math.radians(law.critical_angle),
                    math.log(law.speed_kept),
                    law.departure,
                    math.radians(law.roughness),
                ]
                for law in laws
            ]
        )


_INERTIA = "18 degrees / sqrt(7850 / {0:g}) (Johnson and Reid 1975, at second hand); share of speed by inertia{1}"
_JUDGED = "judgement: Coulomb friction alone would leave 0.8; breaking, deforming and roughness take more"
KINDS = {
    "water": Ricochet(6.4, 0.83, 1.0, 0.5, "water", _INERTIA.format(1000, "")),
    "soft_soil": Ricochet(7.9, 0.70, 1.0, 2.0, "soft_soil", _INERTIA.format(1500, " and friction 0.45, deduced")),
    "sand": Ricochet(8.4, 0.69, 1.0, 2.0, "sand", _INERTIA.format(1700, " and friction 0.45, deduced")),
    "hard_soil": Ricochet(
        12.0, 0.60, 1.0, 2.0, "hard_soil",
        "judgement: 9.1 degrees by its density of 2000 kg/m3, raised for its strength; less speed kept, being steeper",
    ),
    "asphalt": Ricochet(15.0, 0.65, 0.6, 0.5, "asphalt", _JUDGED),
    "concrete": Ricochet(20.0, 0.65, 0.5, 0.5, "concrete", _JUDGED),
    "rock": Ricochet(20.0, 0.65, 0.5, 3.0, "rock", _JUDGED),
}  # fmt: skip
"""Laws by kind of ground: the nominal ones."""
DEFAULT = "soft_soil"
"""Kind of ground where nothing else is said."""
RANGE = {
    "critical_angle": (0.7, 1.0, 1.8), "speed_kept": (0.65, 1.0, 1.3), "departure": (0.5, 1.0, 1.5),
    "roughness": (0.25, 1.0, 2.0),
}  # fmt: skip
"""Low, nominal and high factor on each number of a law, of every kind: judgements; see the module.

Critical angle: low for jagged fragments, which dig in; high for flat ones, which plane, and for strong soil. Speed
kept: bullets lose up to 35 %, tumbling fragments may lose more. Departure: flatter than the impact off hard ground by
most descriptions, steeper off soil that throws up a lip. Roughness: from a mown, rolled field to a ploughed one.
"""
