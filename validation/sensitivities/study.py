"""The sensitivities from their runs to their rows, tables and figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.figures import keep_picture
from validation.readme import LADDER, insert_tables
from validation.rows import Row, rows_table, within
from validation.runs import STOPPED, StudyError, summary_of
from validation.sensitivities.check import Answers, bounds, grid_rows, rows_of, sound_rows, tornado, values_table
from validation.sensitivities.figure import draw, draw_tornado, scales
from validation.sensitivities.responses import respond
from validation.sensitivities.variations import NAME, REFERENCE, base, parameters
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from validation.options import Options
    from validation.runs import Runs
    from validation.sensitivities.responses import Response
    from validation.sensitivities.variations import Parameter, Variation

__all__ = ["study"]


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Vary one parameter at a time; a variation whose burst stops or is not sound is reported, and left out."""
    bench = _Bench(options, runs, rows)
    origin = bench.response(base(quick=options.quick, size=options.cell_size))
    if origin is None:
        return  # nothing to hold the others against
    found = []
    for parameter in parameters(quick=options.quick, size=options.cell_size):
        found.append(bench.answers(parameter, origin))
        rows += [row for one in found[-1].responses for row in rows_of(one, origin)]
    rows += bench.worst()
    family = _family(found, origin)
    if family:
        rows += grid_rows(family)
    pictures = _draw(found, origin, runs)
    table = values_table(found, origin)
    (runs.folder / f"{NAME}.md").write_text(table + "\n", encoding="utf-8")
    if options.readme:
        for path in pictures:
            keep_picture(path)
        shown = ("grid convergence index", "against its limit")
        kept = [row for row in rows if row.passed is not None or any(words in row.quantity for words in shown)]
        insert_tables({NAME: rows_table(kept), f"{NAME}_values": table}, LADDER)


class _Bench:
    """Bursts made once each, with what speaks against them."""

    def __init__(self, options: Options, runs: Runs, rows: list[Row]) -> None:
        self.quick, self.threads, self.runs = options.quick, options.threads, runs
        self.realisations = REFERENCE["quick_realisations" if options.quick else "realisations"]
        self.rows = rows
        self.sound: list[Mapping[str, Any]] = []
        self.base: Path | None = None

    def response(self, variation: Variation) -> Response | None:
        """The answer to a variation; None, with rows that say why, where its burst cannot be used.

        Raises
        ------
        StudyError
            The base's burst stopped, or any input is at fault.
        """
        folder = self.base
        if variation.burst or folder is None:
            try:
                folder = self.runs.run(
                    variation.name, REFERENCE["case"], variation.size, variation.all_changes, stage="burst"
                )
            except StudyError as error:
                if error.code != STOPPED or self.base is None:
                    raise
                quantity = f"{variation.label}: bursts that stopped"
                self.rows.append(within(NAME, quantity, 1.0, 0.0, 0.0, "own bound"))
                return None
        summary = summary_of(folder)
        if variation.burst:
            rows = sound_rows(summary, variation, quick=self.quick)
            if not all_passed(rows):
                self.rows += [row for row in rows if row.passed is False]
                return None
            self.sound.append(summary["burst"])
        if self.base is None:
            self.base = folder
        return respond(folder, variation, summary["burst"], self.realisations, self.threads)

    def answers(self, parameter: Parameter, origin: Response) -> Answers:
        """The answers to all variations of a parameter."""
        responses = (self.response(one) for one in parameter.variations)
        return Answers(parameter, origin, tuple(one for one in responses if one is not None))

    def worst(self) -> list[Row]:
        """Rows of what the bursts must fulfil, each with the worst of those that were used."""
        worst = {
            "energy_error_at_outputs": max(burst["energy_error_at_outputs"] for burst in self.sound),
            "contact_error_at_end": max(burst["contact_error_at_end"] for burst in self.sound),
            "lost_cells": sum(burst["lost_cells"] for burst in self.sound),
            "cell_size": max(burst["cell_size"] for burst in self.sound),
        }
        label = f"worst of {len(self.sound)} bursts"
        last = 1e6 * max(burst["acceleration_complete"] for burst in self.sound)
        end = 1e6 * min(burst["end_time"] for burst in self.sound)
        return [
            *sound(NAME, {"burst": worst}, bounds(quick=self.quick), label),
            within(NAME, f"{label}: acceleration complete at", last, 0.0, end, "own bound", "us"),
        ]


def _family(found: Sequence[Answers], origin: Response) -> list[Response]:
    """The bursts of the family of cell sizes that the grid index is of, from coarse to fine; none if one is missing."""
    sizes = REFERENCE["parameters"]["cell_size"]["family"]
    others = [one for answers in found if answers.parameter.name == "cell_size" for one in answers.responses]
    by_size = {one.variation.size: one for one in (origin, *others)}
    wanted = [f"{size:g} mm" for size in sizes]
    return [by_size[size] for size in wanted] if by_size.keys() >= set(wanted) else []


def _draw(found: Sequence[Answers], origin: Response, runs: Runs) -> list[Path]:
    shown = [answers for answers in found if answers.responses]
    if not shown:
        return []
    ends = scales(shown)
    paths = [draw(answers, ends, runs.folder / f"{NAME}_{answers.parameter.name}.png") for answers in shown]
    return [*paths, draw_tornado(tornado(shown), origin, runs.folder / f"{NAME}_tornado.png")]
