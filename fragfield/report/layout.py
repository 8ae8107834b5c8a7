"""Where the panels of a figure stand, measured once, and what need not be measured again while it is drawn.

Constrained layout measures every text twice and solves a system for any arrangement; a report's panels stand in one
grid, for which the widest decoration of each row and column is enough. Matplotlib measures the ticks again for every
file, label and frame: what follows from the places found here is kept.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, cast

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

__all__ = ["place_panels", "prepare", "settle", "without_markup"]

_PAD = 3.0 / 72.0  # inches around each panel with its decorations
_GUESS = (0.6, 0.15, 0.5, 0.3)  # of the decorations left, right, below and above a panel (inches), to measure with
_DECADES = 1.5  # of a logarithmic axis: of a shorter one the minor ticks have labels
_RAISED = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"\$\\mathdefault\{(-?)(?:([0-9.]+)\\times)?10\^\{([-−]?\d+)\}\}\$")


def prepare(figure: Figure) -> None:
    """Make the axes light to measure and to draw, with the same look: once all that is drawn is in them."""
    for axes in figure.axes:
        for spine in axes.spines.values():
            spine.set_in_layout(False)  # otherwise it asks for all ticks; they reach farther than it
        for axis in axes._axis_map.values():  # type: ignore[attr-defined]
            if axis.get_scale() == "log":
                _lighten(axes, axis)


def _lighten(axes: Axes, axis: Axis) -> None:
    """Powers as plain text, and all minor ticks of a logarithmic axis as one line of markers."""
    from matplotlib.lines import TICKDOWN, TICKLEFT
    from matplotlib.ticker import NullLocator

    _write_plainly(axis)
    low, high = sorted(axis.get_view_interval())
    if not 0.0 < low * 10.0**_DECADES < high:
        return
    upright = axis.axis_name == "y"  # type: ignore[attr-defined]
    places = np.array([place for place in axis.get_minorticklocs() if low <= place <= high])
    axis.set_minor_locator(NullLocator())
    if not len(places) or not axis.get_visible():
        return
    from matplotlib import rcParams

    name = "ytick" if upright else "xtick"
    edge = np.zeros(len(places))
    x, y = (edge, places) if upright else (places, edge)
    limits = axes.get_xlim(), axes.get_ylim()
    axes.plot(
        x, y, linestyle="none", marker=TICKLEFT if upright else TICKDOWN, markersize=rcParams[f"{name}.minor.size"],
        markeredgewidth=rcParams[f"{name}.minor.width"], color=rcParams[f"{name}.color"], clip_on=False,
        transform=axes.get_yaxis_transform() if upright else axes.get_xaxis_transform(), zorder=2.01, in_layout=False,
        scalex=False, scaley=False, label="_minor",
    )  # fmt: skip
    axes.set(xlim=limits[0], ylim=limits[1])


def _write_plainly(axis: Axis) -> None:
    from matplotlib.ticker import LogFormatterSciNotation

    class Plain(LogFormatterSciNotation):
        """Powers of ten in raised digits: mathematical text is parsed for each label."""

        def __call__(self, value: float, position: int | None = None) -> str:
            """The label of a tick."""
            return without_markup(super().__call__(value, position))

    if type(axis.get_major_formatter()) is LogFormatterSciNotation:
        axis.set_major_formatter(Plain())


def without_markup(text: str) -> str:
    """A power of ten written in raised digits; any other text as it is."""
    found = _POWER.fullmatch(text)
    if found is None:
        return text
    sign, factor, power = found.groups()
    return f"{'−' if sign else ''}{f'{factor}×' if factor else ''}10{power.translate(_RAISED)}"


def place_panels(figure: Figure) -> None:
    """Give the panels of a figure's one grid all the room that their decorations leave."""
    axes = [axis for axis in figure.axes if axis.get_subplotspec() is not None]
    if not axes:
        return
    grid = axes[0].get_subplotspec().get_gridspec()  # type: ignore[union-attr]
    rows, columns = grid.nrows, grid.ncols
    width, height = figure.get_size_inches()
    ratios = (np.asarray(grid.get_width_ratios(), dtype=float), np.asarray(grid.get_height_ratios(), dtype=float))
    across, along = np.tile(_GUESS[:2], (columns, 1)), np.tile((_GUESS[3], _GUESS[2]), (rows, 1))
    _set_positions(axes, (width, height), across, along, ratios)
    across, along = np.zeros((columns, 2)), np.zeros((rows, 2))
    for axis in axes:
        spec = axis.get_subplotspec()
        outer = axis.get_tightbbox(for_layout_only=True)
        if outer is None or spec is None:
            continue
        inner, dots = cast("Bbox", axis.get_window_extent()), figure.dpi
        row, column = spec.rowspan.start, spec.colspan.start
        across[column] = np.maximum(across[column], [(inner.x0 - outer.x0) / dots, (outer.x1 - inner.x1) / dots])
        along[row] = np.maximum(along[row], [(outer.y1 - inner.y1) / dots, (inner.y0 - outer.y0) / dots])
    _set_positions(axes, (width, height), across, along, ratios)


def _set_positions(
    axes: list[Axes],
    size: tuple[float, float],
    across: np.ndarray,
    along: np.ndarray,
    ratios: tuple[np.ndarray, np.ndarray],
) -> None:
    """Panels of the grid's ratios between margins `across` the columns (left, right) and `along` the rows (top, bottom)."""
    width, height = size
    wide = max(width - across.sum() - 2 * _PAD * len(across), 0.2 * width) * ratios[0] / ratios[0].sum()
    high = max(height - along.sum() - 2 * _PAD * len(along), 0.2 * height) * ratios[1] / ratios[1].sum()
    for axis in axes:
        spec = axis.get_subplotspec()
        assert spec is not None
        row, column = spec.rowspan.start, spec.colspan.start
        left = across[:column].sum() + across[column, 0] + wide[:column].sum() + (2 * column + 1) * _PAD
        top = along[:row].sum() + along[row, 0] + high[:row].sum() + (2 * row + 1) * _PAD
        axis.set_position((left / width, 1 - (top + high[row]) / height, wide[column] / width, high[row] / height))


def settle(figure: Figure) -> Bbox:
    """Measure what will be drawn (inches), and keep the labels where they are then."""
    drawn = figure.get_tightbbox()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axis.label.get_text():
                place = axis.label.get_transform().transform(axis.label.get_position())
                axis.set_label_coords(*axes.transAxes.inverted().transform(place))
    return drawn
