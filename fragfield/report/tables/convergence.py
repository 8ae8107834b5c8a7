"""Grid convergence in the report: a table of the values by cell size, and a small figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.numbers import SPACE, UNKNOWN, number
from fragfield.pipeline.grid_convergence import KINDS
from fragfield.quantities import shown
from fragfield.report.blocks import Paragraph, Table
from fragfield.report.figures.drawing import ACCENT, GREY, LINES, new_figure

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from matplotlib.figure import Figure

    from fragfield.quantities import Quantity
    from fragfield.report.blocks import Block
    from fragfield.report.reading.run_files import RunFiles


_NOTE = (
    "Uncertainty of this run's value due to cell size alone: the grid convergence index of Roache and ASME V&V 20, "
    "about 95 %. Safety factor 1.25 where three sizes show an order (used between 0.5 and 2), else 3 on the range of "
    "the values at first order. Statistical errors (±) are given separately and are not included."
)
_LARGEST = (
    "The largest speed is the mean of one cell, whose mass decreases with the cell size: at a corner of the charge it "
    "increases without limit. The speed that 99 % of the mass does not exceed converges; use it for comparisons."
)


def convergence_tables(run: RunFiles) -> Iterator[Block]:
    """What other cell sizes gave, or why there are none."""
    found = run.part("convergence")
    if not found:
        return
    if found["reason"]:
        yield Paragraph(f"{found['reason'][0].upper()}{found['reason'][1:]}.")
    if "sizes" not in found:
        return
    own = run.part("burst").get("cell_size")
    sizes = [
        f"{number(1e3 * size, 3)}{SPACE}mm{' (this run)' if own and abs(size - own) < 1e-9 else ''}"
        for size in found["sizes"]
    ]
    head = ("Quantity", *sizes, "order", "limit", "uncertainty", "")
    followed = {one.name: one for one in shown("convergence")}
    lines = tuple(_line(followed[name], entry) for name, entry in found["quantities"].items())
    yield Table("Grid convergence", head, lines)


def convergence_notes() -> tuple[Block, ...]:
    """What the columns of the table mean."""
    return Paragraph(_NOTE), Paragraph(_LARGEST)


def _line(followed: Quantity, entry: Mapping[str, Any]) -> tuple[str, ...]:
    factor, unit = (1e3, "mm") if followed.path == "burst.outer_diameter" else (1.0, followed.unit)
    errors = entry.get("standard_errors") or [None] * len(entry["values"])
    values = [_value(value, error, factor) for value, error in zip(entry["values"], errors, strict=True)]
    label = f"{followed.label}{f' ({unit})' if unit else ''}"
    order = "–" if entry["order"] is None else number(entry["order"], 2)
    limit, uncertainty = (
        "–" if entry[key] is None else number(factor * entry[key], digits)
        for key, digits in (("extrapolated", 4), ("uncertainty", 2))
    )
    return (label, *values, order, limit, uncertainty, KINDS[entry["kind"]])


def _value(value: float | None, error: float | None, factor: float) -> str:
    if value is None:
        return UNKNOWN
    text = number(factor * value, 4)
    return text if error is None else f"{text}{SPACE}±{SPACE}{number(factor * error, 2)}"


def convergence_figure(run: RunFiles) -> Figure | None:
    """Quantities over their values in this run, against the cell size; bars are standard errors."""
    found = run.part("convergence")
    own = run.part("burst").get("cell_size")
    if len(found.get("sizes") or []) < 2 or not own:
        return None
    figure, (axis,) = new_figure(height=2.8)
    at = min(range(len(found["sizes"])), key=lambda i: abs(found["sizes"][i] - own))
    sizes = [1e3 * size for size in found["sizes"]]
    for style, one in zip(LINES, shown("convergence"), strict=False):
        entry = found["quantities"].get(one.name)
        if entry is None or not entry["values"][at]:
            continue
        scale = entry["values"][at]
        known = [i for i, value in enumerate(entry["values"]) if value is not None]
        place, values = [sizes[i] for i in known], [entry["values"][i] / scale for i in known]
        errors = entry.get("standard_errors")
        bars = [(errors[i] or 0.0) / scale for i in known] if errors else None
        axis.errorbar(place, values, yerr=bars, marker="o", markersize=3.5, capsize=2, label=one.label, **style)
        if entry["extrapolated"] is not None:
            axis.plot(0.0, entry["extrapolated"] / scale, marker="o", markersize=4, fillstyle="none", **style)
    axis.axvline(1e3 * own, color=ACCENT, linewidth=0.9, linestyle=":")
    axis.axhline(1.0, color=GREY, linewidth=0.7)
    axis.set(xlabel="Cell size (mm)", ylabel="Value / value of this run")
    axis.set_xlim(left=-0.03 * max(sizes))
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2))
    return figure
