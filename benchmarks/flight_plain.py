"""Clouds of fragments, and their flight as users of scipy write it: solve_ivp, one by one, right-hand side in NumPy."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

from flight import Fragments, StandardAtmosphere
from flight.drag import Drag

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

__all__ = ["PlainFlight", "burst_cloud", "plain_seconds", "two_tubes"]

_GRAVITY = 9.80665
_GAS = 8314.32 / 28.9644  # J/(kg K)
_EARTH = 6_356_766.0  # m
_TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)


class PlainFlight:
    """Fragments in the standard atmosphere below 11 km with TP-12 drag."""

    def __init__(self, fragments: Fragments) -> None:
        drag = Drag.named("shell_fragment")
        self.fragments, self.mach = fragments, drag.mach
        self.pieces = PchipInterpolator(drag.mach, drag.coefficient).c
        self.density = float(StandardAtmosphere().density(0.0))

    def motion(self, i: int) -> Callable[[float, NDArray[np.float64]], NDArray[np.float64]]:
        """Right-hand side of fragment i."""
        area = 0.5 * float(self.fragments.presented_area[i]) / float(self.fragments.mass[i])
        exponent = _GRAVITY / (_GAS * 0.0065) - 1.0
        mach, pieces, top = self.mach, self.pieces, float(self.mach[-1])

        def right_hand_side(_: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
            height = _EARTH * y[2] / (_EARTH + y[2])
            temperature = 288.15 - 0.0065 * height
            density = self.density * (temperature / 288.15) ** exponent
            speed = np.sqrt(y[3:] @ y[3:])
            m = speed / np.sqrt(1.4 * _GAS * temperature)
            row = min(max(np.searchsorted(mach, m, side="right") - 1, 0), mach.size - 2)
            d = min(m, top) - mach[row]
            c = pieces[:, row]
            coefficient = ((c[0] * d + c[1]) * d + c[2]) * d + c[3]
            out = np.empty(6)
            out[:3] = y[3:]
            out[3:] = -area * density * coefficient * speed * y[3:]
            out[5] -= _GRAVITY
            return out

        return right_hand_side

    def start(self, i: int) -> NDArray[np.float64]:
        """Place and velocity (6,) at launch."""
        return np.concatenate([self.fragments.position[i], self.fragments.velocity[i]])

    def exact_range(self, i: int, late: float) -> float:
        """Range (m) by DOP853 at 1e-12; `late` is the time of landing, near enough that the rest is straight."""
        end = solve_ivp(self.motion(i), (0.0, late), self.start(i), method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
        rest = -end[2] / end[5]
        return math.hypot(end[0] + rest * end[3], end[1] + rest * end[4])

    def landed_range(self, i: int, method: str, tolerance: float) -> float:
        """Range (m) as a user gets it: integrate until the event of reaching the ground."""

        def ground(_: float, y: NDArray[np.float64]) -> float:
            return float(y[2])

        ground.terminal, ground.direction = True, -1.0  # type: ignore[attr-defined]
        done = solve_ivp(
            self.motion(i), (0.0, 3600.0), self.start(i), method=method, rtol=tolerance, atol=tolerance, events=ground
        )
        x, y = done.y_events[0][0][:2]
        return math.hypot(x, y)


def plain_seconds(
    plain: PlainFlight, chosen: Sequence[int] | NDArray[np.int64], exact: NDArray[np.float64], error: float
) -> list[dict[str, Any]]:
    """Seconds a fragment of RK45 and of DOP853, each with the loosest tolerance (a power of ten) within `error`."""
    rows = []
    for method in ("RK45", "DOP853"):
        for tolerance in _TOLERANCES:
            began, worked = time.perf_counter(), time.process_time()
            found = np.array([plain.landed_range(int(i), method, tolerance) for i in chosen])
            seconds = (time.perf_counter() - began) / len(chosen)
            core_seconds = (time.process_time() - worked) / len(chosen)
            largest = float(np.abs(found / exact - 1.0).max())
            if largest <= error or tolerance == _TOLERANCES[-1]:
                rows.append(
                    {
                        "method": method,
                        "tolerance": tolerance,
                        "error": largest,
                        "seconds_a_fragment": seconds,
                        "core_seconds_a_fragment": core_seconds,
                    }
                )
                break
    return rows


def burst_cloud(number: int, seed: int = 0) -> Fragments:
    """0.1 g to 0.5 kg (uniform in the logarithm), 300 to 2000 m/s, all directions, up and down, from 1 m height."""
    generator = np.random.default_rng(seed)
    mass = np.exp(generator.uniform(math.log(1e-4), math.log(0.5), number))
    direction = generator.normal(size=(number, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return Fragments(
        mass, (0.0, 0.0, 1.0), direction * generator.uniform(300.0, 2000.0, number)[:, None]
    )  # fmt: skip


def two_tubes(number: int, seed: int = 0) -> Fragments:
    """The fragments of two casings of 32 kg that burst side by side, by Mott's law, at 800 to 1200 m/s."""
    generator = np.random.default_rng(seed)
    mass = generator.exponential(size=number) ** 2
    azimuth = generator.uniform(0.0, 2.0 * np.pi, number)
    outward = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(number)], axis=1)
    side = np.where(np.arange(number) % 2, 0.2, -0.2)
    position = 0.13 * outward + np.stack([side, 0.0 * side, generator.uniform(1.2, 1.8, number)], axis=1)
    velocity = outward * generator.uniform(800.0, 1200.0, number)[:, None]
    velocity[:, 2] = generator.normal(0.0, 60.0, number)
    return Fragments(mass * (64.0 / mass.sum()), position, velocity)
