"""Pictures of a run by pyvista without a window; ParaView opens burst.xdmf and trajectories.xdmf for all else."""

from __future__ import annotations

import ctypes
import io
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import EXIT_INPUT, InputError
from fragfield.report.figures.drawing import SPEED_MAP, round_length
from fragfield.results.run import StoredRun
from fragfield_base.writing import write_bytes
from fragfield_base.xdmf import check_xdmf

if TYPE_CHECKING:
    import pyvista
    from numpy.typing import NDArray

    from flight import Fragments
    from fragfield.interface.burst import Burst


STREAK = 1e-4
"""Time (s) that fragments have flown on, without drag, where they are shown."""
_LIBRARIES = {
    "libEGL.so.1": "EGL",
    "libOSMesa.so.8": "OSOpenGL",
    "libOSMesa.so.6": "OSOpenGL",
    "libOSMesa.so": "OSOpenGL",
}
_CASING = 0  # part of a cell, as the snapshot numbers them
_BAR: dict[str, Any] = {"n_labels": 3, "fmt": "%.0f", "title_font_size": 22, "label_font_size": 22, "color": "black",
                        "width": 0.5, "height": 0.06, "position_x": 0.25, "position_y": 0.02}  # fmt: skip


def view_run(run_directory: Path | str, folder: Path | str | None = None) -> list[Path]:
    """Write picture_of_burst.png and picture_of_fragments.png, as far as the run has data for them.

    `folder`: for the pictures; left out: `figures` in the run's.

    Raises InputError: neither burst nor break-up has been run, a file is damaged, or VTK cannot draw here.
    """
    run = StoredRun(run_directory)
    run.require()
    if run.snapshot is None and run.launched is None:
        raise InputError(f"{run.path}: nothing to show; run `fragfield burst` or `fragfield break-up` first")
    if fault := picture_fault():
        raise InputError(fault)
    target = run.path / "figures" if folder is None else Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    written = []
    for name, found, draw in (("burst", run.snapshot, lambda: _burst(run)),
                              ("fragments", run.launched, lambda: _fragments(run.fragments))):  # fmt: skip
        if found is not None:
            buffer, plotter = io.BytesIO(), draw()
            plotter.screenshot(buffer)
            plotter.close()
            written.append(write_bytes(target / f"picture_of_{name}.png", buffer.getvalue(), InputError))
    return written


def draw_beside(run_directory: str, folder: str) -> int:
    """As `view_run`, in a process of its own; its exit code, with the words of a refusal on standard error."""
    try:
        view_run(run_directory, folder)
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        return EXIT_INPUT
    return 0


def picture_fault() -> str:
    """Why VTK cannot draw here, with the cure; empty where it can. Points VTK to a library that needs no display."""
    for library, window in _LIBRARIES.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = f"vtk{window}RenderWindow"
        return ""
    return (
        "VTK needs libEGL or libOSMesa to draw without a window, neither of which is installed; install libegl1 "
        "(Debian: apt-get install libegl1), then run `fragfield report` or `fragfield view` again"
    )


def burst_sections(run: StoredRun) -> list[tuple[float, pyvista.PolyData, pyvista.PolyData]]:
    """Time (s), section coloured by `speed` (m/s) and outline of the casings, halfway and at the end of the burst.

    Images behind planes of symmetry are cut with the rounds; of an axisymmetric burst both sides of the meridian are
    shown. Raises InputError: burst.xdmf is damaged.
    """
    import pyvista

    from burst_fenicsx.meshing.placement import FACING, to_local

    burst = run.snapshot
    assert burst is not None
    end, points = burst.time, burst.nodes["position"]
    if burst.is_axisymmetric:
        points = to_local(points, burst.rounds[0].position.tolist(), burst.rounds[0].axis.tolist())
    kind = pyvista.CellType.QUAD if burst.is_axisymmetric else pyvista.CellType.HEXAHEDRON
    last = pyvista.UnstructuredGrid({kind: burst.cells["nodes"]}, points)
    last.cell_data["part"] = np.asarray(burst.cells["part"], dtype=np.int32)
    last.point_data["velocity"] = burst.nodes["velocity"]
    states = [(end, last)]
    if (path := run.path / "burst.xdmf").is_file() and (run.path / "burst").is_dir():
        check_xdmf(path, InputError, "run `fragfield burst` again")  # VTK would crash on damaged files
        reader: Any = pyvista.get_reader(str(path))
        if earlier := [time for time in reader.time_values if 0.0 < time < 0.999 * end]:
            half = min(earlier, key=lambda time: abs(time - 0.5 * end))
            reader.set_active_time_value(half)
            grid = _checked(reader.read(), path)
            if burst.is_axisymmetric:
                grid.points = np.asarray(grid.points) @ FACING.T
            states.insert(0, (half, grid))
    return [(time, *_cut(grid, burst, str(run.path))) for time, grid in states]


def _checked(grid: pyvista.UnstructuredGrid, where: Path) -> pyvista.UnstructuredGrid:
    if "velocity" not in grid.point_data or "part" not in grid.cell_data:
        raise InputError(f"{where}: velocity or part is missing; run `fragfield burst` again")
    if grid.cell_connectivity.min() < 0 or grid.cell_connectivity.max() >= grid.n_points:
        raise InputError(f"{where}: cells refer to nodes that do not exist; run `fragfield burst` again")
    return grid


def _cut(grid: pyvista.UnstructuredGrid, burst: Burst, where: str) -> tuple[pyvista.PolyData, pyvista.PolyData]:
    import pyvista

    from transition.placement.mirroring import images

    grid.point_data["speed"] = np.linalg.norm(grid.point_data["velocity"], axis=1)
    copies = [(np.diag([-1.0, 1.0, 1.0]), np.zeros(3))] if burst.is_axisymmetric else []
    copies += [(image.matrix, image.shift) for image in images(burst.planes, where)]
    parts = [grid]
    for matrix, shift in copies:
        parts.append(grid.copy())
        parts[-1].points = np.asarray(grid.points) @ matrix.T + shift
    whole = pyvista.merge(parts, merge_points=False)
    casing = whole.extract_cells(np.flatnonzero(whole.cell_data["part"] == _CASING))
    if burst.is_axisymmetric:
        section, casing_section = whole.extract_surface(algorithm=None), casing.extract_surface(algorithm=None)
    else:  # a hair behind the axis, where planes of the mesh coincide with it
        height = _axis_of_section(burst, where) + 1e-4 * float(whole.bounds[3] - whole.bounds[2])
        section, casing_section = (one.slice(normal="y", origin=(0.0, height, 0.0)) for one in (whole, casing))
    if not casing_section.n_cells:
        return section, casing_section
    return section, casing_section.extract_feature_edges(
        boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
    )


def _axis_of_section(burst: Burst, where: str) -> float:
    """The y (m) of the axis that is cut: of the round next to the centre, or before it; the same at all times."""
    from transition.placement.mirroring import images

    centres = []
    for item in burst.rounds:
        centre = item.position + 0.5 * item.length * item.axis / np.linalg.norm(item.axis)
        centres += [centre, *(image.place(centre) for image in images(burst.planes, where))]
    places = [float(centre[1]) for centre in centres]
    middle = 0.5 * (min(places) + max(places))
    # Of two rounds equally near the front one is cut.
    return min(places, key=lambda y: (round(abs(y - middle), 6), y))


def _burst(run: StoredRun) -> pyvista.Plotter:
    sections = burst_sections(run)
    fastest = max(float(section.point_data["speed"].max()) for _, section, _ in sections) or 1.0
    plotter = _plotter((1, len(sections)), (600, 640))
    bounds = np.array([section.bounds for _, section, _ in sections])
    low, high = bounds[:, ::2].min(axis=0), bounds[:, 1::2].max(axis=0)
    for place, (time, section, outline) in enumerate(sections):
        plotter.subplot(0, place)
        plotter.add_text(f"{1e6 * time:.0f} µs", font_size=14, color="black")
        plotter.add_mesh(section, scalars="speed", cmap=SPEED_MAP, clim=(0.0, fastest), ambient=1.0, diffuse=0.0,
                         scalar_bar_args={**_BAR, "title": "Speed (m/s)" + " " * place})  # fmt: skip
        if outline.n_cells:
            plotter.add_mesh(outline, color="black", line_width=2)
        plotter.view_xz()
        plotter.enable_parallel_projection()
        plotter.reset_camera(bounds=tuple(np.ravel([low, high], order="F")))
        plotter.camera.zoom(0.9)
        _length_bar(plotter, low, high)
    return plotter


def _length_bar(plotter: pyvista.Plotter, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
    import pyvista

    length = round_length(0.5 * float(high[0] - low[0]))
    middle, top = 0.5 * float(low[0] + high[0]), float(high[2]) + 0.06 * float(high[2] - low[2])
    ends = [(middle + side * length / 2.0, float(low[1]), top) for side in (-1.0, 1.0)]
    plotter.add_mesh(pyvista.Line(*ends), color="black", line_width=4)
    plotter.add_point_labels([ends[1]], [f" {1e3 * length:g} mm"], shape=None, show_points=False, font_size=22,
                             text_color="black", always_visible=True)  # fmt: skip


def _fragments(fragments: Fragments) -> pyvista.Plotter:
    import pyvista

    points = pyvista.PolyData(fragments.position + STREAK * fragments.velocity)
    points.point_data["speed"] = fragments.speed
    points.point_data["size"] = np.cbrt(fragments.mass)
    # A mean fragment is drawn as a hundredth of the cloud, whatever its size: true sizes may vanish.
    enlarged = 0.009 * float(points.length) / max(float(points.point_data["size"].mean()), 1e-9)
    sphere = pyvista.Sphere(theta_resolution=8, phi_resolution=8)
    plotter = _plotter((1, 1), (800, 640))
    plotter.add_mesh(points.glyph(scale="size", factor=enlarged, orient=False, geom=sphere), scalars="speed",
                     cmap=SPEED_MAP, ambient=0.45, diffuse=0.65, specular=0.0,
                     scalar_bar_args={**_BAR, "title": "Initial speed (m/s)"})  # fmt: skip
    wide, deep, high = np.ptp(points.points, axis=0)
    plotter.add_text(f"Cloud {wide:.2f} x {deep:.2f} x {high:.2f} m", font_size=12, color="black")
    plotter.view_vector((-1.0, -1.6, 0.7), viewup=(0, 0, 1))
    plotter.enable_parallel_projection()
    plotter.reset_camera(bounds=points.bounds)
    plotter.camera.zoom(1.25)
    return plotter


def _plotter(shape: tuple[int, int], size: tuple[int, int]) -> pyvista.Plotter:
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, shape=shape, window_size=(size[0] * shape[1], size[1]), border=False)
    plotter.set_background("white")
    return plotter
