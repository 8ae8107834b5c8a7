"""The pair of M107 from its runs to its rows and tables."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import copysign
from typing import TYPE_CHECKING, Any

from validation.ensembles import ring_ensemble_of_run
from validation.m107_pair.check import (
    BINS_OF_PAPER,
    NAME,
    REFERENCE,
    convergence_rows,
    cost_rows,
    end_row,
    reading_rows,
    symmetry_rows,
)
from validation.m107_pair.sectors import focus, profile, reading
from validation.m107_pair.tables import convergence_table, reading_table, symmetry_table
from validation.readme import insert_tables
from validation.runs import STOPPED, StudyError, summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from validation.ensembles import RingEnsemble
    from validation.m107_pair.sectors import Key
    from validation.options import Options
    from validation.paper_3_2.ratios import Estimate
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

_SEEDS = {"quarter": 1, "single": 2, "mirrored": 3, "full": 4}
"""Ensembles of forms that are compared have seeds of their own."""


@dataclass
class _Pairs:
    """Bursts and ensembles by form, cell size and move, each made once; rows say which must be left out."""

    options: Options
    runs: Runs
    rows: list[Row]
    folders: dict[tuple[str, str, float], Path | None] = field(default_factory=dict)
    ensembles: dict[tuple[str, str, float], RingEnsemble | None] = field(default_factory=dict)

    def folder(self, form: str, size: str, move: float = 0.0) -> Path | None:
        """Run directory of a form, the gap wider by `move` (m); None where the burst stopped or is not sound."""
        key = form, size, move
        if key not in self.folders:
            self.folders[key] = self._run(*key)
        return self.folders[key]

    def _run(self, form: str, size: str, move: float) -> Path | None:
        case, symmetry, geometry = REFERENCE["forms"][form]
        changes: dict[str, Any] = {"burst.symmetry": symmetry}
        name = form
        if move:
            changes["round.*.position.0"] = _farther(move)
            name = f"{form}_{1e6 * move:+g}_um"
        try:
            folder = self.runs.run(f"{NAME}_{name}", case, size, changes, stage="burst", geometry=geometry)
        except StudyError as error:
            if error.code != STOPPED:
                raise
            self.rows.append(end_row(f"{size}, {name}", ended=False))
            return None
        checks = sound(NAME, summary_of(folder), REFERENCE["sound"], f"{size}, {name}")
        self.rows += [row for row in checks if row.passed is False]
        return folder if all_passed(checks) else None

    def ensemble(self, form: str, size: str, move: float = 0.0) -> RingEnsemble | None:
        """Its realisations on the ring: more where forms are compared."""
        key = form, size, move
        if key not in self.ensembles:
            folder = self.folder(*key)
            compared = not move and size in _sizes(self.options, "symmetry")
            self.ensembles[key] = folder and ring_ensemble_of_run(
                folder,
                1 if form == "single" else 2,
                seed=_SEEDS[form],
                realisations=self.options.realisations * (REFERENCE["symmetry"]["more"] if compared else 1),
                threads=self.options.threads,
            )
        return self.ensembles[key]

    def fan(self, form: str, size: str) -> list[dict[Key, Estimate]]:
        """Profiles of a form whose gaps differ by micrometres, those left out that stopped."""
        made = [self.ensemble(form, size, move) for move in (0.0, *REFERENCE["symmetry"]["moves"])]
        return [profile(ensemble) for ensemble in made if ensemble]

    def burst(self, form: str, size: str) -> dict[str, Any]:
        """The entry "burst" of its summary; empty where there is none."""
        folder = self.folder(form, size)
        found: dict[str, Any] = summary_of(folder)["burst"] if folder else {}
        return found


def _farther(move: float) -> Callable[[str], str]:
    """Move a round away from the plane x = 0 by half of what the gap grows (m)."""

    def moved(old: str) -> str:
        x = float(old.split(maxsplit=1)[0])
        return f"{x + copysign(0.5 * move, x)!r} m"

    return moved


def _sizes(options: Options, part: str) -> list[str]:
    if options.cell_size:
        return [options.cell_size]
    found: list[str] = REFERENCE[part]["quick_sizes" if options.quick else "sizes"]
    return found


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Compare the forms of the burst, then the quarter over cell sizes, then its peaks with the paper's."""
    pairs = _Pairs(options, runs, rows)
    profiles, bursts = {}, {}
    for size in _sizes(options, "symmetry"):
        made = {form: pairs.ensemble(form, size) for form in ("quarter", "mirrored", "full")}
        forms = {form: profile(ensemble) for form, ensemble in made.items() if ensemble}
        if "quarter" not in forms:
            continue
        fans = (
            {} if profiles or options.quick else {form: pairs.fan(form, size) for form in REFERENCE["symmetry"]["fans"]}
        )
        profiles[size], bursts[size] = forms, {form: pairs.burst(form, size) for form in forms}
        rows += cost_rows(size, bursts[size]) + symmetry_rows(size, forms, fans)
    quarters = {size: pairs.ensemble("quarter", size) for size in _sizes(options, "convergence")}
    found = {size: focus(ensemble) for size, ensemble in quarters.items() if ensemble}
    rows += convergence_rows(found)
    readings = {}
    for size in _sizes(options, "reading"):
        pair, single = pairs.ensemble("quarter", size), pairs.ensemble("single", size)
        if pair and single:
            readings[size] = reading(pair, single, BINS_OF_PAPER)
    rows += reading_rows(readings)
    if options.readme and not options.quick and not options.cell_size:
        insert_tables(
            {
                f"{NAME}_symmetry": symmetry_table(profiles, bursts),
                f"{NAME}_convergence": convergence_table(found, {size: pairs.burst("quarter", size) for size in found}),
                f"{NAME}_reading": reading_table(readings),
            }
        )
