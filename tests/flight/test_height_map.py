"""Ground as a map of heights: exact landing, no cell passed over, edges."""

from __future__ import annotations

import numpy as np
import pytest

from flight import Adaptive, FixedStep, Fragments, HeightMap, InputError, StandardAtmosphere, Status, fly
from tests.flight.clouds import GRAVITY, cloud


def plane_map(
    slope_x: float, slope_y: float, reach: float = 60_000.0, cells: int = 7, height: float = 0.0
) -> HeightMap:
    """A tilted plane through (0, 0, height)."""
    x = np.linspace(-reach, reach, cells)
    return HeightMap(height + slope_y * x[:, None] + slope_x * x[None, :], 2 * reach / (cells - 1), (-reach, -reach))


def hills(cells: int = 65, reach: float = 320.0, seed: int = 3) -> HeightMap:
    """Rough ground: heights of 0 to 40 m, node by node."""
    heights = np.random.default_rng(seed).uniform(0.0, 40.0, (cells, cells))
    heights[cells // 2 - 1 : cells // 2 + 2, cells // 2 - 1 : cells // 2 + 2] = 5.0  # a level place to start from
    return HeightMap(heights, 2 * reach / (cells - 1), (-reach, -reach))


def slow_cloud(number: int, seed: int, start: tuple[float, float, float] = (0.0, 0.0, 6.0)) -> Fragments:
    generator = np.random.default_rng(seed)
    direction = generator.normal(size=(number, 3)) * [1.0, 1.0, 0.5]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return Fragments(0.01, start, direction * generator.uniform(5.0, 80.0, (number, 1)))


@pytest.mark.parametrize("cells", [2, 7, 900])
def test_inclined_plane_in_vacuum(cells: int) -> None:
    slope_x, slope_y = 0.15, -0.1
    fragments, gravity = cloud(300, height=2.0), 100.0 * GRAVITY  # else they land where no ground on Earth is so high
    ground = plane_map(slope_x, slope_y, reach=7_000.0, cells=cells)
    landing = fly(fragments, air="vacuum", gravity=gravity, ground=ground).landing
    v = fragments.velocity
    climb = v[:, 2] - slope_x * v[:, 0] - slope_y * v[:, 1]
    time = (climb + np.sqrt(climb**2 + 4.0 * gravity)) / gravity
    fast = climb < 0.0
    time[fast] = 4.0 / (np.sqrt(climb[fast] ** 2 + 4.0 * gravity) - climb[fast])  # without cancellation
    assert (landing["status"] == Status.LANDED).all()
    assert landing["time"] == pytest.approx(time, rel=1e-9)
    assert landing["position"][:, 0] == pytest.approx(v[:, 0] * time, rel=1e-8, abs=1e-6)


def test_level_map_is_flat_ground() -> None:
    fragments = cloud(2000)
    flat = fly(fragments, ground=0.0).landing
    level = fly(fragments, ground=HeightMap(np.zeros((200, 200)), 50.0, (-5000.0, -5000.0))).landing
    assert np.array_equal(level["status"], flat["status"])
    for name in ("time", "distance", "speed"):
        assert level[name] == pytest.approx(flat[name], rel=1e-9), name


@pytest.mark.parametrize("integrator", [None, FixedStep(0.05)])
def test_no_hill_is_flown_through(integrator: FixedStep | None) -> None:
    """Against the parabola looked at every 3 cm: never below the ground before the landing, and on it there."""
    ground = hills()
    fragments = slow_cloud(2500, seed=1)
    landing = fly(fragments, air="vacuum", ground=ground, integrator=integrator).landing
    assert set(landing["status"].tolist()) == {Status.LANDED}
    landed = landing["status"] == Status.LANDED
    assert landed.sum() > 2000
    on = landing[landed]
    assert on["position"][:, 2] == pytest.approx(ground.at(*on["position"][:, :2].T), abs=1e-9)
    for row in landing:
        v = fragments.velocity[row["fragment"]]
        way = row["time"] * np.linalg.norm(v)
        t = np.linspace(0.0, row["time"], max(20, int(way / 0.03)))[:-1]
        z = 6.0 + v[2] * t - 0.5 * GRAVITY * t * t
        assert (z - ground.at(v[0] * t, v[1] * t)).min() > -1e-7, f"fragment {row['fragment']}"
        end = 6.0 + v[2] * row["time"] - 0.5 * GRAVITY * row["time"] ** 2
        assert end == pytest.approx(row["position"][2], abs=1e-6)


def test_needle_hills_are_met() -> None:
    """One node of a fine map stands up; those on a line towards it and below its top land on it."""
    heights = np.zeros((401, 401))
    heights[200, 300] = 30.0
    ground = HeightMap(heights, 1.0, (-200.0, -200.0))  # the needle at (100, 0)
    z = np.linspace(1.0, 29.9, 200)
    place = np.stack([np.zeros(200), np.zeros(200), z], axis=1)
    shots = Fragments(0.01, place, np.tile([2000.0, 0.0, 0.0], (200, 1)))
    landing = fly(shots, air="vacuum", gravity=0.0, ground=ground, time_limit=1.0).landing
    assert (landing["status"] == Status.LANDED).all()
    assert landing["position"][:, 0] == pytest.approx(99.0 + z / 30.0, abs=1e-6)
    above = Fragments(0.01, place + np.array([0.0, 0.0, 29.5]), shots.velocity)
    landing = fly(above, air="vacuum", gravity=0.0, ground=ground, time_limit=1.0).landing
    assert (landing["status"] == Status.TIME_OUT).all()


def test_saddle_of_one_cell() -> None:
    """A bilinear cell is curved along its diagonal: z = x y / 100 on 10 m by 10 m."""
    ground = HeightMap([[0.0, 0.0], [0.0, 1.0]], 10.0)
    shots = Fragments(0.01, (0.0, 0.0, 0.36), [[300.0, 300.0, 0.0]])
    landing = fly(shots, air="vacuum", gravity=0.0, ground=ground, time_limit=1.0).landing[0]
    assert landing["position"] == pytest.approx([6.0, 6.0, 0.36], abs=1e-7)


def test_beyond_the_edge_the_ground_is_level_at_its_height() -> None:
    """As on a map that is larger by level ground: profiles of the edges go on straight, the corners both ways."""
    profile = np.array([[0.0, 4.0], [3.0, 1.0], [6.0, -2.0]])
    small = HeightMap(profile, 40.0, (-20.0, -40.0))
    large = HeightMap(np.pad(profile, 60, mode="edge"), 40.0, (-20.0 - 2400.0, -40.0 - 2400.0))
    generator = np.random.default_rng(4)
    velocity = generator.normal(0.0, 150.0, (3000, 3))
    shots = Fragments(0.02, (0.0, 0.0, 6.5), velocity)
    flown, expected = (fly(shots, ground=ground).landing for ground in (small, large))
    off = ~small.contains(*expected["position"][:, :2].T)
    assert off.sum() > 1500
    assert large.contains(*expected["position"][:, :2].T).all()
    assert (flown["status"] == expected["status"]).all()
    assert flown["position"] == pytest.approx(expected["position"], abs=1e-5)
    assert flown["position"][off, 2] == pytest.approx(small.at(*flown["position"][off, :2].T), abs=1e-7)


def test_distance_to_the_edge() -> None:
    ground = HeightMap(np.zeros((3, 4)), 100.0, (-100.0, -50.0))
    assert ground.reach((0.0, 0.0), [0.0, 90.0, 180.0, 270.0]) == pytest.approx([200.0, 150.0, 100.0, 50.0])
    assert ground.reach((50.0, 0.0), 45.0) == pytest.approx(150.0 * np.sqrt(2.0))


def test_starting_on_the_ground_flies() -> None:
    """On flat ground and on a map a start at the ground's own height is no landing."""
    shot = Fragments(0.01, (0.0, 0.0, 0.0), (100.0, 0.0, 1.0))
    for ground in (0.0, plane_map(0.0, 0.0)):
        landing = fly(shot, air="vacuum", ground=ground).landing[0]
        assert landing["distance"] == pytest.approx(200.0 / GRAVITY, rel=1e-6)


@pytest.mark.parametrize("tolerance", [1e-4, 3e-8])
def test_landing_with_drag_lies_on_the_ground(tolerance: float) -> None:
    ground = hills()
    fragments = Fragments(cloud(3000).mass, (0.0, 0.0, 6.0), cloud(3000).velocity)
    landing = fly(fragments, ground=ground, integrator=Adaptive(tolerance)).landing
    landed = landing[landing["status"] == Status.LANDED]
    assert len(landed) > 2500
    assert landed["position"][:, 2] == pytest.approx(ground.at(*landed["position"][:, :2].T), abs=1e-9)


def test_where_a_hole_ends_the_map_its_reach_ends() -> None:
    beyond = np.zeros((41, 41), dtype=bool)
    beyond[:, 31:] = True  # from x = 110 m on
    ground = HeightMap(np.zeros((41, 41)), 10.0, (-200.0, -200.0), beyond=beyond)
    assert ground.reach((0.0, 0.0), [0.0, 90.0, 180.0]) == pytest.approx([110.0, 200.0, 200.0], abs=6.0)
    assert ground.contains([90.0, 105.0, 150.0, -150.0, 55.0], 0.0).tolist() == [True, False, False, True, True]
    with pytest.raises(InputError, match="1 start off height map"):
        fly(Fragments(0.01, (150.0, 0.0, 1.0), (1.0, 0.0, 0.0)), ground=ground)


def test_an_array_is_read_as_what_it_is() -> None:
    """Masked nodes are holes; heights that are none on Earth, complex numbers and a map of 1 m are refused."""
    masked = np.ma.masked_equal([[1.0, 2.0, 3.0], [4.0, -9999.0, 6.0], [7.0, 8.0, 9.0]], -9999.0)
    with pytest.raises(InputError, match="1 of 9 nodes have no height"):
        HeightMap(masked, 10.0)
    with pytest.raises(
        InputError, match=r"1 of 9 heights are beyond -9500 to 9500 m, the first is -9999 m; nodes with"
    ):
        HeightMap(masked.data, 10.0)
    for height in (7001.0, -2501.0):
        with pytest.raises(InputError, match=r"beyond -500 to 9000 m"):
            HeightMap(np.full((3, 3), height), 10.0, datum=2000.0)
        HeightMap(np.full((3, 3), height - np.sign(height)), 10.0, datum=2000.0)
    with pytest.raises(InputError, match="heights are complex"):
        HeightMap(np.zeros((3, 3), dtype=complex), 10.0)
    with pytest.raises(InputError, match=r"the map measures 0\.9 m by 20 m; needed: 10 m or more both ways"):
        HeightMap(np.zeros((3, 3)), (0.45, 10.0))


def test_the_air_is_that_of_the_maps_height() -> None:
    """Given a datum the standard atmosphere begins there, unless another is given."""
    shot = Fragments(0.01, (0.0, 0.0, 1.0), (800.0, 0.0, 200.0))
    ground = HeightMap(np.zeros((2, 2)), 9000.0, (-4500.0, -4500.0), datum=2500.0)
    by_map, given, low = (
        fly(shot, ground=one, air=air, ricochet="none").landing["distance"][0]
        for one, air in ((ground, "standard"), (0.0, StandardAtmosphere(2500.0)), (ground, StandardAtmosphere(0.0)))
    )
    assert by_map == pytest.approx(given, rel=1e-6)
    assert low < 0.85 * by_map


def test_more_messages() -> None:
    with pytest.raises(InputError, match=r"heights have shape \(1, 3\)"):
        HeightMap([[1.0, 2.0, 3.0]], 1.0)
    with pytest.raises(InputError, match=r"step is 0\.0"):
        HeightMap(np.zeros((2, 2)), 0.0)
    with pytest.raises(InputError, match="1 start off height map, which reaches from 0 to 10 m along x"):
        fly(Fragments(0.01, (15.0, 0.0, 1.0), (1.0, 0.0, 0.0)), ground=HeightMap(np.zeros((2, 2)), 10.0))
    with pytest.raises(InputError, match="1 start below the ground of height map"):
        fly(Fragments(0.01, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)), ground=plane_map(0.0, 0.0, height=1.5))
