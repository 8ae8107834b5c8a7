"""Layout of the panels of a figure, measured once.

Constrained layout measures every text twice and solves a system for any arrangement; a report's panels stand in one
grid, for which the widest decoration of each row and column is enough. Matplotlib measures the ticks again for every
file, label and frame: what follows from the places found here is kept.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox
    from numpy.typing import NDArray

__all__ = ["place_panels", "prepare", "settle", "without_markup"]

_PAD = 3.0 / 72.0  # inches around each panel with its decorations
_GUESS = (0.6, 0.15, 0.5, 0.3)  # of the decorations left, right, below and above a panel (inches), to measure with
_LEFT, _DOWN = 0, 3  # markers of matplotlib: TICKLEFT, TICKDOWN
_DECADES = 1.5  # of a logarithmic axis: of a shorter one the minor ticks have labels
_RAISED = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"\$\\mathdefault\{(-?)(?:([0-9.]+)\\times)?10\^\{([-−]?\d+)\}\}\$")


def prepare(figure: Figure) -> None:
    """Make the axes light to measure and to draw, with the same look: once all that is drawn is in them."""
    for axes in figure.axes:
        for spine in axes.spines.values():
            spine.set_in_layout(False)  # otherwise it asks for all ticks; they reach farther than it
    each = [(axes, axis) for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) if axis.get_scale() == "log"]
    logarithmic = [(axes, axis, _minor_places(axis)) for axes, axis in each]
    # Panels may share their ticks: those of all are found before those of the first are taken away.
    for axes, axis, places in logarithmic:
        _write_plainly(axis)
        if places is not None:
            _mark_minor(axes, axis, places)


def _minor_places(axis: Axis) -> NDArray[np.float64] | None:
    """Minor ticks of a logarithmic axis; None where they have labels."""
    low, high = sorted(axis.get_view_interval())
    if not 0.0 < low * 10.0**_DECADES < high:
        return None
    return np.array([place for place in axis.get_minorticklocs() if low <= place <= high])


def _mark_minor(axes: Axes, axis: Axis, places: NDArray[np.float64]) -> None:
    """Draw the minor ticks as one line of markers: each tick is four artists otherwise."""
    from matplotlib import rcParams
    from matplotlib.ticker import NullLocator

    upright = axis is axes.yaxis
    axis.set_minor_locator(NullLocator())
    if not len(places) or not axis.get_visible():
        return
    name = "ytick" if upright else "xtick"
    edge = np.zeros(len(places))
    x, y = (edge, places) if upright else (places, edge)
    limits = axes.get_xlim(), axes.get_ylim()
    axes.plot(
        x, y, linestyle="none", marker=_LEFT if upright else _DOWN, markersize=rcParams[f"{name}.minor.size"],
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
    """Give the panels of a figure's one grid all the room that their decorations leave.

    Axes outside of the grid, such as a shared scale, stand at the foot of the figure and stay there.
    """
    axes = [axis for axis in figure.axes if axis.get_subplotspec() is not None]
    if not axes:
        return
    below = [axis.get_tightbbox() for axis in figure.axes if axis.get_subplotspec() is None]
    foot = max((box.y1 / figure.dpi for box in below if box is not None), default=0.0)
    grid = axes[0].get_subplotspec().get_gridspec()  # type: ignore[union-attr]
    rows, columns = grid.nrows, grid.ncols
    size = (*figure.get_size_inches(), foot)
    ratios = (np.asarray(grid.get_width_ratios(), dtype=float), np.asarray(grid.get_height_ratios(), dtype=float))
    across, along = np.tile(_GUESS[:2], (columns, 1)), np.tile((_GUESS[3], _GUESS[2]), (rows, 1))
    _set_positions(axes, size, across, along, ratios)
    across, along = np.zeros((columns, 2)), np.zeros((rows, 2))
    for axis in axes:
        spec = axis.get_subplotspec()
        outer = axis.get_tightbbox(for_layout_only=True)
        if outer is None or spec is None:
            continue
        inner, dots = axis.get_window_extent(), figure.dpi
        row, column = spec.rowspan.start, spec.colspan.start
        across[column] = np.maximum(across[column], [(inner.x0 - outer.x0) / dots, (outer.x1 - inner.x1) / dots])
        along[row] = np.maximum(along[row], [(outer.y1 - inner.y1) / dots, (inner.y0 - outer.y0) / dots])
    _set_positions(axes, size, across, along, ratios)


def _set_positions(
    axes: list[Axes],
    size: tuple[float, float, float],
    across: NDArray[np.float64],
    along: NDArray[np.float64],
    ratios: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> None:
    """Panels of the grid's ratios in a figure of that width, height and foot (inches).

    Their margins are `across` the columns (left, right) and `along` the rows (top, bottom).
    """
    width, height, foot = size
    wide = max(width - across.sum() - 2 * _PAD * len(across), 0.2 * width) * ratios[0] / ratios[0].sum()
    high = max(height - foot - along.sum() - 2 * _PAD * len(along), 0.2 * height) * ratios[1] / ratios[1].sum()
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
