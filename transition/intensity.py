"""Expected number of fragments of an axisymmetric round by mass, ring of the casing and velocity: no draw.

Mott's law of a segment holds in each of its cells alike, up to the mass of the segment, and closes on its mass: the
fragments of mass m are n(m) dm = M f(m) / m dm, with f the law's distribution of the mass. A fragment has the mean
velocity and position of the metal that it is made of (`transition.placement.means`). Directions are those before their
random deviation, with the mean of the small shift by which deviations are kept from changing the momentum of a segment
(`transition.placement.scatter`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from transition.cells.interpolation import interpolated
from transition.cells.meridian import mass_density, node_shares
from transition.law.samplers import masses_at
from transition.placement.means import mean_states
from transition.placement.scatter import STIFFEST, mean_cosine

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.law.samplers import Sampler
    from transition.law.segment_law import SegmentLaw
    from transition.placement.placing import Sheet

    Array = NDArray[np.float64]


class RingFragments(NamedTuple):
    """Points of the intensity (n,): rings of the casing with their fragments. SI units."""

    number: Array
    """Fragments that each point stands for; the mean over points of the unit cube is the number of all."""
    mass: Array
    radius: Array
    station: Array
    """Distance from the axis, and along it from `Intensity.place`."""
    radial: Array
    axial: Array
    """Components of the velocity, before its direction scatters."""


@dataclass(frozen=True, eq=False)
class SegmentIntensity:
    """One segment: its law and sampler, and its rings."""

    law: SegmentLaw
    sampler: Sampler
    mass: Array
    """(m,) float64: of the rings (kg)."""
    corners: NDArray[np.int64]
    """(m, 4) int64: their nodes, of the k below."""
    reference: Array
    """(k, 2) float64: radius and height of the nodes before the burst (m)."""
    state: Array
    """(k, 4) float64: radius and height (m), radial and axial velocity (m/s) of the nodes now."""
    sheet: Sheet
    averaged: bool
    """Whether a fragment has the means over its metal, or the velocity at a point of it."""

    def rings(self, fragments: Array, quantiles: Array, across: Array) -> tuple[Array, Array]:
        """States (n, 4) of fragments about points of the rings, and the density of the mass there over the points'.

        `fragments` (n,): their masses (kg); `quantiles` (n,): of the mass over the rings, ring by ring and along the
        first coordinate of each; `across` (n,): the second coordinate, 0 to 1.
        """
        total = np.concatenate([[0.0], np.cumsum(self.mass)])
        total /= total[-1]
        ring = np.minimum(np.searchsorted(total, quantiles, side="right") - 1, len(self.mass) - 1)
        along = np.clip((quantiles - total[ring]) / (total[ring + 1] - total[ring]), 0.0, 1.0)
        density = mass_density(self.reference[self.corners])
        powers = np.arange(3)
        xi, eta = (2.0 * one[:, None] - 1.0 for one in (along, across))
        here = np.einsum("nij,ni,nj->n", density[ring], xi**powers, eta**powers)
        mean = np.einsum("mij,i,j->m", density, *(np.array([1.0, 0.0, 1.0 / 3.0]),) * 2)
        point, nodes = np.column_stack([along, across]), self.corners[ring]
        if not self.averaged:
            return interpolated(self.state[nodes], point), here / mean[ring]
        levels, states = self._means
        level = np.clip(np.searchsorted(levels, fragments) - 1, 0, len(levels) - 2)
        share = np.clip((fragments - levels[level]) / (levels[level + 1] - levels[level]), 0.0, 1.0)[:, None]
        low, high = (interpolated(states[one[:, None], nodes], point) for one in (level, level + 1))
        return (1.0 - share) * low + share * high, here / mean[ring]

    @cached_property
    def _means(self) -> tuple[Array, Array]:
        """Masses (l,), and states (l, k, 4) of fragments of these masses about the nodes."""
        of_nodes = node_shares(self.reference[self.corners]) * self.mass[:, None] / self.mass.sum()
        share = np.zeros(len(self.reference))
        np.add.at(share, self.corners, of_nodes)
        levels, states = mean_states(self.sheet, self.reference, share, self.state)
        return levels * self.law.mass, states


@dataclass(frozen=True, eq=False)
class Intensity:
    """The intensity of the fragments of one axisymmetric round, as `flight.hazard.integral.Source`. SI units."""

    segments: tuple[SegmentIntensity, ...]
    axis: tuple[float, float, float]
    """Unit vector from the base to the nose."""
    place: tuple[float, float, float]
    """Centre of its base plane (m), from which stations count."""
    scatter: float
    """Standard deviation of the directions about each of two axes (rad)."""
    shape_factor: float
    """k of the presented areas (kg/m3)."""

    @property
    def number(self) -> float:
        """Expected number of fragments by Mott's law."""
        return float(sum(segment.law.n0 for segment in self.segments))

    def at(self, points: Array) -> RingFragments:
        """Rings and masses at points (n, 3) of the unit cube, whose measure is the intensity.

        The first coordinate is that of segment and mass, the other two are those of place.
        """
        of_segment = np.array([segment.law.mass for segment in self.segments])
        ends = np.concatenate([[0.0], np.cumsum(of_segment)]) / of_segment.sum()
        which = np.minimum(np.searchsorted(ends, points[:, 0], side="right") - 1, len(of_segment) - 1)
        made = np.zeros((len(RingFragments._fields), len(points)))
        for number, segment in enumerate(self.segments):
            mine = which == number
            inside = (points[mine, 0] - ends[number]) / (ends[number + 1] - ends[number])
            mass, per_mass = masses_at(segment.law.law, segment.sampler, segment.law.mass, inside)
            state, density = segment.rings(mass, points[mine, 1], points[mine, 2])
            radius, station, radial, axial = state.T
            axial, radial = self._shifted(segment, axial, radial)
            made[:, mine] = of_segment.sum() * per_mass * density, mass, radius, station, radial, axial
        return RingFragments(*made)

    def _shifted(self, segment: SegmentIntensity, axial: Array, radial: Array) -> tuple[Array, Array]:
        """Velocities in the mean direction after what keeps the momentum along the axis; speeds stay."""
        speed = np.hypot(axial, radial)
        moving = np.maximum(speed, 1e-300)
        along = axial / moving + self._shift(segment)
        turned = speed / np.maximum(np.hypot(along, radial / moving), 1e-300)
        return turned * along, turned * radial / moving

    def _shift(self, segment: SegmentIntensity) -> float:
        """Shift of all unit vectors along the axis that makes up for the momentum lost to the deviations."""
        velocity = segment.state[segment.corners][..., 2:].mean(axis=1)
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        weight = segment.mass * speed
        along = np.divide(velocity[:, 1], speed, out=np.zeros_like(speed), where=speed > 0.0)
        kept, doubled = mean_cosine(self.scatter), mean_cosine(2.0 * self.scatter)
        squared = 0.5 * (1.0 + doubled) * along**2 + 0.25 * (1.0 - doubled) * (1.0 - along**2)
        stiffness = float(weight @ (1.0 - squared))
        if not stiffness > STIFFEST * float(weight.sum()):
            return 0.0
        return (1.0 - kept) * float(weight @ along) / stiffness
