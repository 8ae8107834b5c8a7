"""The rounds and segments as the break-up needs them: initial radii and walls, masses, speeds, state at rupture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.files.snapshot import ExpansionRecord, RoundRecord
from burst_fenicsx.kernels.constants import GURNEY_VOLUME
from burst_fenicsx.materials.products.landau import LandauProducts
from burst_fenicsx.problem import Part
from fragfield_base.burst_snapshot import SegmentRecord

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.assembled import AssembledBurst

    Radii = Sequence[tuple[float, np.ndarray, np.ndarray]]

__all__ = ["round_records"]


def round_records(
    run: AssembledBurst, radii: Radii, masses: Sequence[np.ndarray], speeds: Sequence[np.ndarray]
) -> list[RoundRecord]:
    """Describe every computed round of a finished run, cut ones as whole.

    `radii` are times (s) with the outer radii of casings and charges (m) then; `masses` (kg) and `speeds` (m/s) are
    those of the casing's segments, round by round.
    """
    mesh = run.mesh
    volume = mesh.volumes * run.part.multiplicity[mesh.round]
    records = []
    for index, item in enumerate(run.rounds):
        own = mesh.round == index
        totals = {part: float(volume[own & (mesh.part == part)].sum()) for part in Part}
        segments = []
        for number, segment in enumerate(mesh.segments[index]):
            inside = own & (mesh.station >= segment.start) & (mesh.station < segment.end)
            by_part = {part: float(volume[inside & (mesh.part == part)].sum()) for part in Part}
            length = segment.end - segment.start
            whole = sum(by_part.values())
            inner = np.sqrt((whole - by_part[Part.CASING]) / (np.pi * length))
            outer = np.sqrt(whole / (np.pi * length))
            rupture_radius, rupture_wall = _at_rupture(run, radii, index, segment.start, segment.end)
            segments.append(
                SegmentRecord(
                    name=segment.name,
                    kind=segment.kind,
                    start=segment.start,
                    end=segment.end,
                    outer_radius=float(outer),
                    wall_thickness=float(outer - inner),
                    charge_radius=float(np.sqrt(by_part[Part.CHARGE] / (np.pi * length))),
                    casing_mass=float(masses[index][number]),
                    charge_mass=by_part[Part.CHARGE] * item.explosive.density,
                    speed=float(speeds[index][number]),
                    rupture_radius=rupture_radius,
                    rupture_wall=rupture_wall,
                )
            )
        products = run.fields.products[index]
        explosive = item.explosive
        if isinstance(products, LandauProducts):
            gurney = products.gurney_velocity(GURNEY_VOLUME)
        else:
            # Eq. 24 in SI: km/s and m/s in the paper's 0.52 + 2.8e-4 D.
            gurney = 520.0 + 0.28 * explosive.detonation_velocity
        records.append(
            RoundRecord(
                name=item.name,
                length=mesh.lengths[index],
                casing_density=item.casing.density,
                casing_yield=2.0 * item.casing.shear_strength,  # Tresca
                casing_mass=totals[Part.CASING] * item.casing.density,
                charge_mass=totals[Part.CHARGE] * explosive.density,
                fuze_mass=totals[Part.FUZE] * run.fuze_density[index],
                explosive=explosive.name,
                explosive_density=explosive.density,
                detonation_velocity=explosive.detonation_velocity,
                gurney_velocity=gurney,
                position=tuple(item.position),
                axis=tuple(item.axis),
                segments=tuple(segments),
                expansion=_expansion(run, radii, index),
            )
        )
    return records


def _at_rupture(run: AssembledBurst, radii: Radii, index: int, start: float, end: float) -> tuple[float, float]:
    """Outer radius and wall (m) of a segment when its charge first passed the leakage radius; not a number before."""
    parts = run.settings.leakage.parts
    surfaces = run.surfaces
    charge = (run.mesh.round == index) & (run.mesh.part == Part.CHARGE)
    if not charge.any() or not radii:
        return float("nan"), float("nan")
    inside = charge & (run.mesh.station >= start) & (run.mesh.station < end)
    chosen = np.unique(surfaces.cell_slice[inside])
    bins = (surfaces.bin_round == index) & (surfaces.bin_station >= start) & (surfaces.bin_station < end)
    chosen = chosen[chosen < parts * len(run.rounds)]
    if not len(chosen) or not bins.any():
        return float("nan"), float("nan")
    ruptured = run.leakage.rupture_time[chosen]
    if not np.isfinite(ruptured).all():
        return float("nan"), float("nan")
    times = np.array([time for time, _, _ in radii])
    outer = np.array([np.nanmean(casing[bins]) for _, casing, _ in radii])
    inner = np.array([charge_radii[chosen].mean() for _, _, charge_radii in radii])
    when = float(ruptured.mean())
    radius = float(np.interp(when, times, outer))
    return radius, radius - float(np.interp(when, times, inner))


def _expansion(run: AssembledBurst, radii: Radii, index: int) -> ExpansionRecord:
    """Outer radius of a round's casing by station bin over the whole burst."""
    bins = run.surfaces.bin_round == index
    station = run.surfaces.bin_station[bins]
    time = np.array([entry[0] for entry in radii])
    outer = np.array([casing[bins] for _, casing, _ in radii]).reshape(len(time), len(station))
    return ExpansionRecord(time, station, outer)
