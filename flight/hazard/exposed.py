"""Fragments at exposed sites: upright prisms over polygons, counted by witness panels around them.

A prism's sides and roof are witness surfaces. Between two crossings a path lies inside or outside; inside, its length
is that of the chord: over the few metres of a prism a path of a hazardous fragment departs from it by less than 1e-5
of its length. Where a path ends on the ground or in an obstacle inside the prism, the chord ends there.

Lengths over the prism's volume are the density normal to the paths (trajectory-normal method), landings over its
ground the density on the ground. Where an obstacle fills the prism (a building), a hit is the first crossing inward,
and the density normal to the paths is the sum over hits of 1 / (area of the prism seen along the path).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array, require_numbers
from flight.errors import InputError
from flight.rows import Status
from flight.scene.targets import Panel, Polygon, signed_area

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from flight.result import FlightResult
    from flight.scene.targets import Witness

    Array = NDArray[np.float64]
    Stops = Callable[[Array, Array], NDArray[np.bool_]]


MARGIN = 1e-3  # m by which the surfaces stand off, so that a wall behind them stops no fragment before it is counted

COUNTS = np.dtype(
    [
        ("track", "f8"),  # length of hazardous paths inside (m)
        ("track_squares", "f8"),  # sum of the squares of single lengths (m2)
        ("fluence", "f8"),  # sum over hazardous hits of 1 / (area seen along the path) (1/m2)
        ("fluence_squares", "f8"),
        ("hits", "i8"),  # fragments that entered with the criterion's energy or more
        ("landings", "i8"),  # of those, impacts on the ground inside
        ("through", "i8"),  # of those, not shown to be stopped by the wall or roof that they hit
        ("any_hits", "i8"),  # fragments that entered with any energy
        ("energy", "f8"),  # largest at entry (J)
    ]
)


@dataclass(frozen=True, eq=False)
class Prism:
    """An upright prism.

    Attributes
    ----------
    corners : (k, 2) float64
        Of its plan (m), in order; turned counter-clockwise when made.
    bottom, top : float
        Heights z (m); the bottom lies on or below the ground everywhere.
    energy : float
        Of a hazardous fragment (J).
    height : float
        From the ground to the top (m), over which densities are taken.
    wall, roof : callable, optional
        Whether a fragment is shown to be stopped, from masses (kg) and speeds (m/s); left out: none is.
    """

    corners: Array
    bottom: float
    top: float
    energy: float = 79.0
    height: float = 1.8
    wall: Stops | None = None
    roof: Stops | None = None

    def __post_init__(self) -> None:
        """Refuse what encloses nothing."""
        corners = real_array("exposed", "corners", self.corners, "m").copy()
        require_numbers("exposed", self, {"bottom": "m", "top": "m", "energy": "J", "height": "m"})
        if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not np.isfinite(corners).all():
            raise InputError(f"exposed: corners have shape {corners.shape}, needed (k, 2) with k of 3 or more, finite")
        area = signed_area(corners)
        if not abs(area) > 1e-9:
            raise InputError("exposed: the corners enclose no area")
        if not self.top > self.bottom:
            raise InputError(f"exposed: the top at {self.top} m is not above the bottom at {self.bottom} m")
        object.__setattr__(self, "corners", corners if area > 0.0 else corners[::-1].copy())

    @property
    def area(self) -> float:
        """Of its plan (m2)."""
        return signed_area(self.corners)

    @property
    def volume(self) -> float:
        """Over the height above the ground (m3)."""
        return self.area * self.height

    @property
    def longest(self) -> float:
        """No chord inside is longer (m)."""
        across = self.corners[:, None] - self.corners[None]
        return math.hypot(float(np.sqrt((across**2).sum(axis=2)).max()), self.height)

    @property
    def min_shadow(self) -> float:
        """No direction from above or level sees less of it (m2): that of its narrowest side, or of its plan."""
        turn = np.radians(np.arange(360.0))
        level = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(360)])
        return min(self.area, float(self.seen_area(level).min()))

    def surfaces(self, name: str) -> list[Witness]:
        """Its sides in the order of its corners, then its roof; normals look out, polygons stand `MARGIN` off."""
        outline = _offset(self.corners, MARGIN)
        top, bottom = self.top + MARGIN, self.bottom
        made: list[Witness] = []
        for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            way = end - start
            length = float(np.hypot(*way))
            centre = (*(0.5 * (start + end)).tolist(), 0.5 * (bottom + top))
            # Panels overlap a little at the corners: a path through the edge itself must not slip between two.
            made.append(Panel(centre, (way[1] / length, -way[0] / length, 0.0), length + 1e-9, top - bottom, name=name))
        roof = np.column_stack([outline, np.full(len(outline), top)])
        return [*made, Polygon(roof, name=name)]

    def seen_area(self, direction: Array) -> Array:
        """Area of sides and roof (above the ground) seen along unit vectors (n, 3), in m2; of a convex prism."""
        ways = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.column_stack([ways[:, 1], -ways[:, 0]])  # times the length of the side
        sides = np.maximum(-direction[:, :2] @ normals.T, 0.0).sum(axis=1) * self.height
        return np.asarray(sides + self.area * np.maximum(-direction[:, 2], 0.0))


def surfaces_of(prisms: Sequence[Prism]) -> list[Witness]:
    """Witness surfaces of all prisms, one after the other."""
    return [surface for number, prism in enumerate(prisms) for surface in prism.surfaces(f"exposed {number}")]


def count_exposed(
    result: FlightResult, prisms: Sequence[Prism], first: int, start: Array, speed: Array, *, ricochet: bool = True
) -> NDArray[Any]:
    """Count one flight at every prism: (p,) array of dtype COUNTS.

    The witnesses of the flight from index `first` on are `surfaces_of(prisms)`; its fragments began at `start` (n, 3)
    (m) with `speed` (n,) (m/s). `ricochet`: what they do after their first impact on the ground counts.
    """
    counts = np.zeros(len(prisms), dtype=COUNTS)
    rows = result.hits[result.hits["witness"] >= first]
    impacts = result.ricochets[:0]
    if ricochet and len(result.ricochets):
        later = result.ricochet_hits[result.ricochet_hits["witness"] >= first]
        rows, impacts = np.concatenate([rows, later]), result.ricochets
        rows = rows[np.lexsort((rows["time"], rows["fragment"]))]
    if not len(rows):
        return counts
    sizes = np.array([len(prism.corners) + 1 for prism in prisms])
    begins = first + np.concatenate([[0], np.cumsum(sizes)])
    owner = np.searchsorted(begins, rows["witness"], side="right") - 1
    for number in np.unique(owner):
        face = rows["witness"][owner == number] - begins[number]
        here = counts[number : number + 1]
        _count(here, prisms[number], rows[owner == number], face, result.landing, impacts, start, speed)
    return counts


def _count(
    counts: NDArray[Any], prism: Prism, rows: NDArray[Any], face: NDArray[np.int64], landing: NDArray[Any],
    impacts: NDArray[Any], start: Array, speed: Array,
) -> None:  # fmt: skip
    """Fill the counts (1,) of one prism from its crossings."""
    entering = rows["direction"] < 0
    who = np.unique(rows["fragment"])
    hazardous = entering & (rows["energy"] >= prism.energy)
    counts["any_hits"] = len(np.unique(rows["fragment"][entering]))
    counts["energy"] = rows["energy"][entering].max(initial=0.0)
    _, each = np.unique(rows["fragment"][hazardous], return_index=True)  # rows are in time for each fragment
    hits, hit_face = rows[hazardous][each], face[hazardous][each]
    counts["hits"] = len(hits)
    counts["through"] = _not_stopped(prism, hits, hit_face)
    if len(hits):
        weight = 1.0 / prism.seen_area(hits["velocity"] / hits["speed"][:, None])
        counts["fluence"], counts["fluence_squares"] = weight.sum(), (weight**2).sum()
    lengths, landed = _inside(prism, rows, landing[who], who, impacts[np.isin(impacts["fragment"], who)], start, speed)
    counts["track"], counts["track_squares"] = lengths.sum(), (lengths**2).sum()
    counts["landings"] = landed


def _not_stopped(prism: Prism, hits: NDArray[Any], face: NDArray[np.int64]) -> int:
    """Hits on a wall or roof that is not shown to stop them."""
    passed = 0
    roof = face == len(prism.corners)
    for stops, on in ((prism.wall, ~roof), (prism.roof, roof)):
        here = hits[on]
        passed += len(here) if stops is None else int((~stops(here["mass"], here["speed"])).sum())
    return passed


def _inside(
    prism: Prism, rows: NDArray[Any], ends: NDArray[Any], who: NDArray[np.int64], impacts: NDArray[Any], start: Array,
    speed: Array,
) -> tuple[Array, int]:  # fmt: skip
    """Lengths of hazardous paths inside (fragments,), and the number of hazardous impacts on the ground there.

    Start, crossings, first impact and, after it, the ricochets of every fragment make a chain in time; inside lies
    what follows more entries than exits. A fragment whose first crossing leads out began inside.
    """
    number = len(who)
    first, later = impacts[impacts["number"] == 0], impacts[impacts["number"] > 0]
    fragment = np.concatenate([who, rows["fragment"], who, later["fragment"]])
    nowhere = ~np.isfinite(ends["position"]).all(axis=1)
    end_place = np.where(nowhere[:, None], 0.0, ends["position"])
    end_time = np.where(nowhere, np.inf, ends["time"])
    time = np.concatenate([np.full(number, -np.inf), rows["time"], end_time, later["time"]])
    place = np.concatenate([start[who], rows["position"], end_place, later["position"]])
    at_launch = 0.5 * ends["mass"] * speed[who] ** 2
    after = np.zeros(number)  # what follows the first impact
    after[np.searchsorted(who, first["fragment"])] = first["energy_after"]
    energy = np.concatenate([at_launch, rows["energy"], after, later["energy_after"]])  # of the path that follows
    struck = np.concatenate([np.zeros(number + len(rows)), np.nan_to_num(ends["energy"]), later["energy"]])
    change = np.concatenate([np.zeros(number), -rows["direction"], np.zeros(number + len(later))]).astype(np.int64)
    kind = np.repeat([0, 1, 2, 3], [number, len(rows), number, len(later)])
    order = np.lexsort((kind, time, fragment))
    fragment, time, place, energy, struck, change, kind = (
        a[order] for a in (fragment, time, place, energy, struck, change, kind)
    )
    total = np.cumsum(change)
    firsts = np.flatnonzero(kind == 0)
    group = np.cumsum(kind == 0) - 1
    depth = total - (total[firsts] - change[firsts])[group]
    lowest = np.minimum.reduceat(depth, firsts)
    depth = depth - np.minimum(lowest, 0)[group]  # began inside
    follows = np.append(group[1:] == group[:-1], False)
    later = np.append(place[1:], place[-1:], axis=0)
    known = np.isfinite(np.append(time[1:], np.inf)) & follows
    counted = known & (depth > 0) & (energy >= prism.energy)
    chord = np.where(counted, np.sqrt(((later - place) ** 2).sum(axis=1)), 0.0)
    lengths = np.asarray(np.bincount(group, weights=chord, minlength=number), dtype=np.float64)
    status = ends["status"] == Status.LANDED
    landed = (kind >= 2) & (depth > 0) & status[group] & (struck >= prism.energy)
    return lengths[lengths > 0.0], int(landed.sum())


def _offset(corners: Array, distance: float) -> Array:
    """The outline (counter-clockwise) moved outward by a small distance, side by side."""
    ways = np.roll(corners, -1, axis=0) - corners
    ways = ways / np.hypot(ways[:, 0], ways[:, 1])[:, None]
    normals = np.column_stack([ways[:, 1], -ways[:, 0]])
    before = np.roll(normals, 1, axis=0)
    share = 1.0 + (normals * before).sum(axis=1)
    return np.asarray(corners + distance * (normals + before) / np.maximum(share, 0.1)[:, None])
