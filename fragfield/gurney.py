"""Gurney's estimate of a casing's speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from burst_fenicsx.problem import Explosive

__all__ = ["gurney_constant", "gurney_speed"]


def gurney_constant(explosive: Explosive) -> float:
    """Gurney's sqrt(2E) (m/s) by Eq. 24: 0.52 km/s + 2.8e-4 D."""
    return 520.0 + 0.28 * explosive.detonation_velocity


def gurney_speed(constant: float, charge_ratio: float) -> float:
    """Speed (m/s) of a cylinder's casing without end losses, Eq. 23; `charge_ratio` is charge over casing mass."""
    return constant * math.sqrt(charge_ratio / (1.0 + 0.5 * charge_ratio))
