"""Findings on flight and distance: certainty, convergence, imprint of the mesh."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fragfield.numbers import number
from fragfield.pipeline.grid_convergence import KINDS
from fragfield.report.findings.finding import Finding
from fragfield.results.words import certainty

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.interface.results import Run
    from fragfield.results.hazard import Hazard


_SMALLER = "smaller cells reduce it (burst.cell_size)"
_ADVICE = {
    "statistical": "the sizes differ within their statistical error, so that more realisations reduce it (a smaller "
    "hazard.tolerance) and smaller cells do not",
    "oscillating": "the sizes differ to both sides, which is in the recommended distance, and a further size need not "
    "reduce it",
    "diverging": "the sizes do not converge, and what they differ by is in the recommended distance",
}
_MOST_TOLERANCES = 3.0  # of hazard.tolerance, that the cells may add


def flight_findings(run: Run) -> Iterator[Finding]:
    """Certainty of the distance, and fragments outside the drag table or still in the air."""
    if run.summary.hazard:
        yield from _certainty(run.summary.hazard)
    if (flight := run.summary.flight) is None or not flight.fragments:
        return
    flown = number(flight.fragments)
    if flight.above_drag_table:
        yield Finding(
            "warning",
            f"{number(flight.above_drag_table)} of {flown} fragments were faster than the end of the drag table "
            f"“{flight.drag}”; its last coefficient was used there.",
        )
    if held := flight.status.stopped.fragments:
        yield Finding("note", f"{number(held)} of {flown} fragments were stopped by obstacles.")
    if (left := flight.fragments - flight.landed - held) > 0:
        yield Finding("note", f"{number(left)} of {flown} fragments did not land.")


def _certainty(hazard: Hazard) -> Iterator[Finding]:
    """Whether the distance is determined, and whether there are enough realisations."""
    words = certainty(hazard)
    if words or hazard.standard_error is None:
        yield Finding("warning" if hazard.determined else "stop", f"{words[0].upper()}{words[1:]}.")
        return
    share = 100 * hazard.standard_error / hazard.expected if hazard.expected else 0.0
    good = {
        "integral": "The expected density is an integral: no random number is in the distance.",
        "weighted_fragments": f"Weighted fragments fix the expected distance to {share:.1f} % (standard error); the "
        "case's seed is not in it.",
        "realisations": f"{number(hazard.realisations)} realisations fix the expected distance to {share:.1f} % "
        f"(standard error; `hazard.tolerance` asks for {100 * hazard.tolerance:g} %).",
    }
    yield Finding("good", good[hazard.method])
    bias = hazard.max_bias or 0.0
    if hazard.expected and bias > 0.5 * hazard.standard_error:
        share = 100 * bias / hazard.expected
        text = f"Taking the worst direction makes the expected distance {share:.1g} % too large, which is taken off it."
        yield Finding("note", text)


def convergence_findings(run: Run) -> Iterator[Finding]:
    """How far the cells, apart from randomness, leave the expected distance open."""
    found, hazard = run.summary.convergence, run.summary.hazard
    if found is None or hazard is None or not hazard.determined:
        return
    entry = (found.quantities or {}).get("expected_distance")
    if entry is None or entry.uncertainty is None or not hazard.expected:
        if found.reason:
            yield Finding("note", f"{found.reason[0].upper()}{found.reason[1:]}.")
        return
    share, tolerance = entry.uncertainty / hazard.expected, hazard.tolerance
    text = f"The cell size leaves the expected distance uncertain by {number(100.0 * share, 2)} %"
    if share > _MOST_TOLERANCES * tolerance:
        text += f" ({KINDS[entry.kind]}), several times `hazard.tolerance` ({100.0 * tolerance:g} %)"
        yield Finding("warning", f"{text}: {_ADVICE.get(entry.kind, _SMALLER)}.")
    else:
        yield Finding("good", f"{text} (grid convergence, in addition to its statistical error).")


def imprint_findings(run: Run) -> Iterator[Finding]:
    """Numbers that differ between neighbouring sectors far more than randomness explains: the mesh may show."""
    for witness in run.summary.witness or ():
        hits = np.array([sector.hits for sector in witness.by_azimuth], dtype=float)
        if len(hits) < 12 or hits.mean() < 5:
            continue
        # A count's variance is its mean; less the mean of two neighbours it is 3/2 of that. Fragments fill the casing
        # without gaps, which alone makes it two to three times as much.
        jump = hits - 0.5 * (np.roll(hits, 1) + np.roll(hits, -1))
        ratio = float(np.mean(jump**2) / (1.5 * hits.mean()))
        if ratio > 6.0:
            yield Finding(
                "warning",
                f"Numbers by azimuth on “{witness.name}” differ between neighbouring sectors "
                f"{math.sqrt(ratio):.1f} times as much as independent counts would: directions may be affected by the "
                "mesh. Judge single sectors only with smaller cells, or use wider sectors.",
            )
