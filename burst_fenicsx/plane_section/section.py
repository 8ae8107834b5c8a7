"""Where a section cuts the rounds of a stack, and what cannot be computed in one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.mechanics.detonation import ignition_times, place_ignition
from burst_fenicsx.meshing.placement import frame

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.problem import BurstSettings, RigidPlane, Round

__all__ = ["WORDS", "PlaneSection", "find_section", "widest_station"]

WORDS = "plane section: no axial flow"
"""What every page says of a burst that was computed in a section."""

_PARALLEL = 1e-6  # sine of the angle between directions that are taken to be parallel
_WIDEST = 0.999  # of the largest radius of the charge: what counts as its widest part
_SAMPLES = 4001


@dataclass(frozen=True, eq=False)
class PlaneSection:
    """The plane of a section and where it cuts each round.

    Attributes
    ----------
    origin : (3,) m, where it cuts the axis of the first round.
    directions : (3, 3) unit vectors of the coordinates (u, y, v) in the world: u and v across the first round's axis,
        y against it.
    stations : (rounds,) station of each round in the section, from its nose end (m).
    centres : (rounds, 2) places (u, v) of the rounds' axes (m).
    ignition : (rounds,) times at which a front reaches the section on each round's axis (s).
    """

    origin: NDArray[np.float64]
    directions: NDArray[np.float64]
    stations: NDArray[np.float64]
    centres: NDArray[np.float64]
    ignition: NDArray[np.float64]

    def of_rounds(self, indices: Sequence[int]) -> PlaneSection:
        """The same plane with some of the rounds."""
        chosen = list(indices)
        return replace(
            self, stations=self.stations[chosen], centres=self.centres[chosen], ignition=self.ignition[chosen]
        )

    def world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 3) of the section's coordinates in the world (m)."""
        placed: NDArray[np.float64] = self.origin + points @ self.directions
        return placed

    def planes(self, planes: Sequence[RigidPlane]) -> tuple[RigidPlane, ...]:
        """Rigid planes in the section's coordinates; those along the section are left aside."""
        found = []
        for plane in planes:
            normal = self.directions @ (np.asarray(plane.normal) / np.linalg.norm(plane.normal))
            if abs(normal[1]) > 0.5:
                continue
            point = self.directions @ (np.asarray(plane.point) - self.origin)
            found.append(replace(plane, point=_triple(point), normal=_triple(normal * [1.0, 0.0, 1.0])))
        return tuple(found)


def find_section(rounds: Sequence[Round], settings: BurstSettings) -> tuple[PlaneSection | None, str | None]:
    """The section of a burst, or why it has none, in words."""
    reason = _unfit(rounds, settings)
    if reason is not None:
        return None, reason
    first = rounds[0]
    assert first.profile is not None
    station = settings.section_station
    if station is None:
        station = widest_station(first.profile)
    e1, e2, axis = frame(first.axis)
    origin = np.asarray(first.position, dtype=float) + (first.profile.length - station) * axis
    directions = np.stack([e1, -axis, e2])
    stations, centres, ignition = [], [], []
    for item in rounds:
        assert item.profile is not None
        own = frame(item.axis)[2]
        base = np.asarray(item.position, dtype=float)
        place = item.profile.length - float((origin - base) @ axis) * float(np.sign(own @ axis))
        if not item.profile.charge_front < place < item.profile.charge_end:
            return None, (
                f"the section cuts round '{item.name}' at station {1e3 * place:.4g} mm, where it has no charge; "
                f"its charge lies between {1e3 * item.profile.charge_front:.4g} and "
                f"{1e3 * item.profile.charge_end:.4g} mm"
            )
        across = directions @ (base - origin)
        stations.append(place)
        centres.append(across[[0, 2]])
        points, delays = place_ignition(item, item.profile.length)
        centre = base + (item.profile.length - place) * own
        ignition.append(float(ignition_times(centre[None], points, delays, item.explosive.detonation_velocity)[0]))
    return PlaneSection(origin, directions, np.array(stations), np.array(centres), np.array(ignition)), None


def widest_station(profile: Profile) -> float:
    """Middle of the first stretch over which the charge of a profile is widest (m from the nose end)."""
    stations = np.linspace(profile.charge_front, profile.charge_end, _SAMPLES)
    radius = profile.section(stations).charge_radius
    wide = np.flatnonzero(radius >= _WIDEST * radius.max())
    # The first run of neighbouring stations alone: a charge may have several stretches of that width.
    last = wide[np.flatnonzero(np.diff(wide, append=len(stations) + 1) > 1)[0]]
    return float(0.5 * (stations[wide[0]] + stations[last]))


def _unfit(rounds: Sequence[Round], settings: BurstSettings) -> str | None:
    """Why rounds and settings cannot be cut, before where."""
    axis = frame(rounds[0].axis)[2]
    for item in rounds:
        if item.profile is None:
            return f"round '{item.name}' comes from a mesh file, which has no stations to cut at"
        if item.initiation is not None or not item.ignition:
            return f"round '{item.name}' may be initiated by shock, which a section cannot show"
        if float(np.linalg.norm(np.cross(frame(item.axis)[2], axis))) > _PARALLEL:
            return (
                f"the axis of round '{item.name}' is not parallel to that of '{rounds[0].name}': no common section is "
                "at right angles to both"
            )
    if settings.quadrature != "one_point":
        return "full quadrature belongs to hexahedra"
    for plane in settings.planes:
        along = abs(float(axis @ (np.asarray(plane.normal) / np.linalg.norm(plane.normal))))
        if _PARALLEL < along < 1.0 - _PARALLEL:
            return f"plane '{plane.name}' is neither along the rounds' axes nor at right angles to them"
    return None


def _triple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(value) + 0.0 for value in vector)
    return x, y, z
