"""Horizontal wind, constant or as a profile over height."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import InputError
from flight.scene.tables import evaluate_pieces, monotone_pieces
from fragfield_base.bounds import Bounds, Entries, OnlyWith
from fragfield_base.errors import show
from fragfield_base.inputs import Angle, Length, PositiveLength, Quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray


_POWER_LAW = OnlyWith("model", ("power_law",))
_NO_PROFILE = OnlyWith("model", ("constant", "power_law"))
_PROFILE = OnlyWith("model", ("profile",), refused=True)
_Blowing = Annotated[float, Quantity("m/s", "5 m/s", minimum=0.0)]


@dataclass(frozen=True)
class WindLaw:
    """Horizontal wind; angles in radians."""

    model: Literal["constant", "power_law", "profile"] = "constant"
    """The same at all heights, growing with height, or given at heights."""
    speed: Annotated[
        _Blowing, Bounds(0.0, 200.0, "no wind at the ground is faster", usual=(0.0, 40.0)), _NO_PROFILE
    ] = 0.0
    """Speed; for model = "power_law" the one at `reference_height`."""
    towards: Annotated[Angle, _NO_PROFILE] = 0.0
    """Azimuth that the wind blows towards, from +x counter-clockwise."""
    reference_height: Annotated[PositiveLength, Bounds(0.01, 1e4, "heights of anemometers"), _POWER_LAW] = 10.0
    """For model = "power_law"."""
    exponent: Annotated[
        float, Bounds(0.0, 1.0, "winds grow slower than heights", above=True, below=True), _POWER_LAW
    ] = 1.0 / 7.0
    """For model = "power_law"."""
    heights: Annotated[list[Length] | None, Entries(10000, "heights of a sounding"), _PROFILE] = None
    """For model = "profile": heights over the ground below a fragment, rising."""
    speeds: Annotated[
        list[_Blowing] | None, Bounds(0.0, 200.0, "no wind up to 20 km is faster", usual=(0.0, 100.0)), _PROFILE
    ] = None
    """For model = "profile": one speed for each height."""
    directions: Annotated[list[Angle] | None, _PROFILE] = None
    """For model = "profile": one azimuth for each height."""

    @property
    def is_still(self) -> bool:
        """Whether there is none."""
        return self.speed == 0.0 and not any(self.speeds or ())

    def faults(self) -> Iterator[tuple[str, str]]:
        """Key and words of what is wrong in a profile."""
        if self.model != "profile":
            return
        heights = list(self.heights or ())
        for key in ("heights", "speeds", "directions"):
            number = len(getattr(self, key) or ())
            if not 0 < number == len(heights):
                yield key, f'found {number} values; model = "profile" needs one for each height, at least 1'
        if any(after <= before for before, after in pairwise(heights)):
            yield "heights", f"found {show(heights)} (m); allowed: values that rise"

    def wind(self) -> Wind | None:
        """The wind; None where there is none. Raises InputError: a profile's columns do not fit together."""
        for key, words in self.faults():
            raise InputError(f"wind.{key}: {words}")
        if self.model == "profile":
            return Wind.profile(self.heights or (), self.speeds or (), np.degrees(self.directions or ()).round(10))
        if self.speed == 0.0:
            return None
        towards = round(math.degrees(self.towards), 10)
        if self.model == "power_law":
            return Wind.power_law(self.speed, towards, self.reference_height, self.exponent)
        return Wind.constant(self.speed, towards)


@dataclass(frozen=True, eq=False)
class Wind:
    """Horizontal velocity of the air by the height over the ground, constant below the first and above the last entry.

    The height is that over the ground below a fragment; without ground it is z. Between entries each component follows
    a cubic that does not overshoot. The direction is the one the wind blows towards, counter-clockwise from +x like
    every azimuth here.

    Attributes
    ----------
    height : (n,) float64
        Heights over the ground (m), rising.
    velocity : (n, 2) float64
        Velocity along x and y (m/s).
    """

    height: NDArray[np.float64]
    velocity: NDArray[np.float64]

    def __post_init__(self) -> None:
        height, velocity = self.height, self.velocity
        if height.ndim != 1 or height.size == 0 or velocity.shape != (height.size, 2):
            raise InputError(
                f"wind: heights have shape {height.shape}, velocities {velocity.shape}; needed (n,), (n, 2)"
            )
        if not (np.isfinite(height).all() and np.isfinite(velocity).all()):
            raise InputError("wind: a height or a velocity is not a finite number")
        if not (np.diff(height) > 0.0).all():
            row = int(np.argmin(np.diff(height) > 0.0)) + 1
            raise InputError(f"wind: height {height[row]} m follows {height[row - 1]} m; heights must rise")

    @classmethod
    def constant(cls, speed: float, towards_deg: float) -> Wind:
        """Wind of one speed (m/s) blowing towards an azimuth (degrees) at every height."""
        require_number("wind", "speed", speed, "m/s")
        require_number("wind", "towards_deg", towards_deg, "degrees")
        return cls.profile([0.0], [speed], [towards_deg])

    @classmethod
    def profile(cls, height: ArrayLike, speed: ArrayLike, towards_deg: ArrayLike) -> Wind:
        """Wind from heights (m), speeds (m/s) and azimuths that it blows towards (degrees), each (n,) or single."""
        given = (("height", height, "m"), ("speed", speed, "m/s"), ("towards_deg", towards_deg, "degrees"))
        try:
            arrays = np.broadcast_arrays(*(np.atleast_1d(real_array("wind", *one)) for one in given))
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"wind: heights, speeds and azimuths do not fit together ({error})") from None
        position, amount, angle = arrays
        with np.errstate(invalid="ignore"):  # what is not finite is refused below
            velocity = np.stack([amount * np.cos(np.radians(angle)), amount * np.sin(np.radians(angle))], axis=1)
        return cls(np.ascontiguousarray(position), velocity)

    @classmethod
    def power_law(
        cls,
        speed: float,
        towards_deg: float,
        reference_height: float = 10.0,
        exponent: float = 1.0 / 7.0,
        top: float = 1000.0,
    ) -> Wind:
        """Wind growing as (height over the ground / reference height)^exponent up to `top` (m over the ground)."""
        require_number("wind", "reference_height", reference_height, "m", above=0.0)
        require_number("wind", "top", top, "m", above=0.0)
        require_number("wind", "exponent", exponent, "", finite=True)
        require_number("wind", "speed", speed, "m/s", finite=True)
        rise = np.concatenate([[0.0], np.geomspace(min(0.1, 0.01 * top), top, 41)])
        return cls.profile(rise, speed * (rise / reference_height) ** exponent, towards_deg)

    def at(self, height: ArrayLike) -> NDArray[np.float64]:
        """Velocity (..., 2) in m/s at heights over the ground (m)."""
        position = np.asarray(height, dtype=np.float64)
        if self.height.size == 1:
            return np.broadcast_to(self.velocity[0], (*position.shape, 2)).copy()
        parts = [evaluate_pieces(self.height, monotone_pieces(self.height, c), position) for c in self.velocity.T]
        return np.stack(parts, axis=-1)

    def table(self) -> NDArray[np.float64]:
        """Rows for the kernels (n, 9): lower end, then the coefficients along x and along y.

        The first row stands for all below the first entry, the last for all above the last.
        """
        height, velocity = self.height, self.velocity
        rows = np.zeros((height.size + 1, 9))
        rows[1:, 0] = height
        rows[0, [1, 5]], rows[-1, [1, 5]] = velocity[0], velocity[-1]
        if height.size > 1:
            rows[1:-1, 1:5] = monotone_pieces(height, np.ascontiguousarray(velocity[:, 0]))
            rows[1:-1, 5:9] = monotone_pieces(height, np.ascontiguousarray(velocity[:, 1]))
        rows[0, 0] = height[0]  # finite: its offset is multiplied by zero
        return rows
