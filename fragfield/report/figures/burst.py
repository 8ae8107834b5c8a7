"""Figures of the burst and of the fragments: speeds, energy ledger, masses and polar zones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.report.figures.drawing import ACCENT, COLOURS, GREY, INK, LINES, figure, new_figure, plain_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fragfield.results.break_up import Segment
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
    "number_by_mass", "Number of fragments by mass",
    lambda run: "Number of fragments heavier than m against the root of m (upper figures; lower figures: m)"
    + (": law (lines) and sample (circles), in total and by segment." if run.fragments_file is None
       else ", first realisation."),
)  # fmt: skip
def _number_by_mass(run: StoredRun) -> Figure | None:
    if (launched := run.launched) is None or not len(launched):
        return None
    rounds = run.summary.break_up.rounds if run.summary.break_up else ()
    laws = [law for one in rounds for law in one.segments if law.n0]
    figure, (axis,) = new_figure(height=3.6)
    masses = launched.mass
    grid = np.linspace(0.0, np.sqrt(masses.max() * 1e3) * 1.04, 300)
    _sampled(axis, masses, INK, label="all, sampled")
    if laws:
        total = sum(number_above(law, grid**2 * 1e-3) for law in laws)
        _law(axis, grid, total, {"color": INK, "linestyle": "-"}, "all, law")
    of_first = "" if len(run.rounds) < 2 else f" of {plain_name(run.rounds[0].name)}"
    for index, law in enumerate(rounds[0].segments if rounds else ()):
        style = LINES[1 + index % (len(LINES) - 1)]
        chosen = (launched.round == 0) & (launched.segment == index)
        if chosen.any():
            _sampled(axis, masses[chosen], COLOURS[1 + index % (len(LINES) - 1)], symbols=20)
        _law(axis, grid, number_above(law, grid**2 * 1e-3), style, f"{plain_name(law.name)}{of_first}")
    axis.set(yscale="log", xlim=(0, grid[-1]), ylim=(0.7, len(masses) * 2.0), xlabel="√m (√g); below: m (g)")
    axis.set_ylabel("Number heavier than m")
    ticks = [tick for tick in axis.get_xticks() if 0 <= tick <= grid[-1]]
    axis.set_xticks(ticks, [f"{tick:g}\n{tick**2:,.4g}" for tick in ticks])
    axis.legend(loc="upper right", fontsize=7)
    return figure


def _sampled(axis: Axes, masses: NDArray[np.float64], color: str, label: str | None = None, symbols: int = 60) -> None:
    ordered = np.sort(masses)[::-1]
    count = np.arange(1, len(ordered) + 1)
    keep = np.unique(np.geomspace(1, len(count), symbols).round().astype(int)) - 1
    axis.plot(
        np.sqrt(ordered[keep] * 1e3), count[keep], marker="o", markersize=3, linestyle="none", color=color,
        markerfacecolor="white", markeredgewidth=0.9, label=label,
    )  # fmt: skip


def _law(axis: Axes, grid: NDArray[np.float64], number: Any, style: dict[str, Any], label: str) -> None:  # noqa: ANN401
    axis.plot(grid, np.where(number > 1e-3, number, np.nan), label=label, linewidth=1.4, zorder=1.5, **style)


@figure(
    "polar_zones", "Fragments by polar zone",
    "Numbers and speeds of one round's fragments at launch by angle from the nose, as arena tests report them.",
)  # fmt: skip
def _zone_figure(run: StoredRun) -> Figure | None:
    from flight.arena import ArenaTable

    path = run.path / "arena.csv"
    if not path.is_file():
        return None
    table = ArenaTable.read(path)
    zones = table.by_zone(run.criteria.energy)
    figure, (count, speed) = new_figure(2, 1, height=4.2, sharex=True)
    edges = table.zones
    for index, (name, label) in enumerate((("number", "all"), ("hazardous", "hazardous at launch"))):
        count.stairs(zones[name], edges, label=label, **LINES[index])
    seen = zones["number"] > 0.0
    for index, (name, label) in enumerate((("mean_speed", "mean by mass"), ("max_speed", "largest"))):
        speed.stairs(np.where(seen, zones[name], np.nan), edges, label=label, **LINES[index])
    count.set(ylabel="Fragments\nin a zone")
    count.set_ylim(bottom=0.0)
    speed.set(ylabel="Speed (m/s)", xlabel="Angle from the nose (°)", xlim=(0.0, 180.0), xticks=range(0, 181, 30))
    speed.set_ylim(bottom=0.0)
    for axis in (count, speed):
        axis.legend(loc="upper right")
    return figure


def number_above(law: Segment, mass: NDArray[np.float64]) -> NDArray[np.float64]:
    """Expected number of fragments heavier than `mass` (kg) from a segment (Eq. 19).

    Parts of a mixture have one mean mass, so that their shares of the mass are those of the number.
    """
    parts = [one.mass_fraction * np.exp(-((mass / one.mu) ** (1.0 / one.dimension))) for one in law.parts]
    return np.asarray(law.n0 * np.sum(parts, axis=0))
