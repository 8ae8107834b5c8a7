"""One run divided by another, a pair by its single round: ratios of the results, and the inputs that differ."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fragfield.case import differences
from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.quantities import shown, value_at

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from fragfield.quantities import Quantity


def inputs_that_differ(run: Path, reference: Path) -> list[str]:
    """A line a key in which the cases of two runs differ; raises InputError where a folder is no run."""
    other, mine = (RunDirectory(folder).stored_case() for folder in (reference, run))
    return differences(other, mine, words=("reference", "run"))


def ratios(run: Path, reference: Path) -> list[dict[str, Any]]:
    """A row a quantity that both runs have: its path in the summary, label, unit, both values, ratio and its error.

    The standard error is that of independent realisations, None where a run has none. Recommended distances that hold
    different parts have no ratio: one would seem larger by what is known of it alone. Raises InputError where a
    summary is damaged or has no results.
    """
    summaries = [_summary(folder) for folder in (run, reference)]
    return [row for one in shown("compare") for row in _row(one, *summaries)]


def _summary(folder: Path) -> dict[str, Any]:
    found = RunDirectory(folder).summary()
    if not any(isinstance(found.get(part), dict) for part in ("burst", "flight")):
        raise InputError(f"{folder}: its summary.json has no results; run `fragfield run` first")
    return found


def _row(one: Quantity, run: Mapping[str, Any], reference: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    mine, other = one.of(run), one.of(reference)
    if mine is None or other is None:
        return
    alike = not one.path.endswith(".recommended") or _parts(run) == _parts(reference)
    ratio = mine / other if other and alike else None
    errors = [value_at(each, one.error) if one.error else None for each in (run, reference)]
    error = None
    if ratio and None not in errors:
        error = ratio * math.hypot(errors[0] / mine, errors[1] / other)
    yield {
        "quantity": one.path, "label": one.label, "unit": one.unit, "run": mine, "reference": other, "ratio": ratio,
        "ratio_error": error,
    }  # fmt: skip


def _parts(summary: Mapping[str, Any]) -> set[str]:
    """The parts that a recommended distance holds."""
    return {name for name, value in summary["hazard"]["parts"].items() if value is not None}


def print_ratios(found: Mapping[str, Any]) -> None:
    """Print the inputs that differ and the ratios."""
    from rich.table import Table

    from fragfield.terminal.show import plain_console

    console, table = plain_console(), Table(box=None, pad_edge=False)
    for line in found["differences"] or ["no input differs"]:
        console.print(line)
    for head in ("", "unit", "run", "reference", "ratio", "±"):
        table.add_column(head, justify="right" if head not in ("", "unit") else "left")
    for row in found["ratios"]:
        numbers = (row[key] for key in ("run", "reference", "ratio", "ratio_error"))
        table.add_row(row["label"], row["unit"], *("" if value is None else f"{value:.4g}" for value in numbers))
    console.print(table)
    if any(row["ratio"] is None and row["reference"] for row in found["ratios"]):
        console.print("no ratio of recommended distances: they hold different parts; compare the expected distances")
