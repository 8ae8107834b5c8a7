"""Directions of natural fragments: the panel test of the 75 mm M48 by polar zone, and the scatter of directions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from transition import Snapshot
from transition.settings import DIRECTION_SCATTER
from validation.figures import keep_picture
from validation.polar_zones.figure import draw
from validation.polar_zones.zones import REFERENCE, deciding_scatter, sample_of, zones_of
from validation.runs import break_up_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from validation.polar_zones.zones import Sample
    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["check_zones", "study"]

SIZE, QUICK_SIZE = "2 mm", "3 mm"
REALISATIONS, QUICK_REALISATIONS = 60, 20
SCATTERS = np.arange(3.0, 10.01, 1.0)
"""Scatters that are tried (degrees)."""
_SOURCE = REFERENCE["source"]
_TWO = 2.0
"""Standard errors that make a test's uncertainty."""
_ZONES = {
    "side": "in 76 to 111 degrees",
    "between": "between the zones",
    "base": "in the rear cone, 162.5 to 180 degrees",
    "nose": "in the front cone, 0 to 17.5 degrees",
}


def study(runs: Runs, rows: Rows) -> None:
    """Burst both contours that the test's masses allow, break them up and count directions by zone."""
    count = QUICK_REALISATIONS if rows.quick else REALISATIONS
    angles: dict[str, dict[str, NDArray[np.float64]]] = {}
    for contour in REFERENCE["contours"]:
        name = contour.removesuffix(".toml")
        folder, burst = runs.burst(f"polar_zones_{name}", REFERENCE["case"], QUICK_SIZE if rows.quick else SIZE,
                                   {"round.*.profile": contour})  # fmt: skip
        label, masses = name.replace("_", " "), REFERENCE["masses"]
        rows.verify(f"{label}: mass of the body", burst["casing_mass"], masses["body"], 1e-3, _SOURCE, "kg")
        sample = sample_of(Snapshot.read(folder / "burst_snapshot.h5"), break_up_of(folder), count)
        check_zones(rows, label, sample)
        angles[f"M48, {label}"] = _of_figure(sample)
    path = draw(angles, count, runs.folder / "polar_zones.png")
    if not rows.quick:
        keep_picture(path)


def check_zones(rows: Rows, label: str, sample: Sample) -> None:
    """Rows of one contour: number, zones, perforations at the boards, and the scatter that the peaks ask for."""
    angle, mass = sample.angles(DIRECTION_SCATTER)
    pit, percent = REFERENCE["pit"], REFERENCE["percent"]
    found = zones_of(angle[mass >= pit["lightest"]], sample.realisations)
    rows.compare(f"{label}: fragments above 0.5 g", found.number, pit["pieces"], _SOURCE,
                 uncertainty=_TWO * pit["standard_error"])  # fmt: skip
    errors = {zone: _TWO * error for zone, error in percent["standard_error"].items()}
    for zone, words in _ZONES.items():
        rows.compare(f"{label}: {words}", getattr(found, zone), percent[zone], _SOURCE, "%",
                     uncertainty=errors.get(zone))  # fmt: skip
    limit = sample.limit(REFERENCE["boards"]["number"][0])
    peak = REFERENCE["peak"]
    for board, feet in enumerate(REFERENCE["boards"]["distance_ft"][1:], start=1):
        through = zones_of(angle[sample.energy[board] >= limit], sample.realisations)
        measured, error = peak["over_mean"][board - 1], peak["standard_error"][board - 1]
        rows.compare(f"{label}: peak over mean at {feet:g} ft", through.peak, measured, _SOURCE,
                     uncertainty=_TWO * error / measured)  # fmt: skip
    best, low, high = _asked_for(sample, limit)
    default = math.degrees(DIRECTION_SCATTER)
    rows.trend(f"{label}: scatter of directions that both peaks ask for ({low:.1f} to {high:.1f}, one standard error), "
               "beside the default", best, default, _SOURCE, "deg")  # fmt: skip


def _asked_for(sample: Sample, limit: float) -> tuple[float, float, float]:
    peaks = np.empty((len(SCATTERS), 2))
    for row, degrees in enumerate(SCATTERS):
        angle, _ = sample.angles(math.radians(degrees))
        for board in (1, 2):
            peaks[row, board - 1] = zones_of(angle[sample.energy[board] >= limit], sample.realisations).peak
    peak = REFERENCE["peak"]
    return deciding_scatter(SCATTERS, peaks, np.array(peak["over_mean"]), np.array(peak["standard_error"]))


def _of_figure(sample: Sample) -> dict[str, NDArray[np.float64]]:
    """Polar angles of the fragments above half a gram, without the scatter and with it."""
    found = {}
    for words, scatter in (("no scatter", 0.0), ("scatter of the default", DIRECTION_SCATTER)):
        angle, mass = sample.angles(scatter)
        found[words] = angle[mass >= REFERENCE["pit"]["lightest"]]
    return found
