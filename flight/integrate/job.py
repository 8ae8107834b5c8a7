"""The work of one flight: settings, tables for the kernel, threads that pull chunks of fragments, rows of results."""

from __future__ import annotations

import math
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from flight.arguments import require_number, require_numbers
from flight.errors import InputError
from flight.fluence import Fluence, FluenceGrid, PolarGrid, Weights
from flight.rows import HITS, LANDING, OBSTACLE_HITS, RICOCHETS, Flown, Trajectories
from flight.scene.targets import Cylinder, pack, within
from fragfield_base.bounds import Bounds, OnlyWith
from fragfield_base.inputs import Time

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from flight.drag import Drag
    from flight.fragments import Fragments
    from flight.integrate.contact import Legs
    from flight.kernels.events import Ends, Limits
    from flight.scene.air import Air
    from flight.scene.scene import Scene
    from flight.scene.targets import Witness
    from flight.scene.wind import Wind


CHUNK = 3072  # fragments a thread takes at once
_HIT_FRAGMENT, _PATH_FRAGMENT, _STRUCK_FRAGMENT, _GROUND_FRAGMENT = 8, 7, 9, 8  # columns
_NOWHERE = np.array([math.inf, -math.inf] * 3)  # a box that nothing lies in
_AFTER_GROUND = 10  # column of a crossing: 1 after an impact on the ground
EXTENSION = 4.0  # of the cells of paths near the ground, where fragments pass beyond them
MOST_STEPS = 100_000_000  # of one fragment
POINTS_PER_STEP = 2  # of a trajectory
_SLOPES = 0x510E  # distinguishes this stream from others of the same seed


@dataclass(frozen=True)
class Adaptive:
    """Dormand-Prince 5(4) with a step that keeps the error per step below `tolerance` of the velocity.

    The default, that of the case file too, keeps the range within 1e-6 of itself with the rough digitised drag tables;
    a smooth drag law comes out far closer. Of 20,000 fragments of 0.1 g to 0.5 kg at 300 to 2000 m/s the largest error
    was 6e-7; with 1e-6 it was 4e-5, in half the time.

    `longest_step` (s) bounds the step where the air has layers thinner than a step would see.
    """

    tolerance: float = 3e-8
    longest_step: float = math.inf

    def __post_init__(self) -> None:
        require_number("integrator", "tolerance", self.tolerance, "", low=1e-14, high=1e-2)
        require_number("integrator", "longest_step", self.longest_step, "s")
        if not self.longest_step > 0.0:
            raise InputError(f"integrator: longest step is {self.longest_step} s, needed: above zero")


@dataclass(frozen=True)
class FixedStep:
    """The same formula of fifth order with one step size (s); the paper's is 1e-4 s."""

    step: float = 1e-4

    def __post_init__(self) -> None:
        require_number("integrator", "step", self.step, "s", above=0.0)


Integrator = Adaptive | FixedStep


@dataclass(frozen=True)
class Steps:
    """How trajectories are integrated, as a case says it."""

    method: Literal["adaptive", "fixed"] = "adaptive"
    """Embedded Runge-Kutta with a step of its own for every fragment, or a fixed step."""
    tolerance: Annotated[
        float, Bounds(1e-14, 1e-2, "between the digits of a number and a per cent"), OnlyWith("method", ("adaptive",))
    ] = Adaptive.tolerance
    """Relative error of a step, for method = "adaptive"; 3e-8 keeps a range within 1e-6 of itself, 1e-6 within 4e-5."""
    step: Annotated[
        Time, Bounds(1e-8, 1.0, "a fragment stops within seconds", usual=(1e-6, 0.01)), OnlyWith("method", ("fixed",))
    ] = FixedStep.step
    """For method = "fixed" (the paper: 0.1 ms)."""

    def integrator(self) -> Integrator:
        """The integrator."""
        return Adaptive(self.tolerance) if self.method == "adaptive" else FixedStep(self.step)


@dataclass(frozen=True)
class Domain:
    """Where a fragment counts as gone: beyond a radius from the origin, above a ceiling, below a floor (m)."""

    radius: float = math.inf
    ceiling: float = math.inf
    floor: float = -math.inf

    def __post_init__(self) -> None:
        require_numbers("domain", self, {"radius": "m", "ceiling": "m", "floor": "m"})
        if not self.radius > 0.0:
            raise InputError(f"domain: radius is {self.radius} m, needed: above zero")
        if not self.floor < self.ceiling:
            raise InputError(f"domain: floor {self.floor} m is not below ceiling {self.ceiling} m")


@dataclass(frozen=True)
class FlightProgress:
    """How far a flight has come: fragments done, of how many, and the time it took so far (s)."""

    done: int
    total: int
    wall_seconds: float

    @property
    def seconds_left(self) -> float:
        """Time left at the rate so far (s)."""
        return self.wall_seconds * (self.total - self.done) / max(self.done, 1)


class FlightJob:
    """One flight: the tables, and the threads that pull chunks of fragments."""

    def __init__(
        self, fragments: Fragments, air: Air, drag: Drag, gravity: float, wind: Wind | None, scene: Scene,
        witnesses: Sequence[Witness], integrator: Integrator, domain: Domain, time_limit: float,
        origin: tuple[float, float], cells: FluenceGrid | None = None, seed: int = 0,
        weights: Weights | None = None,
    ) -> None:  # fmt: skip
        from flight.kernels import motion, trajectory
        from flight.kernels.events import Limits

        self.trajectory = trajectory
        self.fragments, self.witnesses, self.origin = fragments, tuple(witnesses), origin
        self.clock = np.tile([0.0, math.inf], (len(fragments), 1))
        self._first_key = np.random.SeedSequence([seed, _SLOPES]).generate_state(1, np.uint64)
        self.numbers = np.arange(len(fragments))  # by which slopes of the ground are drawn
        self.legs: Legs | None = None  # between contacts
        table = air.table()
        self.around = motion.Surroundings(
            *table, *drag.table(), np.zeros((0, 9)) if wind is None else wind.table(), scene.height_at(*origin),
            float(gravity),
        )  # fmt: skip
        steps = (
            (1.0, integrator.step, math.inf)
            if isinstance(integrator, FixedStep)
            else (integrator.tolerance, 0.0, integrator.longest_step)
        )
        ground, above = scene.flat_height, 0.0 if cells is None else float(cells.height)
        levels = np.zeros((4, 6))
        levels[:, 2] = ground, domain.ceiling, domain.floor, ground + above
        levels[:, 5] = 1.0, -1.0, 1.0, 1.0
        self.limits = Limits(
            ground, float(origin[0]), float(origin[1]), float(domain.radius), float(domain.ceiling),
            float(domain.floor), levels, float(time_limit), *steps, MOST_STEPS, 0,
        )  # fmt: skip
        self.in_air = bool(table.pieces[:, :4].any())
        self.rows, self.vertices = pack(self.witnesses)
        self.cells = cells if cells is not None and scene.ground is not None else None
        self.fluence: Fluence | None = None
        self.weights = weights
        rows = scene.obstacle_rows()
        # None: what a scene has not is not compiled.
        self.scene, self.terrain, self.obstacles = scene, scene.terrain(), rows if len(rows) else None
        self.surfaces = scene.surfaces()
        self.boxes = np.stack([_around(rows), _NOWHERE, _around(self.rows), within(self.witnesses)])

    def run(self, threads: int, on_progress: Callable[[FlightProgress], None] | None, began: float) -> Flown:
        """Fly all."""
        total = len(self.fragments)
        landing = np.zeros(total, dtype=LANDING)
        extremes = np.zeros((total, 4), dtype=np.float32)
        chunks = range(0, total, CHUNK)
        kinds = {"hits": HITS, "ricochet_hits": HITS, "struck": OBSTACLE_HITS, "ricochets": RICOCHETS}
        tables = {name: [np.zeros(0, dtype=kind)] * len(chunks) for name, kind in kinds.items()}
        arrays = [*self._arrays(self.fragments), self.clock, self._keys, *self._weights]
        done, lock, stop = 0, threading.Lock(), threading.Event()
        queue = iter(enumerate(chunks))
        counted: list[NDArray[np.int64]] = []
        beyond = False

        def work() -> None:
            nonlocal done, beyond
            lengths = self._lengths(self.cells)
            counted.append(lengths)
            while not stop.is_set():
                with lock:
                    index, start = next(queue, (-1, -1))
                if index < 0:
                    return
                end = min(start + CHUNK, total)
                ends, hits, _, struck, ground, inside = self._fly(arrays, start, end, self.limits, lengths)
                later = hits[:, _AFTER_GROUND] > 0.0
                tables["hits"][index] = self._hits(hits[~later])
                tables["ricochet_hits"][index] = self._hits(hits[later])
                tables["struck"][index] = self._struck(struck)
                tables["ricochets"][index] = self._ricochets(ground)
                self._fill_landing(landing[start:end], start, ends)
                extremes[start:end] = ends.first[:, 7:11]
                with lock:
                    done += end - start
                    beyond |= not inside

        workers = max(1, min(threads, len(chunks)))
        if workers == 1 and on_progress is None:
            work()
        else:
            with ThreadPoolExecutor(workers) as pool:
                running = [pool.submit(work) for _ in range(workers)]
                try:
                    while not all(future.done() for future in running):
                        time.sleep(0.002 if time.perf_counter() - began < 1.0 else 0.1)
                        if on_progress is not None:
                            on_progress(FlightProgress(done, total, time.perf_counter() - began))
                finally:
                    stop.set()
                for future in running:
                    future.result()
            if on_progress is not None:
                on_progress(FlightProgress(done, total, time.perf_counter() - began))
        if self.cells is not None:
            if beyond:
                self.cells = replace(self.cells, grid=self.cells.grid.up_to(EXTENSION * self.cells.grid.reach))
                return self.run(threads, on_progress, began)
            self.fluence = Fluence.of(self.cells, counted, self.weights and self.weights.number)
        whole = {name: _joined(parts, kinds[name]) for name, parts in tables.items()}
        return Flown(landing=landing, extremes=extremes, **whole)

    def paths(self, chosen: NDArray[np.int64]) -> Trajectories:
        """Fly the chosen fragments again, in all their legs, and keep their paths."""
        if self.legs is not None:
            return self.legs.join_paths(chosen, self._paths(self.legs.of(chosen)))
        return self._paths(chosen)

    def _paths(self, chosen: NDArray[np.int64]) -> Trajectories:
        if chosen.size == 0:
            none = np.zeros((0, 3))
            return Trajectories(chosen, np.zeros(1, dtype=np.int64), np.zeros(0), none, none)
        few = [*self._arrays(self.fragments.select(chosen)), self.clock[chosen], self._keys[chosen]]
        few += [one[chosen] for one in self._weights]
        # adaptive whatever the flight's step: points of a fixed small step would fill the memory
        tolerance = min(self.limits.tolerance, Adaptive().tolerance)
        limits = self.limits._replace(path_points=POINTS_PER_STEP, fixed_step=0.0, tolerance=tolerance)
        starts = range(0, chosen.size, CHUNK)
        uncounted = self._lengths(None)
        path = np.concatenate(
            [self._fly(few, start, min(start + CHUNK, chosen.size), limits, uncounted)[2] for start in starts]
        )
        start_rows = np.searchsorted(path[:, _PATH_FRAGMENT], np.arange(chosen.size + 1))
        return Trajectories(
            chosen, start_rows.astype(np.int64), path[:, 0].copy(), path[:, 1:4].copy(), path[:, 4:7].copy()
        )

    @property
    def _fluence_cells(self) -> tuple[Any, ...]:
        """What is counted near the ground, for the kernel; of no meaning where nothing is."""
        return (self.cells or FluenceGrid(PolarGrid(1, 2, 1.0, 1))).table()

    def _arrays(self, fragments: Fragments) -> list[NDArray[np.float64]]:
        """Arrays for the kernel in one layout: numba would compile again for read-only or strided ones."""
        start = self.scene.lifted(fragments.position)
        arrays = (fragments.mass, fragments.shape_factor, start, fragments.velocity)
        return [np.require(array, requirements=["C", "W"]) for array in arrays]

    @property
    def _weights(self) -> Weights:
        number = len(self.fragments)
        return self.weights or Weights(np.ones(number), np.zeros((number, 0)))

    @property
    def _keys(self) -> NDArray[np.uint64]:
        return self._first_key + self.numbers.astype(np.uint64)

    @staticmethod
    def _lengths(cells: FluenceGrid | None) -> NDArray[np.int64]:
        """Counters of paths near the ground, before and after the first impact on it; none without cells."""
        return np.zeros((2, *((0, 0) if cells is None else cells.grid.shape)), dtype=np.int64)

    def _fly(
        self, arrays: list[NDArray[Any]], start: int, end: int, limits: Limits, lengths: NDArray[np.int64]
    ) -> tuple[Ends, NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], bool]:
        """Fly one chunk, and on from every ricochet; adds to `lengths`.

        Returns how flights ended, crossings of witness surfaces, points of paths, impacts on obstacles, impacts on the
        ground of the fragments that ricochet off it, each by fragment and then time, and whether the cells reach as far
        as paths near the ground.
        """
        from flight.kernels.events import FIRST_COLUMNS, Ends

        number = end - start
        status, last_status = np.zeros((2, number), dtype=np.int8)
        ricochets, contacts = np.zeros((2, number), dtype=np.int64)
        ends = Ends(
            np.empty((number, FIRST_COLUMNS)), status, np.empty((number, 7)), last_status,
            np.empty((number, 2), dtype=np.int64), ricochets, contacts,
        )  # fmt: skip
        hits, path, struck, ground, inside = self.trajectory.fly_chunk(
            start, end, *arrays, self.around, limits, self.terrain, self.obstacles, self.surfaces, self.rows,
            self.vertices, self.boxes, self._fluence_cells, lengths, ends,
        )  # fmt: skip
        ground = ground[ricochets[ground[:, _GROUND_FRAGMENT].astype(np.int64)] > 0]
        struck, ground = _sorted(struck, _STRUCK_FRAGMENT), _sorted(ground, _GROUND_FRAGMENT)
        struck[:, _STRUCK_FRAGMENT] += start
        ground[:, _GROUND_FRAGMENT] += start
        return ends, _sorted(hits, _HIT_FRAGMENT), _sorted(path, _PATH_FRAGMENT), struck, ground, inside

    def _fill_landing(self, rows: NDArray[Any], start: int, ends: Ends) -> None:
        self._fill(rows, np.arange(start, start + len(rows)), ends.first)
        rows["status"], rows["last_status"], rows["ricochets"] = ends.first_status, ends.last_status, ends.ricochets
        rows["obstacle"], rows["face"] = ends.stopped_by[:, 0], ends.stopped_by[:, 1]
        rows["last_time"], rows["last_position"] = ends.last[:, 0], ends.last[:, 1:4]
        self._place(rows, ends.first)
        self._place(rows, ends.last, "last_")
        rows["angle"] = _angles(-ends.first[:, 6], _horizontal(ends.first[:, 4:6]))

    def _struck(self, buffer: NDArray[np.float64]) -> NDArray[Any]:
        rows = np.zeros(len(buffer), dtype=OBSTACLE_HITS)
        rows["obstacle"], rows["face"], rows["stopped"] = buffer[:, 7], buffer[:, 8], buffer[:, 10]
        self._fill(rows, buffer[:, _STRUCK_FRAGMENT].astype(np.int64), buffer)
        return rows

    def _ricochets(self, buffer: NDArray[np.float64]) -> NDArray[Any]:
        rows = np.zeros(len(buffer), dtype=RICOCHETS)
        rows["fragment"], rows["number"] = buffer[:, _GROUND_FRAGMENT], buffer[:, 9]
        rows["time"], rows["position"] = buffer[:, 0], buffer[:, 1:4]
        half = 0.5 * self.fragments.mass[rows["fragment"]]
        rows["energy"], rows["energy_after"] = half * (buffer[:, 4:7] ** 2).sum(axis=1), half * buffer[:, 7] ** 2
        self._place(rows, buffer)
        rows["angle"] = _angles(-buffer[:, 6], _horizontal(buffer[:, 4:6]))
        return rows

    def _hits(self, buffer: NDArray[np.float64]) -> NDArray[Any]:
        rows = np.zeros(len(buffer), dtype=HITS)
        rows["witness"], rows["direction"] = buffer[:, 7], buffer[:, 9]
        self._fill(rows, buffer[:, _HIT_FRAGMENT].astype(np.int64), buffer)
        centres = [surface.centre if isinstance(surface, Cylinder) else self.origin for surface in self.witnesses]
        rows["azimuth"] = _azimuth(buffer[:, 1:3] - np.array(centres).reshape(-1, 2)[rows["witness"]])
        rows["elevation"] = _angles(buffer[:, 6], _horizontal(buffer[:, 4:6]))
        return rows

    def _fill(self, rows: NDArray[Any], fragment: NDArray[np.int64], buffer: NDArray[np.float64]) -> None:
        """What a row has of its fragment, and of time, place and velocity, the buffer's first columns."""
        rows["fragment"] = fragment
        for name in ("round", "segment", "mass"):
            rows[name] = getattr(self.fragments, name)[fragment]
        rows["time"], rows["position"], rows["velocity"] = buffer[:, 0], buffer[:, 1:4], buffer[:, 4:7]
        with np.errstate(over="ignore"):  # a flight that gave NaN
            rows["initial_speed"] = np.linalg.norm(self.fragments.velocity[fragment], axis=1)
            rows["speed"] = np.linalg.norm(buffer[:, 4:7], axis=1)
            rows["energy"] = 0.5 * rows["mass"] * rows["speed"] ** 2

    def _place(self, rows: NDArray[Any], buffer: NDArray[np.float64], which: str = "") -> None:
        """Distance and azimuth from the origin."""
        place = buffer[:, 1:3] - self.origin
        rows[f"{which}distance"], rows[f"{which}azimuth"] = _horizontal(place), _azimuth(place)


def _around(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Box (6,) around the boxes of obstacles or witnesses: low and high by axis; one that nothing touches of none."""
    low, high = rows[:, 1:7:2].min(axis=0, initial=math.inf), rows[:, 2:7:2].max(axis=0, initial=-math.inf)
    return np.stack([low, high], axis=1).ravel()


def _sorted(rows: NDArray[np.float64], fragment: int) -> NDArray[np.float64]:
    return rows[np.lexsort((rows[:, 0], rows[:, fragment]))]


def _joined(parts: list[NDArray[Any]], kind: np.dtype[Any]) -> NDArray[Any]:
    """All rows of the parts, which are taken from the list one by one: never twice in memory."""
    whole = np.empty(sum(map(len, parts)), dtype=kind)
    end = len(whole)
    while parts:
        part = parts.pop()
        whole[end - len(part) : end] = part
        end -= len(part)
    return whole


def _horizontal(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    from flight.kernels.trajectory import row_lengths

    result = np.empty(len(rows))
    row_lengths(np.ascontiguousarray(rows[:, 0]), np.ascontiguousarray(rows[:, 1]), result)
    return result


def _angles(opposite: NDArray[np.float64], adjacent: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees from -180 to 180."""
    from flight.kernels.trajectory import row_angles

    result = np.empty(len(opposite))
    row_angles(np.ascontiguousarray(opposite), np.ascontiguousarray(adjacent), result)
    return result


def _azimuth(place: NDArray[np.float64]) -> NDArray[np.float64]:
    angle = _angles(place[:, 1], place[:, 0]) % 360.0
    angle[angle >= 360.0] = 0.0  # a tiny negative angle rounds up to 360
    return np.asarray(angle)
