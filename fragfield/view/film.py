"""Films drawn off-screen: the burst over time in its section, and the flight of the fragments to the ground."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.report.figures.drawing import GREY, INK, RULE, SPEED_MAP
from fragfield.view.offscreen import PictureUnavailableError, require_offscreen
from fragfield.view.scenes import burst_at, burst_times, final_burst, section
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import pyvista
    from numpy.typing import NDArray

    from fragfield.report.reading.run_files import RunFiles

__all__ = ["FILM_OF_BURST", "FILM_OF_FLIGHT", "Paths", "film_fault", "film_of_burst", "film_of_flight", "read_paths"]

FILM_OF_BURST, FILM_OF_FLIGHT = "film_of_burst.mp4", "film_of_flight.mp4"
_SIZE = (1280, 960)  # pixels; H.264 needs multiples of 16
_SECONDS = 8.0  # that a film lasts, when there are frames enough
_MOST_FRAMES, _FEWEST_A_SECOND = 96, 4.0


def film_fault() -> str | None:
    """Why no film can be written here, with the cure; None when it can."""
    from importlib.util import find_spec

    missing = [name for name, module in (("imageio", "imageio"), ("av", "av")) if find_spec(module) is None]
    if missing:
        return f"films need the packages {' and '.join(missing)}; install them: pip install {' '.join(missing)}"
    return None


def film_of_burst(run: RunFiles, path: Path | None = None) -> Path:
    """Write the film of the section of the rounds, coloured by speed.

    Parameters
    ----------
    run : RunFiles
        The run.
    path : Path, optional
        The MP4 file; otherwise `figures/film_of_burst.mp4` in the run directory.

    Raises
    ------
    InputError
        The burst has not been run, or its series over time is missing.
    PictureUnavailableError
        VTK cannot draw here, or the packages that write films are missing.
    """
    end = final_burst(run)
    times = burst_times(run)
    if len(times) < 2:
        raise InputError(f"{run.folder}: burst.xdmf with several times is missing; run `fragfield burst` again")
    fastest = float(end.point_data["speed"].max()) or 1.0
    return _written(_burst_frames(run, _spread(times), end, fastest), len(_spread(times)), run, path, FILM_OF_BURST)


def _spread(times: tuple[float, ...]) -> list[float]:
    """At most `_MOST_FRAMES` of the times, evenly among them, the first and the last kept."""
    places = np.linspace(0, len(times) - 1, min(len(times), _MOST_FRAMES)).round().astype(int)
    return [times[place] for place in np.unique(places)]


def _burst_frames(
    run: RunFiles, times: list[float], end: pyvista.UnstructuredGrid, fastest: float
) -> Iterator[NDArray[np.uint8]]:
    bounds = np.asarray(end.bounds, dtype=float)
    centre = 0.5 * (bounds[::2] + bounds[1::2])
    reach = max(float(bounds[5] - bounds[4]), float(bounds[1] - bounds[0]) * _SIZE[1] / _SIZE[0])
    plotter = _plotter()
    try:
        plotter.camera_position = [centre - np.array([0.0, 10.0 * reach, 0.0]), centre, (0, 0, 1)]
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = 0.64 * reach
        for time in times:
            grid = burst_at(run, time)
            _add_coloured(plotter, section(grid), fastest, "Speed (m/s)")
            plotter.add_text(f"{time * 1e6:.1f} µs", name="time", **_TEXT)
            yield plotter.screenshot(None, return_img=True)
    finally:
        plotter.close()


@dataclass(frozen=True)
class Paths:
    """Flown paths: time (s), place (m) and speed (m/s) at all points, path i at `start[i]:start[i + 1]`."""

    start: NDArray[np.int64]
    time: NDArray[np.float64]
    position: NDArray[np.float64]
    speed: NDArray[np.float64]

    def at(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Places (paths, times, 3) and speeds (paths, times), linear between points; before and after, those of the ends."""  # fmt: skip  # noqa: E501
        place = np.empty((len(self.start) - 1, len(times), 3))
        speed = np.empty(place.shape[:2])
        for i, (first, last) in enumerate(zip(self.start[:-1], self.start[1:], strict=True)):
            for axis in range(3):
                place[i, :, axis] = np.interp(times, self.time[first:last], self.position[first:last, axis])
            speed[i] = np.interp(times, self.time[first:last], self.speed[first:last])
        return place, speed


def read_paths(run: RunFiles) -> Paths:
    """The sample of flown paths, from trajectories.xdmf.

    Raises
    ------
    InputError
        The flight has not been run, or kept no paths.
    """
    import pyvista

    file = run.folder / "trajectories.xdmf"
    if not file.is_file() or not file.with_suffix(".h5").is_file():
        raise InputError(f"{file} is missing; set flight.trajectories to 1 or more and run `fragfield fly`")
    grid = pyvista.get_reader(str(file)).read()
    return Paths(
        np.asarray(grid.cell_offsets, dtype=np.int64),
        np.asarray(grid.point_data["time"], dtype=float)[grid.cell_connectivity],
        np.asarray(grid.points, dtype=float)[grid.cell_connectivity],
        np.asarray(grid.point_data["speed"], dtype=float)[grid.cell_connectivity],
    )


def film_of_flight(run: RunFiles, path: Path | None = None) -> Path:
    """Write the film of a sample of fragments that fly to the ground; parameters and errors as `film_of_burst`.

    Time runs slowly at first, since fragments lose most of their speed in the first tenths of a second.
    """
    paths = read_paths(run)
    times = float(paths.time.max()) * np.linspace(0.0, 1.0, _MOST_FRAMES) ** 2
    return _written(_flight_frames(paths, times), len(times), run, path, FILM_OF_FLIGHT)


def _flight_frames(paths: Paths, times: NDArray[np.float64]) -> Iterator[NDArray[np.uint8]]:
    import pyvista

    place, speed = paths.at(times)
    fastest = float(speed.max()) or 1.0
    reach = float(np.hypot(paths.position[:, 0], paths.position[:, 1]).max()) or 1.0
    height = max(float(paths.position[:, 2].max()), 1e-3 * reach)
    rings, spacing = _rings(reach)
    plotter = _plotter()
    try:
        plotter.add_mesh(rings, color=RULE, line_width=2)
        plotter.add_text(f"Rings every {spacing:g} m", position="upper_right", font_size=11, color=INK)
        plotter.view_vector((-0.5, -1.0, 0.6), viewup=(0, 0, 1))
        plotter.enable_parallel_projection()
        plotter.reset_camera(bounds=(-reach, reach, -reach, reach, 0.0, height))
        plotter.camera.zoom(1.3)
        for frame in range(len(times)):
            now = pyvista.PolyData(place[:, frame])
            now.point_data["speed"] = speed[:, frame]
            if frame:
                plotter.add_mesh(_trails(place[:, : frame + 1]), name="trails", color=GREY, line_width=1, **_LATER)
            _add_coloured(plotter, now, fastest, "Speed (m/s)", render_points_as_spheres=True, point_size=8)
            plotter.add_text(f"{times[frame]:.3f} s", name="time", **_TEXT)
            yield plotter.screenshot(None, return_img=True)
    finally:
        plotter.close()


def _trails(place: NDArray[np.float64]) -> pyvista.PolyData:
    """One line a path through the places (paths, frames, 3)."""
    import pyvista

    number, frames = place.shape[:2]
    lines = np.column_stack([np.full(number, frames), np.arange(number * frames).reshape(number, frames)])
    return pyvista.PolyData(place.reshape(-1, 3), lines=lines.ravel())


def _rings(reach: float) -> tuple[pyvista.PolyData, float]:
    """Rings on the ground about the origin at round distances (m), and their spacing."""
    import pyvista
    from matplotlib.ticker import MaxNLocator

    ticks = MaxNLocator(nbins=5, steps=[1, 2, 5, 10]).tick_values(0.0, reach)
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    radii = [tick for tick in ticks if 0.0 < tick <= 1.05 * reach]
    return pyvista.merge([pyvista.lines_from_points(radius * circle) for radius in radii]), float(ticks[1] - ticks[0])


_LATER = {"render": False, "reset_camera": False}  # a frame is drawn once, when all of it is there
_TEXT: dict[str, Any] = {"position": (24, 905), "font_size": 14, "color": INK, "render": False}


def _plotter() -> pyvista.Plotter:
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=_SIZE)
    plotter.set_background("white")
    return plotter


def _add_coloured(plotter: pyvista.Plotter, mesh: pyvista.DataSet, fastest: float, quantity: str, **look: Any) -> None:
    """Show the mesh instead of that of the frame before."""
    bar = {"title": quantity, "color": INK, "n_labels": 4, "fmt": "%.0f", "position_x": 0.25, "width": 0.5}
    plotter.add_mesh(
        mesh, name="coloured", scalars="speed", cmap=SPEED_MAP, clim=(0.0, fastest), scalar_bar_args=bar, ambient=0.45,
        diffuse=0.65, specular=0.0, **_LATER, **look,
    )  # fmt: skip


def _written(frames: Iterator[NDArray[np.uint8]], number: int, run: RunFiles, path: Path | None, name: str) -> Path:
    """Code the frames as H.264 in an MP4 file, which browsers, players and slides show."""
    if fault := film_fault():
        raise PictureUnavailableError(fault)
    require_offscreen()
    import imageio.v3 as iio

    target = path or run.folder / "figures" / name
    target.parent.mkdir(parents=True, exist_ok=True)
    rate = max(round(number / _SECONDS), round(_FEWEST_A_SECOND))
    coded = BytesIO()  # some megabytes
    with iio.imopen(coded, "w", plugin="pyav", extension=".mp4") as film:
        film.init_video_stream("libx264", fps=rate)
        for frame in frames:
            film.write_frame(np.ascontiguousarray(frame))
    return write_bytes(target, coded.getvalue(), InputError)
