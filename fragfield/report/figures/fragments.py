"""Figures of the fragments: their masses and their directions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.report.figures.drawing import COLOURS, INK, LINES, figure, new_figure, plain_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fragfield.results.break_up import Segment
    from fragfield.results.run import StoredRun


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


@figure(
    "directions", "Directions of the mass",
    "Share of the first round's mass by direction of flight at the end of the burst: fragments of the first "
    "realisation (bars) and the velocity field of the casing from which they were made (line).",
)  # fmt: skip
def _directions(run: StoredRun) -> Figure | None:
    if run.summary.break_up is None or not run.summary.break_up.rounds:
        return None
    found = run.summary.break_up.rounds[0].directions
    angles = (
        (found.polar_deg, found.polar_fragments, found.polar_cells),
        (found.azimuth_deg, found.azimuth_fragments, found.azimuth_cells),
    )
    figure, (polar, azimuth) = new_figure(2, 1, height=4.2)
    for axis, (centres, of_fragments, of_cells) in zip((polar, azimuth), angles, strict=True):
        place = np.array(centres)
        width = float(place[1] - place[0])
        axis.bar(place, 100 * np.array(of_fragments), width, color="#c9d3df", edgecolor="white",
                 linewidth=0.4, label="fragments")  # fmt: skip
        axis.plot(
            place, 100 * np.array(of_cells), drawstyle="steps-mid", color=INK, linewidth=1.2,
            label="cells of the casing",
        )  # fmt: skip
        axis.set(ylabel=f"% of the mass in {width:g}°")
        axis.set_ylim(bottom=0)
    polar.set(title="From the axis", xlabel="Angle from the nose's direction (°)", xlim=(0, 180))
    polar.set_xticks(np.arange(0, 181, 30))
    azimuth.set(title="Around", xlabel="Azimuth (°), from +x counter-clockwise", xlim=(-2.5, 357.5))
    azimuth.set_xticks(np.arange(0, 360, 90))
    polar.legend(loc="upper right")
    return figure


def number_above(law: Segment, mass: NDArray[np.float64]) -> NDArray[np.float64]:
    """Expected number of fragments heavier than `mass` (kg) from a segment (Eq. 19).

    Parts of a mixture have one mean mass, so that their shares of the mass are those of the number.
    """
    parts = [one.mass_fraction * np.exp(-((mass / one.mu) ** (1.0 / one.dimension))) for one in law.parts]
    return np.asarray(law.n0 * np.sum(parts, axis=0))
