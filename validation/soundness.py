"""What a burst must fulfil before its numbers are compared with anything: one way for all cases.

Where one of these rows fails, the comparison is void: the study returns them alone, and the case has failed.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from validation.rows import Row, within

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

__all__ = ["all_passed", "sound", "void_where_unsound"]

_SOURCE = "own bound"
MOST_OF_CONTACT = 0.01
"""Energy that contact may have made or lost by the end of a burst, over the work of the products."""


def sound(case: str, summary: Mapping[str, Any], bounds: Mapping[str, float], label: str = "") -> list[Row]:
    """Whether a burst may be compared: ledger closed, no cell lost, cells small enough.

    Parameters
    ----------
    case : str
        Name of the case.
    summary : mapping
        The run's summary.json.
    bounds : mapping
        `energy_error`, the largest of the ledger at the outputs, relative to the work done; `coarsest_cell_size` (m).
    label : str
        What the run is, where a case has several.
    """
    burst = summary["burst"]
    start = f"{label}: " if label else ""
    error, size = burst["energy_error_at_outputs"], 1e3 * burst["cell_size"]
    # A hair more than the bound: a cell size is the same number whatever the unit that it was given in.
    coarsest = 1e3 * bounds["coarsest_cell_size"] * (1.0 + 1e-9)
    return [
        within(case, f"{start}energy error at the outputs", error, 0.0, bounds["energy_error"], _SOURCE),
        within(
            case,
            f"{start}energy that contact made, at the end",
            burst["contact_error_at_end"],
            0.0,
            MOST_OF_CONTACT,
            _SOURCE,
        ),
        within(case, f"{start}lost cells", float(burst["lost_cells"]), 0.0, 0.0, _SOURCE),
        within(case, f"{start}cell size", size, 0.0, coarsest, _SOURCE, "mm"),
    ]


@contextmanager
def void_where_unsound(unsound: list[Row], rows: list[Row]) -> Iterator[None]:
    """A comparison of several bursts: where one of them adds a row to `unsound`, such rows are all that is left."""
    try:
        yield
    finally:
        if unsound:
            rows[:] = unsound


def all_passed(rows: Iterable[Row]) -> bool:
    """Whether no row has failed."""
    return all(row.passed is not False for row in rows)
