"""Figures of the hazard: landing points, density, fragments around the rounds; and what inputs do to the distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.surroundings import bearing_of, direction_words
from fragfield.report.figures.drawing import ACCENT, COLOURS, GREY, INK, LINES, figure, new_figure, plain_name
from fragfield.results.words import metres

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fragfield.results.hazard import FlownAttitude
    from fragfield.results.run import StoredRun


_SHADE = 0.28  # of a band's colour: seen on paper, and two on each other still distinguished
_LIGHT = "#9db7cf"
_NOTHING = 1e-12  # of a logarithmic axis
_HATCHES = ("", "////")
_BESIDE = 1.6  # of the largest distance that the curve marks, up to which it is shown


@figure(
    "landing_map", "Landing points",
    "Landing points of the fragments of the first realisation, seen from above, y upwards.",
)  # fmt: skip
def _landing_map(run: StoredRun) -> Figure | None:
    from matplotlib.ticker import MaxNLocator

    rows, limit = run.landed, run.criteria.energy
    if not len(rows):
        return None
    # Distance and azimuth count from the origin that the case gives.
    turn, distance, hazardous = np.radians(rows["azimuth"]), rows["distance"], rows["energy"] >= limit
    x, y = distance * np.cos(turn), distance * np.sin(turn)
    figure, (axis,) = new_figure(height=3.9)
    # Points are drawn as pixels: ten thousand vector symbols would make the file slow to open.
    axis.scatter(
        x[~hazardous], y[~hazardous], s=2, color="#a3acb6", linewidths=0, rasterized=True, label=f"below {limit:.3g} J"
    )
    axis.scatter(
        x[hazardous], y[hazardous], s=6, color=COLOURS[0], edgecolors="white",
        linewidths=0.25, marker="D", rasterized=True, label=f"{limit:.3g} J or more",
    )  # fmt: skip
    reach = float(distance.max()) * 1.04
    for radius in MaxNLocator(nbins=5, steps=[1, 2, 5, 10]).tick_values(0, reach):
        if 0 < radius < reach:
            _ring(axis, radius, color="#5d6670", dashes=":", label=f"{radius:g} m", angle=45.0)
    if recommended := run.summary.hazard.recommended if run.summary.hazard else None:
        reach = max(reach, 1.04 * recommended)
        _ring(axis, recommended, color=ACCENT, dashes="-", label=f"recommended {metres(recommended)}", angle=290.0)
    _outline(axis, run)
    axis.plot(0, 0, marker="+", color=INK, markersize=8, markeredgewidth=1.2)
    axis.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2, markerscale=2.0)
    return figure


def _outline(axis: Axes, run: StoredRun) -> None:
    """Where directions differ, the expected distance by direction, as its upper bound where it has one."""
    found = run.ensemble
    if found is None or found.undetermined or found.expected.direction is None:
        return
    expected = found.expected
    bounded = expected.upper is not None
    reach = _closed(expected.upper_by_direction if bounded else expected.by_direction)
    turn = np.radians(_closed(expected.azimuth))
    label = f"{'upper bound' if bounded else 'expected'} by direction"
    axis.plot(reach * np.cos(turn), reach * np.sin(turn), label=label, zorder=3, **{**LINES[1], "linewidth": 1.3})


def _ring(axis: Axes, radius: float, *, color: str, dashes: str, label: str, angle: float) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    axis.plot(radius * np.cos(turn), radius * np.sin(turn), color=color, linestyle=dashes, linewidth=1.1, zorder=3)
    place = np.radians(angle)
    axis.annotate(
        label, (radius * np.cos(place), radius * np.sin(place)), ha="center", va="center", fontsize=7,
        color=color, zorder=4,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85},
    )  # fmt: skip


@figure(
    "density_curve", "Density by distance",
    "Expected number of hazardous fragments per acceptable area, over all azimuths where they are alike, else in the "
    "direction that decides. Shaded: 5 to 95 % of the bootstrap, the certainty of the mean, not the scatter of single "
    "events.",
)  # fmt: skip
def _density(run: StoredRun) -> Figure | None:
    found = run.ensemble
    if found is None or not len(run.landed) or not found.expected.density.any():
        return None
    acceptable, expected = run.criteria.density, found.expected
    figure, (axis,) = new_figure(height=3.2)
    decides = int(expected.normal >= expected.ground)
    for number, label in sorted(enumerate(("on the ground", "normal to the paths")), key=lambda one: one[0] != decides):
        style, density = LINES[number], expected.density[number] / acceptable
        words = f"{label}{', which decides' if number == decides else ''}"
        axis.plot(expected.radius, np.where(density > 0, density, np.nan), label=words, **style)
        if expected.density_low.size:
            axis.fill_between(
                expected.radius, np.maximum(expected.density_low[number] / acceptable, _NOTHING),
                np.maximum(expected.density_high[number] / acceptable, _NOTHING), color=COLOURS[number], alpha=_SHADE,
                linewidth=0, hatch=_HATCHES[number], label="its mean, 5 to 95 %", zorder=1,
            )  # fmt: skip
    axis.axhline(1.0, color=ACCENT, linewidth=1.4, label=f"criterion, 1 per {1 / acceptable:.1f} m²")
    marked = [] if found.undetermined else [
        (expected.distance, ":", "expected"), (expected.upper, "--", "upper bound (95 %)"),
        (run.summary.hazard.recommended if run.summary.hazard else None, "-", "recommended"),
    ]  # fmt: skip
    for distance, dashes, words in marked:
        if distance:
            axis.axvline(distance, color=INK, linewidth=1.0, linestyle=dashes, label=f"{words}, {metres(distance)}")
    farthest = max((distance for distance, *_ in marked if distance), default=0.0)
    last = float(expected.radius[expected.density.any(axis=0)].max())
    axis.set(yscale="log", xlabel="Distance (m)", ylabel=f"Hazardous fragments per {1 / acceptable:.1f} m²")
    axis.set_xlim(0, max(min(last, _BESIDE * farthest), 1.05 * farthest) if farthest else last)
    axis.set_ylim(1e-3, 1e3)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), fontsize=7)
    return figure


def _closed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.append(values, values[0])


@figure(
    "polar_by_sector", "Number and speed around the rounds",
    lambda run: "Fragments that cross the witness surface over all realisations: median and band of 5 to 95 % by "
    f"sector, in degrees from +x counter-clockwise, seen from above{_of_x(run)}.",
)  # fmt: skip
def _polar_by_sector(run: StoredRun) -> Figure | None:
    if run.summary.hazard and run.summary.hazard.basis == "all_azimuths":
        return None  # sectors differ from each other at random alone
    name = next((name for name, table in run.witness_ensemble.items() if table["hits"].any()), None)
    if name is None:
        return None
    table = run.witness_ensemble[name]
    figure, (number, speed) = new_figure(2, 1, height=7.0, gap=0.95, subplot_kw={"projection": "polar"})
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
            turn, _closed(low), _closed(high), color=COLOURS[number], alpha=_SHADE, linewidth=0,
            hatch=_HATCHES[number], label=f"5 to 95 % of {len(each)}", zorder=1,
        )  # fmt: skip


def _of_x(run: StoredRun) -> str:
    bearing = None if run.values is None else bearing_of(run.values, 0.0)
    return "" if bearing is None else f"; +x points to {direction_words(0.0, bearing)}"


@figure(
    "attitude_curve", "Distance by attitude",
    "Distance by the inclination of the rounds from upright, each in its worst direction; of an arrangement that is "
    "not axisymmetric the worst roll of each inclination. In wind each is of an eighth of the fragments; the worst "
    "were flown again with all, for the distance.",
)  # fmt: skip
def _attitude_figure(run: StoredRun) -> Figure | None:
    hazard = run.summary.hazard
    if hazard is None or not hazard.attitude.curve:
        return None
    worst: dict[float, FlownAttitude] = {}
    for one in hazard.attitude.curve:
        known = worst.setdefault(one.inclination_deg, one)
        if (one.upper or one.expected or 0.0) > (known.upper or known.expected or 0.0):
            worst[one.inclination_deg] = one
    shown = [worst[inclination] for inclination in sorted(worst)]
    figure, (axis,) = new_figure(height=2.9)
    axis.errorbar(
        [one.inclination_deg for one in shown], [one.expected or np.nan for one in shown],
        yerr=[2.0 * (one.standard_error or 0.0) for one in shown], marker="o", markersize=3.5, capsize=2,
        label="of the expected density, ± 2 standard errors", **LINES[0],
    )  # fmt: skip
    if bounds := [(one.inclination_deg, one.upper) for one in shown if one.upper is not None]:
        axis.plot(*zip(*bounds, strict=True), color=GREY, linewidth=1.0, linestyle="--", label="upper bound (95 %)")
    if hazard.recommended is not None:
        axis.axhline(hazard.recommended, color=ACCENT, linewidth=1.2, label="recommended distance")
    axis.set(xlabel="Inclination from upright (°)", ylabel="Expected distance (m)", xlim=(-3.0, 183.0))
    axis.set_xticks(range(0, 181, 30))
    axis.set_ylim(bottom=0.0)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18))
    return figure


@figure(
    "uncertainty_distribution", "Distribution of the expected distance",
    "Share of the samples whose distance is not larger, statistical errors of the samples taken out; uprights: 5, 50 "
    "and 95 %, the distance of the run itself, and the recommended one.",
)  # fmt: skip
def _distribution_figure(run: StoredRun) -> Figure | None:
    if run.study is None or (entry := run.study.distance) is None or (hazard := run.study.hazard) is None:
        return None
    figure, (axis,) = new_figure(height=3.0)
    curve, spread = entry.curve, entry.spread
    axis.plot(curve.value, [100.0 * level for level in curve.level], **LINES[0])
    for value, level in ((spread.low, 5), (spread.median, 50), (spread.high, 95)):
        axis.plot([value] * 2, [0, level], color=GREY, linewidth=0.8)
        axis.plot(value, level, "o", color=INK, markersize=3.5)
    axis.axvline(hazard.parts.expected or 0.0, color=GREY, linestyle=":", linewidth=1.2, label="the run itself")
    axis.axvline(hazard.recommended or 0.0, color=ACCENT, linewidth=1.4, label="recommended")
    axis.set(xlabel="Expected distance (m)", ylabel="Samples (%)", ylim=(0, 100))
    axis.legend(loc="upper left")
    return figure


@figure(
    "uncertainty_tornado", "Effect of each input on the expected distance",
    "Mean distance with one input at 5 % and at 95 % of its own distribution (for discrete inputs over all steps), by "
    "linear regression. Light: the input at its low end.",
)  # fmt: skip
def _tornado_figure(run: StoredRun) -> Figure | None:
    if run.study is None or (entry := run.study.distance) is None or not entry.tornado:
        return None
    rows = sorted(entry.tornado, key=lambda one: abs(one.high - one.low))
    height = 0.9 + 0.27 * len(rows)
    figure, (axis,) = new_figure(height=height)
    mean = entry.spread.mean
    for place, row in enumerate(rows):
        for value, colour in ((row.low, _LIGHT), (row.high, COLOURS[0])):
            axis.barh(place, value - mean, left=mean, height=0.62, color=colour)
    axis.axvline(mean, color=INK, linewidth=0.8)
    axis.set_yticks(range(len(rows)), [plain_name(row.name) for row in rows])
    axis.set(xlabel="Expected distance (m)")
    axis.grid(visible=False, axis="y")
    return figure
