"""Figures of the hazard: landing points, densities, distances, and their scatter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.hazard.certainty import metres
from fragfield.report.figures.drawing import ACCENT, GREY, INK, LINES, new_figure
from fragfield.report.reading.landings import ensemble, hazard_density, hazard_energy, landings

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from flight.hazard.bands import Curve
    from flight.hazard.density.distance import ExpectedDistance
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["density_curve", "distance_by_azimuth", "hit_probability", "landing_map", "polar_by_sector"]

_SHADE = 0.28  # of a band's colour: seen on paper, and two on each other still distinguished
_NOTHING = 1e-12  # of a logarithmic axis
_HATCHES = ("", "////", "....")


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
    over_all = ensemble(run)
    if over_all is not None and over_all.expected is not None and not over_all.undetermined:
        reach = max(reach, 1.04 * _outline(axis, over_all.expected))
    axis.plot(0, 0, marker="+", color=INK, markersize=8, markeredgewidth=1.2)
    axis.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    axis.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.1 if not narrow else -0.17),
        ncols=1 if narrow else 2,
        markerscale=1.8,
    )
    return figure


def _outline(axis: Axes, expected: ExpectedDistance) -> float:
    """Draw the upper bound of the expected distance by direction, or itself where it has none; its reach (m)."""
    bounded = expected.upper is not None
    by_direction = expected.upper_by_direction if bounded else expected.by_direction
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    sector = np.round(turn / (2.0 * np.pi) * len(by_direction)).astype(int) % len(by_direction)
    reach = by_direction[sector]
    if not reach.max() > 0.0:
        return 0.0
    axis.plot(reach * np.cos(turn), reach * np.sin(turn), color=ACCENT, linewidth=1.3, zorder=3)
    words = f"expected density, {'upper bound: ' if bounded else ''}{metres(float(reach.max()))}"
    place = np.radians(290.0 if expected.direction is None else expected.direction)
    axis.annotate(
        words, (reach.max() * np.cos(place), reach.max() * np.sin(place)), ha="center", va="center", fontsize=7,
        color=ACCENT, zorder=4,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85},
    )  # fmt: skip
    return float(reach.max())


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
    """Expected hazardous fragments per acceptable area against distance, with the bootstrap's band."""
    found = ensemble(run)
    if found is None or found.expected is None or not found.expected.density.any():
        return None
    acceptable, expected = hazard_density(run), found.expected
    figure, (axis,) = new_figure(narrow=narrow, height=3.6, narrow_height=4.4)
    where = "all azimuths" if expected.direction is None else "worst direction"
    for number, label in enumerate(("on the ground", "normal to the paths")):
        style, density = LINES[number], expected.density[number] / acceptable
        axis.plot(expected.radius, np.where(density > 0, density, np.nan), label=f"{label}, {where}", **style)
        if expected.density_low.size:
            axis.fill_between(
                expected.radius, np.maximum(expected.density_low[number] / acceptable, _NOTHING),
                np.maximum(expected.density_high[number] / acceptable, _NOTHING), color=style["color"], alpha=_SHADE,
                linewidth=0, hatch=_HATCHES[number], label="5 to 95 % of the mean", zorder=1,
            )  # fmt: skip
    axis.axhline(1.0, color=ACCENT, linewidth=1.1)
    axis.annotate(
        f"acceptable: 1 per {1 / acceptable:.1f} m²", (0.99, 1.0), xycoords=("axes fraction", "data"),
        textcoords="offset points", xytext=(0, 3), ha="right", color=ACCENT, fontsize=7.5,
    )  # fmt: skip
    if not found.undetermined:
        for place, dashes, words in (
            (expected.distance, ":", "expected distance"),
            (expected.upper, "-", "upper bound"),
        ):
            if place:
                axis.axvline(place, color=GREY, linewidth=1.0, linestyle=dashes, label=f"{words}, {metres(place)}")
    axis.set(yscale="log", xlabel="Distance (m)", ylabel=f"Hazardous fragments\nper {1 / acceptable:.1f} m²")
    axis.set_xlim(0, found.counts.edges[-1])
    axis.set_ylim(bottom=1e-4)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=1 if narrow else 2)
    return figure


def hit_probability(run: RunFiles, narrow: bool) -> Figure | None:
    """Probability that a person is hit by a hazardous fragment against distance, with the band of single events."""
    found = ensemble(run)
    if found is None or not found.pooled.hazardous.any():
        return None
    figure, (axis,) = new_figure(narrow=narrow, height=3.2, narrow_height=3.8)
    _banded(axis, found.distance, found.by_distance["probability"], "anywhere around", 0, 1.0, found.realisations)
    axis.set(yscale="log", xlabel="Distance (m)", ylabel="Probability of a hit\non a person", ylim=(1e-6, 1.5))
    axis.set_xlim(0, found.counts.edges[-1])
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.19), ncols=1 if narrow else 2)
    return figure


def _banded(
    axis: Axes, place: NDArray[np.float64], curve: Curve, label: str, number: int, factor: float, realisations: int
) -> None:
    """A curve on a logarithmic axis: the mean as a line, 5 to 95 % as an area with a hatch of its own."""
    style = LINES[number]
    axis.plot(place, np.where(curve.pooled > 0, factor * curve.pooled, np.nan), label=f"{label}: mean", **style)
    if realisations < 2:
        return
    # Where 5 % of the realisations have none, the band goes on below the axis; where 95 % have none, it ends.
    seen = curve.high > 0
    low, high = (np.where(seen, np.maximum(factor * edge, _NOTHING), np.nan) for edge in (curve.low, curve.high))
    axis.fill_between(
        place, low, high, color=style["color"], alpha=_SHADE, linewidth=0, hatch=_HATCHES[number],
        label=f"5 to 95 % of {realisations}", zorder=1,
    )  # fmt: skip


def distance_by_azimuth(run: RunFiles, narrow: bool) -> Figure | None:
    """Expected distance by direction with its bound, and the farthest fragment of each sector in single events."""
    found = ensemble(run)
    if found is None or found.expected is None:
        return None
    figure, (axis,) = new_figure(narrow=narrow, height=3.2, narrow_height=3.8)
    expected = found.expected
    if not found.undetermined:
        around = np.linspace(0.0, 360.0, max(len(expected.azimuth), 2) + 1)
        for values, label, style in (
            (expected.upper_by_direction, "expected density, upper bound", {"color": ACCENT, "linewidth": 1.4}),
            (expected.by_direction, "expected density", {**LINES[0], "linewidth": 1.1}),
        ):
            if np.isfinite(values).all():
                axis.plot(around, np.resize(_closed(values), len(around)), label=label, **style)
    curve, style = found.by_sector["max_throw"], LINES[1]
    azimuth = np.append(found.azimuth, 360.0)
    axis.plot(azimuth, _closed(curve.median), drawstyle="steps-mid", label="farthest fragment, median event", **style)
    if found.realisations > 1:
        axis.fill_between(
            azimuth, _closed(curve.low), _closed(curve.high), step="mid", color=style["color"], alpha=_SHADE,
            linewidth=0, hatch=_HATCHES[1], label=f"5 to 95 % of {found.realisations} events", zorder=1,
        )  # fmt: skip
    axis.set(xlim=(0, 360), xticks=np.arange(0, 361, 90 if narrow else 45), ylabel="Distance (m)")
    axis.set_xlabel("Azimuth (°), from +x counter-clockwise")
    axis.set_ylim(bottom=0)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=1 if narrow else 2)
    return figure


def _closed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.append(values, values[0])


def polar_by_sector(run: RunFiles, narrow: bool) -> Figure | None:
    """Number and initial speed of the fragments through the first witness surface by sector, around the rounds."""
    name = next((name for name, table in run.witness_ensemble.items() if table["hits"].any()), None)
    if name is None:
        return None
    table = run.witness_ensemble[name]
    figure, (number, speed) = new_figure(
        *((2, 1) if narrow else (1, 2)), narrow=narrow, height=4.1, narrow_height=7.4,
        subplot_kw={"projection": "polar"},
    )  # fmt: skip
    turn = np.radians(_closed(np.arange(table.shape[1]) * 360.0 / table.shape[1]))
    width = 360.0 / table.shape[1]
    for axis, title, lines in (
        (number, f"Fragments in {width:g}°", (("hits", "all"), ("hazardous_hits", "hazardous"))),
        (speed, "Initial speed (m/s)", (("mean_initial_speed", "mean by mass"), ("max_initial_speed", "largest"))),
    ):
        for index, (field, label) in enumerate(lines):
            _around(axis, turn, table[field], label, index, blank=field.endswith("speed"))
        axis.set_title(title, pad=24)
        axis.set_xticks(np.radians(np.arange(0, 360, 45)))
        axis.set_ylim(bottom=0)
        axis.tick_params(labelsize=7)
        axis.set_rlabel_position(22.5)  # type: ignore[attr-defined]
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=2)
    return figure


def _around(axis: Axes, turn: NDArray[np.float64], each: NDArray[Any], label: str, number: int, *, blank: bool) -> None:
    """Median and band of 5 to 95 % by sector; where `blank`, sectors in which nothing hit do not count."""
    values = np.where(each > 0, each, np.nan) if blank else each.astype(float)
    present = np.isfinite(values).any(axis=0)
    low, median, high = np.full((3, each.shape[1]), np.nan)
    low[present], median[present], high[present] = np.nanquantile(values[:, present], (0.05, 0.5, 0.95), axis=0)
    style = LINES[number]
    axis.plot(turn, _closed(median), label=f"{label}, median", **{**style, "linewidth": 1.3})
    if len(each) > 1:
        axis.fill_between(
            turn, _closed(low), _closed(high), color=style["color"], alpha=_SHADE, linewidth=0,
            hatch=_HATCHES[number], label=f"5 to 95 % of {len(each)}", zorder=1,
        )  # fmt: skip
