"""Directions of flight by mass: the fragments' against those of the cells they were made from."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from transition.cells.interpolation import interpolated
from transition.cells.meridian import mass_density

if TYPE_CHECKING:
    from numpy.typing import NDArray


Shares = tuple["NDArray[np.float64]", "NDArray[np.float64]"]

_BIN = 5.0
_SAMPLES = 4  # along each side of a cell: columns of cells may be as wide as a bin
_CONES, _TURNS = 1440, 360  # polar angles and azimuths that the directions of rings are gathered at


class Directions(NamedTuple):
    """Shares of the mass by direction, of a round's fragments and of its casing cells."""

    polar_deg: NDArray[np.float64]
    """(36,) float64: centres of the bins of the angle between velocity and the round's axis (degrees; 0 beyond the
    nose)."""
    polar_fragments: NDArray[np.float64]
    polar_cells: NDArray[np.float64]
    """(36,) float64: shares of the mass in them."""
    azimuth_deg: NDArray[np.float64]
    """(72,) float64: bins of the horizontal direction from +x counter-clockwise, named by their centre (degrees)."""
    azimuth_fragments: NDArray[np.float64]
    azimuth_cells: NDArray[np.float64]
    """(72,) float64: shares of the mass in them; what flies straight up or down or stands still has none."""


def cell_shares(
    cell_mass: NDArray[np.float64], node_velocity: NDArray[np.float64], axis: tuple[float, float, float]
) -> Shares:
    """Shares of a casing's mass by polar angle (36,) and azimuth (72,), with the velocity's change inside the cells.

    `cell_mass` (m,), `node_velocity` (m, 8, 3): casing cells and the velocities of their nodes (kg, m/s). Each cell is
    taken at the middles of 4 x 4 x 4 equal parts: one velocity a cell would show the columns of cells instead of the
    velocity field; `axis`: axis of the round, from which polar angles count.
    """
    polar, azimuth = np.zeros(36), np.zeros(72)
    for index in np.ndindex((_SAMPLES,) * 3):
        point = np.broadcast_to((np.array(index) + 0.5) / _SAMPLES, (len(cell_mass), 3))
        found = _shares(cell_mass, interpolated(node_velocity, point), np.asarray(axis))
        polar += found[0] / _SAMPLES**3
        azimuth += found[1] / _SAMPLES**3
    return polar, azimuth


def ring_shares(
    ring_mass: NDArray[np.float64],
    reference: NDArray[np.float64],
    node_velocity: NDArray[np.float64],
    axis: tuple[float, float, float],
) -> Shares:
    """The same of an axisymmetric casing: its rings fly on cones around the round's axis.

    `ring_mass` (m,): masses of the rings (kg); `reference` (m, 4, 2): radius and height of the nodes before the burst
    (m), by which the mass is distributed; `node_velocity` (m, 4, 2): radial and axial velocity of the nodes now (m/s).
    Each ring is taken at the middles of 4 x 4 equal parts of its reference square; by azimuth the mass is gathered on
    cones an eighth of a degree apart; `axis`: axis of the round.
    """
    density = mass_density(reference)
    middles = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    powers = (2.0 * middles[:, None] - 1.0) ** np.arange(3)
    weight = np.einsum("mij,ai,bj->mab", density, powers, powers)
    weight *= (ring_mass / weight.sum(axis=(1, 2)))[:, None, None]
    polar, cones = np.zeros(36), np.zeros(_CONES)
    for a, b in np.ndindex(_SAMPLES, _SAMPLES):
        velocity = interpolated(node_velocity, np.broadcast_to([middles[a], middles[b]], (len(ring_mass), 2)))
        moving = np.hypot(velocity[:, 0], velocity[:, 1]) > 0.0
        angle = np.degrees(np.arctan2(np.abs(velocity[moving, 0]), velocity[moving, 1]))
        mass = weight[moving, a, b]
        polar += np.bincount(np.minimum(angle // _BIN, 180.0 / _BIN - 1).astype(int), mass, minlength=36)
        cones += np.bincount(np.minimum(angle * (_CONES / 180.0), _CONES - 1).astype(int), mass, minlength=_CONES)
    used = np.flatnonzero(cones)
    angle = np.radians((used + 0.5) * 180.0 / _CONES)
    unit = np.asarray(axis) / np.linalg.norm(axis)
    # For an upright axis the turns begin at +x, so that none lies on a bound between sectors.
    start = np.eye(3)[0 if abs(unit[0]) < 0.9 else 1]
    first = start - (start @ unit) * unit
    first /= np.linalg.norm(first)
    turn = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
    circle = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * np.cross(unit, first)
    direction = np.sin(angle)[:, None, None] * circle + np.cos(angle)[:, None, None] * unit
    each = np.repeat(cones[used] / _TURNS, _TURNS)
    return polar / ring_mass.sum(), _shares(each, direction.reshape(-1, 3), unit)[1] * (cones.sum() / ring_mass.sum())


def compare_directions(
    fragment_mass: NDArray[np.float64], fragment_velocity: NDArray[np.float64], cells: Shares,
    axis: tuple[float, float, float],
) -> Directions:  # fmt: skip
    """Directions of a round's fragments beside those of its casing.

    `fragment_mass` (n,), `fragment_velocity` (n, 3): as they fly (kg, m/s); `cells`: `cell_shares` or `ring_shares` of
    the casing; `axis`: axis of the round.
    """
    polar, azimuth = _shares(fragment_mass, fragment_velocity, np.asarray(axis))
    return Directions(
        np.arange(0.5 * _BIN, 180.0, _BIN), polar, cells[0], np.arange(0.0, 360.0, _BIN), azimuth, cells[1]
    )


def _shares(mass: NDArray[np.float64], velocity: NDArray[np.float64], axis: NDArray[np.float64]) -> Shares:
    speed = np.linalg.norm(velocity, axis=1)
    moving = speed > 0.0
    cosine = velocity[moving] @ axis / (speed[moving] * np.linalg.norm(axis))
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    polar = np.bincount(np.minimum(angle // _BIN, 180.0 / _BIN - 1).astype(int), mass[moving], minlength=36)
    level = np.hypot(velocity[:, 0], velocity[:, 1]) > 1e-9 * speed
    bearing = np.degrees(np.arctan2(velocity[level, 1], velocity[level, 0]))
    azimuth = np.bincount(np.round(bearing / _BIN).astype(int) % 72, mass[level], minlength=72)
    return polar / mass.sum(), azimuth / mass.sum()
