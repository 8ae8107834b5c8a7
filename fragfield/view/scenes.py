"""The burst's grids over time, and the fragments, as VTK data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield_base.xdmf import check_xdmf

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pyvista
    from numpy.typing import NDArray

    from burst_fenicsx.files.revolve import Revolution
    from fragfield.report.reading.run_files import RunFiles
    from transition.placement.mirroring import Image


STREAK = 1e-4
"""Time (s) that fragments have flown on, without drag, where they are shown."""
CASING = 0
"""Part of a cell, as the snapshot numbers them."""
MOST_CELLS = 200_000
"""Of a picture: the 3-D page thins them further."""
_SECTION = "section"
_MIRRORED = {8: [3, 2, 1, 0, 7, 6, 5, 4], 6: [0, 2, 1, 3, 5, 4], 4: [3, 2, 1, 0]}
"""Corners of a mirrored hexahedron, wedge and quadrilateral in the order in which it is not inside out."""


def final_burst(run: RunFiles) -> pyvista.UnstructuredGrid:
    """The mesh at the end of the burst with the nodes' speed, from the snapshot, with its images.

    The meridian of an axisymmetric burst is shown revolved around its axis.
    """
    if not run.nodes:
        raise InputError(f"{run.folder}: burst_snapshot.h5 is missing; run `fragfield burst` first")
    speed = np.linalg.norm(run.nodes["velocity"], axis=1)
    return _whole(run, run.nodes["position"], run.cells["nodes"], speed, run.cells["part"])


def burst_times(run: RunFiles) -> tuple[float, ...]:
    """Times of the outputs in burst.xdmf (s); empty without the file."""
    path = run.folder / "burst.xdmf"
    if not path.is_file() or not (run.folder / "burst").is_dir():
        return ()
    check_xdmf(path, InputError, "run `fragfield burst` again")  # VTK would crash on damaged files
    return tuple(_reader(run).time_values)


def burst_at(run: RunFiles, time: float) -> pyvista.UnstructuredGrid:
    """As `final_burst` at one of the times of burst.xdmf."""
    reader = _reader(run)
    reader.set_active_time_value(time)
    grid = reader.read()
    if "velocity" not in grid.point_data or "part" not in grid.cell_data:
        raise InputError(f"{run.folder / 'burst.xdmf'}: velocity or part is missing at {time:g} s")
    speed = np.linalg.norm(grid.point_data["velocity"], axis=1)
    cells, corners = grid.cell_connectivity, run.cells["nodes"].shape[1]
    if len(cells) % corners or cells.min() < 0 or cells.max() >= grid.n_points:
        raise InputError(
            f"{run.folder / 'burst' / '0000.h5'}: cells refer to nodes that do not exist; run `fragfield burst` again"
        )
    cells, points = cells.reshape(-1, corners), np.asarray(grid.points)
    if run.is_axisymmetric:
        from burst_fenicsx.meshing.placement import FACING, place

        attributes = run.rounds[0].attributes
        points = place(points @ FACING.T, attributes["position"], attributes["axis"])
    return _whole(run, points, cells, speed, grid.cell_data["part"])


def burst_states(run: RunFiles, number: int) -> list[tuple[float, pyvista.UnstructuredGrid]]:
    """Times (s) and meshes of at most `number` states, even in time, the last of them the end of the burst."""
    end = (run.burst_time or 0.0, final_burst(run))
    times = [time for time in burst_times(run) if time < end[0] * (1 - 1e-9)]
    # Without the start, which shows no speed, when there is anything later.
    later = [time for time in times if time > 0] or times
    wanted = np.linspace(0.0, end[0], number + 1)[1:-1]
    chosen = sorted({later[int(np.abs(np.subtract(later, want)).argmin())] for want in wanted}) if later else []
    return [*((time, burst_at(run, time)) for time in chosen), end]


def _reader(run: RunFiles) -> Any:  # noqa: ANN401 - pyvista's readers share no typed interface for times
    import pyvista

    return pyvista.get_reader(str(run.folder / "burst.xdmf"))


def _whole(
    run: RunFiles,
    points: NDArray[np.float64],
    cells: NDArray[Any],
    speed: NDArray[np.float64],
    part: NDArray[Any],
) -> pyvista.UnstructuredGrid:
    """The cells that were computed, or their revolution, and the images of both, with speed and part."""
    import pyvista

    from transition.placement.mirroring import images

    mirrors = images(run.planes, str(run.folder))
    part = np.asarray(part).astype(np.int32)
    kinds = {pyvista.CellType.HEXAHEDRON: (cells, part)}
    if run.is_axisymmetric:
        shown = _revolved(run, points, speed, part)
        points, speed = shown.points, shown.speed
        kinds = {
            pyvista.CellType.HEXAHEDRON: (shown.hexahedra, shown.part_of_hexahedra),
            pyvista.CellType.WEDGE: (shown.wedges, shown.part_of_wedges),
        }
    places = [points, *(image.place(points) for image in mirrors)]
    corners, parts = {}, []
    for kind, (own, of_kind) in kinds.items():
        if not len(own):
            continue
        inside_out = own[:, _MIRRORED[own.shape[1]]]
        copies = [own]
        for number, image in enumerate(mirrors, start=1):
            turned = inside_out if np.linalg.det(image.matrix) < 0.0 else own
            copies.append(turned + number * len(points))
        corners[kind] = np.vstack(copies)
        parts.append(np.tile(of_kind, 1 + len(mirrors)))
    grid = pyvista.UnstructuredGrid(corners, np.vstack(places))
    grid.point_data["speed"] = np.tile(speed, 1 + len(mirrors))
    grid.cell_data["part"] = np.concatenate(parts)
    grid.field_data[_SECTION] = [_section_plane(run, mirrors)]
    return grid


def _section_plane(run: RunFiles, mirrors: Sequence[Image]) -> float:
    """The y (m) at which the rounds are cut at all times: through the round next to the centre, or before it."""
    centres: list[NDArray[np.float64]] = []
    for item in run.rounds:
        position, axis = (np.asarray(item.attributes[key], dtype=np.float64) for key in ("position", "axis"))
        centre = np.add(position, 0.5 * float(item.attributes["length"]) * axis / np.linalg.norm(axis))
        centres += [centre, *(image.place(centre) for image in mirrors)]
    places = [float(centre[1]) for centre in centres]
    middle = 0.5 * (min(places, default=0.0) + max(places, default=0.0))
    # Of two rounds equally near the front one is cut, and the one behind it stays whole.
    return min(places, key=lambda y: (round(abs(y - middle), 6), y), default=middle)


def middle_plane(grid: pyvista.UnstructuredGrid) -> float:
    """The y of the section (m)."""
    return float(grid.field_data[_SECTION][0])


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

    Raises InputError: the break-up has not been run.
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


@dataclass(frozen=True, eq=False)
class _Revolved:
    """Cells around the axis with the nodes' speed."""

    points: NDArray[np.float64]
    speed: NDArray[np.float64]
    """(n, 3), (n,): nodes (m) and their speed (m/s)."""
    hexahedra: NDArray[np.int64]
    wedges: NDArray[np.int64]
    """(k, 8), (w, 6): cells in VTK's order; those at the axis are wedges."""
    part_of_hexahedra: NDArray[np.int32]
    part_of_wedges: NDArray[np.int32]
    """(k,), (w,): their parts."""


def _revolved(
    run: RunFiles, points: NDArray[np.float64], speed: NDArray[np.float64], part: NDArray[np.int32]
) -> _Revolved:
    """Revolve a state of the meridian: nodes (n, 3) in m, their speed (n,) in m/s, parts of the cells (m,)."""
    sweep = _revolution(run)
    parts, wedges = sweep.cell_field(part).astype(np.int32), sweep.wedges
    return _Revolved(
        sweep.positions(points), np.asarray(speed)[sweep.node], sweep.cells[~wedges], sweep.wedge_nodes(),
        parts[~wedges], parts[wedges],
    )  # fmt: skip


def _revolution(run: RunFiles) -> Revolution:
    """The sweep of the run's meridian; made once a run."""
    if run.revolution is None:
        from burst_fenicsx.files.revolve import revolution

        attributes = run.rounds[0].attributes
        run.revolution = revolution(
            run.nodes["reference"], run.cells["nodes"], attributes["position"], attributes["axis"], MOST_CELLS
        )
    return run.revolution
