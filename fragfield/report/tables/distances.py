"""Tables of distances: the recommended distance with its parts and its neighbours, and the distance by direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.hazard.recommended import RULE
from fragfield.report.blocks import Table
from fragfield.results.words import distances

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.report.reading.run_files import RunFiles


def distance_table(run: RunFiles) -> Iterator[Table]:
    """The recommended distance, its parts, and beside it what single events do."""
    hazard = run.summary.hazard
    if hazard is None:
        return
    head, lines = ("Distance (m)", "Value", "What it is"), tuple(distances(hazard))
    if not hazard.determined:
        yield Table("Distances", head, lines)
        return
    of_what = "over the sets of points of an integral or of weighted fragments, else over the realisations"
    note = f"{RULE} ± is the standard error: {of_what}.{_tilt_words(run)}"
    yield Table("Distances", head, lines, note)


def _tilt_words(run: RunFiles) -> str:
    """How far from plumb the realisations stand; nothing where they are upright, or were flown from a file."""
    deviation = run.part("break_up").get("tilt_deviation") or 0.0
    if not deviation:
        return ""
    return (
        " Every realisation is tilted at random from the vertical, by a standard deviation of "
        f"{np.degrees(deviation):.3g}° about each horizontal axis (break_up.tilt, a judgement)."
    )
