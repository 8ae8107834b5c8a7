"""Axial segments of the casings, and the law by which each breaks: mean mass, mu and number.

By default the segments are those of the burst stage, where contour, wall or charge change. Given stations cut every
round once more: its casing cells go by the station of their centre, and radius, wall and charge of the new segments are
measured on the cells.

End pieces (nose and base, before and behind the charge) are few and large. The v0/a of Eq. 21 is a rate of hoop
strain, and an end piece is thrown along the axis too: its v0 is the outward speed of its expansion, not its speed of
flight. A base is a plate, which the charge stretches in both directions (by the end of the burst to 1.7 to 1.9 times in
the M107 and the M48, median by mass): at rupture its radius has grown by the critical strain and its thickness shrunk
by the square of that. Half of a nose stretches little before it parts from the wall: its radius and wall are those
before the burst, the thickness being at most its length. And there is never less than one piece: the mean mass is at
most the segment's mass.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fragfield_base.burst_snapshot import CHARGE, SEGMENT_KINDS, SegmentRecord
from fragfield_base.errors import names_allowed
from transition.errors import InputError
from transition.law import mean_mass
from transition.law.count_fit import SegmentMasses, fit_counts
from transition.law.fragment_counts import FragmentCounts
from transition.law.mott import MottLaw

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from transition.law.count_fit import CountFit
    from transition.settings import BreakUpSettings, Stations
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
            found = [(record, own[label == k]) for k, record in enumerate(data.segments)]
        else:
            found = list(_recut(snapshot, index, data, own, cuts))
        segments += [_segment(snapshot, index, k, *one) for k, one in enumerate(found) if one[1].size]
    return tuple(segments)


def _recut(
    snapshot: Snapshot, index: int, data: RoundData, own: NDArray[np.int64], cuts: Stations
) -> Iterator[tuple[SegmentRecord, NDArray[np.int64]]]:
    where = f"break_up.segments of round {data.name!r}"
    if cuts and cuts[-1] >= data.length:
        raise InputError(f"{where}: station {cuts[-1]:g} m lies beyond the round's length of {data.length:g} m")
    edges = np.array([0.0, *cuts, data.length])
    place = np.searchsorted(edges[1:-1], snapshot.station[snapshot.casing][own], side="right")
    for k, (start, end) in enumerate(pairwise(edges)):
        cells = own[place == k]
        if not cells.size:
            raise InputError(f"{where}: no casing cell has its centre between {start:g} and {end:g} m")
        yield measured(snapshot, index, data, cells, start, end), cells


def _segment(
    snapshot: Snapshot, index: int, number: int, data: SegmentRecord, cells: NDArray[np.int64]
) -> CasingSegment:
    owner = snapshot.rounds[index]
    away = snapshot.casing_means(snapshot.reference, cells) - np.asarray(owner.position)
    away -= np.outer(away @ owner.along, owner.along)
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
    casing_mass = float(mass.sum())
    shares = np.bincount(snapshot.segment[whole], weights=mass, minlength=len(data.segments)).astype(np.float64)
    kinds = [one.kind for one in data.segments]
    by_kind = {name: sum(s for s, kind in zip(shares, kinds, strict=True) if kind == name) for name in SEGMENT_KINDS}
    kind = max(by_kind, key=lambda name: by_kind[name])
    charge = (snapshot.part == CHARGE) & (snapshot.round == index)
    charge &= (snapshot.station >= start) & (snapshot.station < end)
    charge_mass = float(snapshot.mass[charge].sum())
    low, high = _extent(snapshot, data, whole)
    area = casing_mass / data.casing_density / (high - low)
    radius, charge_radius = _outline(snapshot, data, whole), 0.0
    if charge_mass > 0.0:
        first, last = _extent(snapshot, data, np.flatnonzero(charge))
        charge_radius = float(np.sqrt(charge_mass / data.explosive_density / (last - first) / np.pi))
    if kind == "wall":
        wall = float(radius - np.sqrt(max(radius**2 - area / np.pi, 0.0)))
    else:
        walls = np.asarray([one.wall_thickness for one in data.segments])
        used = np.isfinite(walls) & (shares > 0.0)
        wall = float(shares[used] @ walls[used] / shares[used].sum()) if used.any() else float("nan")
    speed = float(mass @ np.linalg.norm(snapshot.casing_means(snapshot.velocity, cells), axis=1) / mass.sum())
    name = f"{start * 1e3:.0f}-{end * 1e3:.0f} mm"
    return SegmentRecord(
        name, kind, float(start), float(end), radius, wall, charge_radius, casing_mass, charge_mass, speed
    )


def _stations_and_radii(
    snapshot: Snapshot, data: RoundData, cells: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stations and distances from the axis (k, nodes) of the cells' nodes before the burst (m)."""
    away = snapshot.reference[snapshot.cells[cells]] - np.asarray(data.position)
    height = away @ data.along
    return data.length - height, np.linalg.norm(away - height[..., None] * data.along, axis=-1)


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


_ALIKE = 0.02  # of a segment's mass, by which the meshes of rounds that are alike may differ


@dataclass(frozen=True)
class SegmentLaw:
    """How a segment breaks. SI units."""

    law: MottLaw
    """With the mean mass of the segment."""
    mass: float
    """Of the segment's cells (kg)."""
    n0: float
    """Expected number of fragments M/mean (Eq. 20)."""
    v0: float
    """Speed used in the law (m/s); of an end piece that of its expansion."""
    radius: float
    """Outer radius at rupture (m)."""


def segment_laws(
    segments: Sequence[CasingSegment], masses: Sequence[float], rounds: Sequence[RoundData], settings: BreakUpSettings
) -> tuple[tuple[SegmentLaw, ...], CountFit | None]:
    """Laws of all segments, and the fit of their mean masses to the pieces of a test, where the settings hold them.

    `segments`, `masses`: segments of all rounds, and their masses (kg); `rounds`: the rounds; `settings`: choices of
    the break-up. Raises InputError: the burst's speed, radius or wall of a segment cannot be used; as `fit_counts`; a
    test's pieces with rounds that are not alike.
    """
    fit, scale, states, means = None, 1.0, [], []
    for segment, mass in zip(segments, masses, strict=True):
        data = rounds[segment.round]
        where = f"round {data.name!r}, segment {segment.data.name!r}"
        states.append((_speed(segment, mass, data, settings, where), *_at_rupture(segment, settings, where)))
        means.append(_mean_mass(segment, data, settings, *states[-1]))
    counts = settings.mean_mass
    if isinstance(counts, FragmentCounts):
        _check_alike(segments, masses, counts.source)
        known = SegmentMasses(tuple(means), tuple(masses), len({segment.round for segment in segments}))
        fit = fit_counts(counts, settings.dimension, settings.mixed_fraction, known)
        scale = fit.scale * counts.scale
    laws = []
    for mean, mass, (speed, radius, _) in zip(means, masses, states, strict=True):
        limited = min(scale * mean, mass)
        law = MottLaw.from_mean(limited, settings.dimension, settings.mixed_fraction)
        laws.append(SegmentLaw(law, mass, mass / limited, speed, radius))
    return tuple(laws), fit


def _check_alike(segments: Sequence[CasingSegment], masses: Sequence[float], source: str) -> None:
    by_round: dict[int, list[float]] = {}
    for segment, mass in zip(segments, masses, strict=True):
        by_round.setdefault(segment.round, []).append(mass)
    first, *others = by_round.values()
    for other in others:
        if len(other) != len(first) or any(abs(b - a) > _ALIKE * a for a, b in zip(first, other, strict=True)):
            raise InputError(
                f"break_up.mean_mass: {source} holds the fragments of one kind of round, and the rounds here are of "
                "several; give a law or a mass"
            )


def outside_of(rounds: Sequence[RoundData], settings: BreakUpSettings) -> dict[str, list[str]]:
    """By a round's name: in which respects no published data on mean masses are near it; none for a known mean."""
    if not isinstance(settings.mean_mass, str):
        return {}
    found = {}
    for data in rounds:
        casing, charge = (sum(getattr(s, name) for s in data.segments) for name in ("casing_mass", "charge_mass"))
        diameter = 2.0 * max(segment.outer_radius for segment in data.segments)
        metal, filling = (data.casing_density, data.casing_yield), (data.explosive, data.explosive_density)
        found[data.name] = list(mean_mass.outside_data(diameter, charge / casing, metal, filling))
    return found


def _speed(segment: CasingSegment, mass: float, data: RoundData, settings: BreakUpSettings, where: str) -> float:
    if settings.velocity_source == "gurney":
        return mean_mass.gurney_speed(data.detonation_velocity, segment.data.charge_mass / mass)
    if segment.is_end:
        return segment.expansion
    if not (math.isfinite(segment.data.speed) and segment.data.speed >= 0.0):
        raise InputError(f"{where}: the burst stage gives the speed {segment.data.speed}; a finite speed is needed")
    return segment.data.speed


def _at_rupture(segment: CasingSegment, settings: BreakUpSettings, where: str) -> tuple[float, float]:
    """Outer radius and wall (m)."""
    data = segment.data
    for name, value in (("outer_radius", data.outer_radius), ("wall_thickness", data.wall_thickness)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{where}: {name} is {value:g} m; above zero is needed")
    if segment.is_end:
        thickness = min(data.wall_thickness, data.end - data.start)
        stretch = 1.0 + settings.critical_strain if data.kind == "base" else 1.0
        return stretch * data.outer_radius, thickness / stretch**2
    return mean_mass.ruptured(data.outer_radius, data.wall_thickness, settings.critical_strain)


def _mean_mass(
    segment: CasingSegment, data: RoundData, settings: BreakUpSettings, speed: float, radius: float, wall: float
) -> float:
    """By the law (kg), not limited by the segment's mass; a test's counts scale that of Eq. 21."""
    rate = speed / radius  # of hoop strain
    if settings.mean_mass == "mott" or isinstance(settings.mean_mass, FragmentCounts):
        return mean_mass.mott_linfoot(
            settings.prefactor, data.casing_density, radius, settings.fracture_energy, wall, rate * radius
        )
    if settings.mean_mass == "mott_1947":
        return mean_mass.mott_1947(data.casing_density, settings.fracture_stress, settings.fracture_gamma, wall, rate)
    if settings.mean_mass == "gurney_sarmousakis":
        constant = mean_mass.explosive_constant(data.explosive, settings.explosive_constant)
        wall, inner = segment.data.wall_thickness, 2.0 * (segment.data.outer_radius - segment.data.wall_thickness)
        return mean_mass.gurney_sarmousakis(constant, wall, inner)
    return float(settings.mean_mass)
