"""Figures of the burst: speed along the round, casing over time, energy ledger."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.quantities import shown
from fragfield.report.figures.drawing import ACCENT, GREY, INK, LINES, figure, new_figure, plain_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fragfield.results.run import StoredRun


_FEW_ROUNDS = 3  # of which the largest speed is drawn as well
_LEDGER = {
    "kinetic": "kinetic",
    "plastic": "plastic work",
    "strain": "strain",
    "viscous": "artificial viscosity",
    "contact": "springs and friction",
    "hourglass": "hourglass",
    "damping": "damping",
}


@figure(
    "speed_along_round", "Speed along the round",
    "Casing speed at the end of the burst against the station from the nose, as a fraction of the length: mean by "
    "mass, and largest cell, of each axial bin. Dotted lines separate the segments.",
)  # fmt: skip
def _speed_along_round(run: StoredRun) -> Figure | None:
    if not run.rounds:
        return None
    figure, (axis,) = new_figure(height=2.8)
    several, many = len(run.rounds) > 1, len(run.rounds) > _FEW_ROUNDS
    for index, item in enumerate(run.rounds):
        style = LINES[index % len(LINES)]
        dashes = style["linestyle"] if many else "-"
        present = item.along["casing_mass"] > 0
        place = item.along["station"][present] / item.length
        label = f"{plain_name(item.name)}, " if several else ""
        axis.plot(
            place, item.along["mean_speed"][present], color=style["color"], linestyle=dashes, label=f"{label}mean"
        )
        if many:
            continue
        axis.plot(
            place, item.along["max_speed"][present], color=style["color"], linestyle=(0, (4, 1.6)), linewidth=1.1,
            marker=".", markersize=3.5, label=f"{label}largest cell",
        )  # fmt: skip
    _mark_segments(axis, run)
    axis.set(xlim=(0, 1), xlabel="Station from the nose / length", ylabel="Casing speed (m/s)")
    axis.set_ylim(bottom=0)
    axis.legend(ncols=2 if many or not several else 1, loc="upper center", bbox_to_anchor=(0.5, -0.17))
    return figure


def _mark_segments(axis: object, run: StoredRun) -> None:
    """Limits and names of the first round's segments, where all rounds are cut alike."""
    first = run.rounds[0]
    length = first.length
    ends = first.segments["end"] / length
    alike = all(
        len(item.segments) == len(ends) and np.allclose(item.segments["end"] / item.length, ends) for item in run.rounds
    )
    if not alike:
        return
    for line in first.segments:
        start, end = float(line["start"]) / length, float(line["end"]) / length
        axis.axvline(end, color=GREY, linewidth=0.7, linestyle=":")  # type: ignore[attr-defined]
        # A letter takes about 0.06 inches; the axis is about 3 inches wide.
        if (end - start) * 3.0 > 0.06 * len(str(line["name"])):
            axis.annotate(  # type: ignore[attr-defined]
                plain_name(str(line["name"])), ((start + end) / 2, 1.0), xycoords=("data", "axes fraction"),
                ha="center", va="bottom", fontsize=7, color=GREY,
            )  # fmt: skip


@figure(
    "casing_over_time", "Casing over time",
    "Mean speed of the casing by mass, and the largest over the stations of the azimuthal mean outer diameter. A "
    "dotted vertical line marks the time at which acceleration is complete.",
)  # fmt: skip
def _casing_over_time(run: StoredRun) -> Figure | None:
    if not {"time", "mean_casing_speed", "outer_diameter"} <= set(run.history):
        return None
    time = run.history["time"] * 1e6
    figure, (speed, diameter) = new_figure(2, 1, height=3.6, sharex=True)
    speed.plot(time, run.history["mean_casing_speed"], **LINES[0])
    speed.set(ylabel="Mean casing speed (m/s)", title="Speed")
    diameter.plot(time, run.history["outer_diameter"] * 1e3, **LINES[0])
    diameter.set(ylabel="Outer diameter (mm)", title="Largest mean diameter")
    done = run.summary.burst.acceleration_complete if run.summary.burst else None
    for axis in (speed, diameter):
        axis.set_xlim(0, time[-1])
        if done is not None:
            axis.axvline(done * 1e6, color=ACCENT, linewidth=0.9, linestyle=":")
    speed.set_ylim(bottom=0)
    diameter.set_xlabel("Time (µs)")
    return figure


@figure(
    "energy_ledger", "Energy ledger over time",
    "Work of the products and how it is distributed; below, the imbalance of the sum.",
)  # fmt: skip
def _energy_ledger(run: StoredRun) -> Figure | None:
    if not {"time", "products_work", "energy_error"} <= set(run.history):
        return None
    time = run.history["time"] * 1e6
    figure, (ledger, error) = new_figure(2, 1, height=4.8, gap=1.25, sharex=True, gridspec_kw={"height_ratios": (3, 1)})
    ledger.plot(time, run.history["products_work"] * 1e-6, color=INK, linewidth=2.4, label="work of the products")
    for style, (name, label) in zip(LINES, _LEDGER.items(), strict=False):
        values = run.history.get(name)
        if values is not None and np.any(values != 0):
            ledger.plot(time, values * 1e-6, label=label, **style)
    ledger.set(ylabel="Energy (MJ)", title="Ledger")
    ledger.set_ylim(bottom=min(0.0, ledger.get_ylim()[0]))
    ledger.legend(ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.02))
    percent = run.history["energy_error"] * 100
    error.plot(time, percent, label="all", **LINES[0])
    of_contact = run.history.get("contact_error")
    if of_contact is not None:
        error.plot(time, 100 * of_contact, label="made or lost by contact", **LINES[1])
        error.legend(loc="upper right")
    for limit in (-1, 1):
        error.axhline(limit, color=ACCENT, linewidth=0.9, linestyle=":")
    reach = max(1.25, 1.1 * float(np.nanmax(np.abs(percent), initial=0.0)))
    error.set(ylim=(-reach, reach), xlim=(0, time[-1]), xlabel="Time (µs)", title="Imbalance (dotted: 1 %)")
    error.set_ylabel("% of the\nproducts' work")
    return figure


@figure(
    "grid_convergence", "Values by cell size",
    "Each value divided by that of this run (vertical line), with its statistical error; open circles at zero: limits, "
    "where an order was observed.",
)  # fmt: skip
def _convergence_figure(run: StoredRun) -> Figure | None:
    found, burst = run.summary.convergence, run.summary.burst
    if found is None or burst is None or len(found.sizes or ()) < 2:
        return None
    figure, (axis,) = new_figure(height=2.8)
    own, sizes = burst.cell_size, [1e3 * size for size in found.sizes or ()]
    at = min(range(len(sizes)), key=lambda i: abs(sizes[i] - 1e3 * own))
    for style, one in zip(LINES, shown("convergence"), strict=False):
        entry = (found.quantities or {}).get(one.name)
        scale = None if entry is None else entry.values[at]
        if entry is None or not scale:
            continue
        known = [(i, value / scale) for i, value in enumerate(entry.values) if value is not None]
        errors = entry.standard_errors
        bars = [(errors[i] or 0.0) / scale for i, _ in known] if errors else None
        axis.errorbar([sizes[i] for i, _ in known], [value for _, value in known], yerr=bars, marker="o",
                      markersize=3.5, capsize=2, label=one.label, **style)  # fmt: skip
        if entry.extrapolated is not None:
            axis.plot(0.0, entry.extrapolated / scale, marker="o", markersize=4, fillstyle="none", **style)
    axis.axvline(1e3 * own, color=ACCENT, linewidth=0.9, linestyle=":")
    axis.axhline(1.0, color=GREY, linewidth=0.7)
    axis.set(xlabel="Cell size (mm)", ylabel="Value / value of this run")
    axis.set_xlim(left=-0.03 * max(sizes))
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2))
    return figure
