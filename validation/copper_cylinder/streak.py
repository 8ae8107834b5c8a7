"""The cylinder's wall as a streak camera sees it: the outer radius where a fixed slit lies, over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import h5py
import numpy as np

from validation.runs import StudyError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["Streak", "streak"]

_ALIKE = 1e-6  # nodes are of one ring where radius and height agree to this share


@dataclass(frozen=True, eq=False)
class Streak:
    """Displacement of the outer radius at a fixed station.

    Attributes
    ----------
    time : (n,) float64
        Times of the record (s).
    displacement : (n,) float64
        Outer radius less the initial one (m), the mean over the azimuth.
    """

    time: NDArray[np.float64]
    displacement: NDArray[np.float64]

    def speed_at(self, displacement: float, window: float) -> float:
        """Speed (m/s) where the displacement (m) is reached: slope of a parabola through the record near it.

        Parameters
        ----------
        displacement : float
            Where (m).
        window : float
            Records within this displacement of it (m) count. It spans a few reverberations of the wall, which the
            smoothing of a measured record takes away as well.

        Raises
        ------
        StudyError
            The record does not reach beyond the window, or has fewer than four points in it.
        """
        if not self.displacement.max() >= displacement + window:
            raise StudyError(
                f"the wall's record ends at {1e3 * self.displacement.max():.1f} mm; speed at "
                f"{1e3 * displacement:g} mm needs it to {1e3 * (displacement + window):g} mm"
            )
        near = np.abs(self.displacement - displacement) <= window
        if np.count_nonzero(near) < 4:
            raise StudyError(f"{np.count_nonzero(near)} records near {1e3 * displacement:g} mm; 4 are needed")
        # Time over displacement: the speed is wanted where the displacement, not the time, is given.
        curve = np.polyfit(self.displacement[near] - displacement, self.time[near] - self.time[near].mean(), 2)
        return float(1.0 / curve[1])


def streak(series: Path, station: float, length: float) -> Streak:
    """Read the record off a burst's time series.

    Parameters
    ----------
    series : Path
        Folder of the states of one round that stands on its base at the origin, its axis upwards.
    station : float
        Place of the slit, from the initiated end at the top (m).
    length : float
        Of the cylinder (m).

    Raises
    ------
    StudyError
        The file holds no time series.
    """
    height = length - station
    times, radii = [], []
    ring: list[NDArray[np.int64]] = []
    try:
        for number, path in enumerate(sorted(series.glob("*.h5"))):
            with h5py.File(path, "r", locking=False) as file:
                position = _upright(file["position"][()])
                ring = _outer_rings(position) if number == 0 else ring
                radius, level = _rings_now(position, ring)
                times.append(float(file.attrs["time"]))
                radii.append(float(np.interp(height, level, radius)))
    except (OSError, KeyError) as error:
        raise StudyError(f"{series}: no time series of a burst: {error}") from None
    if not times:
        raise StudyError(f"{series}: no time series of a burst: no state is there")
    found = np.array(radii)
    return Streak(np.array(times), found - found[0])


def _upright(position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions (m) with the height last; a meridian's states have it second, and lie in one plane."""
    return position if position[:, 2].any() else position[:, [0, 2, 1]]


def _outer_rings(start: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """Nodes of the outer surface, ring by ring from the base up."""
    radius = np.hypot(start[:, 0], start[:, 1])
    outer = np.flatnonzero(radius > radius.max() * (1.0 - _ALIKE))
    level = np.round(start[outer, 2] / (_ALIKE * np.ptp(start[:, 2]))).astype(np.int64)
    return [outer[level == one] for one in np.unique(level)]


def _rings_now(
    position: NDArray[np.float64], rings: list[NDArray[np.int64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean radius and height of every ring (m)."""
    radius = np.hypot(position[:, 0], position[:, 1])
    return (
        np.array([radius[ring].mean() for ring in rings]),
        np.array([position[ring, 2].mean() for ring in rings]),
    )
