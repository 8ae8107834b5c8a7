"""One analytic burst of a real profile, twice: on the hexahedra of an O-grid, and on the meridian."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.meshing import cell_volumes, mesh_profile
from burst_fenicsx.meshing.sizing import FEWEST_WALL_CELLS, layer_stations
from burst_fenicsx.problem import Part
from fragfield_base.burst_snapshot import SegmentRecord
from tests.transition.synthetic import STEEL, TNT
from transition.cells import ring_volumes
from transition.snapshot import RoundData, Snapshot

if TYPE_CHECKING:
    from burst_fenicsx.geometry import Profile

STRETCH = 1.9


def velocity(station: np.ndarray, radius: np.ndarray, largest: float, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Outward and axial speed (m/s) of a shell: 1,100 m/s on the wall, less towards both ends, which fly apart."""
    x = station / length
    outward = (120.0 + 1150.0 * (4.0 * x * (1.0 - x)) ** 0.5) * radius / (STRETCH * largest)
    return outward, 900.0 * (0.5 - x) ** 3 * 4.0 + 60.0


def mesh_meridian(profile: Profile, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (n, 2) in (r, z), quadrilaterals, part and segment: columns from the axis to the cavity and the outside."""
    stations = layer_stations(profile, size)
    outer, cavity = profile.outer.radius(stations), profile.cavity
    section = profile.section(np.linspace(profile.charge_front, cavity.end, 201))
    wall = max(FEWEST_WALL_CELLS, round(float(section.wall.mean()) / size))
    core = max(2, round(float(np.sqrt((section.inner_radius**2).mean())) / size))
    inner = cavity.radius(np.clip(stations, cavity.start, cavity.end))
    # In solid ends the columns become equally wide towards the end.
    for end, solid in ((cavity.start, stations < cavity.start), (cavity.end, stations > cavity.end)):
        share = float(cavity.radius(end) / profile.outer.radius(end))
        reach = np.clip(np.abs(stations[solid] - end) / profile.max_radius, 0.0, 1.0)
        inner[solid] = outer[solid] * (share + reach**2 * (3.0 - 2.0 * reach) * (core / (core + wall) - share))
    across = np.arange(core + 1) / core, np.arange(1, wall + 1) / wall
    r = np.concatenate([inner[:, None] * across[0], inner[:, None] + (outer - inner)[:, None] * across[1]], axis=1)
    z = np.repeat((profile.length - stations)[:, None], core + wall + 1, axis=1)
    number = np.arange(r.size).reshape(r.shape)
    low, high = number[1:], number[:-1]
    cells = np.stack([low[:, :-1], low[:, 1:], high[:, 1:], high[:, :-1]], axis=-1).reshape(-1, 4)
    centre = 0.5 * (stations[1:] + stations[:-1])
    content = np.where((centre > cavity.start) & (centre < cavity.end), int(Part.CHARGE), int(Part.CASING))
    content[(centre > cavity.start) & (centre < profile.charge_front)] = Part.FUZE
    part = np.where(np.arange(core + wall)[None] < core, content[:, None], int(Part.CASING)).ravel()
    ends = np.array([item.end for item in profile.segments[:-1]])
    segment = np.where(part == Part.CASING, np.repeat(np.searchsorted(ends, centre), core + wall), -1)
    return np.column_stack([r.ravel(), z.ravel()]), cells, part, segment


def meridian_snapshot(profile: Profile, size: float) -> Snapshot:
    """The meridian with the analytic velocities at its nodes."""
    flat, cells, part, segment = mesh_meridian(profile, size)
    mass = ring_volumes(flat[cells]) * np.where(part == Part.CHARGE, TNT, STEEL)
    zero = np.zeros(len(flat))
    now = flat * [STRETCH, 1.0]
    outward, axial = velocity(profile.length - now[:, 1], now[:, 0], profile.max_radius, profile.length)
    return _snapshot(
        profile, np.column_stack([flat[:, 0], zero, flat[:, 1]]), np.column_stack([now[:, 0], zero, now[:, 1]]),
        np.column_stack([outward, zero, axial]), cells, part, segment, mass, "axisymmetric",
    )  # fmt: skip


def hexahedral_snapshot(profile: Profile, size: float) -> Snapshot:
    """The O-grid with the same velocities at its nodes."""
    mesh = mesh_profile(profile, size)
    now = mesh.nodes * [STRETCH, STRETCH, 1.0]
    radius = np.hypot(now[:, 0], now[:, 1])
    outward, axial = velocity(profile.length - now[:, 2], radius, profile.max_radius, profile.length)
    flat = now[:, :2] * (outward / np.maximum(radius, 1e-12))[:, None]
    mass = cell_volumes(mesh) * np.where(mesh.part == Part.CHARGE, TNT, STEEL)
    return _snapshot(
        profile, mesh.nodes, now, np.column_stack([flat, axial]), reordered(mesh.cells), mesh.part, mesh.segment,
        mass, "3d",
    )  # fmt: skip


def _snapshot(profile, reference, position, speed, cells, part, segment, mass, geometry) -> Snapshot:
    station = profile.length - reference[cells][..., 2].mean(axis=1)
    cell_speed = np.linalg.norm(speed[cells].mean(axis=1), axis=1)
    segments = []
    for number, item in enumerate(profile.segments):
        own = (part == Part.CASING) & (segment == number)
        charge = (part == Part.CHARGE) & (station >= item.start) & (station < item.end)
        section = profile.section(np.linspace(item.start, item.end, 41))
        segments.append(
            SegmentRecord(
                item.name, item.kind, item.start, item.end, float(section.outer_radius.mean()),
                float(section.wall.mean()), float(section.charge_radius.mean()), float(mass[own].sum()),
                float(mass[charge].sum()), float(mass[own] @ cell_speed[own] / mass[own].sum()),
            )
        )  # fmt: skip
    data = RoundData(
        "M107", profile.length, STEEL, "TNT", TNT, 6940.0, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), tuple(segments)
    )
    whole = np.zeros(len(cells), dtype=np.int64)
    return Snapshot(
        geometry, 1.2e-4, {}, reference, position, speed, np.asarray(cells, dtype=np.int64),
        part.astype(np.int64), whole, segment.astype(np.int64), station, mass, (data,), (), geometry,
    )  # fmt: skip
