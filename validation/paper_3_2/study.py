"""Case 3.2 from its runs to its rows, its figure and the README's tables."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from validation.ensembles import ring_ensemble_of_run
from validation.paper_3_2 import scaling, sensitivities
from validation.paper_3_2.check import NAME, REFERENCE, compare_with_mirrored, compare_with_paper, sound
from validation.paper_3_2.figure import by_azimuth_table, draw
from validation.paper_3_2.tables import ratio_table, sentences, versions
from validation.readme import PICTURES, insert_tables
from validation.rows import Row, compare, within
from validation.runs import StudyError, summary_of

if TYPE_CHECKING:
    from pathlib import Path

    from validation.options import Options
    from validation.runs import Runs

__all__ = ["FULL_SIZE", "QUICK_SIZE", "study"]

FULL_SIZE, QUICK_SIZE = "3 mm", "8 mm"
ROUNDS = {"single": 1, "pair": 2, "mirrored": 2}
SEEDS = {"pair": 1, "single": 2, "mirrored": 3}
"""Ensembles that are compared have seeds of their own."""


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Compare pair and single round; or only compute the sensitivities, or the scaling, where they are asked for."""
    if options.sensitivities or options.scaling:
        rows += _sensitivities(options, runs) if options.sensitivities else []
        rows += _scaling(options, runs) if options.scaling else []
        return
    folders = _folders(options, runs)
    summaries = {name: summary_of(folder) for name, folder in folders.items()}
    rows += (found := sound(summaries))
    if not all(row.passed for row in found):
        return  # an open ledger, lost cells or unlike cells make the comparison void
    ensembles = {
        name: ring_ensemble_of_run(
            folder, ROUNDS[name], seed=SEEDS[name], realisations=options.realisations, threads=options.threads
        )
        for name, folder in folders.items()
    }
    pair, single = ensembles["pair"], ensembles["single"]
    findings = [compare_with_paper(pair, single, surface) for surface in ("every_height", "band")]
    for finding in findings:
        rows += finding.rows
    if "mirrored" in ensembles:
        rows += compare_with_mirrored(pair, ensembles["mirrored"], single)
    by_azimuth_table(pair, single, runs.folder / f"{NAME}_by_azimuth.csv")
    picture = draw(pair, single, runs.folder / f"{NAME}_ring.png")
    text = sentences([finding.sentence for finding in findings])
    (runs.folder / f"{NAME}.txt").write_text(f"{text}\n\n{ratio_table(pair, single)}\n", encoding="utf-8")
    if options.readme:
        PICTURES.mkdir(parents=True, exist_ok=True)
        (PICTURES / f"{NAME}_ring.png").write_bytes(picture.read_bytes())
        insert_tables(
            {NAME: ratio_table(pair, single), f"{NAME}_sentence": text, f"{NAME}_versions": versions(summaries["pair"])}
        )


def _folders(options: Options, runs: Runs) -> dict[str, Path]:
    """Run directories, the single round's first; given ones are taken, and then nothing is run."""
    given = {"single": options.single, "pair": options.pair, "mirrored": options.mirrored}
    taken = {name: folder for name, folder in given.items() if folder is not None}
    if taken:
        for name in ("single", "pair"):
            if name not in taken:
                raise StudyError(f"{NAME}: --{name} is missing; a comparison needs --single and --pair")
        return taken
    size = options.cell_size or (QUICK_SIZE if options.quick else FULL_SIZE)
    return {name: runs.run(f"{NAME}_{name}", REFERENCE[name], size, stage="burst") for name in given}


def _sensitivities(options: Options, runs: Runs) -> list[Row]:
    outcomes = sensitivities.compute(runs, realisations=options.realisations, base_size=options.cell_size)
    table = sensitivities.table(outcomes)
    content = json.dumps([outcome.as_dict() for outcome in outcomes], indent=1)
    (runs.folder / f"{NAME}_sensitivities.json").write_text(content, encoding="utf-8")
    (runs.folder / f"{NAME}_sensitivities.md").write_text(table + "\n", encoding="utf-8")
    if options.readme:
        insert_tables({f"{NAME}_sensitivities": table})
    base = outcomes[0]
    rows = []
    for outcome in outcomes:
        if not outcome.sound:
            rows.append(_void(outcome))
            continue
        for half_width in sensitivities.HALF_WIDTHS:
            for kind in ("number", "speed"):
                ratio, of_base = getattr(outcome, kind)[half_width], getattr(base, kind)[half_width]
                words = "ratio of largest initial speeds in 1 deg" if kind == "speed" else "number ratio"
                quantity = f"{outcome.variation.words}: {words} within {half_width:g} deg (error {ratio.error:.2g})"
                rows.append(compare(NAME, quantity, ratio.value, of_base.value, None, "the base"))
    return rows


def _void(outcome: sensitivities.Outcome) -> Row:
    if outcome.stopped:
        return within(NAME, f"{outcome.variation.words}: bursts that stopped", 1.0, 0.0, 0.0, "own bound")
    quantity = f"{outcome.variation.words}: energy error, or {outcome.lost_cells} lost cells"
    allowed = REFERENCE["allowed"]["energy_error"]
    return Row(NAME, quantity, outcome.energy_error, allowed, None, 0.0, False, "own bound")


def _scaling(options: Options, runs: Runs) -> list[Row]:
    summaries = scaling.compute(runs, options.cell_size or scaling.SIZE)
    table = scaling.table(summaries)
    (runs.folder / f"{NAME}_scaling.md").write_text(table + "\n", encoding="utf-8")
    if options.readme:
        insert_tables({f"{NAME}_scaling": table})
    return scaling.rows(summaries)
