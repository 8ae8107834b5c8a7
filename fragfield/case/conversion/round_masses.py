"""What a round of a case holds: masses of its casing and charge, and which rounds are alike."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fragfield.case.conversion.burst import burst_round
from fragfield.case.conversion.placing import profile_of

if TYPE_CHECKING:
    from fragfield.case.schema import Case
    from fragfield.case.tables.round import RoundTable

__all__ = ["RoundMasses", "SegmentMass", "are_alike", "contents_text", "first_alike", "masses_of"]

_CONTENTS = {"profile", "mesh", "explosive", "casing"}


@dataclass(frozen=True)
class SegmentMass:
    """An axial segment of a casing: its kind ("nose", "wall" or "base"), and the mass of the casing in it (kg)."""

    name: str
    kind: str
    casing: float


@dataclass(frozen=True)
class RoundMasses:
    """Masses of a round as its contours or its mesh and its materials give them (kg).

    Attributes
    ----------
    casing, charge : float
        Of the whole round.
    segments : tuple of SegmentMass
        Of its profile; none where it is from a mesh file.
    """

    casing: float
    charge: float
    segments: tuple[SegmentMass, ...] = ()


def masses_of(entry: RoundTable) -> RoundMasses:
    """Masses of a resolved round."""
    item = burst_round(entry, entry.name)
    casing, charge = item.casing.density, item.explosive.density
    if entry.mesh is not None:
        from burst_fenicsx.meshing import mesh_round, part_volumes
        from burst_fenicsx.problem import Part

        volumes = part_volumes(mesh_round(item, 1.0))
        return RoundMasses(volumes[Part.CASING] * casing, volumes[Part.CHARGE] * charge)
    profile = profile_of(entry)
    segments = tuple(
        SegmentMass(one.name, one.kind, casing * profile.volumes(one.start, one.end).casing) for one in profile.segments
    )
    return RoundMasses(profile.casing_volume * casing, profile.charge_volume * charge, segments)


def contents_text(entry: RoundTable) -> str:
    """Shape and materials of a round as text: rounds that differ in their place or their initiation alone have one."""
    return json.dumps(entry.model_dump(mode="json", include=_CONTENTS), sort_keys=True)


def first_alike(case: Case) -> list[int]:
    """For every round the index of the first one of the same contents."""
    keys = [contents_text(entry) for entry in case.round]
    return [keys.index(key) for key in keys]


def are_alike(case: Case) -> bool:
    """Whether all rounds of a case have the same contents: the data of a test hold the fragments of one kind."""
    return len({contents_text(entry) for entry in case.round}) <= 1
