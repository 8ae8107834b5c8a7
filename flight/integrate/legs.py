"""Flights in legs: from launch to the first impact, from one impact to the next, and from the last one to the end.

Every leg is flown by the same kernel, with the same witnesses and the same errors as a flight without impacts; a
fragment that is never struck has one leg and flies as if contact were off, to the last bit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.rows import Status, Trajectories

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from flight.rows import Flown


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
