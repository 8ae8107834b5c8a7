"""Rows of a flight's tables: landings, crossings, contacts, ricochets, impacts on obstacles, and sampled paths."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Status(IntEnum):
    """How a flight ended; every fragment has one."""

    LANDED = 1
    TIME_OUT = 2  # still in the air at the time limit
    LEFT_DOMAIN = 3
    STEP_LIMIT = 4  # gave up after too many steps
    NOT_A_NUMBER = 5  # the equation of motion gave NaN
    STOPPED = 6  # by a wall, a barricade or a building


_MOTION = (
    ("mass", "f8"),  # kg
    ("initial_speed", "f8"),  # m/s
    ("time", "f8"),  # s
    ("position", "f8", 3),  # m
    ("velocity", "f8", 3),  # m/s
    ("speed", "f8"),  # m/s
    ("energy", "f8"),  # J
)

LANDING = np.dtype(
    [
        ("fragment", "i8"),  # row in the fragments flown
        ("status", "i1"),  # Status
        ("round", "i4"),
        ("segment", "i4"),
        *_MOTION,  # at the first impact on the ground, or at the end; as all that follows
        ("distance", "f8"),  # horizontal, from the origin (m)
        ("azimuth", "f8"),  # of the place seen from the origin (degrees, 0 to 360)
        ("angle", "f8"),  # of the path below the horizontal (degrees)
        ("ricochets", "i4"),  # off the ground
        ("last_status", "i1"),  # Status at the very end: LANDED is embedded in the ground
        ("obstacle", "i4"),  # index of the one that stopped it, -1: none
        ("face", "i1"),  # of that obstacle, -1: none
        ("last_time", "f8"),  # s; of the last landing, or where it ended otherwise
        ("last_position", "f8", 3),  # m
        ("last_distance", "f8"),  # horizontal, from the origin (m)
        ("last_azimuth", "f8"),  # degrees, 0 to 360
    ]
)

HITS = np.dtype(
    [
        ("witness", "i4"),  # index of the surface
        ("fragment", "i8"),
        ("round", "i4"),
        ("segment", "i4"),
        ("direction", "i1"),  # 1 outward or along the normal, -1 against
        *_MOTION,
        ("azimuth", "f8"),  # of the place seen from the cylinder's axis, or from the origin (degrees, 0 to 360)
        ("elevation", "f8"),  # of the velocity above the horizontal (degrees)
    ]
)

CONTACTS = np.dtype(
    [
        ("first", "i8"),  # rows in the fragments flown, first < second
        ("second", "i8"),
        ("time", "f8"),  # s
        ("first_position", "f8", 3),  # centres (m)
        ("second_position", "f8", 3),
        ("first_before", "f8", 3),  # velocities (m/s)
        ("second_before", "f8", 3),
        ("first_after", "f8", 3),
        ("second_after", "f8", 3),
        ("closing_speed", "f8"),  # along the line of centres (m/s)
        ("energy_lost", "f8"),  # to heat and deformation (J)
    ]
)

RICOCHETS = np.dtype(
    [
        ("fragment", "i8"),
        ("number", "i4"),  # ricochets before it: 0 is the impact in the landing table
        ("time", "f8"),  # s
        ("position", "f8", 3),  # m
        ("energy", "f8"),  # J, at the impact
        ("energy_after", "f8"),  # J, of what flies on; 0 where it stays
        ("distance", "f8"),  # horizontal, from the origin (m)
        ("azimuth", "f8"),  # degrees, 0 to 360
        ("angle", "f8"),  # of the path below the horizontal (degrees)
    ]
)

OBSTACLE_HITS = np.dtype(
    [
        ("obstacle", "i4"),  # index of the obstacle
        ("face", "i1"),  # of its `faces`
        ("fragment", "i8"),
        ("round", "i4"),
        ("segment", "i4"),
        ("stopped", "i1"),  # 1 it stayed there, 0 it was turned off
        *_MOTION,  # at the impact
    ]
)


@dataclass(frozen=True, eq=False, repr=False)
class Trajectories:
    """Paths of a sample of fragments as polylines.

    Attributes
    ----------
    fragment : (n,) int64
        Fragments sampled.
    start : (n + 1,) int64
        Row of each path's first point; the last entry is the number of points.
    time : (p,) float64
        Time of each point (s).
    position, velocity : (p, 3) float64
        Place (m) and velocity (m/s) of each point.
    """

    fragment: NDArray[np.int64]
    start: NDArray[np.int64]
    time: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]

    def __len__(self) -> int:
        return int(self.fragment.size)

    def __repr__(self) -> str:
        return f"<flight.Trajectories: {len(self)} paths of {self.time.size} points>"


@dataclass(frozen=True, eq=False)
class Flown:
    """What the fragments of a flight did: tables as of `flight.FlightResult`.

    `hits` are crossings before the first impact on the ground, `ricochet_hits` those after it, `struck` impacts on
    obstacles, `extremes` (n, 4) steps taken and rejected and the lowest and highest Mach number.
    """

    landing: NDArray[Any]
    hits: NDArray[Any]
    ricochet_hits: NDArray[Any]
    struck: NDArray[Any]
    ricochets: NDArray[Any]
    extremes: NDArray[np.float32]


def to_pandas(table: NDArray[Any]) -> Any:  # noqa: ANN401 - pandas need not be there
    """Return a structured array as a pandas frame (vectors become three columns); pandas must be installed."""
    import pandas as pd  # type: ignore[import-untyped,import-not-found,unused-ignore]

    return pd.DataFrame(flat_columns(table))


def flat_columns(table: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Columns of a structured array, each vector as its three components."""
    columns: dict[str, NDArray[Any]] = {}
    for name in table.dtype.names or ():
        if table[name].ndim == 1:
            columns[name] = table[name]
        else:
            columns |= {f"{name}_{axis}": table[name][:, i] for i, axis in enumerate("xyz")}
    return columns
