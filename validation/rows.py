"""One comparison of a computed quantity with a reference, and how rows are shown."""

from __future__ import annotations

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
    ours, reference : values in `unit`; a reference of None is a bound on ours alone.
    error : relative (or absolute where the reference is None), with its sign.
    tolerance : largest allowed size of the error; None where the row only informs.
    passed : the verdict; None where the row only informs.
    source : where the reference comes from.
    unit : of `ours` and `reference`.
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

    def as_dict(self) -> dict[str, Any]:
        """The row as the machine-readable output has it."""
        return asdict(self)


def compare(
    case: str, quantity: str, ours: float, reference: float, tolerance: float | None, source: str, unit: str = ""
) -> Row:
    """Compare with a reference by the relative error."""
    error = ours / reference - 1.0
    passed = None if tolerance is None else bool(abs(error) <= tolerance)
    return Row(case, quantity, ours, reference, error, tolerance, passed, source, unit)


def within(case: str, quantity: str, ours: float, low: float, high: float, source: str, unit: str = "") -> Row:
    """Ask for a value between two bounds; the reference shown is the nearer bound, the error the distance outside."""
    reference = min(max(ours, low), high)
    error = ours - reference
    return Row(case, quantity, ours, reference, error, 0.0, bool(low <= ours <= high), source, unit)


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
    allowed = "-" if row.tolerance is None else ("in range" if bounded else f"{100 * row.tolerance:g} %")
    return f"{row.ours:.4g}", reference, error, allowed, verdict


def markdown_table(head: Iterable[str], body: Iterable[Iterable[str]]) -> str:
    """A table for the README."""
    titles = list(head)
    lines = ["| " + " | ".join(titles) + " |", "|" + "|".join(" --- " for _ in titles) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in body]
    return "\n".join(lines)
