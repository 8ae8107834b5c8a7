"""Axial segments of a casing: one break-up law holds within each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from burst_fenicsx.data import nearest_name
from burst_fenicsx.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.geometry.contour import Contour


SegmentKind = Literal["nose", "wall", "base"]
SEGMENT_KINDS: tuple[SegmentKind, ...] = ("nose", "wall", "base")

SHORTEST_WALL_SEGMENT = 0.3  # of the round's largest radius: shorter pieces join their neighbour
LARGEST_CHANGE = 0.25  # of outer radius or wall within one segment


@dataclass(frozen=True)
class Segment:
    """A piece of the casing between two stations (m, from the nose end).

    `kind` is "nose" (before the charge), "wall" (around the charge) or "base" (behind the charge).
    """

    name: str
    start: float
    end: float
    kind: SegmentKind


def check_segments(segments: Sequence[Segment], length: float, where: str) -> tuple[Segment, ...]:
    """Return the segments if they cover 0 to `length` without gap or overlap, else raise InputError."""
    slack = 1e-6 * length
    if not segments:
        raise InputError(f"{where}: no segment is given")
    place = 0.0
    for segment in segments:
        if segment.kind not in SEGMENT_KINDS:
            raise InputError(f"{where}: kind = '{segment.kind}'; {nearest_name(segment.kind, SEGMENT_KINDS)}")
        if abs(segment.start - place) > slack or not segment.end > segment.start:
            raise InputError(
                f"{where}: segment '{segment.name}' runs from {segment.start * 1e3:.6g} to {segment.end * 1e3:.6g} mm; "
                f"it must start where the one before ends ({place * 1e3:.6g} mm) and end behind its start"
            )
        place = segment.end
    if abs(place - length) > slack:
        raise InputError(f"{where}: the segments end at {place * 1e3:.6g} mm, the round at {length * 1e3:.6g} mm")
    return tuple(segments)


def automatic_segments(outer: Contour, cavity: Contour, charge_front: float) -> tuple[Segment, ...]:
    """Cut a casing where its contour or wall changes.

    The part before the charge is the nose and the part behind it the base. In between the cuts are the corners of both
    contours; a piece shorter than 0.3 largest radii joins its neighbour, and a piece within which outer radius or
    wall still changes by more than a quarter is cut into equal lengths.

    Parameters
    ----------
    outer, cavity : the casing's contours (m).
    charge_front : station of the charge's front (m).

    Returns
    -------
    tuple of Segment
        From nose to base, without gaps.
    """
    start, end, length = charge_front, cavity.end, outer.end
    shortest = SHORTEST_WALL_SEGMENT * outer.max_radius
    corners = sorted(s for s in {*outer.stations, *cavity.stations} if start < s < end)
    cuts = [start]
    for corner in corners:
        if corner - cuts[-1] >= shortest and end - corner >= shortest:
            cuts.append(corner)
    cuts.append(end)

    stations: list[float] = [start]
    for low, high in pairwise(cuts):
        places = np.linspace(low, high, 41)
        radius = outer.radius(places)
        wall = radius - cavity.radius(places)
        change = max(np.ptp(radius) / radius.max(), np.ptp(wall) / wall.max())
        pieces = max(1, min(math.ceil(change / LARGEST_CHANGE - 1e-9), int((high - low) / shortest)))
        stations += [float(value) for value in np.linspace(low, high, pieces + 1)[1:]]

    segments = [Segment("nose", 0.0, start, "nose")] if start > 0.0 else []
    for number, (low, high) in enumerate(pairwise(stations), start=1):
        segments.append(Segment(f"wall {number}", low, high, "wall"))
    if end < length:
        segments.append(Segment("base", end, length, "base"))
    return tuple(segments)
