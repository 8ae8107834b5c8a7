"""Figures of the fragments: their masses and their directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.report.figures.drawing import INK, LINES, figure, new_figure, plain_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fragfield.report.reading.run_files import RunFiles


@figure(
    "number_by_mass", "Number of fragments by mass",
    lambda run: "Number of fragments heavier than m against the root of m (upper figures; lower figures: m)"
    + (": law (lines) and sample (circles), in total and by segment." if run.fragments_file is None
       else ", first realisation."),
)  # fmt: skip
def _number_by_mass(run: RunFiles) -> Figure | None:
    if not run.fragments or not len(run.fragments["mass"]):
        return None
    laws = segment_laws(run)
    figure, (axis,) = new_figure(height=3.6)
    masses = run.fragments["mass"]
    grid = np.linspace(0.0, np.sqrt(masses.max() * 1e3) * 1.04, 300)
    _sampled(axis, masses, INK, label="all, sampled")
    if laws:
        total = sum(number_above(law, grid**2 * 1e-3) for law in laws)
        _law(axis, grid, total, {"color": INK, "linestyle": "-"}, "all, law")
    first = [law for law in laws if law.round_index == 0]
    of_first = "" if len(run.rounds) < 2 else f" of {plain_name(run.rounds[0].name)}"
    for index, law in enumerate(first):
        style = LINES[1 + index % (len(LINES) - 1)]
        chosen = (run.fragments["round"] == 0) & (run.fragments["segment"] == law.segment_index)
        if chosen.any():
            _sampled(axis, masses[chosen], style["color"], symbols=20)
        _law(axis, grid, number_above(law, grid**2 * 1e-3), style, f"{plain_name(law.name)}{of_first}")
    axis.set(yscale="log", xlim=(0, grid[-1]), ylim=(0.7, len(masses) * 2.0), xlabel="√m (√g); below: m (g)")
    axis.set_ylabel("Number heavier than m")
    _mass_labels(axis)
    axis.legend(loc="upper right", fontsize=7)
    return figure


def _mass_labels(axis: Axes) -> None:
    """Write the mass in grams under the square root, so that no squaring is needed."""
    ticks = [tick for tick in axis.get_xticks() if 0 <= tick <= axis.get_xlim()[1]]
    axis.set_xticks(ticks, [f"{tick:g}\n{tick**2:,.4g}" for tick in ticks])


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
def _zone_figure(run: RunFiles) -> Figure | None:
    from flight.arena import ArenaTable

    path = run.folder / "arena.csv"
    if not path.is_file():
        return None
    table = ArenaTable.read(path)
    zones = table.by_zone(run.criteria.energy)
    figure, (count, speed) = new_figure(2, 1, height=4.2, sharex=True)
    edges = table.zones
    for index, (name, label) in enumerate((("number", "all"), ("hazardous", "hazardous at launch"))):
        style = LINES[index]
        count.stairs(zones[name], edges, label=label, color=style["color"], linestyle=style["linestyle"])
    seen = zones["number"] > 0.0
    for index, (name, label) in enumerate((("mean_speed", "mean by mass"), ("max_speed", "largest"))):
        style = LINES[index]
        values = np.where(seen, zones[name], np.nan)
        speed.stairs(values, edges, label=label, color=style["color"], linestyle=style["linestyle"])
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
def _directions(run: RunFiles) -> Figure | None:
    found = next(
        (item["directions"] for item in run.part("break_up").get("rounds") or [] if "directions" in item), None
    )
    if found is None:
        return None
    figure, (polar, azimuth) = new_figure(2, 1, height=4.2)
    for axis, name in ((polar, "polar"), (azimuth, "azimuth")):
        place = np.array(found[f"{name}_deg"])
        width = float(place[1] - place[0])
        axis.bar(place, 100 * np.array(found[f"{name}_fragments"]), width, color="#c9d3df", edgecolor="white",
                 linewidth=0.4, label="fragments")  # fmt: skip
        axis.plot(
            place, 100 * np.array(found[f"{name}_cells"]), drawstyle="steps-mid", color=INK, linewidth=1.2,
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


@dataclass(frozen=True)
class NumberLaw:
    """N(m) = sum over the terms of n0 exp(-(m/mu)^exponent); one term, or two for the mixture."""

    round_index: int
    segment_index: int
    name: str
    terms: tuple[tuple[float, float, float], ...]
    """n0, mu (kg), exponent."""
    line: dict[str, Any]
    """The segment's line in summary.json."""


def segment_laws(run: RunFiles) -> list[NumberLaw]:
    """Laws of all segments of all rounds; empty while the break-up has not been run."""
    laws = []
    for round_index, item in enumerate(run.part("break_up").get("rounds") or []):
        for segment_index, line in enumerate(item.get("segments") or []):
            terms = _terms(line)
            if terms:
                laws.append(NumberLaw(round_index, segment_index, str(line.get("name", segment_index)), terms, line))
    return laws


def _terms(line: dict[str, Any]) -> tuple[tuple[float, float, float], ...]:
    """Terms of the mixture: its parts have one mean mass, so that their shares of the mass are those of the number."""
    total = line.get("n0")
    if not total:
        return ()
    return tuple(
        (float(total) * float(part["mass_fraction"]), float(part["mu"]), 1.0 / float(part["dimension"]))
        for part in line.get("parts") or []
    )


def number_above(law: NumberLaw, mass: NDArray[np.float64]) -> NDArray[np.float64]:
    """Expected number of fragments heavier than `mass` (kg) from the segment (Eq. 19)."""
    return np.sum([n0 * np.exp(-((mass / mu) ** exponent)) for n0, mu, exponent in law.terms], axis=0)
