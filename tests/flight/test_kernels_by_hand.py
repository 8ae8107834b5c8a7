"""Parts of the flight's kernels that no flight shows: errors of a step, contacts of curved paths, sign changes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import RK45
from scipy.interpolate import BPoly
from scipy.optimize import brentq

from flight.drag import Drag
from flight.scene.air import ConstantAir
from tests.plain import plain

KERNELS = plain("flight.kernels")
motion = KERNELS.motion
LANES, ROWS, Surroundings, accelerate = motion.LANES, motion.ROWS, motion.Surroundings, motion.accelerate
sign_changes, STACK_SHAPE = KERNELS.roots.sign_changes, KERNELS.roots.STACK_SHAPE


@pytest.fixture(autouse=True)
def _as_compiled():
    """Compiled kernels divide by zero and overflow without a warning."""
    with np.errstate(all="ignore"):
        yield


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
    around = Surroundings(*ConstantAir(density).table(), *Drag.constant(1.0).table(), np.zeros((0, 9)), 0.0, gravity)
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
