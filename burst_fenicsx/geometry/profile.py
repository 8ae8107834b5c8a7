"""The profile of a cased charge: casing, charge and fuze as bodies of revolution with exact volumes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from burst_fenicsx.data import nearest_name
from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry.segments import Segment, automatic_segments, check_segments

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from burst_fenicsx.geometry.contour import Contour


FUZE_DENSITIES = (100.0, 9000.0)
"""Mean density that a fuze in its cavity may have (kg/m3): lighter than cork, or denser than brass, none is."""
SAMPLES = 4001  # stations at which the wall is tested, besides the corners


@dataclass(frozen=True)
class Fuze:
    """What fills the cavity before the charge: an inert body of `mass` (kg), or nothing ("void", mass 0)."""

    fill: Literal["inert", "void"]
    mass: float = 0.0


@dataclass(frozen=True)
class PartVolumes:
    """Exact volumes between two stations (m3); `void` is the part of the cavity that stays empty."""

    casing: float
    charge: float
    fuze: float
    void: float


@dataclass(frozen=True)
class CrossSection:
    """Radii across the axis (m); `inner_radius` is 0 where the casing is solid, `charge_radius` 0 without charge."""

    outer_radius: NDArray[np.float64]
    inner_radius: NDArray[np.float64]
    wall: NDArray[np.float64]
    charge_radius: NDArray[np.float64]


@dataclass(frozen=True)
class Profile:
    """A cased charge of revolution. Stations run from the nose end (0) to the base (`length`), SI units.

    Parameters
    ----------
    name : name, for messages and files.
    outer : outside of the casing; starts at station 0.
    cavity : inside of the casing, within the outer contour; where it does not reach an end, the casing is solid there.
    charge_front : station of the charge's front (m): the charge fills the cavity from its base end to here.
    fuze : optional, what fills the cavity before the charge; needed exactly when the charge does not fill the cavity.
    segments : axial segments of the casing; empty: cut automatically (see `automatic_segments`).
    source, notes : where the numbers come from.

    Raises
    ------
    InputError
        The contours cross, the cavity or the charge front lies outside, the fuze is missing or superfluous, or the
        segments leave gaps.
    """

    name: str
    outer: Contour
    cavity: Contour
    charge_front: float
    fuze: Fuze | None = None
    segments: tuple[Segment, ...] = ()
    source: str = ""
    notes: str = ""

    def __post_init__(self) -> None:
        outer, cavity = self.outer, self.cavity
        if outer.start != 0.0:
            raise InputError(
                f"{outer.name}: the first station is {outer.start * 1e3:.6g} mm; the nose end must be station 0"
            )
        if cavity.start < 0.0 or cavity.end > outer.end * (1.0 + 1e-12):
            raise InputError(
                f"{cavity.name}: runs from {cavity.start * 1e3:.6g} to {cavity.end * 1e3:.6g} mm; "
                f"it must lie within the outer contour, 0 to {outer.end * 1e3:.6g} mm"
            )
        self._check_wall()
        self._check_charge()
        if self.segments:
            check_segments(self.segments, self.length, f"{self.name} [[segment]]")
        else:
            object.__setattr__(self, "segments", automatic_segments(outer, cavity, self.charge_front))

    def _check_wall(self) -> None:
        corners = [s for s in self.outer.stations if self.cavity.start < s < self.cavity.end]
        stations = np.concatenate(
            [np.linspace(self.cavity.start, self.cavity.end, SAMPLES), self.cavity.stations, corners]
        )
        wall = self.outer.radius(stations) - self.cavity.radius(stations)
        worst = int(np.argmin(wall))
        if wall[worst] <= 0.0:
            where = f"{stations[worst] * 1e3:.6g} mm"
            if wall[worst] < 0.0:
                raise InputError(
                    f"{self.name}: the cavity crosses the outer contour; worst at station {where}, where the wall is "
                    f"{wall[worst] * 1e3:.4g} mm; it must be positive everywhere"
                )
            raise InputError(
                f"{self.name}: the cavity touches the outer contour at station {where}; the wall must be positive"
            )

    def _check_charge(self) -> None:
        cavity = self.cavity
        if not cavity.start <= self.charge_front < cavity.end:
            raise InputError(
                f"{self.name} [charge]: front = {self.charge_front * 1e3:.6g} mm lies outside the cavity; allowed: "
                f"{cavity.start * 1e3:.6g} (full) to below {cavity.end * 1e3:.6g} mm"
            )
        if self.charge_front > cavity.start and self.fuze is None:
            raise InputError(
                f"{self.name} [fuze]: missing; the cavity before the charge ({cavity.start * 1e3:.6g} to "
                f'{self.charge_front * 1e3:.6g} mm) needs fill = "inert" with a mass, or fill = "void"'
            )
        if self.charge_front == cavity.start and self.fuze is not None:
            raise InputError(f"{self.name} [fuze]: the charge fills the whole cavity; there is no room for a fuze")
        if self.fuze is not None:
            if self.fuze.fill not in ("inert", "void"):
                raise InputError(
                    f"{self.name} [fuze]: fill = '{self.fuze.fill}'; {nearest_name(self.fuze.fill, ('inert', 'void'))}"
                )
            if self.fuze.fill == "inert" and not self.fuze.mass > 0.0:
                raise InputError(
                    f"{self.name} [fuze]: mass = {self.fuze.mass:g}; an inert fuze needs a mass above 0 (kg)"
                )
            if self.fuze.fill == "void" and self.fuze.mass != 0.0:
                raise InputError(
                    f'{self.name} [fuze]: mass = {self.fuze.mass:g}; a void has no mass (use fill = "inert")'
                )
            self._check_fuze_density()

    def _check_fuze_density(self) -> None:
        """Refuse a fuze that its volume cannot hold; the part in the cavity is meant, not what stands before it."""
        low, high = FUZE_DENSITIES
        if self.fuze is None or self.fuze.fill != "inert" or low <= self.fuze_density <= high:
            return
        volume = self.fuze_volume
        raise InputError(
            f"{self.name} [fuze]: mass = {self.fuze.mass:g} kg in the {1e6 * volume:.4g} cm3 of cavity before the "
            "charge "
            f"is {1e-3 * self.fuze_density:.3g} g/cm3; allowed: {1e-3 * low:g} to {1e-3 * high:g} g/cm3, "
            f"{low * volume:.3g} to {high * volume:.3g} kg: the mass of what fills that cavity alone, without "
            "what stands "
            "before the body"
        )

    @property
    def length(self) -> float:
        """Length from nose end to base (m)."""
        return self.outer.end

    @property
    def max_radius(self) -> float:
        """Largest outer radius (m)."""
        return self.outer.max_radius

    @property
    def charge_end(self) -> float:
        """Station of the charge's rear end, which is the cavity's (m)."""
        return self.cavity.end

    @property
    def casing_volume(self) -> float:
        """Exact volume of the casing (m3)."""
        return self.volumes().casing

    @property
    def charge_volume(self) -> float:
        """Exact volume of the charge (m3)."""
        return self.volumes().charge

    @property
    def fuze_volume(self) -> float:
        """Exact volume of the inert fuze (m3); 0 where the front is void or full."""
        return self.volumes().fuze

    @property
    def fuze_mass(self) -> float:
        """Mass of the inert fuze (kg)."""
        return self.fuze.mass if self.fuze is not None else 0.0

    @property
    def fuze_density(self) -> float:
        """Mass of the inert fuze over its volume (kg/m3); 0 without one."""
        return self.fuze_mass / self.fuze_volume if self.fuze_mass > 0.0 else 0.0

    def volumes(self, start: float = 0.0, end: float | None = None) -> PartVolumes:
        """Return the exact volumes of the parts between two stations (the whole round by default)."""
        return _volumes(self, start, self.length if end is None else end)

    def section(self, station: ArrayLike) -> CrossSection:
        """Return radii and wall at stations.

        Parameters
        ----------
        station : stations (m) within the round, any shape.

        Returns
        -------
        CrossSection
            Outer, inner and charge radius and wall (m), each of that shape. Where a section is solid the wall is
            the outer radius.

        Raises
        ------
        InputError
            A station lies outside the round.
        """
        place = np.asarray(station, dtype=np.float64)
        outer = self.outer.radius(place)
        hollow = (place >= self.cavity.start) & (place <= self.cavity.end)
        inner = np.where(hollow, self.cavity.radius(np.clip(place, self.cavity.start, self.cavity.end)), 0.0)
        charge = np.where(place >= self.charge_front, inner, 0.0)
        return CrossSection(outer, inner, outer - inner, charge)


@lru_cache(maxsize=256)  # a case asks for each of its segments a dozen times
def _volumes(profile: Profile, start: float, end: float) -> PartVolumes:
    cavity = profile.cavity.volume(start, end)
    charge = profile.cavity.volume(max(start, profile.charge_front), end) if end > profile.charge_front else 0.0
    front = cavity - charge if start < profile.charge_front else 0.0
    inert = profile.fuze is not None and profile.fuze.fill == "inert"
    return PartVolumes(
        casing=profile.outer.volume(start, end) - cavity,
        charge=charge,
        fuze=front if inert else 0.0,
        void=0.0 if inert else front,
    )
