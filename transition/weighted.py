"""Weighted fragments: points of the intensity of the fragments of any casings, as many as are asked for.

A fragment of the mass m is a run of that mass along the space-filling curve of its segment
(`transition.placing`), so its mean position and velocity are differences of sums along the curve. It is
addressed by a point of the unit cube: segment and quantile of the mass by Mott's law; place of the run on the curve;
azimuth, where the round is of revolution; two coordinates of its direction after the scatter; two of the tilt; and the
slopes of the ground that it meets first.

Three quarters of the fragments that leave near the level take their elevation after the scatter from a density that is
high at the level, where distances are decided, and all weigh by the density of the scatter over that of their drawing
(the balance heuristic of Veach and Guibas 1995): no weight is larger than four times that of a fragment as it comes.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import ndtri

from transition.law.mott import masses_at
from transition.motion import STIFFEST, mean_cosine

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.law.mott import Sampler
    from transition.law.segments import CasingSegment, SegmentLaw
    from transition.motion import Isometry
    from transition.points import MaterialPoints
    from transition.settings import BreakUpSettings

    Array = NDArray[np.float64]


SLOPES = 2
"""First impacts on the ground or an obstacle whose facets' slopes are coordinates too."""
COPIES, MOST_COPIES = 8, 32
"""Of a fragment of the mean mass that leaves level and met others, and of the heaviest."""
_COORDINATES = 7 + SLOPES
_LEVEL = math.radians(1.5)  # half-width of the Lorentz curve about the level
_NATURAL = 0.25  # fraction of the fragments that leave near the level with a direction as the scatter has it
_REACH = 3.5  # standard deviations of the scatter from the direction before, within which the level is aimed at
_STEEPEST = math.radians(60.0)  # elevation before the scatter up to which it is
_one_set = threading.Lock()


class WeightedFragments(NamedTuple):
    """Fragments that stand for others; n points."""

    fragments: Fragments
    number: Array
    """(n,) float64: fragments that each stands for."""
    slopes: Array
    """(n, SLOPES) float64: slopes of the facets that it meets first, over the surface's roughness."""

    @classmethod
    def concatenate(cls, parts: Sequence[WeightedFragments]) -> WeightedFragments:
        """All of several sets, one set after the other."""
        from flight.fragments import Fragments

        number, slopes = (np.concatenate([one[field] for one in parts]) for field in (1, 2))
        return cls(Fragments.concatenate([one.fragments for one in parts]), number, slopes)


def unit_points(number: int, points: int) -> Array:
    """Points (n, c) of Sobol's set, scrambled (Matousek 1998) by a seed of its own: a power of two of them."""
    return np.clip(_sobol(_COORDINATES, points, number), 1e-12, 1.0 - 1e-12)


def _sobol(coordinates: int, points: int, seed: int) -> Array:
    from scipy.stats import qmc  # takes its time to load

    with _one_set:  # before SciPy 1.15 the first sets of a process are silently others if threads make them at once
        return np.asarray(qmc.Sobol(coordinates, scramble=True, seed=seed).random_base2(points.bit_length() - 1))


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs of one segment along one curve or several, one after the other.

    Attributes
    ----------
    segment, law, sampler
        The segment, and what its masses follow.
    end : (p + 1,) float64
        Mass along the curve (kg), from 0.
    sums : (p + 1, 6) float64
        Sums of mass times position (kg m) and velocity (kg m/s) along it.
    shift : (3,) float64
        What unit vectors are shifted by on average, so that deviations keep the segment's momentum.
    averaged : bool
        Whether a fragment has the means over its run, or the state of a point in its middle.
    curves : int
        Number of the curves.
    height : (p,) float64
        Heights of the points along the round's axis before the burst (m).
    """

    segment: CasingSegment
    law: SegmentLaw
    sampler: Sampler
    end: Array
    sums: Array
    shift: Array
    averaged: bool
    curves: int
    height: Array

    @classmethod
    def along(
        cls, segment: CasingSegment, law: SegmentLaw, sampler: Sampler,
        curves: Sequence[tuple[MaterialPoints, NDArray[np.int64]]], settings: BreakUpSettings,
    ) -> Runs:  # fmt: skip
        """Sums over a segment's points in the order of each curve."""
        mass = np.concatenate([points.mass[order] for points, order in curves])
        states = np.concatenate([np.hstack([points.position, points.velocity])[order] for points, order in curves])
        height = np.concatenate([points.reference[order, 2] for points, order in curves])
        sums = np.zeros((len(mass) + 1, 6))
        np.cumsum(mass[:, None] * states, axis=0, out=sums[1:])
        return cls(
            segment, law, sampler, np.concatenate([[0.0], np.cumsum(mass)]), sums,
            _shift(mass, states[:, 3:], settings.direction_scatter), settings.velocity == "mean", len(curves), height,
        )  # fmt: skip

    @cached_property
    def _by_height(self) -> tuple[Array, Array]:
        """Fractions of the mass below the points, from the lowest on, and their places along the curves (0 to 1)."""
        order = np.argsort(self.height)
        below = np.cumsum(np.diff(self.end)[order])
        return below / below[-1], (0.5 * (self.end[:-1] + self.end[1:]) / self.end[-1])[order]

    def places(self, quantiles: Array) -> Array:
        """Places along the curves of the points at quantiles (n,) of the mass by height."""
        below, places = self._by_height
        return places[np.minimum(np.searchsorted(below, quantiles), len(places) - 1)]

    def at(self, quantiles: Array, places: Array) -> tuple[Array, Array, Array]:
        """Masses (n,) in kg, numbers per mass of the segment (n,) in 1/kg, and states (n, 6) in m and m/s."""
        mass, per_mass = masses_at(self.law.law, self.sampler, self.law.mass, quantiles)
        total = self.end[-1] / self.curves
        # Shorter than a point a run is within it; a difference of the sums would be lost in round-off.
        shortest = self.end[-1] / (len(self.end) - 1)
        length = np.minimum(np.maximum(mass, shortest) if self.averaged else shortest, total)
        curve, along = np.divmod(places * self.curves, 1.0)
        begin = curve * total + self._begins(along, total, total - length)
        states = self._sums_to(begin + length) - self._sums_to(begin)
        return mass, per_mass, states / np.broadcast_to(length, mass.shape)[:, None]

    def _begins(self, along: Array, total: float, last: Array) -> Array:
        """Where runs begin along a curve of the mass `total` (kg), up to `last`, at fractions `along` of them.

        Drawn fragments follow each other in random order from an end of the curve, a process of renewal: about either
        end there are m2 / (2 m1^2) of them more than evenly spread ones, at m3 / (3 m2) - m2 / (2 m1) from it on
        average, with the moments m1, m2, m3 of a fragment's mass (D. R. Cox, Renewal Theory, 1962, section 4.2).
        """
        one, two, three = (self.law.law.moment(order) for order in (1.0, 2.0, 3.0))
        more, away = min(0.5 * two / (one * total), 0.5), three / (3.0 * two) - 0.5 * two / one
        with np.errstate(divide="ignore"):
            before, behind = (-away * np.log1p(-np.minimum(side / more, 1.0)) for side in (along, 1.0 - along))
        evenly = (along - more) / max(1.0 - 2.0 * more, 1e-12) * last
        begin = np.where(along < more, before, np.where(along > 1.0 - more, last - behind, evenly))
        return np.asarray(np.clip(begin, 0.0, last))

    def _sums_to(self, at: Array) -> Array:
        after = np.clip(np.searchsorted(self.end, at, side="right"), 1, len(self.end) - 1)
        share = (at - self.end[after - 1]) / (self.end[after] - self.end[after - 1])
        return np.asarray(self.sums[after - 1] + share[:, None] * (self.sums[after] - self.sums[after - 1]))


@dataclass(frozen=True, eq=False)
class Casings:
    """The casings of all rounds as runs, and how they are placed.

    Attributes
    ----------
    runs : tuple of Runs
        Of the segments that were computed.
    images : tuple of Isometry
        Their mirrored copies.
    axis, base : (3,) float64 or None
        Of a single round of revolution, whose fragments have every azimuth about its axis through its base (m).
    foot : (3,) float64
        About which the rounds are tilted (m).
    rounds : tuple of str
        Names, the computed rounds first.
    settings : BreakUpSettings
        Choices of the break-up.
    """

    runs: tuple[Runs, ...]
    images: tuple[Isometry, ...]
    axis: Array | None
    base: Array
    foot: Array
    rounds: tuple[str, ...]
    settings: BreakUpSettings

    def at(self, points: Array, motion: Isometry | None = None) -> WeightedFragments:
        """Fragments at points (n, c) of the unit cube, whose measure is the intensity.

        `motion`: of all rounds as one body, from where the casing has them.
        """
        from flight.fragments import Fragments

        count, copies, own = len(self.runs), 1 + len(self.images), 1.0 / len(points)
        masses = np.array([runs.law.mass for runs in self.runs] * copies)
        ends = np.concatenate([[0.0], np.cumsum(masses)]) / masses.sum()
        block = np.minimum(np.searchsorted(ends, points[:, 0], side="right") - 1, len(masses) - 1)
        quantile = (points[:, 0] - ends[block]) / (ends[block + 1] - ends[block])
        mass, number = np.zeros((2, len(points)))
        position, velocity, shift = np.zeros((3, len(points), 3))
        for index, runs in enumerate(self.runs):
            mine = np.flatnonzero(block % count == index)
            mass[mine], per_mass, states = runs.at(quantile[mine], points[mine, 1])
            number[mine] = own * masses.sum() * per_mass
            position[mine], velocity[mine], shift[mine] = states[:, :3], states[:, 3:], runs.shift
        for copy, image in enumerate(self.images, start=1):
            mine = block // count == copy
            position[mine] = image.place(position[mine])
            velocity[mine], shift[mine] = image.vector(velocity[mine]), image.vector(shift[mine])
        if self.axis is not None:
            about = _to_azimuth(position - self.base, self.axis, points[:, 2])
            position, velocity = self.base + _turned(position - self.base, about), _turned(velocity, about)
        if self.settings.tilt > 0.0:
            about = np.zeros((len(points), 3))
            about[:, :2] = self.settings.tilt * ndtri(points[:, 5:7])
            position = self.foot + _turned(position - self.foot, about)
            velocity, shift = _turned(velocity, about), _turned(shift, about)
        if motion is not None:
            position = motion.place(position)
            velocity, shift = motion.vector(velocity), motion.vector(shift)
        speed = np.linalg.norm(velocity, axis=1)
        direction = velocity / np.maximum(speed, 1e-300)[:, None]
        direction, weight = aimed(direction, points[:, 3:5], self.settings.direction_scatter)
        direction = direction + shift
        velocity = direction * (speed / np.linalg.norm(direction, axis=1))[:, None]
        rounds, segments = (
            np.array([getattr(runs.segment, name) for runs in self.runs], dtype=np.int32)[block % count]
            for name in ("round", "index")
        )
        rounds += (block // count * (len(self.rounds) // copies)).astype(np.int32)
        made = Fragments(mass, position, velocity, float(self.settings.shape_factor), rounds, segments, self.rounds)
        return WeightedFragments(made, number * weight, np.ascontiguousarray(ndtri(points[:, 7 : 7 + SLOPES])))


def spread_out(
    fragments: Fragments, groups: NDArray[np.int64], width: float, generator: np.random.Generator
) -> WeightedFragments:
    """Fragments that have met others, each with several elevations about its own.

    The elevations scatter by `width` (rad), and first move towards the mean of their group, whose number is in `groups`
    (n,), by as much as keeps its variance (West 1993). A level one of the mean mass becomes `COPIES`, others a power of
    two in proportion to their mass, since the heavy ones decide distances, and to the density with which they come to
    the level; most are aimed there.
    """
    mass, speed = fragments.mass, np.linalg.norm(fragments.velocity, axis=1)
    heading = np.arctan2(fragments.velocity[:, 1], fragments.velocity[:, 0])
    elevation = np.arcsin(np.clip(fragments.velocity[:, 2] / np.maximum(speed, 1e-300), -1.0, 1.0))
    mean = (np.bincount(groups, mass * elevation) / np.maximum(np.bincount(groups, mass), 1e-300))[groups]
    squared = np.bincount(groups, mass * (elevation - mean) ** 2) / np.maximum(np.bincount(groups, mass), 1e-300)
    spread = (np.abs(mean) < _STEEPEST) & (squared[groups] > width**2) & (width > 0.0)
    narrower = np.sqrt(1.0 - width**2 / np.where(spread, squared[groups], np.inf))
    elevation = mean + narrower * (elevation - mean)
    level = spread & (np.abs(elevation) < _REACH * width + _LEVEL)
    wanted = COPIES * mass / mass.mean() * np.exp(-0.5 * (elevation / max(width, 1e-9)) ** 2)
    times = np.where(level, 2 ** np.round(np.log2(np.clip(wanted, 1.0, MOST_COPIES))).astype(np.int64), 1)
    which = np.repeat(np.arange(len(speed)), times)
    number = np.arange(len(which)) - np.repeat(np.cumsum(times) - times, times)
    points = _sobol(1 + SLOPES, MOST_COPIES, 0)[number] + generator.random((len(speed), 1 + SLOPES))[which]
    points = np.clip(points % 1.0, 1e-12, 1.0 - 1e-12)
    before, scatter = elevation[which], np.where(spread, width, 0.0)[which]
    natural = np.where(level, _NATURAL, 1.0)[which]
    aim = points[:, 0] >= natural
    after = before + scatter * ndtri(np.where(aim, 0.5, points[:, 0] / natural))
    share = (points[:, 0] - natural) / np.maximum(1.0 - natural, 1e-300)
    after, of_aim = _aimed_at_level(before, width, aim, share, after)
    normal = np.exp(-0.5 * ((after - before) / np.maximum(scatter, 1e-300)) ** 2)
    normal /= math.sqrt(2.0 * math.pi) * np.maximum(scatter, 1e-300)
    weight = np.where(level[which], normal / np.maximum(natural * normal + (1.0 - natural) * of_aim, 1e-300), 1.0)
    ahead = np.column_stack([np.cos(heading[which]), np.sin(heading[which])])
    velocity = speed[which, None] * np.column_stack([np.cos(after)[:, None] * ahead, np.sin(after)])
    made = replace(fragments.select(which), velocity=velocity)
    return WeightedFragments(made, weight / times[which], np.ascontiguousarray(ndtri(points[:, 1:])))


def _shift(mass: Array, velocity: Array, scatter: float) -> Array:
    """The mean of the shift by which `transition.motion.scattered` keeps a segment's momentum (3,)."""
    speed = np.linalg.norm(velocity, axis=1)
    weight = mass * speed
    total, before = float(weight.sum()), mass @ velocity
    if not total > 0.0 or scatter == 0.0:
        return np.zeros(3)
    along = (velocity.T * (mass / np.maximum(speed, 1e-300))) @ velocity
    kept, doubled = mean_cosine(scatter), mean_cosine(2.0 * scatter)
    after = 0.5 * (1.0 + doubled) * along + 0.25 * (1.0 - doubled) * (total * np.eye(3) - along)
    values, vectors = np.linalg.eigh(total * np.eye(3) - after)
    possible = values > STIFFEST * total
    missing = vectors[:, possible].T @ ((1.0 - kept) * before)
    return np.asarray(vectors[:, possible] @ (missing / values[possible]))


def aimed(directions: Array, uniform: Array, scatter: float) -> tuple[Array, Array]:
    """Directions (n, 3) after the scatter, more of them near the level, and the weights (n,) that make up for it.

    `directions` (n, 3): unit vectors before; `uniform` (n, 2): coordinates of the drawing, 0 to 1; `scatter`: standard
    deviation about each of two axes (rad).
    """
    if scatter == 0.0:
        return directions, np.ones(len(directions))
    before = np.arcsin(np.clip(directions[:, 2], -1.0, 1.0))
    level = np.abs(before) < min(_STEEPEST, _REACH * scatter + _LEVEL)
    natural = np.where(level, _NATURAL, 1.0)
    aim = uniform[:, 0] >= natural
    heading = np.arctan2(directions[:, 1], directions[:, 0])
    # As it comes: a rotation vector across the direction with two normal components.
    share = np.where(aim, 0.5, uniform[:, 0] / natural)
    angle = scatter * np.sqrt(-2.0 * np.log1p(-share))
    turn = 2.0 * math.pi * uniform[:, 1]
    sine, cosine = np.sin(before), np.cos(before)
    up, side = np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn)
    outward, upward = np.cos(angle) * cosine - up * sine, np.cos(angle) * sine + up * cosine
    elevation = np.arcsin(np.clip(upward, -1.0, 1.0))
    aside = np.arctan2(side, outward)
    # Aimed at the level: its elevation by a Lorentz curve, its azimuth normal about that before.
    share = (uniform[:, 0] - natural) / np.maximum(1.0 - natural, 1e-300)
    elevation, of_aim = _aimed_at_level(before, scatter, aim, share, elevation)
    width = scatter / np.sqrt(np.maximum(np.cos(elevation) * cosine, 1e-9))
    aside = np.where(aim, width * ndtri(uniform[:, 1]), aside)
    made = np.cos(elevation) * np.cos(heading + aside), np.cos(elevation) * np.sin(heading + aside), np.sin(elevation)
    after = np.column_stack(made)
    # Densities per solid angle of both.
    chord = np.linalg.norm(after - directions, axis=1)
    angle = 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
    ratio = np.where(angle > 1e-6, angle / np.maximum(np.sin(angle), 1e-300), 1.0)
    wanted = ratio * np.exp(-0.5 * (angle / scatter) ** 2) / (2.0 * math.pi * scatter**2)
    of_aim *= np.exp(-0.5 * (aside / width) ** 2) / (math.sqrt(2.0 * math.pi) * width * np.cos(elevation))
    return after, np.where(level, wanted / (natural * wanted + (1.0 - natural) * of_aim), 1.0)


def _aimed_at_level(
    before: Array, scatter: float, aim: NDArray[np.bool_], share: Array, others: Array
) -> tuple[Array, Array]:
    """Elevations (n,) by a Lorentz curve about the level at quantiles `share` of it, and its density (1/rad) there.

    It ends at `_REACH` standard deviations (rad) from the elevations before; those that are not aimed are `others`.
    """
    low, high = (np.arctan(np.clip(before + sign * _REACH * scatter, -1.5, 1.5) / _LEVEL) for sign in (-1.0, 1.0))
    elevation = np.where(aim, _LEVEL * np.tan(low + np.clip(share, 0.0, 1.0) * (high - low)), others)
    inside = np.abs(elevation - before) <= _REACH * scatter
    width = np.maximum(high - low, 1e-300)
    return elevation, np.where(inside, _LEVEL / (_LEVEL**2 + elevation**2) / width, 0.0)


def _turned(vectors: Array, about: Array) -> Array:
    """Vectors (n, 3), each turned by a rotation vector `about` (n, 3) of its own (rad)."""
    angle = np.linalg.norm(about, axis=1)[:, None]
    axis = about / np.maximum(angle, 1e-300)
    along = axis * (axis * vectors).sum(axis=1)[:, None]
    return np.asarray(along + np.cos(angle) * (vectors - along) + np.sin(angle) * np.cross(axis, vectors))


def _to_azimuth(place: Array, axis: Array, turn: Array) -> Array:
    """Rotation vectors (n, 3) that bring places (n, 3) to azimuths `turn` (n,) about the axis (in turns)."""
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    first /= np.linalg.norm(first)
    now = np.arctan2(place @ np.cross(axis, first), place @ first)
    return np.asarray(axis * (2.0 * math.pi * turn - now)[:, None])
