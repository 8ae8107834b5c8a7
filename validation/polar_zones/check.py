"""Rows of the panel test: percentages by zone, the peak of the side spray, and the scatter that it asks for."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from transition.settings import DIRECTION_SCATTER
from validation.polar_zones.base import experiments
from validation.polar_zones.zones import deciding_scatter, polar_angles, zones_of
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from transition import BreakUpSettings
    from transition.snapshot import Snapshot
    from validation.polar_zones.zones import Sample

__all__ = ["NAME", "REFERENCE", "SCATTERS", "check_base", "check_masses", "check_zones"]

NAME = "polar_zones"
REFERENCE: dict[str, Any] = tomllib.loads((Path(__file__).parent / "reference.toml").read_text(encoding="utf-8"))
SCATTERS = np.arange(3.0, 10.01, 1.0)
"""Scatters that are tried (degrees)."""
_SOURCE = REFERENCE["source"]


def check_masses(label: str, burst: Mapping[str, Any]) -> list[Row]:
    """Masses of a contour against those of the test's lot."""
    masses, allowed = REFERENCE["masses"], REFERENCE["allowed"]["mass"]
    return [
        compare(NAME, f"{label}: mass of the body", burst["casing_mass"], masses["body"], allowed, _SOURCE, "kg"),
        compare(NAME, f"{label}: mass of the charge", burst["charge_mass"], masses["charge"], allowed, _SOURCE, "kg"),
    ]


def check_zones(label: str, sample: Sample) -> list[Row]:
    """Rows of one contour at one cell size."""
    angle, mass = sample.angles(DIRECTION_SCATTER)
    found = zones_of(angle[mass >= REFERENCE["pit"]["lightest"]], sample.realisations, REFERENCE)
    percent, allowed = REFERENCE["percent"], REFERENCE["allowed"]
    rows = [_inform(f"{label}: fragments above 0.5 g", found.number, REFERENCE["pit"]["pieces"])]
    for zone in ("side", "between", "base"):
        low, high = percent[zone] - allowed[zone], percent[zone] + allowed[zone]
        rows.append(within(NAME, f"{label}: {_ZONES[zone]}", getattr(found, zone), low, high, _SOURCE, "%"))
    rows.append(_inform(f"{label}: {_ZONES['nose']}", found.nose, percent["nose"], "%"))
    mixed = REFERENCE["peak"]["over_mean_at_15_ft"]
    rows.append(_inform(f"{label}: peak over mean, above 0.5 g (test: of 36 to 120 ft over 15 ft)", found.peak, mixed))
    return rows + _boards(label, sample, angle) + _scatter(label, sample)


_ZONES = {
    "side": "in 76 to 111 degrees",
    "between": "between the zones",
    "base": "in the rear cone, 162.5 to 180 degrees",
    "nose": "in the front cone, 0 to 17.5 degrees",
}


def _boards(label: str, sample: Sample, angle: NDArray[np.float64]) -> list[Row]:
    """Perforations at each distance: fragments above the energy that gives the test's number at 15 ft."""
    numbers, peak = REFERENCE["boards"]["number"], REFERENCE["peak"]
    limit = sample.limit(numbers[0])
    rows = [_inform(f"{label}: energy of a perforation, from the number at 15 ft", limit, None, "J")]
    for board, feet in enumerate(REFERENCE["boards"]["distance_ft"]):
        through = sample.energy[board] >= limit
        found = zones_of(angle[through], sample.realisations, REFERENCE)
        if board:
            rows.append(_inform(f"{label}: perforations at {feet:g} ft", found.number, numbers[board]))
            measured, error = peak["over_mean"][board - 1], peak["standard_error"][board - 1]
            slack = REFERENCE["allowed"]["peak"] * error
            quantity = f"{label}: peak over mean at {feet:g} ft ({measured} in the test)"
            rows.append(within(NAME, quantity, found.peak, measured - slack, measured + slack, _SOURCE))
    return rows


def _scatter(label: str, sample: Sample) -> list[Row]:
    """The scatter that the peaks ask for, with both distances and with each."""
    limit = sample.limit(REFERENCE["boards"]["number"][0])
    peaks = np.empty((len(SCATTERS), 2))
    for row, degrees in enumerate(SCATTERS):
        angle, _ = sample.angles(math.radians(degrees))
        for board in (1, 2):
            peaks[row, board - 1] = zones_of(angle[sample.energy[board] >= limit], sample.realisations, REFERENCE).peak
    measured = np.array(REFERENCE["peak"]["over_mean"])
    error = np.array(REFERENCE["peak"]["standard_error"])
    best, low, high = deciding_scatter(SCATTERS, peaks, measured, error)
    words = f"{label}: scatter of directions by the peaks at 36 and 75 ft ({low:.1f} to {high:.1f}, one standard error)"
    rows = [within(NAME, words, best, math.degrees(DIRECTION_SCATTER) - 1.0, math.degrees(DIRECTION_SCATTER) + 1.0,
                   "own default, with its standard error", "deg")]  # fmt: skip
    for column, feet in enumerate(REFERENCE["boards"]["distance_ft"][1:]):
        one = slice(column, column + 1)
        best, low, high = deciding_scatter(SCATTERS, peaks[:, one], measured[one], error[one])
        rows.append(_inform(f"{label}: the same by {feet:g} ft alone ({low:.1f} to {high:.1f})", best, None, "deg"))
    return rows


def check_base(label: str, snapshot: Snapshot, settings: BreakUpSettings, realisations: int) -> list[Row]:
    """What the rear cone holds when one thing about the base is changed."""
    rows = []
    for words, prepared in experiments(snapshot, settings):
        angle, mass = polar_angles(prepared, realisations, DIRECTION_SCATTER)
        found = zones_of(angle[mass >= REFERENCE["pit"]["lightest"]], realisations, REFERENCE)
        rows.append(_inform(f"{label}: rear cone, base with {words}", found.base, REFERENCE["percent"]["base"], "%"))
    return rows


def _inform(quantity: str, ours: float, reference: float | None, unit: str = "") -> Row:
    if reference is None:
        return Row(NAME, quantity, ours, None, None, None, None, _SOURCE, unit)
    return compare(NAME, quantity, ours, reference, None, _SOURCE, unit)
