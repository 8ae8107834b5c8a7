"""Attitude of the rounds in the report: a sentence, and for mixed attitudes the curve over them with its table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.case.conversion.attitude import attitude_of, attitude_words
from fragfield.hazard.certainty import metres_and_error, whole_metres
from fragfield.numbers import SPACE, number
from fragfield.report.blocks import Section, Table
from fragfield.report.figures.drawing import ACCENT, GREY, LINES, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fragfield.report.reading.run_files import RunFiles


def attitude_sentence(run: RunFiles) -> str:
    """The attitude in words with the height over the ground; empty where the run has no case."""
    part = run.part("hazard").get("attitude")
    if part is None and run.case is not None:
        part = attitude_of(run.case, given=run.fragments_file is not None)
    return f"Attitude: {attitude_words(part)}." if part else ""


def _curve(run: RunFiles) -> list[dict[str, Any]]:
    return (run.part("hazard").get("attitude") or {}).get("curve") or []


def attitude_figure(run: RunFiles) -> Figure | None:
    """Expected distance and its bound by inclination, the worst roll of each; None without mixed attitudes."""
    rows, hazard = _curve(run), run.part("hazard")
    if not rows:
        return None
    worst: dict[float, dict[str, Any]] = {}
    for row in rows:
        known = worst.setdefault(row["inclination_deg"], row)
        if (row["upper"] or row["expected"]) > (known["upper"] or known["expected"]):
            worst[row["inclination_deg"]] = row
    inclination = sorted(worst)
    figure, (axis,) = new_figure(height=2.9)
    shown = [worst[one] for one in inclination]
    errors = [2.0 * (row["standard_error"] or 0.0) for row in shown]
    axis.errorbar(
        inclination, [row["expected"] for row in shown], yerr=errors, marker="o", markersize=3.5, capsize=2,
        label="of the expected density, ± 2 standard errors", **LINES[0],
    )  # fmt: skip
    bounds = [(one, row["upper"]) for one, row in zip(inclination, shown, strict=True) if row["upper"] is not None]
    if bounds:
        axis.plot(*zip(*bounds, strict=True), color=GREY, linewidth=1.0, linestyle="--", label="upper bound (95 %)")
    if hazard.get("recommended") is not None:
        axis.axhline(hazard["recommended"], color=ACCENT, linewidth=1.2, label="recommended distance")
    axis.set(xlabel="Inclination from upright (°)", ylabel="Expected distance (m)", xlim=(-3.0, 183.0))
    axis.set_xticks(range(0, 181, 30))
    axis.set_ylim(bottom=0.0)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18))
    return figure


def attitude_sections(run: RunFiles) -> list[Section]:
    """The annex with the distance in every attitude that was flown; none without mixed attitudes."""
    rows = _curve(run)
    if not rows:
        return []
    rolled = any(row["roll_deg"] for row in rows)
    head = (
        "Inclination (°)", *(("Roll (°)",) if rolled else ()), "Expected distance (m), upper bound",
        "Of the expected density", "Worst direction from the nose (°)", "Realisations",
    )  # fmt: skip
    lines = tuple(
        (
            number(row["inclination_deg"], 4), *((number(row["roll_deg"], 4),) if rolled else ()),
            whole_metres(row["upper"]), metres_and_error(row["expected"], row["standard_error"], SPACE),
            "all alike" if row["direction_deg"] is None else f"{row['direction_deg']:g}", number(row["realisations"]),
        )
        for row in rows
    )  # fmt: skip
    note = (
        "Inclination of the axis from upright, 180°: nose down. Coarse steps, and finer ones beside the worst "
        "attitude, which is flown until its distance is known to the tolerance. ± is the standard error by bootstrap."
    )
    return [Section("attitudes", "Distance by attitude", [Table("Attitudes", head, lines, note)], annex=True)]
