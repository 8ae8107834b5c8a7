"""Figures of a study of uncertainty: distribution of the distance, tornado, exposed sites."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.report.figures.drawing import ACCENT, COLOURS, GREY, INK, LINES, figure, new_figure, plain_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fragfield.results.run import StoredRun
    from fragfield.results.uncertainty import SampledSiteQuantity


_LIGHT = "#9db7cf"


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


@figure(
    "uncertainty_sites", "Exposed sites over the inputs",
    "Expected hits at each exposed site: 5 to 95 % over the inputs (bar), median (dot), the run itself (cross).",
)  # fmt: skip
def _places_figure(run: StoredRun) -> Figure | None:
    sites = () if run.study is None else run.study.exposed
    drawn = [(one.name, one.hits) for one in sites if one.hits is not None and one.hits.spread.high > 0.0]
    if not drawn:
        return None
    height = 1.0 + 0.3 * len(drawn)
    figure, (axis,) = new_figure(height=height)
    floor = min(value for _, hits in drawn for value in _values(hits) if value > 0.0) / 3.0
    for place, (_, hits) in enumerate(reversed(drawn)):
        low, median, high, nominal = (max(value, floor) for value in _values(hits))
        axis.plot([low, high], [place, place], color=COLOURS[0], linewidth=5, solid_capstyle="butt", alpha=0.45)
        axis.plot(median, place, "o", color=COLOURS[0], markersize=4)
        axis.plot(nominal, place, "x", color=ACCENT, markersize=5)
    axis.set_yticks(range(len(drawn)), [plain_name(name) for name, _ in reversed(drawn)])
    axis.set(xlabel="Expected hazardous hits", xscale="log")
    axis.grid(visible=False, axis="y")
    return figure


def _values(hits: SampledSiteQuantity) -> tuple[float, ...]:
    return hits.spread.low, hits.spread.median, hits.spread.high, hits.nominal or 0.0
