"""Cutting the casings into axial segments, each of which breaks by its own law.

By default the segments are those of the burst stage, where contour, wall or charge change. Given stations cut every
round once more: its casing cells go by the station of their centre, and radius, wall and charge of the new segments are
measured on the cells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fragfield_base.burst_snapshot import CHARGE, SEGMENT_KINDS, SegmentRecord
from fragfield_base.errors import names_allowed
from transition.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.settings import Stations
    from transition.snapshot import RoundData, Snapshot


@dataclass(frozen=True, eq=False)
class CasingSegment:
    """A segment and the casing cells that make it."""

    round: int
    index: int
    """Number of the round and of the segment within it."""
    data: SegmentRecord
    """Its description; masses and speed as the cells have them."""
    cells: NDArray[np.int64]
    """(k,) int64: its cells, as places in `Snapshot.casing`."""
    expansion: float
    """Outward speed at its outer radius (m/s): of all expansions with a speed in proportion to the distance from the
    axis, the one nearest to the cells'. What moves along the axis only has none."""

    @property
    def is_end(self) -> bool:
        """Whether it is an end piece, before or behind the charge."""
        return self.data.kind != "wall"


def casing_segments(
    snapshot: Snapshot, stations: Stations | Mapping[str, Stations] | None = None
) -> tuple[CasingSegment, ...]:
    """Segments of all rounds, by round and from the nose to the base; those without cells are left out.

    `snapshot`: end of the burst stage; `stations`: cuts (m from the nose end) for all rounds or for the rounds named;
    None: the segments of the burst stage. Raises InputError: a station beyond a round's length, an unknown round, or
    stations between which there is no casing cell.
    """
    if isinstance(stations, Mapping):
        names = [data.name for data in snapshot.rounds]
        for name in stations:
            if name not in names:
                raise InputError(f"break_up.segments: no round {name!r}{names_allowed(name, names)}")
    segments: list[CasingSegment] = []
    for index, data in enumerate(snapshot.rounds):
        own = np.flatnonzero(snapshot.round[snapshot.casing] == index)
        cuts = stations.get(data.name) if isinstance(stations, Mapping) else stations
        if not own.size:
            continue
        if cuts is None:
            label = snapshot.segment[snapshot.casing][own]
            found = [(k, own[label == k]) for k in range(len(data.segments))]
            segments += [_segment(snapshot, index, k, data.segments[k], cells) for k, cells in found if cells.size]
        else:
            segments += _recut(snapshot, index, data, own, cuts)
    return tuple(segments)


def _recut(
    snapshot: Snapshot, index: int, data: RoundData, own: NDArray[np.int64], cuts: Stations
) -> list[CasingSegment]:
    where = f"break_up.segments of round {data.name!r}"
    if cuts and cuts[-1] >= data.length:
        raise InputError(f"{where}: station {cuts[-1]:g} m lies beyond the round's length of {data.length:g} m")
    edges = np.array([0.0, *cuts, data.length])
    place = np.searchsorted(edges[1:-1], snapshot.station[snapshot.casing][own], side="right")
    segments = []
    for k, (start, end) in enumerate(pairwise(edges)):
        cells = own[place == k]
        if not cells.size:
            raise InputError(f"{where}: no casing cell has its centre between {start:g} and {end:g} m")
        segments.append(_segment(snapshot, index, k, measured(snapshot, index, data, cells, start, end), cells))
    return segments


def _segment(
    snapshot: Snapshot, index: int, number: int, data: SegmentRecord, cells: NDArray[np.int64]
) -> CasingSegment:
    owner = snapshot.rounds[index]
    axis = np.asarray(owner.axis) / np.linalg.norm(owner.axis)
    away = snapshot.casing_means(snapshot.reference, cells) - np.asarray(owner.position)
    away -= np.outer(away @ axis, axis)
    mass = snapshot.mass[snapshot.casing[cells]]
    velocity = snapshot.casing_means(snapshot.velocity, cells)
    spread = float(mass @ (away**2).sum(axis=1))
    rate = float(mass @ (away * velocity).sum(axis=1)) / spread if spread > 0.0 else 0.0
    return CasingSegment(index, number, data, cells, max(rate * data.outer_radius, 0.0))


def measured(
    snapshot: Snapshot, index: int, data: RoundData, cells: NDArray[np.int64], start: float, end: float
) -> SegmentRecord:
    """Describe a new segment by its cells.

    The kind is that of most of its mass. The outer radius is the mass-weighted mean of the outline; the wall of a
    "wall" follows from the casing's volume over the segment's length, that of an end piece from the segments of
    the burst stage.
    """
    whole = snapshot.casing[cells]
    mass = snapshot.mass[whole]
    old = snapshot.segment[whole]
    shares = np.bincount(old, weights=mass, minlength=len(data.segments)).astype(np.float64)
    by_kind = {
        kind: sum(s for s, g in zip(shares, data.segments, strict=True) if g.kind == kind) for kind in SEGMENT_KINDS
    }
    kind = max(by_kind, key=lambda name: by_kind[name])
    charge = (snapshot.part == CHARGE) & (snapshot.round == index)
    charge &= (snapshot.station >= start) & (snapshot.station < end)
    charge_mass = float(snapshot.mass[charge].sum())
    low, high = _extent(snapshot, data, whole)
    area = float(mass.sum()) / data.casing_density / (high - low)
    radius = _outline(snapshot, data, whole)
    wall = radius - np.sqrt(max(radius**2 - area / np.pi, 0.0))
    charge_radius = 0.0
    if charge_mass > 0.0:
        first, last = _extent(snapshot, data, np.flatnonzero(charge))
        charge_radius = float(np.sqrt(charge_mass / data.explosive_density / (last - first) / np.pi))
    if kind != "wall":
        wall = _weighted(shares, [g.wall_thickness for g in data.segments])
    speeds = np.linalg.norm(snapshot.casing_means(snapshot.velocity, cells), axis=1)
    return SegmentRecord(
        name=f"{start * 1e3:.0f}-{end * 1e3:.0f} mm",
        kind=kind,
        start=float(start),
        end=float(end),
        outer_radius=radius,
        wall_thickness=float(wall),
        charge_radius=charge_radius,
        casing_mass=float(mass.sum()),
        charge_mass=charge_mass,
        speed=float(mass @ speeds / mass.sum()),
    )


def _weighted(shares: NDArray[np.float64], values: list[float]) -> float:
    """Mean of the finite values by their shares; NaN where no share has one."""
    array = np.asarray(values)
    used = np.isfinite(array) & (shares > 0.0)
    return float(shares[used] @ array[used] / shares[used].sum()) if used.any() else float("nan")


def _stations_and_radii(
    snapshot: Snapshot, data: RoundData, cells: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stations and distances from the axis (k, nodes) of the cells' nodes before the burst (m)."""
    axis = np.asarray(data.axis) / np.linalg.norm(data.axis)
    away = snapshot.reference[snapshot.cells[cells]] - np.asarray(data.position)
    height = away @ axis
    return data.length - height, np.linalg.norm(away - height[..., None] * axis, axis=-1)


def _extent(snapshot: Snapshot, data: RoundData, cells: NDArray[np.int64]) -> tuple[float, float]:
    stations, _ = _stations_and_radii(snapshot, data, cells)
    return float(stations.min()), float(stations.max())


def _outline(snapshot: Snapshot, data: RoundData, cells: NDArray[np.int64]) -> float:
    """Mass-weighted mean over the cells of the largest node radius near their station (m)."""
    stations, radii = _stations_and_radii(snapshot, data, cells)
    mass = snapshot.mass[cells]
    centre = stations.mean(axis=1)
    length = float(np.ptp(stations))
    bins = max(1, round(length / float(np.median(np.ptp(stations, axis=1)))))
    place = np.minimum((bins * (centre - stations.min()) / length).astype(int), bins - 1)
    # Half of the cell's own taper lies beyond its centre: take the mean over the nodes of its outer face or edge.
    outer = np.full(bins, 0.0)
    np.maximum.at(outer, place, np.sort(radii, axis=1)[:, radii.shape[1] // 2 :].mean(axis=1))
    return float(mass @ outer[place] / mass.sum())
