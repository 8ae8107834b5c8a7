"""What there is to look at: the burst's grids over time, and the fragments, as VTK data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError

if TYPE_CHECKING:
    import pyvista
    from numpy.typing import NDArray

    from fragfield.report.run_files import RunFiles

__all__ = ["burst_at", "burst_times", "cut", "final_burst", "fragment_points", "middle_plane", "section"]

CASING = 0
"""Part of a cell, as the snapshot numbers them."""


def final_burst(run: RunFiles) -> pyvista.UnstructuredGrid:
    """The mesh at the end of the burst with the nodes' speed, from the snapshot."""
    import pyvista

    if not run.nodes:
        raise InputError(f"{run.folder}: burst_snapshot.h5 is missing; run `fragfield burst` first")
    cells = run.cells["nodes"]
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: cells}, run.nodes["position"])
    grid.point_data["speed"] = np.linalg.norm(run.nodes["velocity"], axis=1)
    grid.cell_data["part"] = run.cells["part"].astype(np.int32)
    return grid


def burst_times(run: RunFiles) -> tuple[float, ...]:
    """Times of the outputs in burst.xdmf (s); empty without the file."""
    path = run.folder / "burst.xdmf"
    if not path.is_file() or not (run.folder / "burst.h5").is_file():
        return ()
    return tuple(_reader(run).time_values)


def burst_at(run: RunFiles, time: float) -> pyvista.UnstructuredGrid:
    """The mesh at one of the times of burst.xdmf with the nodes' speed."""
    reader = _reader(run)
    reader.set_active_time_value(time)
    grid = reader.read()
    if "velocity" not in grid.point_data or "part" not in grid.cell_data:
        raise InputError(f"{run.folder / 'burst.xdmf'}: velocity or part is missing at {time:g} s")
    grid.point_data["speed"] = np.linalg.norm(grid.point_data["velocity"], axis=1)
    return grid


def _reader(run: RunFiles) -> Any:  # noqa: ANN401 - pyvista's readers share no typed interface for times
    import pyvista

    return pyvista.get_reader(str(run.folder / "burst.xdmf"))


def middle_plane(grid: pyvista.UnstructuredGrid) -> float:
    """The y of the section: the middle of the grid (m)."""
    return 0.5 * float(grid.bounds[2] + grid.bounds[3])


def section(grid: pyvista.UnstructuredGrid) -> pyvista.UnstructuredGrid:
    """The half behind the section, of whole cells."""
    centres = grid.cell_centers().points
    return grid.extract_cells(np.flatnonzero(centres[:, 1] >= middle_plane(grid)))


def cut(grid: pyvista.UnstructuredGrid) -> tuple[pyvista.PolyData, pyvista.PolyData]:
    """The plane of the section through the cells, and the outline of the casing in it."""
    # A hair behind the middle, where planes of the mesh coincide with it.
    depth = float(grid.bounds[3] - grid.bounds[2])
    origin = (0.0, middle_plane(grid) + 1e-4 * depth, 0.0)
    casing = grid.extract_cells(np.flatnonzero(grid.cell_data["part"] == CASING))
    outline = casing.slice(normal="y", origin=origin)
    if outline.n_cells:
        outline = outline.extract_feature_edges(
            boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
        )
    return grid.slice(normal="y", origin=origin), outline


def fragment_points(run: RunFiles, streak: float = 0.0) -> tuple[pyvista.PolyData, NDArray[np.float64]]:
    """Fragments as points with speed and size, and the places that they leave within `streak` seconds.

    Raises
    ------
    InputError
        The break-up has not been run.
    """
    import pyvista

    if not run.fragments:
        raise InputError(f"{run.folder}: fragments.h5 is missing; run `fragfield break-up` first")
    velocity = run.fragments["velocity"]
    points = pyvista.PolyData(run.fragments["position"] + streak * velocity)
    points.point_data["speed"] = np.linalg.norm(velocity, axis=1)
    # Diameter of the sphere of that mass in steel; only a symbol, the shape of a fragment is not known.
    points.point_data["size"] = np.cbrt(6.0 * run.fragments["mass"] / (np.pi * 7850.0))
    return points, run.fragments["position"]
