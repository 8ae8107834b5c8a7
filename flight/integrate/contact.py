"""Collisions between fragments in the first metres, where the clouds of a stack cross, and flights between them.

Flights are in legs: from launch to the first impact, from one impact to the next, and from the last one to the end.
Every leg is flown by the same kernel, with the same witnesses and the same errors as a flight without impacts; a
fragment that is never struck has one leg and flies as if contact were off, to the last bit.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from flight.arguments import require_number, require_numbers
from flight.errors import InputError
from flight.rows import CONTACTS, Status, Trajectories
from fragfield_base.bounds import Bounds
from fragfield_base.errors import names_allowed
from fragfield_base.inputs import Density, PositiveLength, Time

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from flight.kernels.contacts import Spheres, Touch
    from flight.kernels.motion import Surroundings
    from flight.rows import Flown


COMPARED = 10.0  # pairs a fragment that a window aims at: fewer make windows short, more make them expensive
TURN = 0.1  # share of its velocity that drag may take from a fragment within a window
LONGEST_CHANGE = 1.5  # of a window over the one before
CELL = 1.5  # length of a cell over the mean extent of what a fragment sweeps
FEWEST = 2  # groups of fragments that can meet


@dataclass(frozen=True)
class Contact:
    """How fragments strike each other; as an argument of `flight.fly` it switches contact on.

    Fragments are spheres of their volume that move under drag and gravity as everywhere in the flight. Impacts are
    taken as they come, in order of time (event-driven), each as the limit of a linear spring and dashpot with Coulomb
    friction for a contact that is short beside the flight between two: at 1000 m/s a spring would need steps below
    a microsecond. Windows in which pairs are looked for grow as the cloud thins out; a fragment takes no part beyond
    `distance` from its launch or below the ground, and when no fragment is left the rest is normal flight.

    Between which fragments: by default all. Fragments of one casing part where they break, and how that deflects them
    is what a scatter of their directions stands for (`transition.motion`); together with that only fragments
    of different rounds should meet.

    Pairs that overlap at launch, as pieces of one casing do when they are drawn as spheres, are separated before they
    can strike. Pairs that close slower than `min_speed` pass each other: otherwise a heavy fragment that pushes a
    light one before it would strike it without end.

    Attributes
    ----------
    density, restitution, distance, time_limit
        See below. For steel at some hundred m/s Johnson (1985, Eq. 11.47) gives a restitution of about 0.3 with a yield
        stress of 1 GPa (not checked against the original). Of two M107 side by side 99 % of the contacts happen within
        1.3 m, all but one in a thousand within 5 m.
    friction_angle_deg : float
        Coulomb friction, tan of it the coefficient; 20 degrees as between casings (Wang et al.).
    min_speed : float
        Of closing (m/s).
    duration : float
        Of a contact (s): within it a pair strikes once. One caught between two others that close in on it would be
        struck without end otherwise; it is let through. Hertz's duration for steel pieces of 1 cm is about 10 us.
    between : "all" or "rounds"
        Whether any two fragments can meet, or only those of different rounds.
    """

    density: Annotated[Density, Bounds(100.0, 2.5e4, "densities of casings", usual=(1000.0, 2e4))] = 7850.0
    """Of the casing, for spheres of the fragments' volume."""
    restitution: Annotated[float, Bounds(0.0, 1.0, "nothing rebounds faster than it came")] = 0.3
    """Speed of separation over speed of closing."""
    friction_angle_deg: float = 20.0
    distance: Annotated[
        PositiveLength, Bounds(1e-3, 200.0, "beyond it fragments are too far apart to meet", usual=(0.1, 50.0))
    ] = 5.0
    """From its launch up to which a fragment takes part."""
    time_limit: Time = 1.0
    """Up to which contact is looked for."""
    min_speed: float = 0.5
    duration: float = 1e-5
    between: Literal["all", "rounds"] = "all"

    def __post_init__(self) -> None:
        units = {"density": "kg/m3", "distance": "m", "time_limit": "s", "min_speed": "m/s", "duration": "s"}
        require_numbers("contact", self, units, above=0.0)
        require_number("contact", "restitution", self.restitution, "", low=0.0, high=1.0)
        require_number("contact", "friction_angle_deg", self.friction_angle_deg, "degrees", low=0.0, below=90.0)
        if self.between not in ("all", "rounds"):
            raise InputError(f"contact: between is {self.between!r}{names_allowed(self.between, ('all', 'rounds'))}")

    def radius(self, fragments: Fragments) -> NDArray[np.float64]:
        """Radii (n,) of the spheres (m)."""
        return np.cbrt(0.75 / math.pi * fragments.mass / self.density)

    def groups(self, fragments: Fragments) -> NDArray[np.int64]:
        """Numbers (n,) of groups within which no two fragments meet."""
        return np.arange(len(fragments)) if self.between == "all" else fragments.round.astype(np.int64)

    def possible(self, fragments: Fragments) -> bool:
        """Whether any two of the fragments can meet."""
        return np.unique(self.groups(fragments)).size >= FEWEST


class Encounters:
    """All impacts of one flight.

    Attributes
    ----------
    contacts : structured array of dtype `CONTACTS`
        In order of time.
    summary : dict
        Numbers, energy lost (J) and errors of the balances.
    """

    def __init__(
        self, fragments: Fragments, contact: Contact, around: Surroundings, ground: float, threads: int = 1,
        *, one_cell: bool = False, windows: Sequence[float] = (),
    ) -> None:  # fmt: skip
        """Follow the fragments, of at least `FEWEST` groups, until none can meet another.

        `ground` is the height of the ground (m; nan: none), below which nothing meets. With `one_cell` every pair is
        compared, and `windows` are the ends (s) that windows shall have: slow, for tests.
        """
        self.fragments, self.contact = fragments, contact
        self.order = _neighbours_together(fragments, contact.distance)
        self.around, self.one_cell, self.threads = around, one_cell, threads
        self.ground = ground if ground == ground else -math.inf
        self.time, self.window_ends, self.given_ends = 0.0, list[float](), tuple(windows)
        if threads == 1:
            log = self._follow(map)
        else:
            with ThreadPoolExecutor(threads) as pool:
                log = self._follow(pool.map)
        self.contacts = _table(log, self.order)
        self.summary = self._summary()

    def _follow(self, of_all: Callable[..., Iterable[Any]]) -> NDArray[np.float64]:
        """Window after window; returns the rows that the kernel logged. `of_all` is `map`, or that of a pool."""
        from flight.kernels.contacts import LOG_COLUMNS, Touch

        friction = math.tan(math.radians(self.contact.friction_angle_deg))
        touch = Touch(self.contact.restitution, friction, self.contact.min_speed, self.contact.duration, self.ground)
        spheres = self._spheres()
        launch, fastest = spheres.state[:, :3].copy(), float(self.fragments.speed.max(initial=0.0))
        shortest = min(float(spheres.radius.mean()) / max(fastest, 1e-3), self.contact.time_limit)
        active, log, step = np.arange(len(launch)), [], shortest
        while active.size >= FEWEST and self.time < self.contact.time_limit:
            until = min(self.time + step, self.contact.time_limit)
            if self.given_ends:
                until = self.given_ends[len(self.window_ends)]
            rate, compared, rows = self._window(of_all, active, spheres, touch, until)
            log.append(rows)
            self.window_ends.append(until)
            self.time = until
            spheres.state[active] = spheres.end[active]
            spheres.since[active] = until
            gone = _squares(spheres.state[active, :3] - launch[active])
            active = active[(gone <= self.contact.distance**2) & (spheres.state[active, 2] >= self.ground)]
            pairs_each = max(compared, 1) / max(active.size, 1)
            step *= min(max(math.sqrt(COMPARED / pairs_each), 1.0 / LONGEST_CHANGE), LONGEST_CHANGE)
            step = min(max(step, shortest), TURN / rate if rate > 0.0 else math.inf)
        return np.concatenate(log) if log else np.zeros((0, LOG_COLUMNS))

    def _window(
        self,
        of_all: Callable[..., Iterable[Any]],
        active: NDArray[np.int64],
        spheres: Spheres,
        touch: Touch,
        until: float,
    ) -> tuple[float, int, NDArray[np.float64]]:
        """One window: the largest |a| / |v| (1/s), how many pairs were compared, and the contacts."""
        from flight.kernels import contacts as kernel

        parts = np.array_split(active, self.threads)
        rate = max(of_all(lambda part: kernel.advance(part, spheres, self.around, until), parts))
        extent = float((spheres.boxes[active, 3:] - spheres.boxes[active, :3]).mean())
        cell = math.inf if self.one_cell else CELL * extent
        starts, member, place = kernel.fill_cells(active, spheres.boxes, cell, spheres.cells)
        bounds = np.linspace(0, len(starts) - 1, self.threads + 1).astype(np.int64)
        several = list(
            of_all(
                lambda one, next_one: kernel.first_collisions(
                    one, next_one, starts, member, place, spheres, until, touch
                ), bounds[:-1], bounds[1:],
            )
        )  # fmt: skip
        times, pairs = (np.concatenate([one[k] for one in several]) for k in (1, 2))
        rows, log = kernel.strike_in_turn(
            active, starts, member, place, times, pairs, spheres, self.around, touch, until, cell,
            np.empty((64, kernel.LOG_COLUMNS)),
        )  # fmt: skip
        return rate, sum(one[0] for one in several), log[:rows]

    def _spheres(self) -> Spheres:
        from flight.kernels.contacts import PARTNERS, Spheres

        fragments = self.fragments.select(self.order)
        number = len(fragments)
        self.radius = self.contact.radius(fragments)
        self.spin = np.zeros((number, 3))
        return Spheres(
            mass=fragments.mass,
            radius=self.radius,
            group=self.contact.groups(fragments),
            drag_area=0.5 * fragments.presented_area / fragments.mass,
            state=np.hstack([fragments.position, fragments.velocity]),
            end=np.zeros((number, 6)),
            path=np.zeros((number, 3, 6)),
            since=np.zeros(number),
            spin=self.spin,
            boxes=np.zeros((number, 6)),
            cells=np.zeros((number, 6), dtype=np.int64),
            entered=np.zeros((number, 6), dtype=np.int64),
            changes=np.zeros(number, dtype=np.int64),
            partners=np.full((number, PARTNERS), -1),
            struck=np.full((number, PARTNERS), -math.inf),
        )

    def _summary(self) -> dict[str, Any]:
        table, mass = self.contacts, self.fragments.mass
        one, other = mass[table["first"]], mass[table["second"]]

        def momentum(when: str) -> NDArray[np.float64]:
            return np.asarray(
                one[:, None] * table[f"first_{when}"] + other[:, None] * table[f"second_{when}"], dtype=np.float64
            )

        def energy(when: str) -> NDArray[np.float64]:
            return np.asarray(
                0.5 * one * _squares(table[f"first_{when}"]) + 0.5 * other * _squares(table[f"second_{when}"])
            )

        spin = 0.2 * mass[self.order] * self.radius**2 * _squares(self.spin)
        launch = float(mass @ self.fragments.speed)
        change = momentum("after") - momentum("before")
        struck = np.unique(np.concatenate([table["first"], table["second"]]))
        return {
            "contacts": len(table),
            "fragments_struck": int(struck.size),
            "mass_struck": float(mass[struck].sum()),
            "energy_lost": float(table["energy_lost"].sum()),
            "energy_of_spin": float(spin.sum()),
            "energy_error": float(
                abs((energy("before") - energy("after") - table["energy_lost"]).sum() - spin.sum())
                / max(self.fragments.kinetic_energy, 1e-300)
            ),
            "momentum_error": float(np.linalg.norm(change.sum(axis=0)) / launch) if launch > 0.0 else 0.0,
            "largest_closing_speed": float(table["closing_speed"].max()) if len(table) else 0.0,
            "until": self.time,
            "windows": len(self.window_ends),
        }


def _squares(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum("ij,ij->i", rows, rows))


def _neighbours_together(fragments: Fragments, distance: float) -> NDArray[np.int64]:
    """Order (n,) in which fragments that come near each other stand near each other in memory.

    That of their places, with no drag and when most are half way, along Morton's curve (1966) of 2^10 cells a side.
    """
    place = fragments.position + fragments.velocity * (0.5 * distance / max(float(np.median(fragments.speed)), 1e-3))
    span = np.ptp(place, axis=0).max()
    cell = ((place - place.min(axis=0)) * (1023.0 / span if span > 0.0 else 0.0)).astype(np.int64)
    code = np.zeros(len(fragments), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def _table(log: NDArray[np.float64], order: NDArray[np.int64]) -> NDArray[Any]:
    """Rows of `CONTACTS` from the kernel's, whose numbers count in `order`."""
    table = np.zeros(len(log), dtype=CONTACTS)
    one, other = order[log[:, 1].astype(np.int64)], order[log[:, 2].astype(np.int64)]
    table["time"], table["closing_speed"], table["energy_lost"] = log[:, 0], log[:, 21], log[:, 22]
    table["first"], table["second"] = np.minimum(one, other), np.maximum(one, other)
    as_is = (one < other)[:, None]
    for column, name in ((3, "position"), (9, "before"), (15, "after")):
        low, high = log[:, column : column + 3], log[:, column + 3 : column + 6]
        table[f"first_{name}"], table[f"second_{name}"] = np.where(as_is, low, high), np.where(as_is, high, low)
    return table


@dataclass(frozen=True, eq=False)
class Legs:
    """All legs, by fragment and then time."""

    launched: Fragments
    """The fragments at launch."""
    fragments: Fragments
    """The same at the start of every leg."""
    clock: NDArray[np.float64]
    """(legs, 2) float64: start and latest end of each (s), infinite for a fragment's last."""
    first: NDArray[np.int64]
    """(n + 1,) int64: first leg of each fragment, and the number of legs."""

    @property
    def owner(self) -> NDArray[np.int64]:
        """Fragment of each leg."""
        return np.repeat(np.arange(len(self.launched)), np.diff(self.first))

    def of(self, chosen: NDArray[np.int64]) -> NDArray[np.int64]:
        """All legs of the chosen fragments, one fragment after the other."""
        return np.concatenate([np.arange(self.first[i], self.first[i + 1]) for i in chosen] or [np.zeros(0, np.int64)])

    def join(self, run: Flown) -> Flown:
        """What a flight gave for the legs, for the fragments."""
        owner, starts, last = self.owner, self.first[:-1], self._last(run.landing)
        rows = run.landing[last]
        launch_speed = np.linalg.norm(self.launched.velocity, axis=1)
        rows["fragment"], rows["initial_speed"] = np.arange(len(rows)), launch_speed

        def of_fragments(table: NDArray[Any]) -> NDArray[Any]:
            table = table[table["fragment"] <= last[owner[table["fragment"]]]]
            table["fragment"] = owner[table["fragment"]]
            if "initial_speed" in (table.dtype.names or ()):
                table["initial_speed"] = launch_speed[table["fragment"]]
            return table

        joined = np.add.reduceat(run.extremes, starts)
        joined[:, 2] = np.minimum.reduceat(run.extremes[:, 2], starts)
        joined[:, 3] = np.maximum.reduceat(run.extremes[:, 3], starts)
        return replace(
            run, landing=rows, extremes=joined,
            **{name: of_fragments(getattr(run, name)) for name in ("hits", "struck", "ricochet_hits", "ricochets")},
        )  # fmt: skip

    def _last(self, landing: NDArray[Any]) -> NDArray[np.int64]:
        """Last leg of each fragment (n,): one that ended otherwise than by its clock."""
        number = np.arange(len(landing))
        stopped = (landing["status"] != Status.TIME_OUT) | np.isinf(self.clock[:, 1])
        return np.asarray(np.minimum.reduceat(np.where(stopped, number, len(landing)), self.first[:-1]))

    def last(self, landing: NDArray[Any]) -> NDArray[np.int64]:
        """The leg after the last contact of each fragment whose flight (`landing`) has not ended before."""
        begin = self.first[1:] - 1
        return begin[landing["time"] >= self.clock[begin, 0]]

    def flown(self, landing: NDArray[Any]) -> NDArray[np.int64]:
        """Legs that were flown: none after its fragment's last."""
        number = np.arange(len(landing))
        return number[number <= self._last(landing)[self.owner]]

    def join_paths(self, chosen: NDArray[np.int64], paths: Trajectories) -> Trajectories:
        """Paths of the chosen fragments from those of all their legs."""
        counts = np.diff(self.first)[chosen]
        starts = paths.start[np.concatenate([[0], np.cumsum(counts)])]
        return Trajectories(chosen, starts, paths.time, paths.position, paths.velocity)


def legs_between(fragments: Fragments, contacts: NDArray[Any]) -> Legs:
    """Legs of fragments between their contacts (`flight.integrate.contact.CONTACTS`)."""
    number = len(fragments)
    who = np.concatenate([np.arange(number), contacts["first"], contacts["second"]])
    time = np.concatenate([np.zeros(number), contacts["time"], contacts["time"]])
    position = np.concatenate([fragments.position, contacts["first_position"], contacts["second_position"]])
    velocity = np.concatenate([fragments.velocity, contacts["first_after"], contacts["second_after"]])
    order = np.lexsort((np.arange(len(who)), time, who))
    who, time = who[order], time[order]
    same = np.append(who[1:] == who[:-1], False)
    end = np.where(same, np.append(time[1:], 0.0), np.inf)
    lasting = end > time  # two contacts at one moment leave nothing to fly between them
    order, who = order[lasting], who[lasting]
    flown = replace(fragments.select(who), position=position[order], velocity=velocity[order])
    first = np.searchsorted(who, np.arange(number + 1))
    return Legs(
        fragments,
        flown,
        np.stack([time[lasting], end[lasting]], axis=1),
        first.astype(np.int64),
    )
