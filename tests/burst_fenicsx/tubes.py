"""A coarse, short tube as a round, and runs of it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

from burst_fenicsx.geometry import load_profile
from burst_fenicsx.problem import BurstSettings, IgnitionPoint, Round
from tests.burst_fenicsx.boxes import STEEL, TNT

if TYPE_CHECKING:
    from burst_fenicsx.geometry import Profile

SETTINGS = BurstSettings(cell_size=20e-3, end_time=20e-6, output_interval=10e-6, symmetry="off")


@cache
def profile() -> Profile:
    return load_profile("tube")


def tube(**changes: Any) -> Round:
    """155/110 mm steel tube with TNT, initiated at the nose end, on the axis."""
    item = Round(name="tube", explosive=TNT, casing=STEEL, profile=profile(), ignition=(IgnitionPoint(station=0.0),))
    return replace(item, **changes)
