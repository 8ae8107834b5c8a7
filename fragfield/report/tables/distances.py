"""Tables of distances: the recommended distance with its parts and its neighbours, and the distance by direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.hazard.certainty import (
    basis_words,
    metres_and_error,
    ricochet_words,
    rounded_metres,
    single_note,
    source_words,
    whole_metres,
)
from fragfield.hazard.recommended import RULE, parts_of
from fragfield.numbers import SPACE
from fragfield.report.blocks import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.report.reading.run_files import RunFiles


def distance_table(run: RunFiles) -> Iterator[Table]:
    """The recommended distance, its parts, and beside it what single events do."""
    hazard = run.part("hazard")
    if not hazard:
        return
    head = ("Distance (m)", "Value", "What it is")
    if not hazard["determined"]:
        yield Table("Distances", head, (("Recommended distance", "not determined", hazard["reason"]),))
        return
    short = hazard.get("without_ricochet") or dict.fromkeys(("recommended", "expected", "standard_error"))
    bias = f"; {hazard['max_bias']:.2g}{SPACE}m taken off for taking the worst direction"
    single = hazard["single_event"]
    span = f"{rounded_metres(single['low'])}{SPACE}–{SPACE}{rounded_metres(single['high'])}"
    expected, *added = parts_of(hazard)
    lines = [
        ("Recommended distance", whole_metres(hazard["recommended"]), f"to keep; {basis_words(hazard)}"),
        (
            "Expected distance", metres_and_error(expected.value, hazard["standard_error"], SPACE),
            f"{source_words(hazard)}{bias if hazard['max_bias'] else ''}",
        ),
        *(
            (f"– {part.words}", "–" if part.value is None else f"{part.value:.1f}", part.reason or "part of it")
            for part in added
        ),
        ("Expected, by area of ground alone", whole_metres(hazard["distance_ground"]), "density of landings"),
        (
            "Expected, normal to the paths alone", whole_metres(hazard["distance_normal"]),
            "along the paths below a person's height",
        ),
        (
            "Recommended, without ricochet", whole_metres(short["recommended"]),
            f"all other distances are {ricochet_words(hazard).partition(';')[0]}",
        ),
        (
            "Single events: median, 5 to 95 %", f"{rounded_metres(single['median'])}, {span}",
            single_note(hazard),
        ),
        (
            "Throw exceeded in 5 % of events", rounded_metres(hazard["largest_throw"]),
            "no distance to keep: the farthest fragment of an event",
        ),
    ]  # fmt: skip
    of_what = "over the sets of points of an integral or of weighted fragments, else over the realisations"
    note = f"{RULE} ± is the standard error: {of_what}.{_tilt_words(run)}"
    yield Table("Distances", head, tuple(lines), note)


def _tilt_words(run: RunFiles) -> str:
    """How far from plumb the realisations stand; nothing where they are upright, or were flown from a file."""
    deviation = run.part("break_up").get("tilt_deviation") or 0.0
    if not deviation:
        return ""
    return (
        " Every realisation is tilted at random from the vertical, by a standard deviation of "
        f"{np.degrees(deviation):.3g}° about each horizontal axis (break_up.tilt, a judgement)."
    )
