"""The edge of a map of heights: how large the map must be, and what is not known beyond it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.surroundings import bearing_of, direction_words, ground_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from flight.hazard.density.distance import ExpectedDistance
    from fragfield.case import Case

    Array = NDArray[np.float64]

__all__ = ["beyond_map_words", "farthest_throw", "map_warnings"]

_FASTER = 1.25  # than Gurney's speed: the fastest pieces of a wall, and those of a focus
_ONE_IN = 100.0  # events, in one of which a piece as heavy as the heaviest is expected
_ELEVATIONS = np.radians(np.arange(10.0, 51.0, 5.0))
_STEPS, _LONGEST = 600, 120.0  # of a path, and its time (s)


def map_warnings(case: Case, described: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """A map that ends before the farthest throw, and the size it must have.

    Parameters
    ----------
    case : Case
        Resolved.
    described : sequence of mapping
        `rounds` of `fragfield.checking.check.check_report`.
    """
    ground, throw = ground_of(case), farthest_throw(case, described)
    if isinstance(ground, float) or throw is None:
        return
    azimuth = np.arange(0.0, 360.0, 1.0)
    reach = ground.reach(case.flight.origin, azimuth)
    nearest = int(np.argmin(reach))
    needed = 50.0 * math.ceil(throw / 50.0)
    if reach[nearest] < throw:
        (x, y), turn = case.flight.origin, float(azimuth[nearest])
        yield (
            f"flight.ground.map ends {reach[nearest]:.0f} m from the rounds "
            f"({direction_words(turn, bearing_of(case, turn), whole=True)}), and fragments may fly up to about "
            f"{throw:.0f} m: beyond its edge the ground is taken as level, and a distance that reaches there is not "
            f"determined. A map that holds all reaches from {x - needed:.0f} to {x + needed:.0f} m along x and from "
            f"{y - needed:.0f} to {y + needed:.0f} m along y"
        )


def beyond_map_words(case: Case, expected: ExpectedDistance) -> str:
    """Why a distance is not determined that reaches beyond the map, where the ground is not known; else empty.

    Parameters
    ----------
    case : Case
        Resolved.
    expected : ExpectedDistance
        Of its flights.
    """
    ground = ground_of(case)
    if isinstance(ground, float):
        return ""
    reach = ground.reach(case.flight.origin, expected.azimuth)
    if expected.direction is None:  # one distance for every direction
        reach = ground.reach(case.flight.origin, np.arange(360.0)).min(keepdims=True)
    distance = np.fmax(expected.by_direction, expected.upper_by_direction)
    farthest = int(np.argmax(distance - reach))
    if not distance[farthest] > reach[farthest]:
        return ""
    turn = float(expected.azimuth[farthest])
    where = "" if expected.direction is None else f", {direction_words(turn, bearing_of(case, turn), whole=True)}"
    return (
        f"over level ground beyond the map of heights it would be {distance[farthest]:.0f} m{where}, and the map ends "
        f"{reach[farthest]:.0f} m from the rounds; take a larger map"
    )


def farthest_throw(case: Case, described: Sequence[Mapping[str, Any]]) -> float | None:
    """Distance (m) that the heaviest and fastest fragment to be expected may fly; None without masses to go by.

    Of every wall the piece of which one is expected in a hundred events by Mott's distribution, N(> m) = N0
    exp(-sqrt(2 m / mean)), at most the wall itself, launched at `_FASTER` times Gurney's speed at the best elevation,
    over level ground in the air, and with the drag, of the flight.
    """
    from fragfield.case.checks.fragment_numbers import expected_means
    from fragfield.case.conversion.burst import burst_round
    from fragfield.case.conversion.placing import first_alike
    from fragfield.case.conversion.stages import break_up_settings

    settings, pieces = break_up_settings(case), []
    for index in set(first_alike(case)):
        speeds = {one["name"]: one["gurney_speed"] for one in described[index].get("segments", [])}
        for one in expected_means(burst_round(case.round[index], f"round[{index + 1}]"), settings):
            number = len(case.round) * _ONE_IN * one.mass / one.mean
            heaviest = min(0.5 * one.mean * math.log(number) ** 2, one.mass)
            if speeds.get(one.name):
                pieces.append((heaviest, _FASTER * speeds[one.name]))
    if not pieces:
        return None
    mass, speed = np.array(pieces).T
    return float(_range(case, mass, speed).max())


def _range(case: Case, mass: Array, speed: Array) -> Array:
    """Largest horizontal ranges (n,) of fragments (kg, m/s) over `_ELEVATIONS`, by Heun's steps, back to launch height.

    Steps grow with the time flown, as the path straightens.
    """
    from fragfield.case.conversion.stages import flight_arguments

    flight = flight_arguments(case)
    drag, air, gravity = flight["drag"], flight["air"], flight["gravity"]
    area = (mass / case.flight.shape_factor) ** (2.0 / 3.0)
    number, turn = len(_ELEVATIONS), np.tile(_ELEVATIONS, len(mass))
    loading, launched = np.repeat(0.5 * area / mass, number), np.repeat(speed, number)
    state = np.zeros((4, len(turn)))  # x, z and their speeds
    state[2], state[3] = launched * np.cos(turn), launched * np.sin(turn)
    times = _LONGEST * np.linspace(0.0, 1.0, _STEPS + 1) ** 3

    mach = np.linspace(0.0, 10.0, 2001)
    table = drag.at(mach)

    def rate(now: Array) -> Array:
        total = np.hypot(now[2], now[3])
        height = np.maximum(now[1], 0.0)
        slowing = loading * air.density(height) * np.interp(total / air.sound_speed(height), mach, table) * total
        return np.stack([now[2], now[3], -slowing * now[2], -slowing * now[3] - gravity])

    flying, reached = np.ones(len(turn), dtype=bool), np.zeros(len(turn))
    for step in np.diff(times):
        first = rate(state)
        state = state + 0.5 * step * (first + rate(state + step * first))
        down = flying & (state[1] < 0.0)
        reached[down] = state[0][down]
        flying &= ~down
        if not flying.any():
            break
    reached[flying] = state[0][flying]
    return np.asarray(reached.reshape(-1, number).max(axis=1))
