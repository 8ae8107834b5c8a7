"""Check of `hazard.protective_works`: what is named there must enclose the rounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.case.conversion.exposed_sites import outline_of
from fragfield.errors import nearest
from fragfield_base.errors import show

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fragfield.case.schema import CaseTable


_CLOSED = 270.0  # degrees: three sides, and an entrance on the fourth
_UPRIGHT = 0.5  # largest vertical part of a wall's normal: 30 degrees from plumb


def check_protective_works(case: CaseTable) -> Iterator[str]:
    """Faults of `hazard.protective_works` of a resolved case: unknown names, floors, works that leave the rounds open.

    Seen from the centre of the rounds, all that is named together must close 270 degrees of the directions: a single
    wall, and works that stand apart from the rounds, protect nothing in the other directions.
    """
    key = "hazard.protective_works"
    outlines = {one.name: outline_of(one) for one in case.obstacle}
    planes = {one.name: one for one in case.plane if one.kind == "wall"}
    azimuth = np.radians(np.arange(0.5, 360.0))
    ahead = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    centre = np.mean([one.position[:2] for one in case.round] or [case.flight.origin], axis=0)
    closed = np.zeros(len(azimuth), dtype=bool)
    for name in case.hazard.protective_works:
        if name in outlines:
            closed |= _crossed(ahead, outlines[name] - centre)
        elif name in planes:
            normal = np.array(planes[name].normal, dtype=np.float64)
            normal /= np.linalg.norm(normal)
            if abs(normal[2]) > _UPRIGHT:
                yield f"{key}: found {show(name)}, a plane under or over the rounds; allowed: upright walls"
                return
            closed |= ahead @ normal[:2] < 0.0
        else:
            known = [*outlines, *planes]
            allowed = ", ".join(map(show, known)) or "none: the case has no [[obstacle]] and no [[plane]] of kind wall"
            yield f"{key}: found {show(name)}; allowed: {allowed}{nearest(name, known)}"
            return
    if case.hazard.protective_works and (degrees := float(closed.sum())) < _CLOSED:
        found = ", ".join(map(show, case.hazard.protective_works))
        yield (
            f"{key}: found {found}, which close {degrees:g} of 360 degrees around the rounds; allowed: works that "
            f"enclose them, on {_CLOSED:g} degrees or more"
        )


def _crossed(ahead: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which rays from the origin (n, 2) meet a convex polygon (k, 2)."""
    start, side = corners, np.roll(corners, -1, axis=0) - corners
    across = ahead[:, :1] * side[:, 1] - ahead[:, 1:] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (start[:, 0] * side[:, 1] - start[:, 1] * side[:, 0]) / across
        on_side = (start[:, 0] * ahead[:, 1:] - start[:, 1] * ahead[:, :1]) / across
    return np.asarray(((along > 0.0) & (on_side >= 0.0) & (on_side <= 1.0)).any(axis=1))
