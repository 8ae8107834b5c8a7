"""Pictures drawn off-screen: the section of the burst over time, and the cloud of fragments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.report.figures.drawing import COLUMN, SPEED_MAP, WIDE, blank_figure, drawing_style, to_bytes
from fragfield.view.scenes import STREAK, burst_states, cut, fragment_points, section
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from pathlib import Path

    import pyvista
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fragfield.report.reading.run_files import RunFiles


_PIXELS_HIGH = 900
_LIGHT: dict[str, Any] = {"ambient": 0.45, "diffuse": 0.65, "specular": 0.0}


def write_pictures(run: RunFiles, folder: Path, *, wide: bool) -> None:
    """Write every picture that the run has data for: wide ones, the burst at four times, or of a column, at two."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {}
    if run.nodes:
        drawn["picture_of_burst"] = burst_figure(run, 4 if wide else 2)
    if run.fragments:
        drawn["picture_of_fragments"] = fragments_figure(run, WIDE if wide else COLUMN)
    with drawing_style():
        for name, figure in drawn.items():
            write_bytes(folder / f"{name}.png", to_bytes(figure, "png"), InputError)


@dataclass(frozen=True)
class _Frame:
    """A section at one time, with its extent in x and z (m)."""

    time: float
    pixels: NDArray[np.uint8]
    extent: tuple[float, float, float, float]


def burst_figure(run: RunFiles, frames: int) -> Figure:
    """Figure of the section at `frames` times side by side, two in the width of a column."""
    grids = burst_states(run, frames)
    fastest = max(float(grid.point_data["speed"].max()) for _, grid in grids) or 1.0
    drawn = [_Frame(time, *_render_section(grid, fastest)) for time, grid in grids]
    return _panels(drawn, fastest, max(COLUMN, 0.5 * COLUMN * len(drawn)))


def _panels(drawn: list[_Frame], fastest: float, width: float) -> Figure:
    """The sections with one scale of length and one of speed."""
    widths = [frame.extent[1] - frame.extent[0] for frame in drawn]
    low, high = min(frame.extent[2] for frame in drawn), max(frame.extent[3] for frame in drawn)
    height = float(np.clip((width - 1.2) * (high - low) / sum(widths), 1.8, 5.5))
    with drawing_style():
        figure = blank_figure(width, height + 1.35)
        axes = figure.subplots(1, len(drawn), sharey=True, squeeze=False, gridspec_kw={"width_ratios": widths})[0]
        for axis, frame in zip(axes, drawn, strict=True):
            left, right, bottom, top = (edge * 1e3 for edge in frame.extent)
            axis.imshow(frame.pixels, extent=(left, right, bottom, top), interpolation="antialiased")
            axis.set(title=f"{frame.time * 1e6:.0f} µs", ylim=(low * 1e3, high * 1e3), xlabel="x (mm)")
            axis.grid(visible=False)
        axes[0].set_ylabel("z (mm)")
        figure.subplots_adjust(
            left=0.6 / width, right=1.0 - 0.1 / width, bottom=1.05 / (height + 1.35), top=1.0 - 0.25 / height
        )
        _speed_bar(figure, fastest)
    return figure


def _render_section(
    grid: pyvista.UnstructuredGrid, fastest: float
) -> tuple[NDArray[np.uint8], tuple[float, float, float, float]]:
    """Picture of the half behind the section, viewed along +y, and its extent in x and z (m)."""
    import pyvista

    bounds = np.asarray(grid.bounds, dtype=float)
    margin = 0.02 * max(bounds[1] - bounds[0], bounds[5] - bounds[4])
    extent = (bounds[0] - margin, bounds[1] + margin, bounds[4] - margin, bounds[5] + margin)
    size = np.array([extent[1] - extent[0], extent[3] - extent[2]])
    pixels = tuple(round(length) for length in size / size[1] * _PIXELS_HIGH)
    plotter = pyvista.Plotter(off_screen=True, window_size=pixels)
    plotter.set_background("white")
    colours = {"scalars": "speed", "cmap": SPEED_MAP, "clim": (0.0, fastest), "show_scalar_bar": False, **_LIGHT}
    plotter.add_mesh(section(grid), **colours)
    plane, outline = cut(grid)
    for mesh, look in ((plane, colours), (outline, {"color": "black", "line_width": 1.5})):
        if mesh.n_cells:
            # A little nearer to the eye, so that cells that reach through the plane do not hide it.
            plotter.add_mesh(mesh.translate((0.0, -float(size.max()) * (1.0 if mesh is plane else 1.1), 0.0)), **look)
    centre = (0.5 * (extent[0] + extent[1]), 0.5 * (bounds[2] + bounds[3]), 0.5 * (extent[2] + extent[3]))
    plotter.camera_position = [(centre[0], centre[1] - 10.0 * float(size.max()), centre[2]), centre, (0, 0, 1)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 0.5 * float(size[1])
    picture = plotter.screenshot(None, return_img=True)
    plotter.close()
    return picture, extent


def _speed_bar(figure: Figure, fastest: float) -> None:
    """The scale of speeds along the foot of the figure, above which its panels are placed."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    width, height = figure.get_size_inches()
    place = figure.add_axes((0.12, 0.42 / height, 0.76, 0.019 * width / height))
    bar = figure.colorbar(ScalarMappable(Normalize(0.0, fastest), SPEED_MAP), cax=place, orientation="horizontal")
    bar.set_label("Speed (m/s)")
    bar.outline.set_visible(False)  # type: ignore[operator]


def fragments_figure(run: RunFiles, width: float) -> Figure:
    """Figure of the fragments some time on without drag, sized by mass, coloured by speed; width in inches."""
    import pyvista

    points, _ = fragment_points(run, STREAK)
    fastest = float(points.point_data["speed"].max()) or 1.0
    # A mean fragment is drawn as a hundredth of the cloud, whatever its size: true sizes may vanish.
    enlarged = 0.009 * float(points.length) / max(float(points.point_data["size"].mean()), 1e-9)
    symbols = points.glyph(
        scale="size", factor=enlarged, orient=False, geom=pyvista.Sphere(theta_resolution=8, phi_resolution=8)
    )
    plotter = pyvista.Plotter(off_screen=True, window_size=(1500, 1100))
    plotter.set_background("white")
    plotter.add_mesh(symbols, scalars="speed", cmap=SPEED_MAP, clim=(0.0, fastest), show_scalar_bar=False, **_LIGHT)
    plotter.view_vector((-1.0, -1.6, 0.7), viewup=(0, 0, 1))
    plotter.enable_parallel_projection()
    plotter.reset_camera(bounds=points.bounds)
    plotter.camera.zoom(1.25)
    picture = _cropped(plotter.screenshot(None, return_img=True))
    plotter.close()
    extents = np.ptp(points.points, axis=0)
    text = f"Cloud {extents[0]:.2f} × {extents[1]:.2f} × {extents[2]:.2f} m; spheres {enlarged:.2g} times their size"
    return _cloud(picture, fastest, text, width, 0.45 * width + 1.5)


def _cloud(picture: NDArray[np.uint8], fastest: float, text: str, width: float, height: float) -> Figure:
    with drawing_style():
        figure = blank_figure(width, height)
        axis = figure.add_axes((0.02, 0.85 / height, 0.96, 1.0 - 1.1 / height))
        axis.imshow(picture, interpolation="antialiased")
        axis.set_axis_off()
        axis.set_title(text, loc="center", fontsize=8 if width > 5 else 7, fontweight="normal")
        _speed_bar(figure, fastest)
    return figure


def _cropped(picture: NDArray[np.uint8], margin: int = 12) -> NDArray[np.uint8]:
    """The picture without its white borders."""
    drawn = picture.min(axis=2) < 250
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    if not len(rows):
        return picture
    top, bottom, left, right = rows[0], rows[-1], columns[0], columns[-1]
    return picture[max(0, top - margin) : bottom + margin, max(0, left - margin) : right + margin]
