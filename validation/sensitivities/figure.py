"""One figure a parameter, all on the same scales, and the tornado chart of the hazardous fragment distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.ticker import MaxNLocator

from fragfield.report.figures.drawing import GREY, INK
from validation.figures import picture
from validation.sensitivities.check import KINDS, value_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from validation.sensitivities.check import Answers, Bar
    from validation.sensitivities.responses import Response

__all__ = ["draw", "draw_tornado", "scales"]

_TITLES = {
    "mean_speed": "Mean initial speed (m/s)",
    "largest_speed": "Largest initial speed (m/s)",
    "number": "Fragments",
    "distance": "Hazardous distance (m)",
}
_LOWER, _UPPER = "#16365c", "#b9c4d0"  # far apart in lightness


def scales(found: Sequence[Answers]) -> dict[str, tuple[float, float]]:
    """Ends of the axis of every kind of response over its base's: alike in all figures, so that flat looks flat."""
    ends = {}
    for kind in KINDS:
        values = [1.0]
        for answers in found:
            origin = value_of(answers.base, kind)
            for one in (answers.base, *answers.responses):
                spread = one.error if kind == "distance" else 0.0
                values += [(value_of(one, kind) + side * spread) / origin for side in (-1.0, 1.0)]
        room = 0.06 * (max(values) - min(values)) or 0.01
        ends[kind] = (min(values) - room, max(values) + room)
    return ends


def draw(answers: Answers, ends: Mapping[str, tuple[float, float]], path: Path) -> Path:
    """Write the figure of one parameter as PNG, `ends` as `scales` gives them; the base is the open circle."""
    parameter, base = answers.parameter, answers.base
    pairs = sorted(
        [(one.variation.value, one) for one in answers.responses] + [(parameter.base, base)], key=lambda pair: pair[0]
    )
    places = [value for value, _ in pairs]
    with picture(path, len(KINDS), height=2.3) as axes:
        for axis, kind in zip(axes, KINDS, strict=True):
            values = [value_of(one, kind) for _, one in pairs]
            axis.axhline(value_of(base, kind), color=GREY, linewidth=0.8)
            if kind == "distance":
                axis.errorbar(places, values, [one.error for _, one in pairs], color=INK, capsize=2.5, linewidth=1.2)
            else:
                axis.plot(places, values, color=INK, linewidth=1.2)
            axis.plot(places, values, "o", color=INK, markersize=4)
            axis.plot([parameter.base], [value_of(base, kind)], "o", color=INK, markerfacecolor="white", markersize=5.5)
            axis.set_title(_TITLES[kind], fontsize=8)
            axis.set(
                ylim=[end * value_of(base, kind) for end in ends[kind]],
                xticks=places,
                xticklabels=[f"{place:.3g}" for place in places],
            )
            axis.margins(x=0.12)
            axis.minorticks_off()
            axis.yaxis.set_major_locator(MaxNLocator(5, integer=True))
            axis.tick_params(labelsize=6.5)
        axes[0].figure.supxlabel(parameter.axis, fontsize=8.5)
    return path


def draw_tornado(bars: Sequence[Bar], base: Response, path: Path) -> Path:
    """Write the tornado chart as PNG: changes of the distance, with the values at which they are met."""
    with picture(path, height=0.9 + 0.42 * len(bars)) as (axis,):
        reach = max(bar.swing for bar in bars)
        for row, bar in enumerate(bars):
            for change, value, error, colour, side in (
                (bar.low, bar.low_value, bar.low_error, _LOWER, -1.0),
                (bar.high, bar.high_value, bar.high_error, _UPPER, 1.0),
            ):
                if change == 0.0:
                    continue
                axis.barh(row, change, height=0.62, color=colour, edgecolor=INK, linewidth=0.6)
                axis.errorbar(change, row, xerr=error, color=INK, capsize=2.5, linewidth=1.0)
                axis.annotate(
                    value, (change + side * (error + 0.012 * reach), row), fontsize=7.8, va="center",
                    ha="left" if side > 0.0 else "right",
                )  # fmt: skip
        axis.axvline(0.0, color=INK, linewidth=1.0)
        axis.set(yticks=range(len(bars)), yticklabels=[bar.words for bar in bars], ylim=(len(bars) - 0.4, -0.6))
        axis.set_xlabel(
            f"Change of the hazardous fragment distance (m) from {base.distance:.1f} ± {base.error:.1f} m\n"
            "(whiskers: standard error of the change)"
        )
        axis.margins(x=0.12)
        axis.grid(visible=False, axis="y")
    return path
