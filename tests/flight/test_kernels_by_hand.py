"""Parts of the flight's kernels against closed forms: azimuth cells, chords, ends of a step, slides, contacts."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import RK45
from scipy.interpolate import BPoly
from scipy.optimize import brentq

from flight.drag import Drag
from flight.fluence import PolarGrid
from flight.hazard.criteria import Criteria
from flight.scene.air import ConstantAir
from tests.plain import plain

KERNELS = plain("flight.kernels")
motion, IN_FLIGHT, LANDED, LEFT_DOMAIN = (
    KERNELS.motion, KERNELS.events.IN_FLIGHT, KERNELS.events.LANDED, KERNELS.events.LEFT_DOMAIN,
)  # fmt: skip
LANES, ROWS, Surroundings, accelerate = motion.LANES, motion.ROWS, motion.Surroundings, motion.accelerate
sign_changes, STACK_SHAPE = KERNELS.roots.sign_changes, KERNELS.roots.STACK_SHAPE

NOWHERE = KERNELS.events.Limits(
    ground=math.nan, origin_x=0.0, origin_y=0.0, domain_radius=math.inf, ceiling=math.inf, floor=-math.inf,
    time_limit=1e9, tolerance=1e-6, fixed_step=0.0, longest_step=1.0, most_steps=100, path_points=0,
)  # fmt: skip
"""From -20 to 40 m along x and from -10 to 20 m along y."""


@pytest.fixture(autouse=True)
def _as_compiled():
    """Compiled kernels divide by zero and overflow without a warning."""
    with np.errstate(all="ignore"):
        yield


def test_the_azimuth_cell_is_that_of_the_angle() -> None:
    """All round in cells of a hundredth of a degree, against the arc tangent; only within 1e-7 rad of a bound not."""
    grid = PolarGrid(72, 500)
    near, turns = Criteria().fluence_grid(grid).table(), grid.azimuth_cells
    generator = np.random.default_rng(3)
    angles = np.concatenate([generator.uniform(-math.pi, math.pi, 3000), np.arange(-4, 4) * math.pi / 4.0])
    cells = (np.degrees(angles) - grid.start) / grid.width
    clear = np.abs(cells - np.round(cells)) * math.radians(grid.width) > 1e-7
    assert clear.sum() > 2900
    for angle, cell in zip(angles[clear], np.floor(cells[clear]), strict=True):
        distance = generator.uniform(0.1, 500.0)
        assert (
            KERNELS.fluence._cell_of(distance * math.cos(angle), distance * math.sin(angle), near, turns)
            == cell % turns
        )


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        ((3.0, -4.0), (3.0, 4.0), 3.0),
        ((0.0, 5.0), (5.0, 0.0), 5.0 / math.sqrt(2.0)),
        ((1.0, 7.0), (4.0, 3.0), 5.0),  # from (1, 7) on along (3, -4): its end is the nearest
        ((4.0, 3.0), (1.0, 7.0), 5.0),
        ((-1.0, 1.0), (2.0, -2.0), 0.0),
        ((2.0, 1.0), (2.0, 1.0), math.sqrt(5.0)),
        ((2.0, -1.0), (-1.0, 5.0), 3.0 / math.sqrt(5.0)),  # on the line y = 3 - 2 x
    ],
)
def test_the_nearest_of_a_chord_is_its_foot_or_its_end(start, end, expected) -> None:
    assert KERNELS.fluence._nearest(*start, *end) == pytest.approx(expected, abs=1e-12)
    for turn in np.radians([17.0, 120.0, 251.0]):
        c, s = math.cos(turn), math.sin(turn)
        turned = [(c * x - s * y, s * x + c * y) for x, y in (start, end)]
        assert KERNELS.fluence._nearest(*turned[0], *turned[1]) == pytest.approx(expected, abs=1e-12)


def straight(start, end) -> np.ndarray:
    """Control points of a step along a straight line at even speed."""
    points = np.zeros((6, 6))
    points[:3] = np.linspace(start, end, 6).T
    return points


@pytest.mark.parametrize(
    ("limits", "end", "share", "status"),
    [
        ({"ground": 0.0}, (30.0, 0.0, -10.0), 0.5, LANDED),
        ({"ceiling": 14.0}, (30.0, 0.0, 26.0), 0.25, LEFT_DOMAIN),
        ({"floor": 2.0}, (30.0, 0.0, -10.0), 0.4, LEFT_DOMAIN),
        ({"domain_radius": 20.0, "origin_x": 1.0, "origin_y": -2.0}, (31.0, -2.0, 26.0), 20.0 / 30.0, LEFT_DOMAIN),
        # the earlier one, whichever it is
        ({"ground": 0.0, "domain_radius": 12.0}, (30.0, 0.0, -10.0), 11.0 / 29.0, LEFT_DOMAIN),
        ({"ground": 0.0, "domain_radius": 25.0}, (30.0, 0.0, -10.0), 0.5, LANDED),
        ({"ground": 0.0, "floor": 4.0}, (30.0, 0.0, -10.0), 0.3, LEFT_DOMAIN),
        ({"ground": 0.0, "ceiling": 11.0, "floor": -20.0, "domain_radius": 99.0}, (30.0, 0.0, 9.0), 2.0, IN_FLIGHT),
    ],
)
def test_a_step_ends_where_its_straight_path_meets_the_first_limit(limits, end, share, status) -> None:
    """From (1, y, 10) m; what earlier steps have left among the scratch plays no part."""
    points = straight((1.0, limits.get("origin_y", 0.0), 10.0), end)
    roots, stack, pieces = (
        np.full(12, 0.001),
        np.full(STACK_SHAPE, 0.001),
        np.full(KERNELS.surfaces.PIECES_SHAPE, 0.001),
    )
    found, how = KERNELS.events.ending(points, NOWHERE._replace(**limits), pieces, stack, roots)
    assert found == pytest.approx(share, abs=1e-12)
    assert how == status


def test_two_paths_close_by_the_rate_of_their_distance() -> None:
    """Of quintics at random, at any position: the threshold beside the derivative of the distance."""
    generator, length = np.random.default_rng(11), 0.03
    closing = 0
    for _ in range(60):
        relative = generator.normal(size=(3, 6))
        curve = BPoly(relative.T[:, None, :], [0.0, length])
        theta = generator.uniform(0.02, 0.98)
        place, speed = curve(theta * length), curve.derivative()(theta * length)
        rate = float(place @ speed) / float(np.linalg.norm(place))
        if rate < 0.0:
            closing += 1
            assert KERNELS.collision._closing(relative, length, theta, -rate * (1.0 - 1e-9))
            assert not KERNELS.collision._closing(relative, length, theta, -rate * (1.0 + 1e-9))
        else:
            assert not KERNELS.collision._closing(relative, length, theta, 0.0)
    assert 15 < closing < 45


def test_curved_paths_meet_where_their_distance_first_falls_to_the_reach() -> None:
    """Quintics that begin together or one later, against the distance at 2,000 times and a bisection.

    At random; at random, but together at the very end; and nearly straight and fast, as most are.
    """
    generator, end, seen = np.random.default_rng(12), 0.03, {True: 0, False: 0}
    scratch, roots = np.zeros((KERNELS.collision.SCRATCH_ROWS, KERNELS.roots.LARGEST_DEGREE + 3)), np.zeros(16)
    for trial in range(240):
        starts, kind = [(0.0, 0.0), (0.0, 0.011), (0.019, 0.0)][trial % 3], trial // 3 % 3
        paths = generator.normal(size=(2, 3, 6)) + generator.normal(size=(2, 3, 1))
        reach = float(generator.uniform(0.5, 2.5))
        if kind == 1:
            paths[1, :, :5] += 3.0 * np.eye(3)[trial % 3][:, None] * generator.choice([-1.0, 1.0])
            paths[1, :, 5] = paths[0, :, 5] + 0.5 * reach * generator.uniform(-1.0, 1.0, 3)
        elif kind == 2:
            way, middle = generator.normal(scale=40.0, size=(2, 3, 1)), generator.uniform(0.0, 1.0, (2, 1, 1))
            paths = 0.05 * paths + way * (np.arange(6.0) / 5.0 - middle)
        one, other = (BPoly(path.T[:, None, :], [start, end]) for path, start in zip(paths, starts, strict=True))

        def excess(time, one=one, other=other, reach=reach):
            return np.linalg.norm(one(time) - other(time), axis=-1) - reach

        times = np.linspace(max(starts), end, 2001)
        apart = excess(times)
        turns = np.flatnonzero((apart[1:-1] < apart[:-2]) & (apart[1:-1] < apart[2:]))
        if np.abs(apart[1:-1][turns]).min(initial=1.0) < 1e-3 or abs(apart[-1]) < 1e-6:
            continue  # they touch, or nearly
        falls = np.flatnonzero((apart[:-1] > 0.0) & (apart[1:] <= 0.0))
        found = KERNELS.collision.first_collision(
            paths[0], starts[0], paths[1], starts[1], end, reach, 0.0, scratch, roots
        )
        expected = brentq(excess, times[falls[0]], times[falls[0] + 1], xtol=1e-15) if falls.size else math.inf
        assert found == pytest.approx(expected, abs=1e-9), trial
        seen[bool(falls.size)] += 1
    assert min(seen.values()) > 50


def test_the_errors_of_a_step_are_those_of_dormand_and_princes_pair():
    """Beside scipy's RK45 with its own table of coefficients: drag with one coefficient in air of one density."""
    area, gravity, step, density = 0.05, 9.81, 0.01, 1.2
    rows, bins, per_mach = Drag.constant(1.0).table()
    table = ConstantAir(density).table()
    around = Surroundings(
        table.bottom,
        table.step,
        table.pieces,
        table.site_altitude,
        rows,
        bins,
        per_mach,
        np.zeros((0, 9)),
        0.0,
        gravity,
    )
    start = np.array([[0.0, 0.0, 100.0, 700.0, -200.0, 150.0], [0.0, 0.0, 50.0, -20.0, 900.0, -300.0]])
    q = np.zeros((ROWS, LANES))
    for lane in range(LANES):
        q[:6, lane] = start[lane % 2]
    q[motion.STEP], q[motion.AREA] = step, area
    q[motion.HEIGHT], q[motion.RELATIVE : motion.RELATIVE + 3] = q[2], q[3:6]
    q = q.ravel()
    accelerate(q, motion.SLOPE, 0.0, around)
    motion.take_step(q, around)
    found = q.reshape(ROWS, LANES)

    def fall(y):
        drag = -area * density * np.linalg.norm(y[3:]) * y[3:]
        return np.concatenate([y[3:], drag - [0.0, 0.0, gravity]])

    for lane, y in enumerate(start):
        slopes = np.empty((7, 6))
        for stage in range(6):
            slopes[stage] = fall(y + step * RK45.A[stage, :stage] @ slopes[:stage])
        new = y + step * RK45.B @ slopes[:6]
        slopes[6] = fall(new)
        error = step * slopes.T @ RK45.E
        np.testing.assert_allclose(found[motion.NEW : motion.NEW + 6, lane], new, rtol=1e-12, atol=1e-12)
        assert found[motion.PLACE_ERROR, lane] == pytest.approx(float(error[:3] @ error[:3]), rel=1e-6)
        assert found[motion.VELOCITY_ERROR, lane] == pytest.approx(float(error[3:] @ error[3:]), rel=1e-6)


def test_a_lane_forgets_a_fragment_of_infinite_speed():
    """Its Mach number lies in the last row of the table, whatever stands behind that in memory."""
    rows, bins, per_mach = Drag.named("shell_fragment").table()
    memory = np.full((len(rows) + 2, 6), np.nan)
    memory[:, 0], memory[:, 5] = 0.0, 1e9  # a row that would serve every later fragment of the lane
    memory[: len(rows)] = rows
    air = ConstantAir(1.2).table()
    around = Surroundings(
        air.bottom,
        air.step,
        air.pieces,
        air.site_altitude,
        memory[: len(rows)],
        bins,
        per_mach,
        np.zeros((0, 9)),
        0.0,
        9.81,
    )

    def accelerations(q, speed):
        rows = q.reshape(ROWS, LANES)
        rows[motion.AREA], rows[motion.HEIGHT] = 0.05, 100.0
        rows[motion.RELATIVE] = speed
        rows[motion.RELATIVE + 1 : motion.RELATIVE + 3] = 0.0
        accelerate(q, motion.SLOPE, 0.0, around)
        return rows[motion.SLOPE : motion.SLOPE + 3].copy()

    used, fresh = np.zeros(ROWS * LANES), np.zeros(ROWS * LANES)
    accelerations(used, np.where(np.arange(LANES) == 3, 1e200, 700.0))  # whose square is infinite
    np.testing.assert_array_equal(accelerations(used, 650.0), accelerations(fresh, 650.0))


def test_two_boxes_that_share_cells_meet_in_the_lowest_of_them_alone() -> None:
    """Of random boxes, each in the cells that its corners and all between them lie in."""
    generator, met = np.random.default_rng(4), 0
    for _ in range(200):
        boxes, ranges = [], np.zeros((2, 6), dtype=np.int64)
        for cells in ranges:
            low = generator.uniform(-0.8, 0.8, 3)
            box = np.concatenate([low, low + generator.uniform(0.0, 1.5, 3)])
            boxes.append(box)
            number = KERNELS.cells.cells_of(box, 0.7, cells)
            assert (cells == np.floor(box / 0.7)).all()
            assert number == np.prod(cells[3:] - cells[:3] + 1)
        each = [set(itertools.product(*(range(r[k], r[3 + k] + 1) for k in range(3)))) for r in ranges]
        shared = each[0] & each[1]
        for cell in each[0] | each[1]:
            assert KERNELS.cells.home(ranges[0], ranges[1], *cell) == (bool(shared) and cell == min(shared))
        met += bool(shared)
    assert 20 < met < 180


@pytest.mark.parametrize(
    ("coefficients", "expected"),
    [
        ([1e-17, -1e-17, 1e-17, -1e-17], [0.5]),  # noise that ends on the other side: once, in the middle
        ([-1e-17, 1e-17, -1e-17, 1e-17], [0.5]),
        ([1e-17, -1e-17, 1e-17], []),
        ([0.0, 0.0, 0.0, 0.0], []),  # zeros count as positive
        ([0.0, 0.0, -1.0], [0.0]),
        ([0.0, 1.0, 2.0], []),
        ([-1.0, 0.9, -1.0], []),  # a parabola that stays below zero
        ([-1.0, 1.5, -1.0], [0.2763932, 0.7236068]),  # (5 -+ sqrt 5) / 10
        ([-1.0, -1.0, 1.0], [math.sqrt(0.5)]),  # 2 t^2 = 1
    ],
)
def test_signs_change_where_bernstein_polynomials_cross_zero(coefficients, expected) -> None:
    degree = len(coefficients) - 1
    stack, roots = np.zeros(STACK_SHAPE), np.full(4, np.nan)
    stack[0, : degree + 1] = coefficients
    found = sign_changes(stack, degree, 1.0, roots)
    assert roots[:found].tolist() == pytest.approx(expected, abs=1e-7)


def test_root_isolation_against_known_roots() -> None:
    """Bernstein polynomials built from their roots: all inside [0, 1] found, in order, with multiplicity by sign."""
    generator = np.random.default_rng(0)
    stack, roots = np.zeros(STACK_SHAPE), np.zeros(16)
    for trial in range(150):
        degree = int(generator.integers(2, KERNELS.roots.LARGEST_DEGREE + 1))
        known = generator.uniform(-0.5, 1.5, degree)
        if trial % 3 == 0:
            known[1] = known[0] + 10.0 ** generator.uniform(-5, -2)  # a close pair
        if np.diff(np.sort(known)).min() < 1e-6:
            continue
        # product of (t - r) in Bernstein form: multiply by the factor with coefficients (-r, 1 - r)
        coefficients = np.ones(1)
        for r in known:
            n = coefficients.size
            wider = np.zeros(n + 1)
            k = np.arange(n)
            wider[:-1] += coefficients * (n - k) / n * -r
            wider[1:] += coefficients * (k + 1) / n * (1.0 - r)
            coefficients = wider
        stack[0, : degree + 1] = coefficients
        found = sign_changes(stack, degree, np.abs(coefficients).max(), roots)
        inside = np.sort(known[(known > 0.0) & (known < 1.0)])
        assert found == inside.size, f"trial {trial}: {roots[:found]} for {inside}"
        assert roots[:found] == pytest.approx(inside, abs=1e-7)
