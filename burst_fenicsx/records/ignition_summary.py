"""How each charge was initiated: by its own points, at once or delayed, by shock, or never."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.mechanics.detonation import ignition_times, place_ignition
from burst_fenicsx.meshing.placement import frame

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.mechanics.initiation import Source
    from burst_fenicsx.problem import Round

__all__ = ["Ignition", "ignitions"]


@dataclass(frozen=True)
class Ignition:
    """One of the places from which a charge burnt.

    Attributes
    ----------
    by : "point" or "delay", an ignition point of its own at time zero or later; "shock", the first cell initiated by
    one.
    time : s.
    place : where the charge lay at rest (m).
    station : of that place along the axis, from the nose end (m).
    """

    by: str
    time: float
    place: tuple[float, float, float]
    station: float

    def summary(self) -> dict[str, Any]:
        """Entry of summary.json."""
        return {"by": self.by, "time": self.time, "place": list(self.place), "station": self.station}


def ignitions(item: Round, length: float, shock: Source | None, end: float) -> list[Ignition]:
    """What initiated a round by the end of the burst, in order of time; empty where nothing did.

    A point that a front reaches before its delay is over initiates nothing and is left out.

    Parameters
    ----------
    item : the round. length : of it (m).
    shock : the first cell that a shock initiated, None where none did.
    end : of the burst (s).
    """
    places, times = place_ignition(item, length)
    kinds = ["delay" if time > 0.0 else "point" for time in times]
    if shock is not None:
        places, times = np.vstack([places, shock.place]), np.append(times, shock.time)
        kinds.append("shock")
    reached = ignition_times(places, places, times, item.explosive.detonation_velocity)
    axis, base = frame(item.axis)[2], np.asarray(item.position, dtype=float)
    found = [
        Ignition(kind, float(time), _point(place), float(length - (place - base) @ axis))
        for kind, time, place, first in zip(kinds, times, places, reached, strict=True)
        if time <= min(first, end)
    ]
    return sorted(found, key=lambda one: one.time)


def _point(place: Sequence[float] | np.ndarray) -> tuple[float, float, float]:
    return float(place[0]), float(place[1]), float(place[2])
