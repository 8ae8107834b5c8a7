"""No crossing is missed and none is counted twice, against closed forms in vacuum."""

from __future__ import annotations

import numpy as np
import pytest

from flight import Adaptive, Cylinder, FixedStep, Fragments, InputError, Panel, Polygon, Status, fly
from tests.flight.clouds import GRAVITY, cloud


def times_on_plane(fragments: Fragments, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Times (n, 2) at which parabolas cross a plane, nan where they do not."""
    a = np.full(len(fragments), -0.5 * GRAVITY * normal[2])
    b, c = fragments.velocity @ normal, (fragments.position - point) @ normal
    return quadratic(a, b, c)


def times_on_cylinder(fragments: Fragments, centre: tuple[float, float], radius: float) -> np.ndarray:
    place = fragments.position[:, :2] - centre
    speed = fragments.velocity[:, :2]
    return quadratic((speed**2).sum(1), 2.0 * (place * speed).sum(1), (place**2).sum(1) - radius**2)


def quadratic(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore", divide="ignore"):
        q = -0.5 * (b + np.copysign(np.sqrt(b * b - 4.0 * a * c), b))
        return np.stack([q / a, c / q], axis=1)


def expected_hits(fragments: Fragments, times: np.ndarray, inside) -> tuple[np.ndarray, np.ndarray]:
    """Fragment and time of each crossing before the landing, sorted."""
    w, z = fragments.velocity[:, 2], fragments.position[:, 2]
    landing = (w + np.sqrt(w * w + 2.0 * GRAVITY * z)) / GRAVITY
    fragment = np.repeat(np.arange(len(fragments)), 2)
    time = times.ravel()
    keep = np.isfinite(time) & (time > 0.0)
    keep[keep] = time[keep] <= landing[fragment[keep]]
    fragment, time = fragment[keep], time[keep]
    place = fragments.position[fragment] + fragments.velocity[fragment] * time[:, None]
    place[:, 2] -= 0.5 * GRAVITY * time**2
    within = inside(place)
    order = np.lexsort((time[within], fragment[within]))
    return fragment[within][order], time[within][order]


def vacuum_cloud(number: int, seed: int) -> Fragments:
    generator = np.random.default_rng(seed)
    direction = generator.normal(size=(number, 3)) * [1.0, 1.0, 0.4]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    place = generator.normal(size=(number, 3)) * [0.3, 0.3, 0.2] + [0.0, 0.0, 3.0]
    return Fragments(0.01, place, direction * generator.uniform(20.0, 2000.0, (number, 1)))


def check_none_missed(number: int, seed: int) -> None:
    fragments = vacuum_cloud(number, seed)
    panel = Panel((10.0, 2.0, 3.5), (0.6, 0.1, 0.8), width=8.0, height=0.02, name="strip")
    normal, across, up = panel.axes()
    triangle = Polygon([(-20.0, -5.0, 0.5), (-20.0, 6.0, 0.5), (-24.0, 0.0, 9.0)], name="triangle")
    corners = triangle.corners

    def in_strip(x: np.ndarray) -> np.ndarray:
        offset = x - panel.centre
        return (np.abs(offset @ across) <= 4.0) & (np.abs(offset @ up) <= 0.01)

    def in_triangle(x: np.ndarray) -> np.ndarray:
        sides = [np.cross(corners[(i + 1) % 3] - corners[i], x - corners[i]) @ triangle.axes()[0] for i in range(3)]
        return np.min(sides, axis=0) * np.sign(np.max(sides)) >= 0.0

    cases = [
        (Cylinder(7.62, bottom=2.9, top=2.901, name="thin ring"), times_on_cylinder(fragments, (0.0, 0.0), 7.62),
         lambda x: (x[:, 2] >= 2.9) & (x[:, 2] <= 2.901)),
        (Cylinder(7.62, name="ring"), times_on_cylinder(fragments, (0.0, 0.0), 7.62), lambda x: x[:, 2] >= 0.0),
        (Cylinder(0.005, centre=(3.0, 4.0), name="wire"), times_on_cylinder(fragments, (3.0, 4.0), 0.005),
         lambda x: x[:, 2] >= 0.0),
        (Cylinder(60.0, centre=(900.0, 0.0), name="tank"), times_on_cylinder(fragments, (900.0, 0.0), 60.0),
         lambda x: x[:, 2] >= 0.0),
        (panel, times_on_plane(fragments, np.array(panel.centre), normal), in_strip),
        (triangle, times_on_plane(fragments, corners[0], triangle.axes()[0]), in_triangle),
        (Panel((0.0, 0.0, 2.0), (0.0, 0.0, 1.0), 500.0, 500.0, up=(0.0, 1.0, 0.0), name="floor"),
         times_on_plane(fragments, np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 1.0])),
         lambda x: (np.abs(x[:, :2]) <= 250.0).all(axis=1)),
    ]  # fmt: skip
    result = fly(fragments, air="vacuum", witnesses=[surface for surface, _, _ in cases])
    assert (result.landing["status"] == Status.LANDED).all()
    for surface, times, inside in cases:
        fragment, time = expected_hits(fragments, times, inside)
        hits = result.hits_on(surface.name)
        assert len(fragment) > number * 2e-5, f"{surface.name}: the test meets too few"
        assert np.array_equal(hits["fragment"], fragment), f"{surface.name}: {len(hits)} hits, expected {len(fragment)}"
        assert np.abs(hits["time"] - time).max() < 1e-9 * (1.0 + np.abs(time).max()), surface.name


def test_none_missed_in_vacuum() -> None:
    check_none_missed(40_000, seed=0)


@pytest.mark.slow
def test_none_missed_of_a_million() -> None:
    check_none_missed(1_000_000, seed=1)


@pytest.mark.parametrize("integrator", [None, FixedStep(0.01)])
def test_chord_within_one_step(integrator: FixedStep | None) -> None:
    """Lines that pass a pole closer and closer to grazing cross it twice or not at all."""
    depth = np.array([0.5, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
    offset = np.concatenate([1.0 - depth, 1.0 + depth])
    place = np.stack([np.full(12, -7.0), offset, np.zeros(12)], axis=1)
    fragments = Fragments(0.01, place, np.tile([900.0, 0.0, 0.0], (12, 1)))
    result = fly(
        fragments, air="vacuum", gravity=0.0, ground=None, time_limit=0.05, witnesses=[Cylinder(1.0)],
        integrator=integrator,
    )  # fmt: skip
    assert np.array_equal(result.hits["fragment"], np.repeat(np.arange(6), 2))
    half = np.sqrt(depth * (2.0 - depth))
    x = np.stack([-half, half], axis=1).ravel()
    assert result.hits["position"][:, 0] == pytest.approx(x, abs=1e-6)
    assert result.hits["direction"].tolist() == [-1, 1] * 6


def test_joints_of_steps_count_once() -> None:
    """Surfaces exactly where fixed steps end."""
    fragments = Fragments(0.01, np.zeros(3), (64.0, 0.0, 0.0))
    places = 0.5 * np.arange(1, 40)  # a step of 2^-7 s goes 0.5 m, exactly
    panels = [Panel((x, 0.0, 0.0), (s, 0.0, 0.0), 1.0, 1.0, name=f"{s}{x}") for x in places for s in (1.0, -1.0)]
    rings = [Cylinder(x, name=f"ring{x}") for x in places]
    result = fly(
        fragments, air="vacuum", gravity=0.0, ground=None, time_limit=1.0, witnesses=[*panels, *rings],
        integrator=FixedStep(2.0**-7),
    )  # fmt: skip
    assert np.array_equal(np.bincount(result.hits["witness"]), np.ones(len(panels) + len(rings)))


@pytest.mark.parametrize("tolerance", [1e-4, 3e-8])
def test_ring_around_the_burst_meets_all_that_fly_past(tolerance: float) -> None:
    """With drag: a ring of all heights is crossed once by every fragment that lands beyond it and by no other."""
    fragments = cloud(20_000, seed=8)
    radii = [1.0, 7.62, 40.0, 150.0, 400.0]
    rings = [Cylinder(r, name=f"{r}") for r in radii]
    result = fly(fragments, witnesses=rings, integrator=Adaptive(tolerance))
    for radius in radii:
        hits = result.hits_on(f"{radius}")
        beyond = np.flatnonzero(result.landing["distance"] > radius)
        assert np.array_equal(hits["fragment"], beyond)
        assert np.hypot(*hits["position"][:, :2].T) == pytest.approx(radius, rel=1e-9)


def test_crossing_state_lies_on_the_path() -> None:
    """State on a ring against a flight stopped there by a fine fixed step."""
    fragments = cloud(30, seed=9)
    result = fly(fragments, witnesses=[Cylinder(5.0)])
    for hit in result.hits[:10]:
        one = fragments.select([hit["fragment"]])
        end = fly(one, time_limit=float(hit["time"]), integrator=Adaptive(1e-12), ground=None).landing[0]
        assert end["position"] == pytest.approx(hit["position"], abs=5e-6)
        assert end["velocity"] == pytest.approx(hit["velocity"], rel=2e-6, abs=1e-3)


def test_hit_records() -> None:
    fragments = Fragments(0.02, (0, 0, 1.0), [[0.0, 800.0, 80.0]], round=3, segment=5)
    result = fly(fragments, witnesses=[Cylinder(7.62, name="ring"), Panel((0, 9, 2), (0, 1, 0), 2, 4, name="panel")])
    assert [result.witnesses[i].name for i in result.hits["witness"]] == ["ring", "panel"]
    hit = result.hits[0]
    assert (hit["round"], hit["segment"], hit["mass"], hit["fragment"], hit["direction"]) == (3, 5, 0.02, 0, 1)
    assert hit["azimuth"] == pytest.approx(90.0)
    assert hit["elevation"] == pytest.approx(np.degrees(np.arctan2(hit["velocity"][2], hit["velocity"][1])))
    assert hit["initial_speed"] == pytest.approx(np.hypot(800.0, 80.0))
    assert hit["energy"] == pytest.approx(0.5 * 0.02 * hit["speed"] ** 2)
    assert hit["speed"] < hit["initial_speed"]


def test_outline_with_a_notch() -> None:
    """Shots on a grid through an L, upright and tilted, behind a triangle: each counted inside its own corners only."""
    outline = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]])
    y, z = (a.ravel() for a in np.meshgrid(np.arange(-0.45, 5.0, 0.1), np.arange(-0.45, 4.0, 0.1)))
    inside = (y > 0.0) & (z > 0.0) & (((y < 4.0) & (z < 1.0)) | ((y < 1.0) & (z < 3.0)))
    shots = Fragments(0.1, np.stack([0.0 * y, y, z], axis=1), (300.0, 0.0, 0.0))
    triangle = Polygon([(2.0, 0.0, 0.0), (2.0, 4.03, 0.0), (2.0, 0.0, 4.03)], name="triangle")
    for slope in (0.0, 0.7):
        corners = np.column_stack([5.0 + slope * outline[:, 1], outline])
        for order in (corners, corners[::-1]):
            both = [triangle, Polygon(order, name="L")]
            result = fly(shots, air="vacuum", gravity=0.0, ground=None, time_limit=0.1, witnesses=both)
            assert np.array_equal(result.hits_on("L")["fragment"], np.flatnonzero(inside))
            before = np.flatnonzero((y > 0.0) & (z > 0.0) & (y + z < 4.03))
            assert np.array_equal(result.hits_on("triangle")["fragment"], before)


def test_many_hits_are_all_kept() -> None:
    """Far more crossings than a first buffer holds."""
    fragments = vacuum_cloud(3000, seed=6)
    rings = [Cylinder(1.0 + 0.01 * i, name=f"{i}") for i in range(60)]
    result = fly(fragments, air="vacuum", gravity=0.0, ground=None, time_limit=10.0, witnesses=rings)
    start = np.hypot(*fragments.position[:, :2].T)
    inside = sum(int((start < ring.radius).sum()) for ring in rings)
    outward = result.hits["direction"] == 1
    assert outward.sum() - (~outward).sum() == inside
    assert (np.diff(result.hits["fragment"]) >= 0).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Panel((0, 0, 0), (0, 0, 0), 1, 1), "normal has no direction"),
        (lambda: Panel((0, 0, 0), (0, 0, 1), 1, 1), "a level panel needs another up"),
        (lambda: Polygon([(0, 0, 0), (1, 0, 0), (2, 0, 0)]), "enclose no area"),
        (lambda: Polygon([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)]), "leave their plane by"),
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
