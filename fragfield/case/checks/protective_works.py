"""Check of `hazard.protective_works`: what is named there must enclose the rounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.case.conversion.rounds import placed
from fragfield.case.conversion.surroundings import ground_height, ground_of, surroundings
from fragfield.case.faults import Fault
from fragfield.case.tables.round import UP
from fragfield.errors import nearest
from fragfield_base.errors import show

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fragfield.case.schema import CaseTable


_CLOSED = 270.0  # degrees: three sides, and an entrance on the fourth
_ELEVATION = 30.0  # degrees over the top of the rounds; the fragments that fly farthest leave at 20 to 40
_NEAR = 3.0  # m to a plane, which has no height
_UPRIGHT = 0.5  # largest vertical part of a wall's normal: 30 degrees from plumb


def check_protective_works(case: CaseTable) -> Iterator[Fault]:
    """Faults of `hazard.protective_works` of a resolved case: unknown names, floors, works that leave the rounds open.

    Seen from the top of every round, all that is named together must close 270 degrees of the directions, up to 30
    degrees over the horizontal: a single wall, works far off and low ones do not stop what flies farthest.
    """
    from flight.scene.obstacles import FACES, FIRST_FACE, pack_obstacles
    from flight.scene.scene import Scene

    key, names = "hazard.protective_works", case.hazard.protective_works
    planes = {one.name: one for one in case.plane if one.kind == "wall"}
    known = [*(one.name for one in case.obstacle), *planes]
    for name in names:
        if name not in known:
            allowed = ", ".join(map(show, known)) or "none: the case has no [[obstacle]] and no [[plane]] of kind wall"
            yield Fault(f"{key}", f"found {show(name)}; allowed: {allowed}{nearest(name, known)}")
            return
    walls = []  # of the planes, a point and the unit normal
    for one in (planes[name] for name in names if name in planes):
        normal = np.array(one.normal, dtype=np.float64) / np.linalg.norm(np.array(one.normal))
        if abs(normal[2]) > _UPRIGHT:
            yield Fault(f"{key}", f"found {show(one.name)}, a plane under or over the rounds; allowed: upright walls")
            return
        walls.append((np.array(one.point, dtype=np.float64), normal))
    if not names:
        return
    ground = ground_of(case)
    lowest = ground if isinstance(ground, float) else float(ground.heights.min())
    standing = [one for one in surroundings(case)["obstacles"] if one.name in names]
    bodies = pack_obstacles(standing, lowest, Scene(ground).ground_at)[:, FIRST_FACE:].reshape(-1, FACES, 2, 3)
    azimuth, rise = np.radians(np.arange(0.5, 360.0)), np.tan(np.radians(_ELEVATION))
    ahead = np.stack([np.cos(azimuth), np.sin(azimuth), np.full(len(azimuth), rise)], axis=1)
    origin = (*case.flight.origin, ground_height(case, *case.flight.origin))
    tops = [(*one.position[:2], placed(one).reach(UP)[1]) for one in case.round] or [origin]
    degrees = min(_closed(np.array(top), ahead, bodies, walls) for top in tops)
    if degrees < _CLOSED:
        yield Fault(
            f"{key}",
            f"found {', '.join(map(show, names))}, which close {degrees} of 360 degrees around the rounds up to "
            f"{_ELEVATION:g} degrees over them; allowed: works that enclose them, on {_CLOSED:g} degrees or more, as "
            f"high as that or, of planes, within {_NEAR:g} m",
        )


def _closed(
    top: NDArray[np.float64], ahead: NDArray[np.float64], bodies: NDArray[np.float64],
    walls: list[tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> int:  # fmt: skip
    """How many rays `ahead` (n, 3) from `top` (3,) meet a convex body (k, faces, 2, 3) or a near wall."""
    point, normal = bodies[:, :, 0], bodies[:, :, 1]
    outside = ((top - point) * normal).sum(axis=2)  # (k, faces)
    away = np.einsum("kfj,nj->nkf", normal, ahead)
    with np.errstate(divide="ignore", invalid="ignore"):
        met = -outside / away
    entry = np.where(away < 0.0, met, -np.inf).max(axis=2, initial=0.0)
    leaving = np.where(away > 0.0, met, np.inf).min(axis=2, initial=np.inf)
    beside = ((away == 0.0) & (outside > 0.0)).any(axis=2)
    closed = ((entry <= leaving) & ~beside).any(axis=1)
    for at, out in walls:
        towards = ahead[:, :2] @ out[:2]
        closed |= (towards < 0.0) & (float((top - at) @ out) <= -_NEAR * towards)
    return int(closed.sum())
