"""One run divided by another, a pair by its single round."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.interface.kinds import PathName
from fragfield.interface.results import Run
from fragfield.quantities import Quantity, shown
from fragfield.results.part import value_at
from fragfield.results.summary import Summary

if TYPE_CHECKING:
    from pandas import DataFrame


def compare_runs(run: Run | PathName, reference: Run | PathName) -> DataFrame:
    """Divide what a run gave by what a reference run gave.

    Recommended distances that hold different parts have no ratio: one would seem larger by what is known of it alone.

    Parameters
    ----------
    run, reference : Run or path
        Runs, or their directories.

    Returns
    -------
    pandas.DataFrame
        A row a quantity that both have: `quantity` (its path in the summary), `label`, `unit`, `run`, `reference` (SI),
        `ratio` and `ratio_error` (standard error of independent realisations, NaN where a run has none).

    Raises
    ------
    InputError
        A directory is no run, or its summary is damaged or has no results.
    """
    runs = [one if isinstance(one, Run) else Run(one) for one in (run, reference)]
    for one in runs:
        one.case  # noqa: B018 - says what is wrong with the directory
        if one.summary.burst is None and one.summary.flight is None:
            raise InputError(f"{one.path}: its summary.json has no results; run `fragfield run` first")
    summaries = [one.summary for one in runs]
    from pandas import DataFrame

    return DataFrame([row for one in shown("compare") for row in _row(one, *summaries)])


def _row(one: Quantity, run: Summary, reference: Summary) -> Iterator[dict[str, Any]]:
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


def _parts(summary: Summary) -> set[str]:
    return (
        set()
        if summary.hazard is None
        else {key for key, value in vars(summary.hazard.parts).items() if value is not None}
    )
