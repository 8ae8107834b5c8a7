"""Figures of the fragments: their masses, their directions, where they land and how densely."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.report.drawing import ACCENT, GREY, INK, LINES, new_figure
from fragfield.report.landings import all_round_distance, hazard, hazard_density, hazard_energy, landings
from fragfield.report.laws import number_above, segment_laws

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fragfield.report.run_files import RunFiles

__all__ = ["by_azimuth", "density_curve", "distance_by_azimuth", "landing_map", "number_by_mass"]


def number_by_mass(run: RunFiles, narrow: bool) -> Figure | None:
    """Number of fragments heavier than m against sqrt(m): law and sample, in total and by segment."""
    if not run.fragments or not len(run.fragments["mass"]):
        return None
    laws = segment_laws(run)
    figure, (total, parts) = new_figure(
        *((2, 1) if narrow else (1, 2)), narrow=narrow, height=3.6, narrow_height=6.4, sharey=not narrow
    )
    masses = run.fragments["mass"]
    grid = np.linspace(0.0, np.sqrt(masses.max() * 1e3) * 1.04, 300)
    _sampled(total, masses, INK, label="sampled")
    if laws:
        _law(total, grid, sum(number_above(law, grid**2 * 1e-3) for law in laws), {"color": LINES[1]["color"]}, "law")
    total.set(title="All fragments", ylabel="Number heavier than m")
    total.legend(loc="upper right")
    first = [law for law in laws if law.round_index == 0]
    for index, law in enumerate(first):
        style = LINES[index % len(LINES)]
        chosen = (run.fragments["round"] == 0) & (run.fragments["segment"] == law.segment_index)
        if chosen.any():
            _sampled(parts, masses[chosen], style["color"], symbols=25)
        _law(parts, grid, number_above(law, grid**2 * 1e-3), style, law.name)
    parts.set_title("By segment" if len(run.rounds) < 2 else f"By segment, {run.rounds[0].name}")
    for axis in (total, parts):
        axis.set(yscale="log", xlim=(0, grid[-1]), ylim=(0.7, len(masses) * 2.0), xlabel="√m (√g); below: m (g)")
        _mass_labels(axis)
    if first:
        parts.legend(loc="upper right", ncols=2 if len(first) > 6 else 1)
    return figure


def _mass_labels(axis: Axes) -> None:
    """Write the mass in grams under the square root, so that nobody has to square in his head."""
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


def by_azimuth(run: RunFiles, narrow: bool) -> Figure | None:
    """Number and initial speed of the fragments that cross the first witness surface, by azimuth."""
    witness = next((item for item in run.witnesses if item.get("by_azimuth")), None)
    if witness is None:
        return None
    table = witness["by_azimuth"]
    azimuth = _column(table, "azimuth_deg")
    width = float(np.diff(np.sort(azimuth)).min()) if len(azimuth) > 1 else 5.0
    figure, (number, speed) = new_figure(2, 1, narrow=narrow, height=4.6, narrow_height=4.8, sharex=True)
    number.bar(azimuth, _column(table, "hits"), width, color="#c9d3df", edgecolor="white", linewidth=0.4, label="all")
    hazardous = _column(table, "hazardous_hits")
    if np.isfinite(hazardous).any():
        number.bar(azimuth, hazardous, width * 0.55, color=LINES[0]["color"], label="hazardous")
    number.set(ylabel=f"Fragments in {width:g}°", title="Number")
    number.legend(loc="upper right", ncols=2, bbox_to_anchor=(1.0, 1.16))
    order = np.argsort(azimuth)
    for name, label, style in (
        ("max_initial_speed", "largest", {"color": ACCENT, "linestyle": "none", "marker": "^", "markersize": 3.5}),
        ("mean_initial_speed", "mean", {"color": LINES[0]["color"], "drawstyle": "steps-mid"}),
    ):
        values = np.where(_column(table, "hits") > 0, _column(table, name), np.nan)
        speed.plot(azimuth[order], values[order], label=label, **style)
    speed.set(ylabel="Initial speed (m/s)", title="Speed", xlabel="Azimuth (°), from +x counter-clockwise")
    speed.set(xlim=(-width / 2, 360 - width / 2), xticks=np.arange(0, 360, 90 if narrow else 45))
    speed.set_ylim(bottom=0)
    speed.legend(loc="upper right", ncols=2, bbox_to_anchor=(1.0, 1.16))
    return figure


def _column(table: list[dict[str, Any]], name: str) -> NDArray[np.float64]:
    return np.array([np.nan if line.get(name) is None else line[name] for line in table], dtype=float)


def landing_map(run: RunFiles, narrow: bool) -> Figure | None:
    """Where fragments came down, hazardous or not, with range rings."""
    found = landings(run)
    if found is None or not len(found.x):
        return None
    figure, (axis,) = new_figure(narrow=narrow, height=6.9, narrow_height=4.5)
    # Points are drawn as pixels: ten thousand vector symbols would make the file slow to open.
    axis.scatter(
        found.x[~found.hazardous], found.y[~found.hazardous], s=5, color="#a3acb6", linewidths=0, rasterized=True,
        label=f"below {hazard_energy(run):.3g} J",
    )  # fmt: skip
    axis.scatter(
        found.x[found.hazardous], found.y[found.hazardous], s=10, color=LINES[0]["color"], edgecolors="white",
        linewidths=0.25, marker="D", rasterized=True, label=f"hazardous, {hazard_energy(run):.3g} J or more",
    )  # fmt: skip
    reach = float(found.distance.max()) * 1.04
    for radius in _ring_radii(reach):
        _ring(axis, radius, "#5d6670", ":", f"{radius:g} m", angle=45.0)
    worst = run.part("flight").get("hazardous_fragment_distance")
    for limit, dashes, label, angle in (
        (all_round_distance(run), "--", "hazard, all azimuths", 250.0), (worst, "-", "hazard, worst sector", 290.0),
    ):  # fmt: skip
        if isinstance(limit, (int, float)) and limit > 0:
            _ring(axis, float(limit), ACCENT, dashes, f"{label}: {math.ceil(limit)} m", angle)
            reach = max(reach, 1.04 * limit)
    axis.plot(0, 0, marker="+", color=INK, markersize=8, markeredgewidth=1.2)
    axis.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    axis.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.1 if not narrow else -0.17),
        ncols=1 if narrow else 2,
        markerscale=1.8,
    )
    return figure


def _ring_radii(reach: float) -> list[float]:
    from matplotlib.ticker import MaxNLocator

    return [float(tick) for tick in MaxNLocator(nbins=5, steps=[1, 2, 5, 10]).tick_values(0, reach) if 0 < tick < reach]


def _ring(axis: Axes, radius: float, color: str, dashes: str, label: str, angle: float) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    axis.plot(radius * np.cos(turn), radius * np.sin(turn), color=color, linestyle=dashes, linewidth=1.1, zorder=3)
    place = np.radians(angle)
    axis.annotate(
        label, (radius * np.cos(place), radius * np.sin(place)), ha="center", va="center", fontsize=7,
        color=color, zorder=4,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85},
    )  # fmt: skip


def density_curve(run: RunFiles, narrow: bool) -> Figure | None:
    """Hazardous fragments per area on the ground against distance, with the acceptable density."""
    found = hazard(run)
    if found is None or not found.hazardous.any():
        return None
    acceptable = hazard_density(run)
    figure, (axis,) = new_figure(narrow=narrow, height=3.4, narrow_height=4.0)
    densest = np.maximum(found.ground_density, found.normal_density).max(axis=0)
    for values, label, style in (
        (densest, "densest sector, the larger of both", LINES[1]),
        (found.all_round_normal, "all azimuths, normal to the path", LINES[2]),
        (found.all_round_ground, "all azimuths, on the ground", LINES[0]),
    ):
        axis.plot(found.distance, np.where(values > 0, values / acceptable, np.nan), marker=".", label=label, **style)
    axis.axhline(1.0, color=ACCENT, linewidth=1.1)
    axis.annotate(
        f"acceptable: 1 per {1 / acceptable:.1f} m²", (0.99, 1.0), xycoords=("axes fraction", "data"),
        textcoords="offset points", xytext=(0, 3), ha="right", color=ACCENT, fontsize=7.5,
    )  # fmt: skip
    axis.set(yscale="log", xlabel="Distance (m)", ylabel=f"Hazardous fragments\nper {1 / acceptable:.1f} m²")
    axis.set_xlim(left=0)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=1 if narrow else 3)
    return figure


def distance_by_azimuth(run: RunFiles, narrow: bool) -> Figure | None:
    """Hazardous fragment distance and largest range of each azimuth sector."""
    table = [line for line in run.part("flight").get("by_sector") or [] if "azimuth_deg" in line]
    if not table:
        return None
    figure, (axis,) = new_figure(narrow=narrow, height=3.0, narrow_height=3.4)
    azimuth = _column(table, "azimuth_deg")
    order = np.argsort(azimuth)
    for name, label, style in (
        ("max_throw", "farthest fragment", {"color": GREY, "linestyle": (0, (4, 1.5)), "linewidth": 1.1}),
        ("hazardous_fragment_distance", "hazardous fragment distance", {"color": LINES[0]["color"]}),
    ):
        values = _column(table, name)[order]
        if np.isfinite(values).any():
            axis.plot(azimuth[order], values, drawstyle="steps-mid", label=label, **style)
    overall = all_round_distance(run)
    if overall is not None:
        axis.axhline(overall, color=ACCENT, linewidth=1.0, linestyle=":", label="density over all azimuths")
    axis.set(xlim=(0, 360), xticks=np.arange(0, 361, 90 if narrow else 45), ylabel="Distance (m)")
    axis.set_xlabel("Azimuth (°), from +x counter-clockwise")
    axis.set_ylim(bottom=0)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=1 if narrow else 3)
    return figure
