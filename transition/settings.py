"""How a casing is broken up: plain data in SI units, checked when it is made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from transition.errors import InputError, nearest
from transition.law.fragment_counts import FragmentCounts
from transition.law.mean_mass_data import FACTOR_SOURCE, FACTORS

__all__ = ["DIRECTION_SCATTER", "MOST_FRAGMENTS", "BreakUpSettings", "Stations"]

Stations = tuple[float, ...]

MOST_FRAGMENTS = 20_000_000
"""Fragments of a realisation; a law that makes more is refused, since they would fill the memory."""

DIRECTION_SCATTER = 0.10471975511966  # 6 degrees
"""Default of `BreakUpSettings.direction_scatter`, from panels of the 75 mm M48 (validation/polar_zones)."""

_DIMENSIONS = (2, 3, "mixed")
_COMPARED = {
    "mott": ("prefactor", "fracture_energy", "critical_strain"),
    "mott_1947": ("fracture_stress", "fracture_gamma", "critical_strain"),
    "gurney_sarmousakis": ("explosive_constant",),
}
"""Inputs at whose defaults each law was compared with published data."""
_CHOICES: dict[str, tuple[str | bool, ...]] = {
    "velocity_source": ("burst", "gurney"),
    "sampler": ("quantile", "graded"),
    "velocity": ("mean", "interpolation"),
    "random_roll": (True, False),
}
_FORMER = {("velocity", "patch"): "'patch' is now called 'mean': the mean over the fragment's material points"}


@dataclass(frozen=True)
class BreakUpSettings:
    """Choices of the break-up. SI units.

    Attributes
    ----------
    dimension : 2, 3 or "mixed"
        Break-up of a thin wall (exponent 1/2), of a thick one (1/3), or a mixture of both by mass.
    mixed_fraction : float
        Part of the mass, 0 to 1, that breaks in three dimensions when `dimension` is "mixed".
    mean_mass : "mott", "mott_1947", "gurney_sarmousakis", float or FragmentCounts
        Law of the mean fragment mass: Eq. 21, Mott's of 1947, that of Gurney and Sarmousakis, or a given mass (kg); or
        pieces counted in a test, to which the mean masses of Eq. 21 are fitted by one scale.
    mean_mass_factor : float or None
        Geometric standard deviation of the mean fragment mass about the truth, 1 or above; it is stated in the summary
        and the report and changes no fragment. None: see `factor`.
    prefactor : float or "paper"
        C of Eq. 21 without dimension; measured shells need 2 to 6. "paper" reads the printed 381.5 as grams.
    fracture_energy : float
        W of Eq. 21 (J/m2).
    critical_strain : float
        Hoop strain at rupture of Eq. 22, 0.5 to 1.0 for steel.
    fracture_stress, fracture_gamma : float
        P_F (Pa) and gamma of Mott's law of 1947; the defaults are his values for a steel with 0.45 % of carbon.
    velocity_source : "burst" or "gurney"
        v0 of Eq. 21: mass-weighted speed of the segment, or Eqs. 23 and 24.
    sampler : "quantile" or "graded"
        Stratified inverse of the law with exact mass, or the paper's grades (Eqs. 26 to 29). End pieces are drawn
        by "quantile" always: grades of fine steps hold none of their few fragments.
    graded_m0, graded_dm : float
        m_0 and the step of Eq. 26 (kg).
    velocity : "mean" or "interpolation"
        Mass-weighted mean of the velocity field over the fragment's material points, with their centre of mass as its
        position (keeps momentum); or velocity and position of one of its points, drawn at random by mass, by the
        shape functions (Eq. 30).
    random_roll : bool
        Turn all fragments of a realisation together by a random angle about the round's axis. For a single round
        that is axisymmetric until it breaks up: on average over the realisations no azimuth then differs from another,
        whatever the mesh. Several rounds, and rounds with images, are never turned.
    direction_scatter : float
        Standard deviation (rad) of the random deviation of each fragment's direction, about each of two axes
        perpendicular to it; see `transition.placement.scatter`.
    tilt : float
        Standard deviation (rad) of the tilt of all fragments of a realisation together, about each of the two
        horizontal axes: how far from plumb the round or the stack may stand.
    shape_factor : float
        k in the presented area A = (m/k)^(2/3) given to every fragment (kg/m3).
    explosive_constant : float or None
        B of Gurney and Sarmousakis (kg^(1/2) m^(-7/6)); None: by the name of the explosive.
    segments : None, stations or a mapping from round name to stations
        Where to cut the casing (m from the nose end); None: the segments of the burst stage.

    Raises
    ------
    InputError
        On a value out of its range; the message names the setting, what was found and what is allowed.
    """

    dimension: Literal[2, 3, "mixed"] = 2
    mixed_fraction: float = 0.5
    mean_mass: Literal["mott", "mott_1947", "gurney_sarmousakis"] | float | FragmentCounts = "mott"
    mean_mass_factor: float | None = None
    prefactor: float | Literal["paper"] = 4.0
    fracture_energy: float = 14.7e4
    critical_strain: float = 0.75
    fracture_stress: float = 804e6
    fracture_gamma: float = 67.0
    velocity_source: Literal["burst", "gurney"] = "burst"
    sampler: Literal["quantile", "graded"] = "quantile"
    graded_m0: float = 0.0
    graded_dm: float = 1.0e-4
    velocity: Literal["mean", "interpolation"] = "mean"
    random_roll: bool = False
    direction_scatter: float = DIRECTION_SCATTER
    tilt: float = 0.0
    shape_factor: float = 2600.0
    explosive_constant: float | None = None
    segments: Stations | Mapping[str, Stations] | None = None

    def __post_init__(self) -> None:
        """Refuse what has no meaning."""
        if isinstance(self.dimension, bool) or self.dimension not in _DIMENSIONS:
            raise InputError(f"break_up.dimension: found {self.dimension!r}; allowed: 2, 3, 'mixed'")
        for name, allowed in _CHOICES.items():
            _one_of(name, getattr(self, name), allowed)
        laws = ("mott", "mott_1947", "gurney_sarmousakis")
        if isinstance(self.mean_mass, str):
            if self.mean_mass not in laws:
                raise InputError(
                    f"break_up.mean_mass: found {self.mean_mass!r}{nearest(self.mean_mass, laws)} or a mass in kg"
                )
        elif not isinstance(self.mean_mass, FragmentCounts):
            _positive("mean_mass", self.mean_mass, "kg")
        if isinstance(self.prefactor, str):
            if self.prefactor != "paper":
                raise InputError(f"break_up.prefactor: found {self.prefactor!r}; allowed: a number or 'paper'")
        else:
            _positive("prefactor", self.prefactor, "no dimension")
        _positive("fracture_energy", self.fracture_energy, "J/m2")
        _positive("fracture_stress", self.fracture_stress, "Pa")
        _positive("fracture_gamma", self.fracture_gamma, "no dimension")
        _check_factor(self.mean_mass_factor)
        _positive("graded_dm", self.graded_dm, "kg")
        _positive("shape_factor", self.shape_factor, "kg/m3")
        if self.explosive_constant is not None:
            _positive("explosive_constant", self.explosive_constant, "kg^(1/2) m^(-7/6)")
        for name, low, high in (
            ("mixed_fraction", 0.0, 1.0),
            ("critical_strain", 0.0, 5.0),
            ("graded_m0", 0.0, math.inf),
            ("direction_scatter", 0.0, 0.5),
            ("tilt", 0.0, 0.5),
        ):
            value = _number(name, getattr(self, name))
            if not low <= value <= high or math.isinf(value):
                raise InputError(f"break_up.{name}: found {value:g}; allowed: {low:g} to {high:g}")
        if isinstance(self.segments, Mapping):
            for name, stations in self.segments.items():
                _rising(f"break_up.segments.{name}", stations)
        elif self.segments is not None:
            _rising("break_up.segments", self.segments)

    @property
    def factor(self) -> tuple[float | None, str]:
        """Factor by which the mean mass is uncertain either way, and where that comes from.

        As given; else that of the law over published data, as long as the inputs are those it was compared with; else
        None, with the reason. Of a test's counts that of one law for all pieces: the segments, once they are known,
        give another standard error (`BreakUp.fit`).
        """
        if self.mean_mass_factor is not None:
            return self.mean_mass_factor, "input"
        if isinstance(self.mean_mass, FragmentCounts):
            from transition.law.count_fit import fit_counts  # needs scipy

            fit = fit_counts(self.mean_mass, self.dimension, self.mixed_fraction)
            return fit.factor, fit.label
        if not isinstance(self.mean_mass, str):
            return None, "the mean mass is given"
        changed = [name for name in _COMPARED[self.mean_mass] if getattr(self, name) != _default(name)]
        if changed:
            return None, f"not compared with published data at this {' and '.join(changed)}"
        return FACTORS[self.mean_mass], FACTOR_SOURCE


def _default(name: str) -> object:
    return BreakUpSettings.__dataclass_fields__[name].default


def _one_of(name: str, found: object, allowed: tuple[str | bool, ...]) -> None:
    if (name, found) in _FORMER:
        raise InputError(f"break_up.{name}: {_FORMER[name, str(found)]}")
    if found not in allowed or type(found) is not type(allowed[0]):
        raise InputError(f"break_up.{name}: found {found!r}{nearest(found, [str(choice) for choice in allowed])}")


def _number(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
        raise InputError(f"break_up.{name}: found {value!r}; a number is needed")
    return float(value)


def _positive(name: str, value: object, unit: str) -> None:
    number = _number(name, value)
    if number <= 0.0 or math.isinf(number):
        raise InputError(f"break_up.{name}: found {number:g}; a number above zero is needed ({unit})")


def _check_factor(value: object) -> None:
    if value is None:
        return
    factor = _number("mean_mass_factor", value)
    if not 1.0 <= factor < math.inf:
        raise InputError(
            f"break_up.mean_mass_factor: found {factor:g}; a factor of 1 or above is needed: the geometric standard "
            "deviation of the mean fragment mass, 1 where it was measured"
        )


def _rising(name: str, stations: Stations) -> None:
    try:
        values = [float(station) for station in stations]
    except (TypeError, ValueError):
        raise InputError(f"{name}: found {stations!r}; stations in m from the nose end are needed") from None
    if not all(math.isfinite(value) and value > 0.0 for value in values):
        raise InputError(f"{name}: found {values}; every station lies above zero (m from the nose end)")
    if any(b <= a for a, b in pairwise(values)):
        raise InputError(f"{name}: found {values}; stations must rise from the nose end to the base")
