"""One comparison of a computed quantity with a reference, and how rows are shown."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

__all__ = ["Row", "compare", "markdown_table", "print_rows", "rows_table", "within"]


@dataclass(frozen=True)
class Row:
    """A quantity beside its reference.

    Attributes
    ----------
    case, quantity : what is compared.
    ours, reference : values in `unit`; a reference of None is a bound on ours alone, which holds.
    error : relative (of a bound that is missed the distance outside), with its sign; None where a bound holds.
    tolerance : largest allowed size of the error; None where the row only informs.
    passed : the verdict; None where the row only informs.
    source : where the reference comes from.
    unit : of `ours` and `reference`.
    bounds : lowest and highest value allowed, where that is what is asked for; None for no bound on a side.
    """

    case: str
    quantity: str
    ours: float
    reference: float | None
    error: float | None
    tolerance: float | None
    passed: bool | None
    source: str
    unit: str = ""
    bounds: tuple[float | None, float | None] | None = None

    def as_dict(self) -> dict[str, Any]:
        """The row as the machine-readable output has it."""
        return asdict(self)

    @property
    def has_numbers(self) -> bool:
        """Whether no value is NaN or infinite; one that is not there by design is None."""
        return all(value is None or math.isfinite(value) for value in (self.ours, self.reference, self.error))


def compare(
    case: str, quantity: str, ours: float, reference: float, tolerance: float | None, source: str, unit: str = ""
) -> Row:
    """Compare with a reference by the relative error."""
    error = ours / reference - 1.0
    passed = None if tolerance is None else bool(abs(error) <= tolerance)
    return Row(case, quantity, ours, reference, error, tolerance, passed, source, unit)


def within(case: str, quantity: str, ours: float, low: float, high: float, source: str, unit: str = "") -> Row:
    """Ask for a value between two bounds; only a value outside has a reference, the bound, and an error from it."""
    passed = bool(low <= ours <= high)
    reference = None if passed else min(max(ours, low), high)
    error = None if reference is None else ours - reference
    bounds = (low if math.isfinite(low) else None, high if math.isfinite(high) else None)
    return Row(case, quantity, ours, reference, error, 0.0, passed, source, unit, bounds)


def print_rows(rows: Sequence[Row]) -> None:
    """Print the rows as a table on stdout."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title="Computed against reference")
    for name in ("case", "quantity", "ours", "reference", "error", "allowed", "verdict", "source"):
        table.add_column(name, justify="left" if name in ("case", "quantity", "source") else "right")
    for row in rows:
        table.add_row(row.case, f"{row.quantity} [{row.unit}]" if row.unit else row.quantity, *_cells(row), row.source)
    # A pipe has no width of its own; there a row stays on one line.
    console = Console()
    Console(width=None if console.is_terminal else 200).print(table)


def rows_table(rows: Iterable[Row]) -> str:
    """The rows as a table in Markdown, all of one case."""
    head = ("quantity", "ours", "reference", "error", "allowed", "verdict", "source")
    body = []
    for row in rows:
        ours, reference, *rest = _cells(row)
        unit = f" {row.unit}" if row.unit else ""
        reference = reference if row.reference is None else f"{reference}{unit}"
        body.append((row.quantity, f"{ours}{unit}", reference, *rest, row.source))
    return markdown_table(head, body)


def _cells(row: Row) -> tuple[str, str, str, str, str]:
    verdict = "-" if row.passed is None else ("passed" if row.passed else "MISSED")
    reference = "-" if row.reference is None else f"{row.reference:.4g}"
    bounded = row.tolerance == 0.0
    error = "-" if row.error is None else (f"{row.error:+.2g}" if bounded else f"{100 * row.error:+.1f} %")
    allowed = "-" if row.tolerance is None else (_range(row.bounds) if bounded else f"{100 * row.tolerance:g} %")
    return f"{row.ours:.4g}", reference, error, allowed, verdict


def _range(bounds: tuple[float | None, float | None] | None) -> str:
    """Bounds in words; those of earlier records are not known."""
    if bounds is None or bounds == (None, None):
        return "in range"
    low, high = bounds
    if low is None or high is None:
        return f"{high:.4g} or less" if high is not None else f"{low:.4g} or more"
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def markdown_table(head: Iterable[str], body: Iterable[Iterable[str]]) -> str:
    """A table for the README."""
    titles = list(head)
    lines = ["| " + " | ".join(titles) + " |", "|" + "|".join(" --- " for _ in titles) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in body]
    return "\n".join(lines)
