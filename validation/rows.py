"""Rows of the validation: a quantity, what was computed, its reference, and what may be said of the difference.

A row is of one of three kinds:

verification
    The reference is exact (a closed form, a conserved quantity, a rate of convergence), or a bound that holds for every
    correct computation. It passes or fails, and one that fails fails the validation.
comparison
    The reference is a test, or another code. Where it states its own uncertainty, the row says whether the difference
    lies within it; where it states none, there is the error and no verdict.
trend
    How a quantity moves with an input or with the cells. Only a direction that theory requires has a verdict.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

__all__ = ["KINDS", "Row", "Rows", "markdown_table", "print_rows", "rows_table", "shown"]

Kind = Literal["verification", "comparison", "trend"]
KINDS: tuple[Kind, ...] = ("verification", "comparison", "trend")


@dataclass(frozen=True)
class Row:
    """A quantity beside its reference.

    Attributes
    ----------
    case, quantity : what is compared.
    ours, reference : values in `unit`; a reference of None is a bound on ours alone that holds, or a value shown alone.
    error : relative, with its sign; of a bound that is missed the distance outside; None where a bound holds.
    tolerance : of a verification the largest error allowed, of a comparison the reference's own uncertainty
        (relative, two standard errors);
        0 for a bound, None where nothing is judged.
    passed : the verdict; None where the row only informs.
    source : where the reference comes from.
    kind : see the module.
    unit : of `ours` and `reference`.
    bounds : lowest and highest value allowed, where that is what is asked for; None for no bound on a side.
    standard_error : of `ours`, in its unit, where that is a mean over realisations.
    subjects : what a run must have for the row to bear on it, such as "profile:m107", "explosive:comp_b",
        "products:landau_cj", "burst", "meridian", "stack", "break_up", "flight".
    """

    case: str
    quantity: str
    ours: float
    reference: float | None
    error: float | None
    tolerance: float | None
    passed: bool | None
    source: str
    kind: Kind
    unit: str = ""
    bounds: tuple[float | None, float | None] | None = None
    standard_error: float | None = None
    subjects: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """The row as the machine-readable output has it."""
        return asdict(self)

    @property
    def has_numbers(self) -> bool:
        """Whether no value is NaN or infinite; one that is not there by design is None."""
        return all(value is None or math.isfinite(value) for value in (self.ours, self.reference, self.error))


class Rows(list[Row]):
    """The rows of one case, in the order in which its study adds them.

    Parameters
    ----------
    case : str
        Name of the case.
    subjects : sequence of str
        Of all its rows; a row may have more.
    quick : bool
        Coarse cells: comparisons and trends are shown and not judged, since cells may be what they show.

    Attributes
    ----------
    unsound : list of str
        Bursts whose energy is open or that lost cells: what they were compared with is void.
    """

    def __init__(self, case: str, subjects: Sequence[str] = (), *, quick: bool = False) -> None:
        super().__init__()
        self.case, self.subjects, self.quick = case, tuple(subjects), quick
        self.unsound: list[str] = []

    def verify(
        self, quantity: str, ours: float, reference: float, allowed: float, source: str, unit: str = "", *also: str
    ) -> Row:
        """Add a value that must meet an exact one, to a relative error; `also` are further subjects."""
        error = ours / reference - 1.0
        return self._add("verification", quantity, ours, reference, error, allowed, abs(error) <= allowed, source,
                         unit, also)  # fmt: skip

    def bound(
        self, quantity: str, ours: float, bounds: tuple[float, float], source: str, unit: str = "", *also: str,
        kind: Kind = "verification",
    ) -> Row:  # fmt: skip
        """Add a value that must lie between two; only one outside has a reference, the bound, and an error from it."""
        low, high = bounds
        passed = low <= ours <= high
        reference = None if passed else min(max(ours, low), high)
        error = None if reference is None else ours - reference
        limits = (low if math.isfinite(low) else None, high if math.isfinite(high) else None)
        return self._add(kind, quantity, ours, reference, error, 0.0, passed, source, unit, also, bounds=limits)

    def compare(
        self, quantity: str, ours: float, reference: float, source: str, unit: str = "", *also: str,
        uncertainty: float | None = None, standard_error: float | None = None,
    ) -> Row:  # fmt: skip
        """Add a value beside that of a test or another code; a relative `uncertainty` that it states is judged."""
        error = ours / reference - 1.0
        within = None if uncertainty is None else abs(error) <= uncertainty
        return self._add("comparison", quantity, ours, reference, error, uncertainty, within, source, unit, also,
                         standard_error=standard_error)  # fmt: skip

    def trend(
        self, quantity: str, ours: float, base: float | None, source: str, unit: str = "", *also: str,
        standard_error: float | None = None,
    ) -> Row:  # fmt: skip
        """Add a value beside that of the base, or alone; nothing is judged."""
        error = None if base is None else ours / base - 1.0
        return self._add("trend", quantity, ours, base, error, None, None, source, unit, also,
                         standard_error=standard_error)  # fmt: skip

    def _add(
        self, kind: Kind, quantity: str, ours: float, reference: float | None, error: float | None,
        tolerance: float | None, passed: bool | None, source: str, unit: str, also: Sequence[str], **others: Any,
    ) -> Row:  # fmt: skip
        judged = None if (self.quick and kind != "verification") or passed is None else bool(passed)
        row = Row(self.case, quantity, float(ours), reference, error, tolerance, judged, source, kind, unit,
                  subjects=(*self.subjects, *also), **others)  # fmt: skip
        self.append(row)
        return row

    @property
    def sound(self) -> bool:
        """Whether no verification and no required trend has failed; a comparison is a finding, no fault."""
        return all(row.passed is not False for row in self if row.kind != "comparison")


def print_rows(rows: Iterable[Row]) -> None:
    """Print the rows as a table on stdout."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title="Computed against reference")
    for name in ("case", "quantity", "ours", "reference", "error", "allowed", "verdict", "source"):
        table.add_column(name, justify="left" if name in ("case", "quantity", "source") else "right")
    for row in rows:
        table.add_row(row.case, row.quantity, *shown(row.as_dict()), row.source)
    # A pipe has no width of its own; there a row stays on one line.
    console = Console()
    Console(width=None if console.is_terminal else 200).print(table)


def rows_table(rows: Iterable[Mapping[str, Any]]) -> str:
    """Rows, as the record has them, as a table in Markdown, all of one case."""
    body = []
    for row in rows:
        *values, allowed, verdict = shown(row)
        body.append((row["quantity"], *values, verdict if allowed == "-" else f"{verdict} ({allowed})"))
    return markdown_table(("quantity", "ours", "reference", "error", "verdict (allowed)"), body)


def shown(row: Mapping[str, Any]) -> tuple[str, str, str, str, str]:
    """Ours, reference, error, what is allowed and the verdict of a row, in words."""
    unit = f" {row['unit']}" if row["unit"] else ""
    ours = f"{row['ours']:.4g}{unit}" if row["ours"] is not None else "NaN"
    if row["standard_error"] is not None:
        ours += f" ± {row['standard_error']:.2g}"
    bounded = row["tolerance"] == 0.0
    reference = "-" if row["reference"] is None else f"{row['reference']:.4g}{unit}"
    error = "-" if row["error"] is None else f"{row['error']:+.2g}" if bounded else f"{100 * row['error']:+.1f} %"
    allowed = "-" if row["tolerance"] is None else f"{100 * row['tolerance']:.2g} %"
    return ours, reference, error, _range(row["bounds"]) if bounded else allowed, _verdict(row)


def _verdict(row: Mapping[str, Any]) -> str:
    if row["passed"] is None:
        return "-"
    if row["kind"] == "comparison":
        return "within the test's uncertainty" if row["passed"] else "outside the test's uncertainty"
    return "passed" if row["passed"] else "MISSED"


def _range(bounds: Sequence[float | None]) -> str:
    low, high = bounds
    if low is None or high is None:
        return f"{high:.4g} or less" if high is not None else f"{low:.4g} or more"
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def markdown_table(head: Iterable[str], body: Iterable[Iterable[str]]) -> str:
    """A table for a page."""
    titles = list(head)
    lines = ["| " + " | ".join(titles) + " |", "|" + "|".join(" --- " for _ in titles) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in body]
    return "\n".join(lines)
