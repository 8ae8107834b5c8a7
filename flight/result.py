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

    from flight.near_ground import PathLengths
    from flight.obstacles import Obstacle
    from flight.targets import Witness

__all__ = ["HITS", "LANDING", "OBSTACLE_HITS", "FlightResult", "Status", "Trajectories", "to_pandas"]


class Status(IntEnum):
    """How a flight ended; every fragment has one."""

    LANDED = 1
    TIME_OUT = 2  # still in the air at the time limit
    LEFT_DOMAIN = 3
    STEP_LIMIT = 4  # gave up after too many steps
    NOT_A_NUMBER = 5  # the equation of motion gave no number
    STOPPED = 6  # by a wall, a barricade or a building


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
        ("bounces", "i4"),  # on the ground
        ("rest_status", "i1"),  # Status at the very end: LANDED is at rest on the ground
        ("obstacle", "i4"),  # index of the one that stopped it, -1: none
        ("face", "i1"),  # of that obstacle, -1: none
        ("rest_time", "f8"),  # s
        ("rest_position", "f8", 3),  # m
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

OBSTACLE_HITS = np.dtype(
    [
        ("obstacle", "i4"),  # index of the obstacle
        ("face", "i1"),  # of its `faces`
        ("fragment", "i8"),
        ("round", "i4"),
        ("segment", "i4"),
        ("stopped", "i1"),  # 1 it stayed there, 0 it was turned off
        ("mass", "f8"),  # kg
        ("initial_speed", "f8"),  # m/s
        ("time", "f8"),  # s
        ("position", "f8", 3),  # m
        ("velocity", "f8", 3),  # m/s, at the impact
        ("speed", "f8"),  # m/s
        ("energy", "f8"),  # J
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
        """Number of paths."""
        return int(self.fragment.size)

    def __repr__(self) -> str:
        return f"<flight.Trajectories: {len(self)} paths of {self.time.size} points>"


@dataclass(frozen=True, eq=False, repr=False)
class FlightResult:
    """The outcome of `flight.fly`.

    Attributes
    ----------
    landing : (n,) structured array of dtype `LANDING`
        The end of every fragment's flight, in the order flown: its first impact on the ground, or where it left, was
        stopped or ran out of time; and `rest_*`, where it came to rest once bounce and roll are over.
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
    obstacles : tuple
        Walls, barricades and buildings, in the order `obstacle` counts.
    obstacle_hits : (o,) structured array of dtype `OBSTACLE_HITS`
        Every impact on an obstacle, by fragment and then time.
    near_ground : flight.near_ground.PathLengths, optional
        Lengths of paths below a person's height, where `fly` was asked to count them.
    """

    landing: NDArray[Any]
    hits: NDArray[Any]
    trajectories: Trajectories
    witnesses: tuple[Witness, ...]
    summary: dict[str, Any] = field(default_factory=dict)
    contacts: NDArray[Any] | None = None
    obstacles: tuple[Obstacle, ...] = ()
    obstacle_hits: NDArray[Any] = field(default_factory=lambda: np.zeros(0, dtype=OBSTACLE_HITS))
    near_ground: PathLengths | None = None

    def __repr__(self) -> str:
        return (
            f"<flight.FlightResult: {len(self.landed)} of {len(self.landing)} fragments landed, {len(self.hits)} hits>"
        )

    def __str__(self) -> str:
        lines = [f"{len(self.landing)} fragments flown, {len(self.landed)} landed"]
        ends = {
            status.name.lower().replace("_", " "): int((self.landing["status"] == status).sum()) for status in Status
        }
        others = [f"{number} {name}" for name, number in ends.items() if number and name != "landed"]
        lines += [f"  {', '.join(others)}"] if others else []
        if len(self.landed):
            lines.append(f"  farthest landing {self.landed['distance'].max():.4g} m")
        for index, witness in enumerate(self.witnesses):
            lines.append(f"  witness {witness.name}: {int((self.hits['witness'] == index).sum())} hits")
        for index, obstacle in enumerate(self.obstacles):
            number = int((self.obstacle_hits["obstacle"] == index).sum())
            lines.append(f"  obstacle {obstacle.name}: {number} hits")
        return "\n".join(lines)

    @property
    def landed(self) -> NDArray[Any]:
        """Rows of `landing` whose fragment reached the ground."""
        return self.landing[self.landing["status"] == Status.LANDED]

    def hits_on(self, witness: int | str) -> NDArray[Any]:
        """Crossings of one witness surface, by index or name; all there are, not copied, where it is the only one."""
        from flight.errors import InputError, nearest

        if isinstance(witness, str):
            names = [surface.name for surface in self.witnesses]
            if witness not in names:
                raise InputError(f"no witness {witness!r}{nearest(witness, names)}")
            if names.count(witness) > 1:
                raise InputError(f"{names.count(witness)} witnesses are called {witness!r}; ask by index")
            witness = names.index(witness)
        here = self.hits["witness"] == witness
        return self.hits if here.all() else self.hits[here]

    def by_face(self, energy: float = 79.0) -> list[dict[str, Any]]:
        """Hits on every obstacle by face; see `flight.obstacles.count_by_face`."""
        from flight.obstacles import count_by_face

        return count_by_face(self.obstacles, self.obstacle_hits, energy)

    def to_pandas(self) -> tuple[Any, Any]:
        """`landing` and `hits` as pandas frames (vectors become three columns); pandas must be installed."""
        return to_pandas(self.landing), to_pandas(self.hits)

    def write(self, folder: str | Path, provenance: Mapping[str, str] | None = None, *, csv: bool = True) -> list[Path]:
        """Write landing.h5, hits.h5, CSV copies and trajectories.xdmf into a folder; return the paths.

        With obstacles also obstacle_hits.h5, with contact between fragments contacts.h5.
        """
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
