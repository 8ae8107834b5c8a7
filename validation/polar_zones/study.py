"""The panel test of the 75 mm M48 from its bursts to its rows and its figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from transition import Snapshot
from transition.settings import DIRECTION_SCATTER
from validation.figures import keep_picture
from validation.polar_zones.check import NAME, REFERENCE, check_base, check_masses, check_zones
from validation.polar_zones.figure import draw
from validation.polar_zones.zones import sample_of
from validation.runs import summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from transition import BreakUpSettings
    from validation.options import Options
    from validation.polar_zones.zones import Sample
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

SIZES, QUICK_SIZES = ("3 mm", "2 mm", "1.5 mm"), ("3 mm",)
REALISATIONS, QUICK_REALISATIONS = 60, 20


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Burst both contours with several cells, break them up and count directions by zone."""
    sizes = (options.cell_size,) if options.cell_size else QUICK_SIZES if options.quick else SIZES
    count = QUICK_REALISATIONS if options.quick else REALISATIONS
    angles: dict[str, dict[str, NDArray[np.float64]]] = {}
    for contour in REFERENCE["contours"]:
        name = contour.removesuffix(".toml")
        for size in sizes:
            changes = {"round.*.profile": contour}
            case = REFERENCE["case"]
            folder = runs.run(f"{NAME}_{name}", case, size, changes, stage="burst", geometry="axisymmetric")
            summary, label = summary_of(folder), f"{name.replace('_', ' ')}, {size}"
            found = sound(NAME, summary, REFERENCE["sound"], label)
            rows += found
            if not all_passed(found):
                continue
            snapshot, settings = Snapshot.read(folder / "burst_snapshot.h5"), _settings(folder)
            sample = sample_of(snapshot, settings, REFERENCE, count)
            rows += check_masses(label, summary["burst"]) + check_zones(label, sample)
            if size == sizes[-1]:
                rows += check_base(label, snapshot, settings, count)
                angles[f"M48, {label} cells"] = _of_figure(sample)
    if angles:
        path = draw(angles, count, runs.folder / f"{NAME}.png")
        if options.readme:
            keep_picture(path)


def _settings(folder: Path) -> BreakUpSettings:
    from fragfield.case import read_resolved
    from fragfield.case.conversion.stages import break_up_settings

    return break_up_settings(read_resolved(folder / "case.toml"))


def _of_figure(sample: Sample) -> dict[str, NDArray[np.float64]]:
    """Polar angles of the fragments above half a gram, without the scatter and with it."""
    found = {}
    for words, scatter in (("no scatter", 0.0), ("scatter of the default", DIRECTION_SCATTER)):
        angle, mass = sample.angles(scatter)
        found[words] = angle[mass >= REFERENCE["pit"]["lightest"]]
    return found
