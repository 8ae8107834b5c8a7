"""Slides on curved ground against closed forms, an independent integrator, and finer maps."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from flight import Bounce, Fragments, HeightMap, Status, fly
from flight.errors import CoarseMapWarning
from flight.kernels.rebound import MEMORY
from tests.flight.clouds import GRAVITY


def parabola(height: float, reach: float, step: float, centre: tuple[float, float], turn: float) -> HeightMap:
    """Ground at l^2 / (2 height), l along a direction `turn` (rad) from +x; one cell has its centre at a position."""
    x, y = (
        place + (np.arange(math.floor((-reach - place) / step), math.ceil((reach - place) / step)) + 0.5) * step
        for place in centre
    )
    along = np.add.outer(y * math.sin(turn), x * math.cos(turn))
    return HeightMap(along**2 / (2.0 * height), step, (x[0], y[0]))


def slid(ground: HeightMap, start: tuple[float, float], speed: tuple[float, float], friction: float) -> np.ndarray:
    """Where a fragment rests that slides from a position on the map, with a level velocity turned into its surface.

    A millimetre a second into the ground keeps rounding from lifting it off.
    """
    x, y = start
    z = float(ground.at(x, y))
    slope = np.array([float(ground.at(x + 1e-6, y)) - z, float(ground.at(x, y + 1e-6)) - z]) / 1e-6
    into = np.array([*slope, -1.0]) / math.sqrt(1.0 + slope @ slope)
    shot = Fragments.from_arrays(0.01, (x, y, z + 1e-9), np.array([*speed, slope @ speed]) + 1e-3 * into)
    row = fly(shot, air="vacuum", ground=ground, bounce=Bounce(0.0, 1.0, friction)).landing[0]
    assert row["status"] == row["rest_status"] == Status.LANDED
    return row["rest_position"]


def rest_on_parabola(height: float, friction: float, start: float, speed: float) -> float:
    """Where a slide along z = l^2 / (2 height) ends.

    With s = l / height the normal force a mass is cos(a) (g + u^2 / height), u the level speed, so that the squared
    speed w goes by dw/ds = -2 g height (s + mu) - 2 mu w / (1 + s^2), and (w + g height (1 + s^2)) exp(2 mu atan s)
    stays as it is.
    """

    def kept(w: float, s: float) -> float:
        return (w + GRAVITY * height * (1.0 + s * s)) * math.exp(2.0 * friction * math.atan(s))

    first = start / height
    before = kept(speed**2 * (1.0 + first**2), first)
    places = np.linspace(start, start + 60.0, 6001)[1:]
    end = next(k for k, place in enumerate(places) if before < kept(0.0, place / height))
    return float(brentq(lambda place: before - kept(0.0, place / height), places[end] - 0.02, places[end]))


@pytest.mark.parametrize("turn", [0.0, 0.5])
@pytest.mark.parametrize(
    ("height", "friction", "start", "speed"),
    [(20.0, 0.4, -16.0, 0.0), (-60.0, 0.5, -10.0, 12.0)],
    ids=["valley", "crest"],
)
def test_a_slide_over_a_parabola_ends_where_its_energy_does(height, friction, start, speed, turn) -> None:
    """The error falls as the square of the map's cells, by the mean square over starts, each at a cell's centre."""
    along, across = math.cos(turn), math.sin(turn)
    steps, errors = (4.0, 2.0, 1.0, 0.5), []
    for step in steps:
        found = []
        for back in (0.0, 0.4, 0.9, 1.7):
            place = (start - back) * along, (start - back) * across
            rest = slid(parabola(height, 24.0, step, place, turn), place, (speed * along, speed * across), friction)
            expected = rest_on_parabola(height, friction, start - back, speed)
            assert expected - start > 10.0
            found.append(math.hypot(rest[0] * along + rest[1] * across - expected, rest[1] * along - rest[0] * across))
        errors.append(math.sqrt(np.mean(np.square(found))))
    rate = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert rate > 1.6, (rate, errors)
    assert errors[-1] < 0.02, errors


def test_a_slide_round_a_bowl_follows_the_equation_of_a_point_on_its_surface() -> None:
    """Sideways in z = r^2 / 40: the normal force is cos(a) (g + u.H.u), and it turns the path as well."""
    height, friction, start, level = 20.0, 0.3, (-14.0, 2.0), (4.0, 9.0)

    def slope(_, state: np.ndarray) -> list[float]:
        x, y, u, v = state
        p, q = x / height, y / height
        cosine = 1.0 / math.sqrt(1.0 + p * p + q * q)
        speed = math.sqrt(u * u + v * v + (p * u + q * v) ** 2) + 1e-12
        normal = cosine * (GRAVITY + (u * u + v * v) / height)
        hold = friction * normal / speed
        return [u, v, -normal * cosine * p - hold * u, -normal * cosine * q - hold * v]

    def still(_, state: np.ndarray) -> float:
        return math.hypot(*state[2:]) - 1e-3

    still.terminal = True
    path = solve_ivp(slope, (0.0, 60.0), [*start, *level], events=still, rtol=1e-10, atol=1e-10)
    expected, errors, steps = path.y[:2, -1], [], (4.0, 2.0, 1.0, 0.5)
    for step in steps:
        x, y = (place + (np.arange(-round(40.0 / step), round(40.0 / step)) + 0.5) * step for place in start)
        ground = HeightMap(np.add.outer(y**2, x**2) / (2.0 * height), step, (x[0], y[0]))
        errors.append(math.dist(slid(ground, start, level, friction)[:2], expected))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 0.9, errors
    assert errors[-1] < 0.1, errors


@pytest.mark.parametrize("speed", [10.0, 40.0])
def test_a_crest_gives_back_no_more_than_the_friction_of_the_cells_before(speed) -> None:
    """Up and down a roof. Its ridge would lift a fast fragment off; held to the ground, it slides on without friction.

    Friction that a crest may give back fades with exp(-way / 4 cells): over a long way up to g mu cos(a) 4 cells.
    """
    angle, friction, cell, up = math.radians(15.0), 0.6, 2.0, 5.0
    x = np.arange(-400.0, 401.0, cell)
    ground = HeightMap(np.tile(-math.tan(angle) * np.abs(x), (2, 1)), (cell, 10.0), (-400.0, -5.0))
    level = -up * math.cos(angle)
    rest = slid(ground, (level, 0.0), (speed * math.cos(angle), 0.0), friction)
    hold = friction * GRAVITY * math.cos(angle)
    top = speed**2 - 2.0 * (GRAVITY * math.sin(angle) + hold) * up
    fades = math.exp(-up / (MEMORY * cell))
    given = 2.0 * hold * (MEMORY * cell * (1.0 - fades) + 0.5 * cell * fades)  # half a cell counts as slid before
    after = min(top * math.exp(4.0 * friction * angle), top + given)
    assert (after < top + given) == (speed == 10.0)
    way = after / (2.0 * (hold - GRAVITY * math.sin(angle)))
    assert rest[0] == pytest.approx(way * math.cos(angle), rel=1e-5)


def test_a_map_too_coarse_for_its_ground_is_warned_of() -> None:
    """On a parabola of 20 m, cells of 20 m turn by 45 degrees from one to the next, those of 2 m by 6 at most."""
    with pytest.warns(CoarseMapWarning, match=r"map: 1 of 1 .* more than 20 degrees from one cell of 20 by 20 m"):
        slid(parabola(20.0, 60.0, 20.0, (3.0, 0.0), 0.0), (-16.0, 0.0), (0.0, 0.0), 0.4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        slid(parabola(20.0, 24.0, 2.0, (3.0, 0.0), 0.0), (-16.0, 0.0), (0.0, 0.0), 0.4)


def test_turns_of_a_map_are_the_angles_between_its_cells() -> None:
    """A ditch along y: 0, 30, -30 and 0 degrees of slope; beside it cells turn by nothing."""
    rise = math.tan(math.radians(30.0))
    ground = HeightMap(np.tile(np.array([0.0, 0.0, rise, 0.0, 0.0, 0.0, 0.0]), (3, 1)), 1.0)
    found = np.degrees(ground.turns_at(np.arange(6) + 0.5, np.full(6, 1.2)))
    assert found == pytest.approx([30.0, 60.0, 60.0, 30.0, 0.0, 0.0])
    across = HeightMap(ground.heights.T, 1.0)
    assert np.degrees(across.turns_at(np.full(6, 0.2), np.arange(6) + 0.5)) == pytest.approx(found)
