"""Plan and elevation of the rounds as they stand, images behind planes of symmetry and the ground with them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.report.figures.drawing import GREY, INK, LINES, new_figure, plain_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from fragfield.case import CaseTable
    from fragfield.case.tables.round import PlaneTable
    from fragfield.report.reading.run_files import RunFiles


_STATIONS, _AROUND = 41, 36  # of a round's surface
_MOST_NAMED = 4
_ROOM = 0.25  # beside the rounds, of their largest extent


def arrangement_figure(run: RunFiles) -> Figure | None:
    """Outlines of the rounds seen from above and along +y; None where no contours or places are known."""
    case = run.case
    if case is None or run.fragments_file is not None or not case.round:
        return None
    bodies = list(_bodies(case))
    if not bodies:
        return None
    from fragfield.case.conversion.surroundings import ground_height

    points = np.concatenate([surface for _, surface, _ in bodies])
    ground = ground_height(case, *points[:, :2].mean(axis=0))
    low, high = points.min(axis=0), points.max(axis=0)
    low[2] = min(low[2], ground)
    room = _ROOM * float((high - low).max())
    across = float((high - low)[0]) + 2.0 * room
    ratios = [float((high - low)[axis]) + 2.0 * room for axis in (1, 2)]
    turn = 90.0 if len(bodies) > 1 and ratios[0] < across else 0.0  # names of neighbours beside each other
    height = float(np.clip(3.0 * sum(ratios) / across + 1.0, 3.0, 5.0))
    figure, (plan, elevation) = new_figure(2, 1, height=height, gridspec_kw={"height_ratios": ratios})
    for axes, vertical, title in ((plan, 1, "Plan, from above"), (elevation, 2, "Elevation, seen along +y")):
        for name, surface, image in bodies:
            outline = _hull(surface[:, [0, vertical]])
            axes.fill(*outline.T, facecolor="#e9edf2" if image else "#c9d3df", edgecolor=INK, linewidth=0.8,
                      linestyle="--" if image else "-", hatch="" if image else "///", zorder=2)  # fmt: skip
            if name and not image and len(case.round) <= _MOST_NAMED:
                axes.annotate(plain_name(name), outline.mean(axis=0), ha="center", va="center", fontsize=7, zorder=4,
                              rotation=turn, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})  # fmt: skip
        axes.set(title=title, aspect="equal", ylabel=f"{'xyz'[vertical]} (m)")
        axes.set(xlim=(low[0] - room, high[0] + room), ylim=(low[vertical] - room, high[vertical] + room))
    elevation.axhline(ground, color=INK, linewidth=1.6, label=f"ground, z = {ground:g} m")
    for number, plane in enumerate(case.plane):
        _mark_plane((plan, elevation), plane, LINES[1 + number % 3])
    elevation.set_xlabel("x (m)")
    elevation.legend(loc="upper center", bbox_to_anchor=(0.5, -0.3 * 3.0 / height), ncols=2)
    return figure


def outlines(case: CaseTable, vertical: int) -> Iterator[tuple[str, NDArray[np.float64], bool]]:
    """Name, outline (n, 2) in m and whether it is an image, of every round seen along an axis.

    `vertical` is the axis that points upwards there: 1 from above, 2 along +y.
    """
    for name, surface, image in _bodies(case):
        yield name, _hull(surface[:, [0, vertical]]), image


def _bodies(case: CaseTable) -> Iterator[tuple[str, NDArray[np.float64], bool]]:
    """Name, points of the surface (n, 3) in m and whether it is an image, of every round with a contour."""
    from fragfield.case.conversion.rounds import burst_rounds

    surfaces = [
        (item.name, _surface(item.profile, np.array(item.position), np.array(item.axis)), False)
        for item in burst_rounds(case)
        if item.profile is not None
    ]
    for plane in case.plane:
        if plane.kind == "symmetry":
            normal, point = np.array(plane.normal, dtype=float), np.array(plane.point, dtype=float)
            normal /= np.linalg.norm(normal)
            surfaces += [
                (name, surface - 2.0 * ((surface - point) @ normal)[:, None] * normal, True)
                for name, surface, _ in surfaces
            ]
    yield from surfaces


def _surface(profile: Profile, base: NDArray[np.float64], axis: NDArray[np.float64]) -> NDArray[np.float64]:
    axis = axis / np.linalg.norm(axis)
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    station = np.linspace(0.0, profile.length, _STATIONS)
    turn = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    radius = profile.section(station).outer_radius[:, None, None]
    circle = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    points = base + (profile.length - station)[:, None, None] * axis + radius * circle
    return np.asarray(points.reshape(-1, 3))


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The convex outline of points (n, 2), in order."""
    from scipy.spatial import ConvexHull

    return np.asarray(points[ConvexHull(points).vertices])


def _mark_plane(axes: tuple[Axes, Axes], plane: PlaneTable, style: dict[str, Any]) -> None:
    """A plane that is level or upright, as a line where it is seen on edge."""
    assert plane.normal is not None  # resolved
    assert plane.point is not None
    normal, point = np.array(plane.normal, dtype=float), np.array(plane.point, dtype=float)
    along = int(np.argmax(np.abs(normal)))
    if abs(normal[along]) < (1.0 - 1e-9) * np.linalg.norm(normal):
        return
    label = f"{plane.kind} plane {plain_name(plane.name)}"
    for panel, vertical in zip(axes, (1, 2), strict=True):
        line = panel.axvline if along == 0 else panel.axhline if along == vertical else None
        if line is not None:
            line(point[along], color=GREY if along == 2 else style["color"], linestyle="-.", linewidth=1.0, label=label)
