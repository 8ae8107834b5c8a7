"""Limits of a flight: its end in space and time, and the steps."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["IN_FLIGHT", "LANDED", "LEFT_DOMAIN", "NOT_A_NUMBER", "STEP_LIMIT", "STOPPED", "TIME_OUT", "Limits"]

# as in flight.result.Status
IN_FLIGHT, LANDED, TIME_OUT, LEFT_DOMAIN, STEP_LIMIT, NOT_A_NUMBER, STOPPED = 0, 1, 2, 3, 4, 5, 6


class Limits(NamedTuple):
    """Where and when a flight ends, and how it is stepped. Units: m, s."""

    ground: float  # height of flat ground, nan: none, or a map
    origin_x: float
    origin_y: float
    domain_radius: float  # inf: none
    ceiling: float  # inf: none
    floor: float  # -inf: none
    time_limit: float
    tolerance: float  # relative, of the velocity over one step
    fixed_step: float  # 0: adaptive
    longest_step: float
    most_steps: int
    path_points: int  # recorded per step, 0: none
