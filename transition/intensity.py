"""Expected number of fragments of an axisymmetric round by mass, place and velocity: no draw.

Mott's law of a segment holds all over it alike, up to the mass of the segment, and closes on its mass: the fragments of
mass m are n(m) dm = M f(m) / m dm, with f the law's distribution of the mass. A fragment is a run of that mass along
one of fixed curves over the segment, as it is of a drawn one (`transition.weighted.Runs`), and has the mean
velocity and position of its metal. Directions are those before their random deviation, with the mean of the small shift
by which deviations are kept from changing the momentum of a segment (`transition.motion.scattered`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from transition.weighted import Runs

    Array = NDArray[np.float64]


CURVES, POINTS = 2, 2**16
"""Curves, and points of the casing along each of them: of about equal mass, or eight a ring where that is more."""
END_CURVES = 32
"""Curves over an end of the casing, for single directions: before the nose and behind the base fly a few fragments."""
SAMPLE_CURVES, SAMPLE_POINTS = 1, 2**13
"""The same of a sample of a study."""


class RingFragments(NamedTuple):
    """Points of the intensity (n,): fragments anywhere about the axis. SI units."""

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
class Intensity:
    """The intensity of the fragments of one axisymmetric round, as `flight.hazard.integral.Source`. SI units."""

    segments: tuple[Runs, ...]
    along: Array
    base: Array
    """(3,) float64: its unit axis and the centre of its base plane (m), where the runs lie."""
    axis: Sequence[float]
    """Unit vector from the base to the nose, in the attitude that is wanted."""
    place: Sequence[float]
    """Centre of its base plane (m) there, from which stations count."""
    scatter: float
    """Standard deviation of the directions about each of two axes (rad)."""
    shape_factor: float
    """k of the presented areas (kg/m3)."""

    def at(self, points: Array) -> RingFragments:
        """Fragments at points (n, 2 or more) of the unit cube, whose measure is the intensity.

        The first coordinate is that of segment and mass, the second that of the middle of the run, by its height on the
        round: so the integrand is smooth.
        """
        masses = np.array([segment.law.mass for segment in self.segments])
        ends = np.concatenate([[0.0], np.cumsum(masses)]) / masses.sum()
        which = np.minimum(np.searchsorted(ends, points[:, 0], side="right") - 1, len(masses) - 1)
        mass, per_mass, shift = np.zeros((3, len(points)))
        states = np.zeros((len(points), 6))
        for number, segment in enumerate(self.segments):
            mine = np.flatnonzero(which == number)
            inside = (points[mine, 0] - ends[number]) / (ends[number + 1] - ends[number])
            mass[mine], per_mass[mine], states[mine] = segment.at(inside, segment.places(points[mine, 1]))
            shift[mine] = segment.shift @ self.along
        position, velocity = states[:, :3] - self.base, states[:, 3:]
        station, axial = position @ self.along, velocity @ self.along
        outward = position - station[:, None] * self.along
        radius, speed = np.linalg.norm(outward, axis=1), np.linalg.norm(velocity, axis=1)
        radial = np.copysign(np.sqrt(np.maximum(speed**2 - axial**2, 0.0)), np.einsum("ni,ni->n", velocity, outward))
        moving = np.maximum(speed, 1e-300)
        shifted = axial / moving + shift
        turned = speed / np.maximum(np.hypot(shifted, radial / moving), 1e-300)
        return RingFragments(masses.sum() * per_mass, mass, radius, station, turned * radial / moving, turned * shifted)
