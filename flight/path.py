"""The path of one fragment as a function of time, and where along it the fragment is a danger."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from flight.scene.scene import Scene

    Array = NDArray[np.float64]


DANGER = np.dtype(
    [
        ("start", "f8"),  # m, horizontally from the origin of distances
        ("end", "f8"),  # m
        ("length", "f8"),  # m, along the path
    ]
)
_FINE = 16  # samples between two points of a path, among which what begins and ends there is looked for
_HALVINGS = 50


@dataclass(frozen=True, eq=False, repr=False)
class FlightPath:
    """A fragment's path from launch to its last landing.

    `path(t)` gives position (..., 3) in m and velocity (..., 3) in m/s at times (s) from `start` to `end`: cubics by
    position and velocity at the points of the path; at the time of an impact the velocity after it. Raises InputError
    for other times.

    Attributes
    ----------
    mass : float
        Of the fragment (kg).
    time : (p,) float64
        Times of the points (s); twice that of a ricochet, with both velocities.
    position, velocity : (p, 3) float64
        At the points (m, m/s).
    """

    mass: float
    time: Array
    position: Array
    velocity: Array
    scene: Scene
    origin: tuple[float, float]

    def __repr__(self) -> str:
        return f"<flight.FlightPath: {self.start:.4g} to {self.end:.4g} s, {self.time.size} points>"

    @property
    def start(self) -> float:
        """Time of the launch (s)."""
        return float(self.time[0])

    @property
    def end(self) -> float:
        """Time of the last landing, or of where the flight ended otherwise (s)."""
        return float(self.time[-1])

    def __call__(self, time: ArrayLike) -> tuple[Array, Array]:
        """Position (..., 3) in m and velocity (..., 3) in m/s at times (...) in s."""
        t = real_array("path", "time", time, "s")
        outside = ~((t >= self.start) & (t <= self.end))
        if outside.any():
            raise InputError(f"path: time is {t[outside].flat[0]:g} s, allowed: {self.start:g} to {self.end:g}")
        after = np.clip(np.searchsorted(self.time, t, side="right"), 1, self.time.size - 1)
        h = (self.time[after] - self.time[after - 1])[..., None]
        s = np.divide((t - self.time[after - 1])[..., None], h, out=np.ones_like(h), where=h > 0.0)
        first, last = self.position[after - 1], self.position[after]
        begin, stop = h * self.velocity[after - 1], h * self.velocity[after]
        square, cubic = 3.0 * (last - first) - 2.0 * begin - stop, begin + stop - 2.0 * (last - first)
        position = first + s * (begin + s * (square + s * cubic))
        slope = np.divide(begin + s * (2.0 * square + 3.0 * s * cubic), h, out=self.velocity[after], where=h > 0.0)
        return position, slope

    def danger_space(self, energy: float = 79.0, height: float = 1.8) -> NDArray[Any]:
        """Stretches where the fragment passes within a person's height of the ground with a hazardous energy.

        What `hazard_distance` counts as lengths of paths near the ground, of one fragment.

        Parameters
        ----------
        energy : float
            From which it is hazardous (J).
        height : float
            Of a person (m).

        Returns
        -------
        (k,) structured array of dtype `DANGER`
            In the order of time; none where it passes higher, or slower.
        """
        require_number("danger_space", "energy", energy, "J", low=0.0)
        require_number("danger_space", "height", height, "m", above=0.0)
        if self.scene.ground is None:
            raise InputError("danger_space: the fragments were flown without ground; needed: a height, or a HeightMap")
        share = np.arange(_FINE) / _FINE
        times = np.append((self.time[:-1, None] + np.diff(self.time)[:, None] * share).ravel(), self.end)
        inside = self._dangerous(times, energy, height)
        changes = np.flatnonzero(inside[1:] != inside[:-1])
        low, high, before = times[changes], times[changes + 1], inside[changes]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            same = self._dangerous(middle, energy, height) == before
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        ends = np.concatenate([[self.start] * bool(inside[0]), 0.5 * (low + high), [self.end] * bool(inside[-1])])
        rows = np.zeros(len(ends) // 2, dtype=DANGER)
        for row, (begin, stop) in zip(rows, ends.reshape(-1, 2), strict=True):
            within = np.concatenate([[begin], times[(times > begin) & (times < stop)], [stop]])
            places = self(within)[0]
            far = np.hypot(*(places[:, :2] - self.origin).T)
            row["start"], row["end"] = far[0], far[-1]
            row["length"] = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
        return rows

    def _dangerous(self, time: Array, energy: float, height: float) -> NDArray[np.bool_]:
        position, velocity = self(time)
        ground = self.scene.ground_at(position[:, 0], position[:, 1])
        fast = 0.5 * self.mass * (velocity**2).sum(axis=1) >= energy
        assert ground is not None  # refused above
        return np.asarray(fast & (position[:, 2] - ground <= height))
