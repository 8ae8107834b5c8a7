"""Horizontal wind, constant or as a profile over height."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import InputError
from flight.scene.tables import evaluate_pieces, monotone_pieces

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


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
        """Refuse a profile that cannot be read."""
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
        require_number("wind", "speed", speed, "m/s")
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
