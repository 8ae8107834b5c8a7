"""The map of the site: distances by direction, exposed sites, obstacles and terrain, with scale and north."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.hazard.site_map import COLORS, KINDS, VERDICTS, extent_of, shapes_of
from fragfield.report.figures.drawing import ACCENT, GREY, INK, figure, new_figure, plain_name, round_length
from fragfield.results.words import metres

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fragfield.case import CaseTable
    from fragfield.hazard.site_map import Shape
    from fragfield.results.run import StoredRun


_TERRAIN, _OBSTACLE = "#b7a98c", COLORS["obstacle"]
_BESIDE = ((0, 7, "center"), (0, -7, "center"), (7, 0, "left"), (-7, 0, "right"), (0, 17, "center"), (0, -17, "center"))
"""Offsets (points) of a label from its position, and its alignment, in the order in which they are tried."""


def site_shapes(run: StoredRun) -> tuple[CaseTable, list[Shape]] | None:
    """The resolved case and its shapes, with exposed sites, obstacles, terrain or a geographic position; else None."""
    case = run.values
    if run.ensemble is None or case is None:
        return None
    exposed = run.summary.exposed or ()
    if not (exposed or case.obstacle or case.site is not None or case.flight.ground.map is not None):
        return None
    shapes = shapes_of(case, run.ensemble, exposed, run.summary.hazard.recommended if run.summary.hazard else None)
    return (case, shapes) if shapes else None


def north_of(case: CaseTable) -> float | None:
    """Azimuth of north from +x, counter-clockwise (degrees); None where the case does not say."""
    if case.site is not None:
        return math.degrees(case.site.bearing)
    return 90.0 if case.flight.ground.map is not None else None


@figure(
    "site_map", "Map of the site",
    "Distance by direction, exposed sites by their verdict, barricades and buildings, and lines of equal height, in "
    "the site's frame.",
)  # fmt: skip
def _site_figure(run: StoredRun) -> Figure | None:
    found = site_shapes(run)
    if found is None:
        return None
    case, shapes = found
    figure, (axis,) = new_figure(width=5.2, height=5.2)
    labels: set[str] = set()
    for shape in shapes:
        _draw(axis, shape, labels)
    low, high = extent_of(shapes)
    margin = 0.08 * float((high - low).max())
    axis.set(
        xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin), aspect="equal",
        xlabel="x (m)", ylabel="y (m)",
    )  # fmt: skip
    axis.grid(visible=False)
    _scale(axis)
    north = north_of(case)
    if north is not None:
        _north(axis, north)
    _name(axis, shapes)
    if labels:
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2)
    return figure


def _draw(axis: Axes, shape: Shape, labels: set[str]) -> None:
    points = np.concatenate([shape.points, shape.points[:1]]) if shape.closed else shape.points
    x, y = points.T
    if shape.kind == "terrain":
        axis.plot(x, y, color=_TERRAIN, linewidth=0.6, zorder=1, label=_once(labels, "height of the ground (m)"))
    elif shape.kind in ("hazard_upper", "hazard"):
        upper = shape.kind == "hazard_upper"
        axis.plot(x, y, color=ACCENT, linewidth=1.5 if upper else 0.9, linestyle="-" if upper else (0, (4, 2)),
                  zorder=3, label=_once(labels, KINDS[shape.kind]))  # fmt: skip
    elif shape.kind == "recommended":
        axis.plot(x, y, color=COLORS["recommended"], linewidth=2.0, zorder=3, label=_once(labels, shape.name))
        axis.annotate(metres(shape.properties["distance_m"]), shape.points[45], ha="center", va="center", fontsize=7,
                      color=COLORS["recommended"], zorder=6, annotation_clip=True,
                      bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})  # fmt: skip
    elif shape.kind == "max_throw":
        axis.plot(x, y, color=GREY, linewidth=0.8, linestyle=":", zorder=1, label=_once(labels, KINDS[shape.kind]))
    elif shape.kind == "obstacle":
        axis.fill(x, y, facecolor=_OBSTACLE, alpha=0.45, edgecolor=_OBSTACLE, linewidth=0.8, zorder=2,
                  hatch="////", label=_once(labels, "barricade, wall, building that stops fragments"))  # fmt: skip
    elif shape.kind == "round":
        axis.plot(x[:1], y[:1], marker="+", color=INK, markersize=9, markeredgewidth=1.4, linestyle="", zorder=5,
                  label=_once(labels, "rounds"))  # fmt: skip
    else:
        verdict = shape.properties["verdict"]
        style = VERDICTS[verdict]
        axis.fill(x, y, facecolor=style.color, alpha=style.opacity, zorder=4)
        axis.fill(
            x, y, facecolor="none", edgecolor=style.color, linewidth=0.5 * style.width, hatch=style.hatch, zorder=4
        )
        axis.plot(*shape.centre, marker=style.marker, color=style.color, markersize=5, linestyle="", zorder=5,
                  label=_once(labels, f"exposed site, criterion {verdict}"))  # fmt: skip


def _name(axis: Axes, shapes: Sequence[Shape]) -> None:
    """Names of exposed sites and obstacles, then heights of the ground: where none covers another, or not at all."""
    figure = axis.figure
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    inside, taken = axis.get_window_extent(renderer), list[Any]()
    named = {shape.name for shape in shapes if shape.kind == "exposed"}
    for kind, size, offsets in (("exposed", 7.2, _BESIDE), ("obstacle", 6.5, _BESIDE), ("terrain", 6.0, _BESIDE[:0])):
        for shape in shapes:
            if shape.kind != kind or (kind == "obstacle" and shape.name in named):
                continue
            at = shape.points[len(shape.points) // 2] if kind == "terrain" else shape.centre
            color = VERDICTS[shape.properties["verdict"]].color if kind == "exposed" else COLORS[kind]
            for right, up, alignment in offsets or ((0, 0, "center"),):
                label = axis.annotate(
                    plain_name(shape.name), tuple(at), xytext=(right, up), textcoords="offset points",
                    ha=alignment, va="center", fontsize=size, color=color, zorder=6, annotation_clip=True,
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4, "alpha": 0.8},
                )  # fmt: skip
                box = label.get_window_extent(renderer)
                free = inside.containsx(box.x0) and inside.containsx(box.x1) and inside.containsy(box.y1)
                if free and inside.containsy(box.y0) and not any(box.overlaps(other) for other in taken):
                    taken.append(box)
                    break
                label.remove()


def _once(labels: set[str], label: str) -> str:
    if label in labels:
        return "_"
    labels.add(label)
    return label


def _scale(axis: Axes) -> None:
    (left, right), (low, high) = axis.get_xlim(), axis.get_ylim()
    length = round_length(0.22 * (right - left))
    x, y = left + 0.04 * (right - left), low + 0.035 * (high - low)
    axis.plot([x, x + length], [y, y], color=INK, linewidth=2.2, solid_capstyle="butt", zorder=7)
    axis.annotate(f"{length:g} m", (x + 0.5 * length, y), xytext=(0, 4), textcoords="offset points", ha="center",
                  fontsize=7.5, zorder=7, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5})  # fmt: skip


def _north(axis: Axes, azimuth: float) -> None:
    turn = math.radians(azimuth)
    (left, right), (low, high) = axis.get_xlim(), axis.get_ylim()
    length = 0.07 * min(right - left, high - low)
    way = length * np.array([math.cos(turn), math.sin(turn)])
    tail = np.array([right, high]) - 1.3 * length - 0.5 * way
    style = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
    axis.annotate("", tuple(tail + way), tuple(tail), arrowprops=style, zorder=7)
    x, y = (tail + 1.35 * way).tolist()
    axis.text(x, y, "N", ha="center", va="center", fontsize=9, fontweight="bold", zorder=7)
