"""The rounds and segments as the break-up needs them: initial radii and walls, masses, speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.files.snapshot import RoundRecord
from burst_fenicsx.kernels.constants import GURNEY_VOLUME
from burst_fenicsx.materials.products.landau import LandauProducts
from burst_fenicsx.problem import Part
from fragfield_base.burst_snapshot import SegmentRecord

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.assembled import AssembledBurst

__all__ = ["round_records"]


def round_records(run: AssembledBurst, masses: Sequence[np.ndarray], speeds: Sequence[np.ndarray]) -> list[RoundRecord]:
    """Describe every computed round of a finished run, cut ones as whole.

    `masses` (kg) and `speeds` (m/s) are those of the casing's segments, round by round.
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
            )
        )
    return records
