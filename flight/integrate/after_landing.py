"""A chunk of fragments from launch to the last landing: successive flights, joined by ricochets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from flight.rows import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels.events import Limits
    from flight.kernels.motion import Surroundings
    from flight.kernels.terrain import Terrain
    from flight.scene.scene import Scene

__all__ = ["FlownChunk", "fly_chunk_to_end"]

FRAGMENT_OF_HIT, FRAGMENT_OF_PATH, FRAGMENT_OF_STRIKE, FRAGMENT_OF_LANDING = 8, 7, 9, 8  # columns
AFTER_GROUND = 10  # column of a crossing: 1 after an impact on the ground


class ChunkFlight(Protocol):
    """What flies a chunk once: `flight.integrate.job.FlightJob`."""

    scene: Scene
    around: Surroundings
    terrain: Terrain
    obstacles: NDArray[np.float64]

    def fly(
        self, arrays: list[NDArray[np.float64]], start: int, end: int, limits: Limits, buffers: dict[str, NDArray[Any]]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Crossings and points of paths of the fragments start..end-1."""


@dataclass(frozen=True, eq=False)
class FlownChunk:
    """What became of n fragments.

    Attributes
    ----------
    outcome : (n, 13) float64
        First impact on the ground, or the end of those that have none, as `flight.kernels.trajectory` gives it; steps
        and Mach numbers are of all flights.
    status : (n,) int8
        Status there.
    last : (n, 7) float64
        Time, position, velocity at the very end: the last landing, for those that stay on the ground.
    last_status : (n,) int8
        Status there.
    stopped_by : (n, 2) int64
        Obstacle and face that stopped it, or -1.
    ricochets : (n,) int64
        Off the ground.
    hits, path, struck, ground : arrays
        Crossings of witness surfaces, points of paths, impacts on obstacles, and impacts on the ground of the fragments
        that ricochet off it; rows by fragment and then time.
    """

    outcome: NDArray[np.float64]
    status: NDArray[np.int8]
    last: NDArray[np.float64]
    last_status: NDArray[np.int8]
    stopped_by: NDArray[np.int64]
    ricochets: NDArray[np.int64]
    hits: NDArray[np.float64]
    path: NDArray[np.float64]
    struck: NDArray[np.float64]
    ground: NDArray[np.float64]


def fly_chunk_to_end(
    job: ChunkFlight, arrays: list[NDArray[np.float64]], start: int, end: int, limits: Limits,
    buffers: dict[str, NDArray[Any]],
) -> FlownChunk:  # fmt: skip
    """Fly the fragments start..end-1, and on from every ricochet."""
    hits, path = job.fly(arrays, start, end, limits, buffers)
    outcome, status = buffers["outcome"][: end - start], buffers["status"][: end - start]
    if job.scene.ricochets:
        return _fly_on(job, arrays, start, limits, buffers, (outcome.copy(), status.copy(), hits.copy(), path.copy()))
    stopped = np.flatnonzero(status == Status.STOPPED)
    struck = np.ones((stopped.size, 11))
    struck[:, :7], struck[:, 7:9], struck[:, 9] = outcome[stopped, :7], outcome[stopped, 11:13], start + stopped
    still = np.zeros(end - start, dtype=np.int64)
    stopped_by = outcome[:, 11:13].astype(np.int64)
    return FlownChunk(outcome, status, outcome[:, :7], status, stopped_by, still, hits, path, struck, np.zeros((0, 10)))


def _fly_on(
    job: ChunkFlight, arrays: list[NDArray[np.float64]], start: int, limits: Limits, buffers: dict[str, NDArray[Any]],
    flown: tuple[NDArray[np.float64], NDArray[np.int8], NDArray[np.float64], NDArray[np.float64]],
) -> FlownChunk:  # fmt: skip
    """Let ricochet what has landed or struck, and fly on until all stay."""
    from flight.kernels.impacts import GROUND_COLUMNS, STRUCK_COLUMNS, apply_impacts

    outcome, status, hits, path = flown
    number = len(outcome)
    mass, shape_factor = arrays[0], arrays[1]
    first, first_status = np.zeros_like(outcome), np.zeros(number, dtype=np.int8)
    first[:, 7:11] = outcome[:, 7:11]
    last, last_status = np.zeros((number, 7)), np.zeros(number, dtype=np.int8)
    stopped_by = np.full((number, 2), -1, dtype=np.int64)
    ricochets, contacts = np.zeros(number, dtype=np.int64), np.zeros(number, dtype=np.int64)
    record, landed = np.zeros((number, STRUCK_COLUMNS)), np.zeros((number, GROUND_COLUMNS))
    surfaces = job.scene.surfaces()
    moving = np.arange(number)
    all_hits, all_paths, all_struck, all_ground = [hits], [path], [], []
    while True:
        flying, strikes, landings = apply_impacts(
            moving, len(moving), outcome, status, surfaces, limits, job.terrain, job.obstacles,
            first, first_status, last, last_status, stopped_by, ricochets, contacts, record, landed,
        )  # fmt: skip
        all_struck.append(record[:strikes].copy())
        all_ground.append(landed[:landings].copy())
        moving = moving[:flying]
        if not flying:
            break
        clock = np.column_stack([last[moving, 0], np.full(flying, np.inf), ricochets[moving] > 0])
        again = [mass[start + moving], shape_factor[start + moving], last[moving, 1:4], last[moving, 4:7], clock]
        again = [np.ascontiguousarray(array) for array in again]
        hits, path = job.fly(again, 0, flying, limits, buffers)
        outcome, status = buffers["outcome"][:flying], buffers["status"][:flying]
        first[moving, 7:9] += outcome[:, 7:9]
        first[moving, 9] = np.minimum(first[moving, 9], outcome[:, 9])
        first[moving, 10] = np.maximum(first[moving, 10], outcome[:, 10])
        for rows, column, pile in ((hits, FRAGMENT_OF_HIT, all_hits), (path, FRAGMENT_OF_PATH, all_paths)):
            mine = rows.copy()
            who = moving[rows[:, column].astype(np.int64)]
            mine[:, column] = start + who
            if pile is all_hits:
                mine[:, AFTER_GROUND] = ricochets[who] > 0
            pile.append(mine)
    struck = np.concatenate(all_struck)
    struck[:, FRAGMENT_OF_STRIKE] += start
    ground = np.concatenate(all_ground)
    ground = ground[ricochets[ground[:, FRAGMENT_OF_LANDING].astype(np.int64)] > 0]
    ground[:, FRAGMENT_OF_LANDING] += start
    return FlownChunk(
        first, first_status, last, last_status, stopped_by, ricochets,
        _sorted(np.concatenate(all_hits), FRAGMENT_OF_HIT), _sorted(np.concatenate(all_paths), FRAGMENT_OF_PATH),
        _sorted(struck, FRAGMENT_OF_STRIKE), _sorted(ground, FRAGMENT_OF_LANDING),
    )  # fmt: skip


def _sorted(rows: NDArray[np.float64], fragment: int) -> NDArray[np.float64]:
    """Rows by fragment and then time, those of one time as they came."""
    return rows[np.lexsort((rows[:, 0], rows[:, fragment]))]
