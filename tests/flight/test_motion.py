"""Flight against closed forms, an independent integrator, and itself."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import DOP853, solve_ivp
from scipy.interpolate import PchipInterpolator

from flight import (
    Adaptive,
    ConstantAir,
    Cylinder,
    Domain,
    Drag,
    FixedStep,
    FlightWarning,
    Fragments,
    HeightMap,
    InputError,
    StandardAtmosphere,
    Status,
    Wind,
    fly,
    range_table,
)
from tests.flight.clouds import GRAVITY, cloud


def test_vacuum_parabola() -> None:
    fragments = cloud(500, height=7.0)
    landing = fly(fragments, air="vacuum").landing
    w = fragments.velocity[:, 2]
    root = np.sqrt(w * w + 2.0 * GRAVITY * 7.0)
    time = np.where(w > 0.0, (w + root) / GRAVITY, 14.0 / (root - w))  # each without cancellation
    place = fragments.velocity[:, :2] * time[:, None]
    assert (landing["status"] == Status.LANDED).all()
    assert landing["time"] == pytest.approx(time, rel=1e-12)
    assert np.abs(landing["position"][:, :2] - place).max() <= 1e-12 * np.abs(place).max()
    assert np.linalg.norm(landing["velocity"][:, :2] - fragments.velocity[:, :2], axis=1).max() < 1e-12 * 2000.0
    assert -landing["velocity"][:, 2] == pytest.approx(root, rel=1e-12)
    assert landing["energy"] == pytest.approx(0.5 * fragments.mass * (fragments.speed**2 + 14.0 * GRAVITY), rel=1e-12)


def test_horizontal_flight_decays_with_distance() -> None:
    """V = v0 exp(-s / L), L = 2 m / (Cd rho A)."""
    mass, coefficient, density = np.array([1e-3, 0.01, 0.1]), 1.1, 1.225
    fragments = Fragments(mass, (0.0, 0.0, 0.0), np.tile([900.0, 0.0, 0.0], (3, 1)))
    radii = (2.0, 7.62, 30.0, 100.0)
    result = fly(
        fragments, air=density, drag=coefficient, gravity=0.0, ground=None, time_limit=5.0,
        witnesses=[Cylinder(r, name=f"{r}") for r in radii],
    )  # fmt: skip
    length = 2.0 * mass / (coefficient * density * fragments.presented_area)
    for radius in radii:
        hits = result.hits_on(f"{radius}")
        i = hits["fragment"]
        assert len(i) >= 1
        assert hits["speed"] == pytest.approx(900.0 * np.exp(-radius / length[i]), rel=1e-7)
        assert hits["time"] == pytest.approx(length[i] / 900.0 * np.expm1(radius / length[i]), rel=1e-7)
    travelled = length * np.log1p(900.0 * 5.0 / length)
    assert (result.landing["status"] == Status.TIME_OUT).all()
    assert result.landing["time"].tolist() == [5.0] * 3
    assert result.landing["position"][:, 0] == pytest.approx(travelled, rel=1e-7)


def test_vertical_fall_reaches_terminal_speed() -> None:
    """V = v_t tanh(g t / v_t), fallen v_t^2 / g ln cosh(g t / v_t)."""
    mass, coefficient, density = 0.02, 1.2, 1.0
    fragments = Fragments(mass, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    terminal = math.sqrt(2.0 * mass * GRAVITY / (coefficient * density * float(fragments.presented_area[0])))
    for time in (0.5, 3.0, 30.0):
        end = fly(fragments, air=density, drag=coefficient, ground=None, time_limit=time).landing[0]
        assert end["speed"] == pytest.approx(terminal * math.tanh(GRAVITY * time / terminal), rel=1e-7)
        fallen = terminal**2 / GRAVITY * math.log(math.cosh(GRAVITY * time / terminal))
        assert end["position"][2] == pytest.approx(-fallen, rel=1e-7)


def test_wind_is_a_moving_frame() -> None:
    """Constant air that moves with a constant wind is still air seen from a moving frame."""
    fragments = cloud(300, seed=3)
    wind = Wind.constant(12.0, towards_deg=30.0)
    drift = wind.at(0.0)
    moving = Fragments(fragments.mass, fragments.position, fragments.velocity + np.array([*drift, 0.0]))
    still, windy = (fly(f, air=ConstantAir(1.1), wind=w).landing for f, w in ((fragments, None), (moving, wind)))
    assert windy["time"] == pytest.approx(still["time"], rel=1e-5)
    expected = still["position"][:, :2] + drift * still["time"][:, None]
    assert np.abs(windy["position"][:, :2] - expected).max() < 1e-6 * np.abs(expected).max()


def reference_range(fragments: Fragments, i: int, time: float) -> float:
    """Range by scipy's DOP853 at 1e-12 with air and drag written once more, in plain numbers."""
    air = StandardAtmosphere()
    drag = Drag.named("shell_fragment")
    pieces = PchipInterpolator(drag.mach, drag.coefficient)
    mach, c = drag.mach.tolist(), pieces.c.T.tolist()
    from bisect import bisect_right

    area = 0.5 * float(fragments.presented_area[i]) / float(fragments.mass[i])
    exponent = 9.80665 / (8314.32 / 28.9644 * 0.0065)
    density = float(air.density(0.0))

    def motion(_: float, y: np.ndarray) -> list[float]:
        _, _, z, u, v, w = y.tolist()
        height = 6_356_766.0 * z / (6_356_766.0 + z)  # below 11 km
        temperature = 288.15 - 0.0065 * height
        rho = density * (temperature / 288.15) ** (exponent - 1.0)
        speed = math.sqrt(u * u + v * v + w * w)
        m = speed / math.sqrt(1.4 * 8314.32 / 28.9644 * temperature)
        row = min(max(bisect_right(mach, m) - 1, 0), len(c) - 1)
        d = min(m, mach[-1]) - mach[row]
        cd = ((c[row][0] * d + c[row][1]) * d + c[row][2]) * d + c[row][3]
        f = -area * rho * cd * speed
        return [u, v, w, f * u, f * v, f * w - GRAVITY]

    start = [*fragments.position[i], *fragments.velocity[i]]
    solver = DOP853(motion, 0.0, start, time, rtol=1e-12, atol=1e-12)
    while solver.status == "running":
        solver.step()
    x, y, z, u, v, w = solver.y
    late = -z / w  # what is left to the ground is some nanometres
    assert abs(late) < 1e-3
    return math.hypot(x + late * u, y + late * v)


@pytest.mark.parametrize("number", [25, pytest.param(200, marks=pytest.mark.slow)])
def test_range_against_dop853(number: int) -> None:
    fragments = cloud(200, seed=11)
    landing = fly(fragments).landing
    error = []
    for i in range(number):
        reference = reference_range(fragments, i, float(landing["time"][i]))
        error.append(abs(landing["distance"][i] / reference - 1.0))
    assert max(error) < 1e-6, f"largest error of range {max(error):.2e}, median {np.median(error):.2e}"


def test_fixed_step_converges_with_its_order() -> None:
    fragments = Fragments(0.05, (0.0, 0.0, 100.0), (400.0, 100.0, 200.0))
    law = {"air": ConstantAir(1.0), "drag": 1.0}
    exact = fly(fragments, integrator=Adaptive(1e-13), **law).landing[0]  # type: ignore[arg-type]
    steps = np.array([0.04, 0.02, 0.01, 0.005])
    error = []
    for step in steps:
        end = fly(fragments, integrator=FixedStep(step), **law).landing[0]  # type: ignore[arg-type]
        error.append(np.linalg.norm(end["position"] - exact["position"]))
    rate = np.polyfit(np.log(steps), np.log(error), 1)[0]
    assert 4.7 < rate < 6.3, f"rate {rate:.2f}, errors {error}"
    assert error[-1] < 1e-8, f"rate {rate:.2f}, errors {error}"


def test_result_does_not_depend_on_neighbours() -> None:
    fragments = cloud(2500, seed=2)
    ring = [Cylinder(7.62), Cylinder(50.0, bottom=0.0, top=2.0)]
    every, few = (fly(one, witnesses=ring).landing for one in (fragments, fragments.select(slice(2000, 2100))))
    assert few["position"].tobytes() == every["position"][2000:2100].tobytes()


def test_every_fragment_ends_with_a_status_and_mass_balances() -> None:
    fragments = cloud(4000, seed=4, height=5.0)
    result = fly(fragments, domain=Domain(radius=100.0, ceiling=60.0), time_limit=4.0)
    landing, summary = result.landing, result.summary
    assert np.array_equal(landing["fragment"], np.arange(4000))
    assert set(landing["status"]) == {Status.LANDED, Status.TIME_OUT, Status.LEFT_DOMAIN}
    assert sum(entry["fragments"] for entry in summary["status"].values()) == 4000
    total = math.fsum(fragments.mass)
    assert math.fsum(landing["mass"]) == total
    assert math.fsum(entry["mass"] for entry in summary["status"].values()) == pytest.approx(total, rel=1e-14)
    out = landing[landing["status"] == Status.LEFT_DOMAIN]
    at_edge = np.isclose(out["distance"], 100.0, rtol=1e-9) | np.isclose(out["position"][:, 2], 60.0, rtol=1e-9)
    assert at_edge.all()
    assert (landing["time"][landing["status"] == Status.TIME_OUT] == 4.0).all()
    assert (landing["position"][landing["status"] == Status.LANDED][:, 2] == 0.0).all()


def test_start_at_the_edges() -> None:
    at_ground = Fragments([0.1, 0.1, 0.1], np.zeros(3), [[9, 0, 9], [9, 0, 0], [0, 0, -9]])
    landing = fly(at_ground).landing
    assert landing["time"][0] > 1.0
    assert landing["time"][1:].tolist() == [0.0, 0.0]
    outside = Fragments(0.1, (200.0, 0.0, 5.0), (1.0, 0.0, 0.0))
    end = fly(outside, domain=Domain(radius=100.0)).landing[0]
    assert (end["status"], end["time"], end["position"][0]) == (Status.LEFT_DOMAIN, 0.0, 200.0)
    with pytest.raises(InputError, match=r"radius is 0\.0 m, needed: above zero"):
        Domain(radius=0.0)
    assert len(fly(cloud(5).select([])).landing) == 0


@pytest.mark.parametrize(
    ("scene", "end", "share", "status"),
    [
        ({"ground": 0.0}, (30.0, 0.0, -10.0), 0.5, Status.LANDED),
        ({"domain": Domain(ceiling=14.0)}, (30.0, 0.0, 26.0), 0.25, Status.LEFT_DOMAIN),
        ({"domain": Domain(floor=2.0)}, (30.0, 0.0, -10.0), 0.4, Status.LEFT_DOMAIN),
        ({"domain": Domain(radius=20.0), "origin": (1.0, -2.0)}, (31.0, -2.0, 26.0), 20.0 / 30.0, Status.LEFT_DOMAIN),
        # the earlier one, whichever it is
        ({"ground": 0.0, "domain": Domain(radius=12.0)}, (30.0, 0.0, -10.0), 11.0 / 29.0, Status.LEFT_DOMAIN),
        ({"ground": 0.0, "domain": Domain(radius=25.0)}, (30.0, 0.0, -10.0), 0.5, Status.LANDED),
        ({"ground": 0.0, "domain": Domain(floor=4.0)}, (30.0, 0.0, -10.0), 0.3, Status.LEFT_DOMAIN),
        ({"ground": 0.0, "domain": Domain(99.0, 11.0, -20.0)}, (30.0, 0.0, 9.0), 1.0, Status.TIME_OUT),
    ],
)
def test_a_straight_path_ends_where_it_meets_the_first_limit(scene, end, share, status) -> None:
    """From (1, y, 10) m to `end` within a second."""
    start = np.array([1.0, scene.get("origin", (0.0, 0.0))[1], 10.0])
    options = {"air": "vacuum", "gravity": 0.0, "ground": None, "ricochet": "none", "time_limit": 1.0, **scene}
    row = fly(Fragments(0.1, start, end - start), **options).landing[0]
    assert row["time"] == pytest.approx(share, abs=1e-12)
    assert row["status"] == status


def test_a_fragment_of_infinite_speed_leaves_nothing_to_the_next() -> None:
    """Those that are stepped where one flew before that overflowed fly as alone, to the last bit."""
    others = cloud(64, seed=6)
    every = Fragments.concatenate([cloud(32, seed=7), others])
    every.velocity[:32] = [1e200, 0.0, 0.0]
    with pytest.warns(FlightWarning):
        after = fly(every, threads=1).landing[32:]
    alone = fly(others, ricochet="none", threads=1).landing
    assert after["position"].tobytes() == alone["position"].tobytes()


def test_nan_is_reported_not_dropped() -> None:
    fragments = Fragments(0.1, (0.0, 0.0, 1.0), [[1.0, 0.0, 0.0], [300.0, 0.0, 0.0]])
    fragments.velocity[0, 0] = 1e200  # given so, it would be refused
    with pytest.warns(FlightWarning):
        result = fly(fragments)
    assert result.landing["status"].tolist() == [Status.NOT_A_NUMBER, Status.LANDED]
    assert result.summary["status"]["not_a_number"] == {"fragments": 1, "mass": 0.1}


def test_use_beyond_the_drag_table_is_reported() -> None:
    fast = Fragments([0.1, 0.1], (0.0, 0.0, 1.0), [[3000.0, 0.0, 0.0], [500.0, 0.0, 0.0]])
    with pytest.warns(FlightWarning, match=r"1 of 2 fragments flew above Mach 7.*fastest: Mach 8\.8"):
        summary = fly(fast).summary
    assert summary["above_drag_table"] == 1
    assert summary["below_drag_table"] == 0
    cube = fly(fast.select([1]), drag="cube_face_on", ricochet="none")
    assert cube.summary["below_drag_table"] == 0  # it lands at Mach 0.2
    slow = Fragments(0.1, (0.0, 0.0, 1.0), (100.0, 0.0, 0.0))
    short = fly(slow, drag=Drag(np.array([0.5, 2.0]), np.array([1.0, 1.2])), ricochet="none")
    assert short.summary["below_drag_table"] == 1


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ({"air": "standart"}, "unknown name 'standart'; did you mean 'standard'"),
        ({"drag": "cube"}, "unknown table 'cube'; did you mean 'cube_"),
        ({"time_limit": 0.0}, "time_limit is 0.0 s"),
        ({"ground": 2.0}, "1 start below the ground at 2.0 m, the first is fragment 0 at z = 1.0 m"),
        ({"threads": 0}, "threads is 0"),
        ({"sample": [5]}, "whole numbers from 0 to 0"),
        ({"sample": -1}, "sample is -1"),
        ({"integrator": "euler"}, "integrator is 'euler', allowed: flight.Adaptive or flight.FixedStep"),
        ({"origin": (0.0, math.nan)}, "origin is"),
    ],
)
def test_messages(argument: dict[str, object], message: str) -> None:
    one = Fragments(0.1, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    with pytest.raises(InputError, match=message):
        fly(one, **argument)  # type: ignore[arg-type]


def test_progress_is_reported_to_the_end() -> None:
    seen = []
    fly(cloud(5000), on_progress=seen.append)
    assert seen[-1].done == seen[-1].total == 5000
    assert all(one.done <= other.done for one, other in pairwise(seen))
    assert type(seen[0])(done=500, total=2000, wall_seconds=0.5).seconds_left == 1.5
    assert seen[-1].seconds_left == 0.0


@pytest.mark.parametrize(
    ("altitude", "density"),
    [(10e3, 4.1351e-1), (20e3, 8.8910e-2), (30e3, 1.8410e-2)],
)
def test_flight_feels_the_standard_density_of_its_geometric_altitude(altitude, density):
    """Table I of the US Standard Atmosphere 1976 lists density by geometric altitude: V = v0 exp(-s / L)."""
    fragments = Fragments(1e-3, (0.0, 0.0, 0.0), (900.0, 0.0, 0.0))
    length = 2.0 * 1e-3 / (1.2 * density * fragments.presented_area[0])
    result = fly(
        fragments, air=StandardAtmosphere(altitude), drag=1.2, gravity=0.0, ground=None, time_limit=60.0,
        witnesses=[Cylinder(0.1 * length)],
    )  # fmt: skip
    assert result.hits["speed"][0] == pytest.approx(900.0 * math.exp(-0.1), rel=1e-5)


def test_a_table_of_single_fragments_is_the_parabola_in_a_vacuum() -> None:
    """Range and arrival of every combination by the closed form; NaN where nothing lands."""
    table = range_table([0.01, 0.1], [100.0, 300.0], [10.0, 45.0], height=2.0, air="vacuum")
    assert len(table) == 8
    level, up = (table["speed"] * turn(np.radians(table["elevation"])) for turn in (np.cos, np.sin))
    time = (up + np.sqrt(up**2 + 2.0 * GRAVITY * 2.0)) / GRAVITY
    assert table["time"] == pytest.approx(time, rel=1e-9)
    assert table["range"] == pytest.approx(level * time, rel=1e-9)
    assert table["arrival_speed"] ** 2 == pytest.approx(table["speed"] ** 2 + 2.0 * GRAVITY * 2.0, rel=1e-9)
    assert table["energy"] == pytest.approx(0.5 * table["mass"] * table["arrival_speed"] ** 2, rel=1e-12)
    assert np.isnan(range_table(0.01, 100.0, 45.0, time_limit=0.1)["range"]).all()


@pytest.mark.parametrize("slope", [-0.15, 0.15])
def test_wind_over_a_map_counts_from_the_ground_below(slope: float) -> None:
    """From a hilltop or a valley, with the wind of the power law: against scipy's DOP853 with the ground below."""
    axis = np.arange(-2000.0, 2001.0, 40.0)
    x, y = np.meshgrid(axis, axis)
    heights = slope * np.sqrt(x**2 + y**2 + 100.0**2) + 6.0 * np.sin(x / 90.0)
    heights -= heights[len(axis) // 2, len(axis) // 2]
    hill = HeightMap(heights, 40.0, (axis[0], axis[0]))
    wind, density = Wind.power_law(20.0, 20.0), 1.2
    fragments = Fragments(
        [0.005, 0.05, 0.3, 0.05], (0.0, 0.0, 1.0),
        [[400.0, 0.0, 300.0], [600.0, 200.0, 500.0], [-300.0, 500.0, 400.0], [500.0, 0.0, 40.0]],
    )  # fmt: skip
    landing = fly(fragments, air=density, drag=1.0, wind=wind, ground=hill, ricochet="none").landing
    still = fly(fragments, air=density, drag=1.0, ground=hill, ricochet="none").landing
    for one, end, calm in zip(range(4), landing, still, strict=True):
        area = 0.5 * float(fragments.presented_area[one] / fragments.mass[one])

        def motion(_: float, state: np.ndarray, area: float = area) -> np.ndarray:
            over = state[2] - float(hill.at(state[0], state[1]))
            relative = state[3:] - [*wind.at(over), 0.0]
            return np.concatenate([state[3:], -area * density * np.linalg.norm(relative) * relative])

        def fall(t: float, state: np.ndarray) -> np.ndarray:
            return motion(t, state) - [0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY]

        def ground(_: float, state: np.ndarray) -> float:
            return float(state[2] - hill.at(state[0], state[1]))

        ground.terminal, ground.direction = True, -1.0
        start = [*fragments.position[one], *fragments.velocity[one]]
        way = solve_ivp(fall, (0.0, 100.0), start, "DOP853", events=ground, rtol=1e-7, atol=1e-5, max_step=0.2)
        drift = np.hypot(*(end["position"] - calm["position"])[:2])
        error = np.hypot(*(end["position"] - way.y_events[0][0][:3])[:2])
        assert drift > (20.0 if one < 3 else 0.2)
        assert error < 0.01 * drift + 1e-3, (one, error, drift)
