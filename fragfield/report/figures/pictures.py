"""Pictures of the fields: sections through the burst halfway and at its end, and the cloud of fragments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fragfield.errors import InputError
from fragfield.report.figures.drawing import INK, SPEED_MAP, blank_figure, figure, round_length
from fragfield_base.hdf5_files import reading
from fragfield_base.xdmf import times_of_xdmf

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fragfield.interface.burst import Burst
    from fragfield.results.run import StoredRun

    Array = NDArray[np.float64]


STREAK = 1e-4
"""Time (s) that fragments have flown on, without drag, where they are shown."""
_SIGHT = np.array([-1.0, -1.6, 0.7])
"""From the cloud of fragments towards who looks at it."""
_DIAMETER = 0.009
"""Of a mean fragment as drawn, as a fraction of the cloud's diagonal: true sizes may vanish."""
_CASING = 0  # part of a cell, as the snapshot numbers them
_ON_AXIS = 1e-9  # m
_AGAIN = "run `fragfield burst` again"
_FACES = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Of a hexahedron in VTK's order."""
_TETRAHEDRA = np.array([[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]])
_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
_PIECES = {
    4: {1: [[(0, 1), (0, 2), (0, 3)]], 2: [[(0, 2), (0, 3), (1, 3)], [(0, 2), (1, 3), (1, 2)]],
        3: [[(0, 3), (1, 3), (2, 3)]]},
    3: {1: [[(0, 1), (0, 2)]], 2: [[(0, 2), (1, 2)]]},
}  # fmt: skip
"""Edges of a tetrahedron or a triangle that a plane cuts, by the number of its corners above, which come first."""


class Section(NamedTuple):
    """A section through the burst, viewed along +y."""

    time: float
    """s"""
    points: Array
    """(n, 2) across and upwards (m)."""
    triangles: NDArray[np.int64]
    """(k, 3) points."""
    speed: Array
    """(n,) m/s"""
    outline: Array
    """(j, 2, 2) ends of the lines around the casings (m)."""


@figure(
    "picture_of_burst", "Section of the burst",
    "Section through the axis halfway and at the end, viewed along +y, coloured by speed: light is fast, dark is slow. "
    "The thin line is the outline of the casing.",
)  # fmt: skip
def _burst(run: StoredRun) -> Figure | None:
    if run.snapshot is None:
        return None
    from matplotlib.collections import LineCollection

    sections = burst_sections(run)
    fastest = max(float(one.speed.max()) for one in sections) or 1.0
    low = np.min([one.points.min(axis=0) for one in sections], axis=0)
    high = np.max([one.points.max(axis=0) for one in sections], axis=0)
    figure = blank_figure(3.6, 2.9)
    axes = figure.subplots(1, len(sections), squeeze=False)[0]
    for axis, one in zip(axes, sections, strict=True):
        shown = axis.tripcolor(
            *one.points.T, one.triangles, one.speed, shading="gouraud", cmap=SPEED_MAP, vmin=0.0, vmax=fastest,
            rasterized=True,
        )  # fmt: skip
        axis.add_collection(LineCollection(list(one.outline), colors=INK, linewidths=0.5, rasterized=True))
        axis.set(title=f"{1e6 * one.time:.0f} µs", xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        axis.set_axis_off()
    _length_bar(axes[0], low, high)
    _speed_bar(figure, shown, axes, "Speed (m/s)")
    return figure


def _length_bar(axis: Axes, low: Array, high: Array) -> None:
    length, below = round_length(0.5 * float(high[0] - low[0])), float(low[1] - 0.05 * (high[1] - low[1]))
    start = float(low[0])
    axis.plot([start, start + length], [below, below], color=INK, linewidth=1.6, clip_on=False)
    axis.text(start + 1.05 * length, below, f" {1e3 * length:g} mm", va="center", fontsize=7.5)


def _speed_bar(figure: Figure, shown: Any, axes: Any, label: str) -> None:  # noqa: ANN401 - matplotlib's
    bar = figure.colorbar(shown, ax=axes, orientation="horizontal", fraction=0.05, shrink=0.6, label=label)
    bar.outline.set_visible(False)  # type: ignore[operator]


def burst_sections(run: StoredRun) -> list[Section]:
    """Sections halfway and at the end of the burst.

    Images behind planes of symmetry are cut with the rounds; of an axisymmetric burst both sides of the meridian are
    shown. Raises InputError: burst.xdmf or its data is damaged.
    """
    from burst_fenicsx.meshing.placement import FACING, to_local

    burst = run.snapshot
    assert burst is not None
    points = burst.mesh.position
    if burst.mesh.is_axisymmetric:
        points = to_local(points, burst.rounds[0].position.tolist(), burst.rounds[0].axis.tolist())
    cells = burst.mesh.cells, burst.mesh.part
    sections = [_section(burst, str(run.path), burst.mesh.time, points, burst.mesh.velocity, *cells)]
    path = run.path / "burst.xdmf"
    if path.is_file() and (run.path / "burst").is_dir():
        times = times_of_xdmf(path, InputError, _AGAIN)
        if earlier := [time for time in times if 0.0 < time < 0.999 * burst.mesh.time]:
            half = min(earlier, key=lambda time: abs(time - 0.5 * burst.mesh.time))
            points, velocity, nodes, part = _read_time(path, times[half])
            if burst.mesh.is_axisymmetric:
                points = points @ FACING.T
            sections.insert(0, _section(burst, str(run.path), half, points, velocity, nodes, part))
    return sections


def _read_time(path: Path, where: dict[str, str]) -> Iterator[Any]:
    """Positions, velocities, and nodes and parts of the cells."""
    for name in ("position", "velocity", "cells", "part"):
        if name not in where:
            raise InputError(f"{path}: {name} is missing; {_AGAIN}")
        file_name, _, dataset = where[name].partition(":")
        with reading(path.parent / file_name, InputError, _AGAIN) as file:
            array = file[dataset][()]
        if name == "position":
            nodes = len(array)
        if name == "cells" and len(array) and not 0 <= array.min() <= array.max() < nodes:
            raise InputError(f"{path}: cells refer to nodes that do not exist; {_AGAIN}")
        yield array


def _section(
    burst: Burst, where: str, time: float, points: Array, velocity: Array, cells: NDArray[Any], part: NDArray[Any]
) -> Section:
    from transition.motion import images

    count, speed = len(points), np.linalg.norm(velocity, axis=1)
    copies = [points * (-1.0, 1.0, 1.0)] if burst.mesh.is_axisymmetric else []
    copies += [points @ image.matrix.T + image.shift for image in images(burst.mesh.planes, where)]
    points = np.concatenate([points, *copies])
    speed = np.tile(speed, 1 + len(copies))
    cells = np.concatenate([cells + number * count for number in range(1 + len(copies))])
    casing = cells[np.tile(part, 1 + len(copies)) == _CASING]
    if burst.mesh.is_axisymmetric:
        lines = points[_once(casing[:, [[0, 1], [1, 2], [2, 3], [3, 0]]].reshape(-1, 2))][:, :, ::2]
        off_axis = np.abs(lines[..., 0]).max(axis=1) > _ON_AXIS
        return Section(time, points[:, ::2], cells[:, _TRIANGLES].reshape(-1, 3), speed, lines[off_axis])
    # a hair behind the axis, where planes of the mesh coincide with it
    across = points[:, 1]
    height = _axis_of_section(burst, where) + 1e-4 * float(np.ptp(across))
    flat = np.column_stack([points[:, ::2], speed])
    outline = _cut(_once(casing[:, _FACES].reshape(-1, 4))[:, _TRIANGLES].reshape(-1, 3), across, height, flat)
    crossed = cells[(across[cells].min(axis=1) < height) & (across[cells].max(axis=1) >= height)]
    pieces = _cut(crossed[:, _TETRAHEDRA].reshape(-1, 4), across, height, flat)
    numbers = np.arange(3 * len(pieces)).reshape(-1, 3)
    return Section(time, pieces[..., :2].reshape(-1, 2), numbers, pieces[..., 2].ravel(), outline[..., :2])


def _once(sides: NDArray[Any]) -> NDArray[Any]:
    _, first, counts = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    return sides[first[counts == 1]]


def _cut(simplices: NDArray[Any], across: Array, height: float, values: Array) -> Array:
    """Values (k, corners, j) at the corners of the triangles or lines in which a plane cuts tetrahedra or triangles."""
    above = across[simplices] >= height
    simplices = np.take_along_axis(simplices, np.argsort(~above, axis=1, kind="stable"), axis=1)
    number = above.sum(axis=1)
    ends = np.concatenate([
        simplices[number == count][:, np.array(piece)]
        for count, pieces in _PIECES[simplices.shape[1]].items() for piece in pieces
    ])  # fmt: skip
    start, end = ends[..., 0], ends[..., 1]
    fraction = ((height - across[start]) / (across[end] - across[start]))[..., None]
    cut: Array = values[start] + fraction * (values[end] - values[start])
    return cut


def _axis_of_section(burst: Burst, where: str) -> float:
    """The y (m) of the axis that is cut: of the round next to the centre, or before it; the same at all times."""
    from transition.motion import images

    centres = []
    for item in burst.rounds:
        centre = item.position + 0.5 * item.length * item.axis / np.linalg.norm(item.axis)
        centres += [centre, *(image.place(centre) for image in images(burst.mesh.planes, where))]
    places = [float(centre[1]) for centre in centres]
    middle = 0.5 * (min(places) + max(places))
    # Of two rounds equally near the front one is cut.
    return min(places, key=lambda y: (round(abs(y - middle), 6), y))


@figure(
    "picture_of_fragments", "Fragment cloud",
    lambda run: f"Fragments 100 µs after {'launch' if run.fragments_file else 'the end of the burst'}, drag neglected, "
    "coloured by initial speed. Circles stand for the mass, not to scale; shapes are not known.",
)  # fmt: skip
def _fragments(run: StoredRun) -> Figure | None:
    if run.launched is None:
        return None
    from matplotlib.collections import EllipseCollection

    fragments = run.launched
    points = fragments.position + STREAK * fragments.velocity
    sight = _SIGHT / np.linalg.norm(_SIGHT)
    right = np.cross((0.0, 0.0, 1.0), sight)
    right /= np.linalg.norm(right)
    order = np.argsort(points @ sight)  # what is near hides what is far
    flat = np.column_stack([points @ right, points @ np.cross(sight, right)])[order]
    wide, deep, high = np.ptp(points, axis=0)
    size = np.cbrt(fragments.mass)[order]
    diameter = _DIAMETER * float(np.linalg.norm((wide, deep, high))) * size / max(float(size.mean()), 1e-9)
    figure = blank_figure(3.6, 4.6)
    axis = figure.subplots()
    shown = EllipseCollection(
        diameter, diameter, np.zeros(len(size)), units="xy", offsets=flat, offset_transform=axis.transData,
        array=fragments.speed[order], cmap=SPEED_MAP, edgecolors="white", linewidths=0.1, rasterized=True,
    )  # fmt: skip
    axis.add_collection(shown)
    low, top = (flat - diameter.max()).min(axis=0), (flat + diameter.max()).max(axis=0)
    axis.set(xlim=(low[0], top[0]), ylim=(low[1], top[1]), aspect="equal")
    axis.set_title(f"Cloud {wide:.2f} x {deep:.2f} x {high:.2f} m", fontsize=8, fontweight="normal")
    axis.set_axis_off()
    _speed_bar(figure, shown, axis, "Initial speed (m/s)")
    return figure
