"""Contours of revolution: straight pieces and circular arcs over the station, with exact volumes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray


# A flatter arc is a straight line to 1e-4 of its chord, and its closed form would lose digits.
LARGEST_RADIUS_OVER_CHORD = 1e4


@dataclass(frozen=True)
class Contour:
    """A radius over the station: pieces between consecutive points, each a straight line or a circular arc.

    Parameters
    ----------
    stations : axial stations of the points, from the nose end, strictly increasing (m), shape (n,).
    radii : radii at the points, not negative (m), shape (n,).
    arcs : optional, signed arc radius of each piece (m), shape (n - 1,): 0 for a straight line, positive where the arc
        bulges away from the axis, negative where it bulges towards the axis. Always the shorter arc of the circle.
    name : what the contour is, for messages (file and key).

    Raises
    ------
    InputError
        Fewer than two points, stations that do not increase, negative radii, an arc that is too small for
        its chord, turns back along the axis, reaches over the axis, or is flatter than 1e4 chords.
    """

    stations: tuple[float, ...]
    radii: tuple[float, ...]
    arcs: tuple[float, ...] = ()
    name: str = "contour"

    def __post_init__(self) -> None:
        stations = tuple(float(value) for value in self.stations)
        radii = tuple(float(value) for value in self.radii)
        arcs = tuple(float(value) for value in self.arcs) or (0.0,) * (len(stations) - 1)
        object.__setattr__(self, "stations", stations)
        object.__setattr__(self, "radii", radii)
        object.__setattr__(self, "arcs", arcs)
        if len(stations) < 2:
            raise InputError(f"{self.name}: found {len(stations)} point(s), at least two are needed")
        if len(radii) != len(stations) or len(arcs) != len(stations) - 1:
            raise InputError(
                f"{self.name}: {len(stations)} stations, {len(radii)} radii and {len(arcs)} arcs; "
                "as many radii as stations and one arc fewer are needed"
            )
        for before, after in pairwise(stations):
            if not after > before:
                raise InputError(
                    f"{self.name}: stations must increase from nose to base, found {_mm(before)} followed "
                    f"by {_mm(after)} (a step in radius needs a short cone)"
                )
        for station, radius in zip(stations, radii, strict=True):
            if not radius >= 0.0:
                raise InputError(f"{self.name}: radius {_mm(radius)} at station {_mm(station)}; it may not be negative")
        for index in range(len(arcs)):
            self._check_arc(index)

    def _check_arc(self, index: int) -> None:
        arc = self.arcs[index]
        if arc == 0.0:
            return
        start, end = self.stations[index], self.stations[index + 1]
        chord = float(np.hypot(end - start, self.radii[index + 1] - self.radii[index]))
        place = f"{self.name}: arc radius {_mm(arc)} between stations {_mm(start)} and {_mm(end)}"
        if abs(arc) < 0.5 * chord * (1.0 - 1e-12):
            raise InputError(
                f"{place} is too small for its chord of {_mm(chord)}; at least {_mm(0.5 * chord)} is needed"
            )
        if abs(arc) > LARGEST_RADIUS_OVER_CHORD * chord:
            raise InputError(f"{place} is flatter than {LARGEST_RADIUS_OVER_CHORD:g} chords; use 0 for a straight line")
        centre, centre_radius = self._arc_centres[index]
        sign = np.sign(arc)
        ends = np.array([self.radii[index], self.radii[index + 1]])
        if np.any(sign * (ends - centre_radius) < -1e-9 * abs(arc)):
            smallest = chord**2 / (2.0 * (end - start))
            raise InputError(
                f"{place} turns back along the axis; a radius of at least {_mm(smallest)} "
                "keeps to one radius per station"
            )
        if arc < 0.0 and start < centre < end and centre_radius + arc < 0.0:
            raise InputError(f"{place} reaches over the axis")

    @cached_property
    def _arc_centres(self) -> NDArray[np.float64]:
        """Station and radius of each arc's centre, shape (n - 1, 2); not a number for straight lines."""
        centres = np.full((len(self.arcs), 2), np.nan)
        for index, arc in enumerate(self.arcs):
            if arc == 0.0:
                continue
            first = np.array([self.stations[index], self.radii[index]])
            last = np.array([self.stations[index + 1], self.radii[index + 1]])
            chord = float(np.linalg.norm(last - first))
            along = (last - first) / chord
            outward = np.array([-along[1], along[0]])
            height = np.sqrt(max(arc**2 - 0.25 * chord**2, 0.0))
            centres[index] = 0.5 * (first + last) - np.sign(arc) * height * outward
        return centres

    @property
    def start(self) -> float:
        """First station (m)."""
        return self.stations[0]

    @property
    def end(self) -> float:
        """Last station (m)."""
        return self.stations[-1]

    @property
    def length(self) -> float:
        """Axial length (m)."""
        return self.end - self.start

    @cached_property
    def max_radius(self) -> float:
        """Largest radius (m)."""
        tops = [self.stations[0], *self.stations[1:]]
        for index, arc in enumerate(self.arcs):
            centre = self._arc_centres[index, 0]
            if arc > 0.0 and self.stations[index] < centre < self.stations[index + 1]:
                tops.append(float(centre))
        return float(self.radius(np.array(tops)).max())

    def radius(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return the radius at stations.

        Parameters
        ----------
        station : stations (m), any shape; within `start` and `end`.

        Returns
        -------
        numpy.ndarray
            Radii (m), same shape.

        Raises
        ------
        InputError
            A station lies outside the contour.
        """
        place = np.asarray(station, dtype=np.float64)
        slack = 1e-12 + 1e-9 * self.length
        if place.size and (place.min() < self.start - slack or place.max() > self.end + slack):
            raise InputError(
                f"{self.name}: stations {_mm(float(place.min()))} to {_mm(float(place.max()))} asked for, "
                f"the contour runs from {_mm(self.start)} to {_mm(self.end)}"
            )
        points = np.asarray(self.stations)
        radii = np.asarray(self.radii)
        value = np.interp(place, points, radii)
        piece = np.clip(np.searchsorted(points, place, side="right") - 1, 0, len(self.arcs) - 1)
        arc = np.asarray(self.arcs)[piece]
        curved = arc != 0.0
        if curved.any():
            centre = self._arc_centres[piece]
            inside = np.clip(place, self.start, self.end) - centre[..., 0]
            height = np.sqrt(np.maximum(arc**2 - np.where(curved, inside, 0.0) ** 2, 0.0))
            value = np.where(curved, centre[..., 1] + np.sign(arc) * height, value)
        return np.maximum(value, 0.0)

    def volume(self, start: float | None = None, end: float | None = None) -> float:
        """Return the exact volume of revolution between two stations.

        A cone gives pi L (r0^2 + r0 r1 + r1^2) / 3; an arc with centre (sc, rc), signed radius R and u = s - sc

            V = pi [ (rc^2 + R^2) u - u^3/3 + sign(R) rc (u sqrt(R^2 - u^2) + R^2 asin(u/|R|)) ].

        Parameters
        ----------
        start, end : optional, stations (m); the whole contour by default. What lies outside the contour counts nothing.

        Returns
        -------
        float
            Volume (m3).
        """
        first = self.start if start is None else max(start, self.start)
        last = self.end if end is None else min(end, self.end)
        total = 0.0
        for index, arc in enumerate(self.arcs):
            low, high = max(first, self.stations[index]), min(last, self.stations[index + 1])
            if high > low:
                total += self._arc_volume(index, low, high) if arc != 0.0 else self._cone_volume(index, low, high)
        return total

    def _cone_volume(self, index: int, low: float, high: float) -> float:
        ends = self.stations[index : index + 2]
        first, last = (float(np.interp(value, ends, self.radii[index : index + 2])) for value in (low, high))
        return float(np.pi * (high - low) * (first**2 + first * last + last**2) / 3.0)

    def _arc_volume(self, index: int, low: float, high: float) -> float:
        arc = self.arcs[index]
        centre, centre_radius = self._arc_centres[index]
        square = arc**2

        def primitive(offset: float) -> float:
            height = np.sqrt(max(square - offset**2, 0.0))
            angle = np.arcsin(np.clip(offset / abs(arc), -1.0, 1.0))
            ring = np.sign(arc) * centre_radius * (offset * height + square * angle)
            return float((centre_radius**2 + square) * offset - offset**3 / 3.0 + ring)

        return float(np.pi * (primitive(high - centre) - primitive(low - centre)))

    @classmethod
    def from_points(
        cls, points: Sequence[Sequence[float]], arcs: Sequence[float] = (), name: str = "contour"
    ) -> Contour:
        """Return the contour through points (station, radius) (m)."""
        stations = tuple(float(point[0]) for point in points)
        return cls(stations, tuple(float(point[1]) for point in points), tuple(float(arc) for arc in arcs), name)


def _mm(value: float) -> str:
    return f"{value * 1e3:.6g} mm"
