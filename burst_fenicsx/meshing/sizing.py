"""From the cell size to the counts of an O-grid: layers along the axis and cells across the section."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import log
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError
from burst_fenicsx.meshing.disc import CORE_RADIUS, CORE_SIDE_RADIUS
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Contour, Profile


FEWEST_WALL_CELLS = 3
FEWEST_CORE_CELLS = 4  # a circumference of 16
CLOSEST = 0.4  # of the spacing: a corner of a contour nearer to another boundary gets no layer of its own
LARGEST_ROUND = 50_000_000  # cells


@dataclass(frozen=True)
class GridCounts:
    """Cells along the core's side, rings around it, cells through the wall, and layer boundaries (m)."""

    core: int
    rings: int
    wall: int
    stations: NDArray[np.float64]


def layer_stations(profile: Profile, spacing: float) -> NDArray[np.float64]:
    """Return the stations of the layer boundaries (m), with steps of about `spacing`.

    The ends of the round and of the cavity and the charge's front are always boundaries, so that the parts are exact.
    Corners of the contours and ends of segments are boundaries unless they lie within 0.4 spacings of another.
    """
    cuts = [0.0, profile.length]
    for station in (profile.cavity.start, profile.cavity.end, profile.charge_front):
        if _distance(station, cuts) > 1e-9 * profile.length:  # equal but for round-off
            cuts.append(station)
    cuts.sort()
    for contour in (profile.outer, profile.cavity):
        for station in contour.stations[1:-1]:
            if _distance(station, cuts) >= CLOSEST * spacing or _is_sharp(contour, station, spacing):
                cuts = sorted({*cuts, station})
    for segment in profile.segments[1:]:
        if _distance(segment.start, cuts) >= CLOSEST * spacing:
            cuts = sorted([*cuts, segment.start])
    pieces = [np.linspace(low, high, max(1, round((high - low) / spacing)) + 1)[1:] for low, high in pairwise(cuts)]
    return np.concatenate([[0.0], *pieces])


def _distance(station: float, cuts: list[float]) -> float:
    return min(abs(station - cut) for cut in cuts)


def _is_sharp(contour: Contour, station: float, spacing: float) -> bool:
    """Whether a chord over a corner, one spacing long, would miss its radius by a tenth of the spacing."""
    ends = np.clip([station - 0.5 * spacing, station + 0.5 * spacing], contour.start, contour.end)
    chord = np.interp(station, ends, contour.radius(ends))
    return bool(abs(contour.radius(station) - chord) > 0.1 * spacing)


def check_cell_size(profile: Profile, cell_size: float) -> None:
    """Refuse a cell size (m) that is no positive length or is larger than the round."""
    if not cell_size > 0.0 or not np.isfinite(cell_size):
        raise InputError(f"cell_size = {cell_size!r} m; a positive length is expected")
    if cell_size > profile.max_radius:
        raise InputError(
            f"cell_size = {cell_size * 1e3:g} mm; at most the round's radius is allowed "
            f"({profile.name}: {profile.max_radius * 1e3:g} mm)"
        )


def check_mesh_size(profile: Profile, cell_size: float) -> float:
    """Number of cells that a size (m) asks for, volume over its cube; raises InputError as `grid_counts`."""
    volumes = profile.volumes()
    meshed = volumes.casing + volumes.charge + volumes.fuze
    check_cell_size(profile, cell_size)
    target = meshed / cell_size**3
    if target > LARGEST_ROUND:
        smallest = (meshed / LARGEST_ROUND) ** (1.0 / 3.0)
        raise InputError(
            f"cell_size = {cell_size * 1e3:g} mm makes {target:.3g} cells; at most {LARGEST_ROUND:.1g} are allowed "
            f"({profile.name}: at least {smallest * 1e3:.2g} mm)"
        )
    return target


def grid_counts(profile: Profile, cell_size: float) -> GridCounts:
    """Choose the counts so that the mean cell is `cell_size` cubed and cells are as even as the shape lets them.

    The wall gets its mean thickness over the cell size, but never fewer than three cells. The other counts and the
    axial spacing (within a quarter of the cell size) are those of the smallest misfit: of the number of cells to volume
    over cell size cubed, of core, ring and wall cells to each other, and of the spacing to the cell size. The core's
    side has an even number of cells, so that planes of symmetry are planes of the grid, whether they cut it or not.

    Raises
    ------
    InputError
        The cell size is not a positive length, is larger than the round, or asks for more than fifty million cells.
    """
    target = check_mesh_size(profile, cell_size)
    hollow = np.linspace(profile.charge_front, profile.cavity.end, 201)
    section = profile.section(hollow)
    inner = float(np.sqrt(np.mean(section.inner_radius**2)))
    outer = float(np.sqrt(np.mean(section.outer_radius**2)))
    wall = max(FEWEST_WALL_CELLS, round(float(np.mean(section.wall)) / cell_size))
    around = 2.0 * np.pi * inner / cell_size
    ring_depth = inner * (1.0 - 0.5 * (CORE_RADIUS + CORE_SIDE_RADIUS))

    best: tuple[float, GridCounts] | None = None
    for factor in np.linspace(0.8, 1.25, 46).tolist():
        stations = layer_stations(profile, factor * cell_size)
        layers = len(stations) - 1
        centres = 0.5 * (stations[1:] + stations[:-1])
        empty = 0
        if profile.volumes().void > 0.0:
            empty = int(np.count_nonzero((centres > profile.cavity.start) & (centres < profile.charge_front)))
        for core in range(FEWEST_CORE_CELLS, max(FEWEST_CORE_CELLS + 2, int(around / 2.0)), 2):
            core_cell = 0.5 * np.pi * 0.5 * (CORE_RADIUS + CORE_SIDE_RADIUS) * inner / core
            ring_width = 2.0 * np.pi * (inner - 0.5 * ring_depth) / (4 * core)
            outer_width = 2.0 * np.pi * outer / (4 * core)
            for rings in range(max(1, round(0.7 * ring_depth / ring_width)), 3 + round(1.4 * ring_depth / ring_width)):
                cavity_cells = core**2 + 4 * core * rings
                cells = (cavity_cells + 4 * core * wall) * layers - empty * cavity_cells
                misfit = (
                    20.0 * log(cells / target) ** 2
                    + 2.0 * log(factor) ** 2
                    + log(ring_depth / rings / ring_width) ** 2
                    + 0.5 * log(core_cell / cell_size) ** 2
                    + 0.5 * log(outer_width / cell_size) ** 2
                )
                if best is None or misfit < best[0]:
                    best = (misfit, GridCounts(core, rings, wall, stations))
    if best is None:
        raise InputError(f"cell_size = {cell_size * 1e3:g} mm: no grid was found for {profile.name}")
    return best[1]


def band_radii(profile: Profile, stations: NDArray[np.float64], even: float) -> NDArray[np.float64]:
    """Radius of the boundary between cavity and wall cells at every layer boundary (m).

    The cavity's contour where there is one. In a solid end it runs from the cavity's end to the fraction `even` of the
    outer radius; the change takes one (largest) radius of length.
    """
    cavity, outer = profile.cavity, profile.outer.radius(stations)
    inner: NDArray[np.float64] = cavity.radius(np.clip(stations, cavity.start, cavity.end))
    for end, solid in ((cavity.start, stations < cavity.start), (cavity.end, stations > cavity.end)):
        if not np.any(solid):
            continue
        fraction = float(cavity.radius(end) / profile.outer.radius(end))
        reach = np.clip(np.abs(stations[solid] - end) / profile.max_radius, 0.0, 1.0)
        blend = reach**2 * (3.0 - 2.0 * reach)
        inner[solid] = outer[solid] * (fraction + blend * (even - fraction))
    return inner


def cell_names(
    profile: Profile, stations: NDArray[np.float64], within: NDArray[np.bool_]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
    """Part (-1: void), segment and station of the cells, shape (layers, cells of a layer).

    `within` (cells of a layer,) are those inside the cavity's contour.
    """
    centre = 0.5 * (stations[1:] + stations[:-1])
    content = np.full(len(centre), Part.CASING, dtype=np.int32)
    content[(centre > profile.cavity.start) & (centre < profile.cavity.end)] = Part.CHARGE
    front = (centre > profile.cavity.start) & (centre < profile.charge_front)
    content[front] = Part.FUZE if profile.fuze is not None and profile.fuze.fill == "inert" else -1
    part = np.where(within[None, :], content[:, None], np.int32(Part.CASING)).astype(np.int32)
    ends = np.array([segment.end for segment in profile.segments[:-1]])
    layer_segment = np.searchsorted(ends, centre).astype(np.int32)
    segment = np.where(part == Part.CASING, layer_segment[:, None], np.int32(-1)).astype(np.int32)
    return part, segment, np.repeat(centre[:, None], len(within), axis=1)
