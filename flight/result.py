"""What a flight gives back: one row a fragment, one row a crossing, and how each flight ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from flight.targets import Witness

__all__ = ["HITS", "LANDING", "FlightResult", "Status", "Trajectories", "to_pandas"]


class Status(IntEnum):
    """How a flight ended; every fragment has one."""

    LANDED = 1
    TIME_OUT = 2  # still in the air at the time limit
    LEFT_DOMAIN = 3
    STEP_LIMIT = 4  # gave up after too many steps
    NOT_A_NUMBER = 5  # the equation of motion gave no number
    STOPPED = 6  # by a wall or barricade


LANDING = np.dtype(
    [
        ("fragment", "i8"),  # row in the fragments flown
        ("status", "i1"),  # Status
        ("round", "i4"),
        ("segment", "i4"),
        ("mass", "f8"),  # kg
        ("initial_speed", "f8"),  # m/s
        ("time", "f8"),  # s; of the end of the flight, as all that follows
        ("position", "f8", 3),  # m
        ("velocity", "f8", 3),  # m/s
        ("speed", "f8"),  # m/s
        ("energy", "f8"),  # J
        ("distance", "f8"),  # horizontal, from the origin (m)
        ("azimuth", "f8"),  # of the place seen from the origin (degrees, 0 to 360)
        ("angle", "f8"),  # of the path below the horizontal (degrees)
    ]
)

HITS = np.dtype(
    [
        ("witness", "i4"),  # index of the surface
        ("fragment", "i8"),
        ("round", "i4"),
        ("segment", "i4"),
        ("direction", "i1"),  # 1 outward or along the normal, -1 against
        ("mass", "f8"),  # kg
        ("initial_speed", "f8"),  # m/s
        ("time", "f8"),  # s
        ("position", "f8", 3),  # m
        ("velocity", "f8", 3),  # m/s
        ("speed", "f8"),  # m/s
        ("energy", "f8"),  # J
        ("azimuth", "f8"),  # of the place seen from the cylinder's axis, or from the origin (degrees, 0 to 360)
        ("elevation", "f8"),  # of the velocity above the horizontal (degrees)
    ]
)


@dataclass(frozen=True, eq=False)
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
        """Number of paths."""
        return int(self.fragment.size)


@dataclass(frozen=True, eq=False)
class FlightResult:
    """The outcome of `flight.fly`.

    Attributes
    ----------
    landing : (n,) structured array of dtype `LANDING`
        The end of every fragment's flight, in the order flown.
    hits : (h,) structured array of dtype `HITS`
        Every crossing of a witness surface, by fragment and then time.
    trajectories : Trajectories
        Paths of the sample asked for (may be empty).
    witnesses : tuple
        The surfaces, in the order `hits["witness"]` counts.
    summary : dict
        Numbers and mass by status, steps, wall time, use of the drag table beyond its ends.
    contacts : structured array of dtype `flight.CONTACTS`, optional
        Every contact between fragments, by time, where `fly` was given a `Contact`.
    """

    landing: NDArray[Any]
    hits: NDArray[Any]
    trajectories: Trajectories
    witnesses: tuple[Witness, ...]
    summary: dict[str, Any] = field(default_factory=dict)
    contacts: NDArray[Any] | None = None

    @property
    def landed(self) -> NDArray[Any]:
        """Rows of `landing` whose fragment reached the ground."""
        return self.landing[self.landing["status"] == Status.LANDED]

    def hits_on(self, witness: int | str) -> NDArray[Any]:
        """Crossings of one witness surface, by index or name."""
        from flight.errors import InputError, nearest

        if isinstance(witness, str):
            names = [surface.name for surface in self.witnesses]
            if witness not in names:
                raise InputError(f"no witness {witness!r}{nearest(witness, names)}")
            if names.count(witness) > 1:
                raise InputError(f"{names.count(witness)} witnesses are called {witness!r}; ask by index")
            witness = names.index(witness)
        return self.hits[self.hits["witness"] == witness]

    def to_pandas(self) -> tuple[Any, Any]:
        """`landing` and `hits` as pandas frames (vectors become three columns); pandas must be installed."""
        return to_pandas(self.landing), to_pandas(self.hits)

    def write(self, folder: str | Path, provenance: Mapping[str, str] | None = None, *, csv: bool = True) -> list[Path]:
        """Write landing.h5, hits.h5, their CSV copies and trajectories.xdmf into a folder; return the paths."""
        from flight import files

        return files.write_result(self, folder, provenance or {}, csv=csv)


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
