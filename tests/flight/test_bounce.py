"""Bounce, roll and rest against closed forms."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from flight import (
    Bounce,
    Cylinder,
    Domain,
    Fragments,
    HeightMap,
    InputError,
    Status,
    Wall,
    fly,
)
from flight.errors import CoarseMapWarning
from flight.scene.bounce import SURFACES
from tests.flight.clouds import GRAVITY, cloud


def incline(angle: float, reach: float = 2000.0, cells: int = 41) -> HeightMap:
    """Ground that rises along +x at an angle (degrees)."""
    x = np.linspace(-reach, reach, cells)
    return HeightMap(np.tile(math.tan(math.radians(angle)) * x, (cells, 1)), 2 * reach / (cells - 1), (-reach, -reach))


def drop(height: float = 5.0, **options) -> Fragments:
    return Fragments.from_arrays(0.01, (0.0, 0.0, height), options.get("velocity", (0.0, 0.0, 0.0)))


def test_vertical_drop_is_a_geometric_series() -> None:
    """Heights fall by e^2 each time; from the first impact on it lasts 2 v e / g (1 + e + e^2 + ...)."""
    share, height = 0.7, 5.0
    result = fly(drop(height), air="vacuum", bounce=Bounce(share, 1.0, 0.5, rest_speed=0.01), sample=[0])
    row = result.landing[0]
    fall = math.sqrt(2.0 * height / GRAVITY)
    speed = GRAVITY * fall
    bounces = math.floor(math.log(0.01 / speed) / math.log(share))
    assert row["bounces"] == bounces
    assert (row["status"], row["rest_status"]) == (Status.LANDED, Status.LANDED)
    assert (row["time"], row["speed"]) == (pytest.approx(fall), pytest.approx(speed))
    assert row["rest_time"] == pytest.approx(fall + 2.0 * fall * share * (1 - share**bounces) / (1 - share), rel=1e-6)
    assert row["rest_position"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    paths = result.trajectories
    turns = np.flatnonzero(np.diff(paths.velocity[:, 2]) > 0.5)
    for number, (first, last) in enumerate(pairwise(turns[:5]), start=1):
        tops = paths.position[first : last + 1, 2].max()
        assert tops <= height * share ** (2 * number) * (1 + 1e-6)
    assert (np.diff(paths.time) >= 0.0).all()
    assert paths.time[-1] == pytest.approx(row["rest_time"])


def test_oblique_bounces_then_slide() -> None:
    """Along the ground each impact leaves a share; what is left slides v^2 / (2 mu g) in v / (mu g)."""
    normal, tangential, friction = 0.5, 0.8, 0.4
    u, w = 30.0, 20.0
    shot = Fragments.from_arrays(0.01, (0.0, 0.0, 0.0), (u * 0.6, u * 0.8, w))
    row = fly(shot, air="vacuum", bounce=Bounce(normal, tangential, friction, rest_speed=0.05)).landing[0]
    way = time = 0.0
    while w > 0.05:
        way, time = way + u * 2.0 * w / GRAVITY, time + 2.0 * w / GRAVITY
        if time == 2.0 * w / GRAVITY:
            assert (row["distance"], row["time"]) == (pytest.approx(way), pytest.approx(time))
        u, w = tangential * u, normal * w
    way, time = way + u * u / (2.0 * friction * GRAVITY), time + u / (friction * GRAVITY)
    assert row["rest_position"] == pytest.approx([0.6 * way, 0.8 * way, 0.0], rel=1e-6)
    assert row["rest_time"] == pytest.approx(time, rel=1e-6)
    for origin in ((0.0, 0.0), (10.0, -20.0)):
        ground = Bounce(normal, tangential, friction, rest_speed=0.05)
        found = fly(shot, air="vacuum", bounce=ground, origin=origin).summary["max_rest_distance"]
        assert found == pytest.approx(math.hypot(0.6 * way - origin[0], 0.8 * way - origin[1]), rel=1e-6)


def test_sliding_distance_without_a_bounce() -> None:
    shot = Fragments.from_arrays(0.01, (0.0, 0.0, 1e-3), (40.0, 0.0, 0.0))
    row = fly(shot, air="vacuum", bounce=Bounce(0.0, 1.0, 0.3)).landing[0]
    assert row["bounces"] == 0
    way = row["rest_position"][0] - row["position"][0]
    assert way == pytest.approx(40.0**2 / (2.0 * 0.3 * GRAVITY), rel=1e-9)


@pytest.mark.parametrize("slope", [10.0, -10.0])
@pytest.mark.parametrize("cells", [2, 401])
def test_slide_on_an_incline(slope: float, cells: int) -> None:
    """Uphill and downhill: v^2 / (2 g (mu cos a + sin a)) along the slope, whatever the cells."""
    friction, speed = 0.5, 20.0
    angle = math.radians(slope)
    along = np.array([math.cos(angle), 0.0, math.sin(angle)])
    shot = Fragments.from_arrays(0.01, (0.0, 3.0, 0.0), speed * along)
    ground = incline(slope, reach=600.0, cells=cells)
    row = fly(shot, air="vacuum", ground=ground, bounce=Bounce(0.0, 1.0, friction)).landing[0]
    slowing = GRAVITY * (friction * math.cos(angle) + math.sin(angle))
    way = np.linalg.norm(row["rest_position"] - row["position"])
    touch = row["velocity"] @ along
    assert way == pytest.approx(touch**2 / (2.0 * slowing), rel=1e-8)
    assert row["rest_time"] - row["time"] == pytest.approx(touch / slowing, rel=1e-8)
    assert row["rest_position"][1] == pytest.approx(3.0)


def test_slide_across_an_incline_turns_downhill() -> None:
    """Against the same equation by an independent integrator."""
    from scipy.integrate import solve_ivp

    angle, friction, speed = math.radians(15.0), 0.4, 12.0
    shot = Fragments.from_arrays(0.01, (0.0, 0.0, 1e-7), (0.0, speed, 0.0))
    ground = incline(15.0, reach=500.0, cells=2001)
    row = fly(shot, air="vacuum", ground=ground, bounce=Bounce(0.0, 1.0, friction)).landing[0]

    def slowed(_, state: np.ndarray) -> list[float]:
        size = math.hypot(*state[2:]) + 1e-12
        hold = friction * GRAVITY * math.cos(angle) / size
        return [*state[2:], -GRAVITY * math.sin(angle) - hold * state[2], -hold * state[3]]

    stop = lambda _, state: math.hypot(*state[2:]) - 1e-3  # noqa: E731
    stop.terminal = True
    end = solve_ivp(slowed, (0.0, 60.0), [0.0, 0.0, 0.0, speed], events=stop, rtol=1e-9, atol=1e-9).y[:, -1]
    assert row["rest_position"][0] / math.cos(angle) == pytest.approx(end[0], rel=0.02)
    assert row["rest_position"][1] == pytest.approx(end[1], rel=0.02)


@pytest.mark.filterwarnings("ignore::flight.errors.CoarseMapWarning")  # cells of 20 m hold this ground exactly
def test_the_shorter_side_of_cells_bounds_the_parts_of_a_slide() -> None:
    """Over z = c x y, which cells of any shape hold exactly: oblong ones do as well as square ones of that side."""
    twist, start, speed = 0.02, (-11.3, -9.1), (9.0, 7.0)
    rise = twist * (start[1] * speed[0] + start[0] * speed[1])
    shot = Fragments.from_arrays(0.01, (*start, twist * start[0] * start[1] + 1e-6), (*speed, rise))
    rest = []
    for steps in ((2.0, 2.0), (2.0, 20.0), (20.0, 2.0)):
        x, y = (np.linspace(-80.0, 80.0, round(160.0 / step) + 1) for step in steps)
        ground = HeightMap(twist * np.outer(y, x), steps, (-80.0, -80.0))
        row = fly(shot, air="vacuum", ground=ground, bounce=Bounce(0.0, 1.0, 0.25)).landing[0]
        assert row["rest_status"] == Status.LANDED
        rest.append(row["rest_position"])
    for other in rest[1:]:
        assert other == pytest.approx(rest[0], abs=0.1)
    assert math.dist(rest[0][:2], start) > 20.0


def test_steeper_than_friction_slides_off_the_map() -> None:
    ground = incline(30.0, reach=200.0)
    row = fly(drop(1.0), air="vacuum", ground=ground, bounce=Bounce(0.0, 0.0, 0.3)).landing[0]
    assert (row["status"], row["rest_status"]) == (Status.LANDED, Status.LEFT_DOMAIN)
    assert row["rest_position"][0] == pytest.approx(-200.0)
    angle = math.radians(30.0)
    a = GRAVITY * (math.sin(angle) - 0.3 * math.cos(angle))
    assert row["rest_time"] - row["time"] == pytest.approx(math.sqrt(2.0 * 200.0 / math.cos(angle) / a), rel=1e-6)
    held = fly(drop(1.0), air="vacuum", ground=ground, bounce=Bounce(0.0, 0.0, 0.6)).landing[0]
    assert held["rest_position"] == pytest.approx(held["position"])


def test_bounce_on_an_incline_by_its_normal() -> None:
    """Dropped on 45 degrees and turned off without loss it leaves level."""
    row = fly(drop(10.0), air="vacuum", ground=incline(-45.0), bounce=Bounce(1.0, 1.0, 0.5), sample=[0], time_limit=3.0)
    paths = row.trajectories
    first = np.flatnonzero(np.isclose(paths.time, math.sqrt(20.0 / GRAVITY)) & (paths.velocity[:, 0] > 1.0))[0]
    speed = math.sqrt(2.0 * GRAVITY * 10.0)
    assert paths.velocity[first] == pytest.approx([speed, 0.0, 0.0], abs=1e-6)
    assert row.landing["rest_status"][0] in (Status.TIME_OUT, Status.LANDED)
    assert row.landing["rest_time"][0] <= 3.0


def test_default_rests_where_it_lands() -> None:
    landing = fly(cloud(500)).landing
    assert np.array_equal(landing["rest_position"], landing["position"])
    assert np.array_equal(landing["rest_time"], landing["time"])
    assert np.array_equal(landing["rest_status"], landing["status"])
    assert not landing["bounces"].any()


@pytest.mark.parametrize("name", SURFACES)
def test_first_impact_does_not_depend_on_the_bounce(name: str) -> None:
    fragments = cloud(3000)
    ring = [Cylinder(20.0, name="ring")]
    dead, alive = fly(fragments, witnesses=ring), fly(fragments, witnesses=ring, bounce=name)
    for field in ("status", "time", "position", "velocity", "energy", "distance", "angle"):
        assert np.array_equal(dead.landing[field], alive.landing[field]), field
    assert (alive.landing["rest_time"] > alive.landing["time"]).mean() > 0.9
    assert len(alive.hits) >= len(dead.hits)
    assert SURFACES[name].source


def test_slide_ends_at_walls_edges_and_the_time_limit() -> None:
    shots = Fragments.from_arrays(0.01, (0.0, 0.0, 1e-6), [[30.0, 0, 0], [0, 30.0, 0], [-30.0, 0, 0], [0, -3.0, 0]])
    result = fly(
        shots, air="vacuum", bounce=Bounce(0.0, 1.0, 0.2), obstacles=[Wall((50.0, -5.0), (50.0, 5.0), 2.0, 1.0)],
        domain=Domain(radius=110.0), time_limit=4.0,
    )  # fmt: skip
    rows = result.landing
    ends = [Status.STOPPED, Status.TIME_OUT, Status.TIME_OUT, Status.LANDED]
    assert rows["rest_status"].tolist() == ends
    assert (rows["status"] == Status.LANDED).all()
    a = 0.2 * GRAVITY
    assert rows["rest_position"][0, 0] == pytest.approx(49.5, abs=1e-6)
    assert rows["rest_time"][0] == pytest.approx((30.0 - math.sqrt(900.0 - 2 * a * 49.5)) / a, rel=1e-3)
    assert rows["rest_position"][1, 1] == pytest.approx(30.0 * 4.0 - 0.5 * a * 16.0, rel=1e-3)
    assert rows["obstacle"].tolist() == [0, -1, -1, -1]
    assert result.obstacle_hits["speed"] == pytest.approx(math.sqrt(900.0 - 2 * a * 49.5), rel=1e-3)
    longer = fly(shots, air="vacuum", bounce=Bounce(0.0, 1.0, 0.2), domain=Domain(radius=110.0)).landing
    left = [Status.LEFT_DOMAIN] * 3 + [Status.LANDED]
    assert longer["rest_status"].tolist() == left
    assert longer["rest_position"][1, 1] == pytest.approx(110.0)


@pytest.mark.parametrize("radius", [45.0, 60.0])
def test_a_slide_ends_at_the_wall_or_at_the_edge_that_comes_first(radius: float) -> None:
    """A wall whose near face stands 49.5 m away, and a domain that ends before or behind it."""
    shot = Fragments.from_arrays(0.01, (0.0, 0.0, 1e-6), (30.0, 0.0, 0.0))
    wall = Wall((50.0, -5.0), (50.0, 5.0), 2.0, 1.0)
    ground = Bounce(0.0, 1.0, 0.2)
    row = fly(shot, air="vacuum", bounce=ground, obstacles=[wall], domain=Domain(radius=radius)).landing[0]
    assert row["rest_status"] == (Status.LEFT_DOMAIN if radius < 49.5 else Status.STOPPED)
    assert row["rest_position"][0] == pytest.approx(min(radius, 49.5), abs=1e-6)
    assert row["obstacle"] == (-1 if radius < 49.5 else 0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Bounce(1.2, 0.5, 0.5), "normal restitution is 1.2, allowed: 0 to 1"),
        (lambda: Bounce(0.5, -0.5, 0.5), "tangential restitution is -0.5"),
        (lambda: Bounce(0.5, 0.5, math.nan), "friction is nan"),
        (lambda: Bounce(0.5, 0.5, 0.5, rest_speed=0.0), "rest speed is 0.0 m/s, needed: above zero"),
        (lambda: fly(drop(), bounce="sandd"), "bounce: unknown surface 'sandd'; did you mean 'sand'"),
        (lambda: fly(drop(), bounce="sand", gravity=0.0), "without weight nothing comes to rest"),
        (lambda: fly(drop(), bounce="sand", ground=None), "there is no ground to bounce on"),
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_slide_to_and_fro_in_a_valley() -> None:
    """Between two slopes steeper than friction each way is shorter by one factor, and it rests at the bottom.

    The bottom turns the velocity by twice the slope's angle; its push rubs off all but exp(-friction angle) of it.
    """
    angle, friction = math.radians(40.0), 0.3
    x = np.linspace(-200.0, 200.0, 41)  # a node at the bottom
    ground = HeightMap(np.tile(math.tan(angle) * np.abs(x), (2, 1)), (10.0, 400.0), (-200.0, -200.0))
    start = Fragments.from_arrays(0.01, (33.0, 0.0, 33.0 * math.tan(angle) + 1e-6), (0.0, 0.0, 0.0))
    with pytest.warns(CoarseMapWarning, match="1 of 1 fragments came to rest where the ground turns by more than 20"):
        row = fly(start, air="vacuum", ground=ground, bounce=Bounce(0.0, 1.0, friction)).landing[0]
    down = GRAVITY * (math.sin(angle) - friction * math.cos(angle))
    up = GRAVITY * (math.sin(angle) + friction * math.cos(angle))
    way, time = 33.0 / math.cos(angle), 0.0
    while way > 1e-9:
        speed = math.sqrt(2.0 * down * way)
        turned = speed * math.exp(-friction * 2.0 * angle)
        time, way = time + speed / down + turned / up, 0.5 * turned**2 / up
    assert row["rest_status"] == Status.LANDED
    assert row["rest_position"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-5)
    assert row["rest_time"] - row["time"] == pytest.approx(time, rel=1e-3)
