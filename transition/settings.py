"""How a casing is broken up: plain data in SI units, checked when it is made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

from fragfield_base.bounds import Bounds, OnlyWith, check_inputs
from fragfield_base.inputs import EnergyPerArea, Mass, NumberOrWord, Quantity
from fragfield_base.units import degrees
from transition.errors import InputError
from transition.law.fragment_counts import FragmentCounts
from transition.law.mean_mass import FACTOR_SOURCE, FACTORS

Stations = tuple[float, ...]

MOST_FRAGMENTS = 20_000_000
"""Fragments of a realisation; a law that makes more is refused, since they would fill the memory."""

DIRECTION_SCATTER = degrees(6.0)
"""Default of `BreakUpSettings.direction_scatter`, from panels of the 75 mm M48 (validation/polar_zones)."""

MeanMassLaw = Literal["mott", "mott_1947", "gurney_sarmousakis"]
MEAN_MASS = Bounds(1e-6, 1e3, "casings break into grams, not into dust or tons", usual=(1e-5, 1.0))
SHAPE_FACTOR = Bounds(50.0, 1e5, "a steel cube has 5200, thin plates some hundred", usual=(1000.0, 6000.0))
_COMPARED = {
    "mott": ("prefactor", "fracture_energy", "critical_strain"),
    "mott_1947": ("fracture_stress", "fracture_gamma", "critical_strain"),
    "gurney_sarmousakis": ("explosive_constant",),
}
"""Inputs at whose defaults each law was compared with published data."""
FILE = "<file>"
"""Stands in `OnlyWith` for a case whose mean masses are fitted to the fragments of a file."""
_MOTT = OnlyWith("mean_mass", ("mott",))
_MOTT_1947 = OnlyWith("mean_mass", ("mott_1947",))
_RUPTURE = OnlyWith("mean_mass", ("mott", "mott_1947", FILE))
_GRADED = OnlyWith("sampler", ("graded",))


@dataclass(frozen=True)
class BreakUpSettings:
    """Mott's law per segment, its sampler, and the velocity that fragments inherit (Eqs. 19-31).

    Raises
    ------
    InputError
        On a value out of its range; the message names the setting, what was found and what is allowed.
    """

    dimension: Literal[2, 3, "mixed"] = 2
    """Two-dimensional break-up of thin walls, three-dimensional, or a mixture of both by mass."""
    mixed_fraction: Annotated[float, Bounds(0.0, 1.0, "a fraction"), OnlyWith("dimension", ("mixed",))] = 0.5
    """Mass fraction that breaks up in three dimensions, for dimension = "mixed"."""
    mean_mass: Annotated[MeanMassLaw | float | FragmentCounts, Quantity("kg", "14.9 g"), MEAN_MASS] = "mott"
    """Law of the mean fragment mass: Eq. 21, Mott's of 1947, that of Gurney and Sarmousakis, or a given mass; or pieces
    counted in a test, to which the mean masses of Eq. 21 are fitted by one scale."""
    mean_mass_factor: Annotated[float | None, Bounds(1.0, 1e3, "a factor, 1 where the mass was measured")] = None
    """Factor by which the mean mass is uncertain, for the report; left out: that of the law over published data."""
    prefactor: Annotated[
        float | Literal["paper"],
        NumberOrWord(("paper",), 4.0),
        Bounds(1e-3, 1e4, "C of Eq. 21 is 4 in SI, and 381.5 as printed", usual=(1.0, 20.0)),
        _MOTT,
    ] = 4.0
    """Factor C of Eq. 21 in SI; "paper" reads the printed 381.5 in grams."""
    fracture_energy: Annotated[
        EnergyPerArea, Bounds(1.0, 1e8, "metals have 1e3 to 1e6 J/m^2", usual=(1e3, 1e6)), _MOTT
    ] = 14.7e4  # fmt: skip
    """Energy W of fracture per area; a case that leaves it out takes that of its casing."""
    critical_strain: Annotated[
        float, Bounds(1e-3, 5.0, "casings rupture at strains near 1", usual=(0.1, 1.5)), _RUPTURE
    ] = 0.75  # fmt: skip
    """Strain at rupture, 0.5 to 1.0 for steel; a case that leaves it out takes that of its casing."""
    fracture_stress: Annotated[
        float,
        Quantity("Pa", "804 MPa", above=0.0),
        Bounds(1e5, 1e12, "stresses at fracture of solids", usual=(1e8, 3e9)),
        _MOTT_1947,
    ] = 804e6
    """True stress at fracture P_F, for mean_mass = "mott_1947"; Mott's for a steel with 0.45 % of carbon. A case that
    leaves it out takes that of its casing."""
    fracture_gamma: Annotated[
        float, Bounds(1e-2, 1e5, "Mott found 67 for steel", usual=(10.0, 300.0)), _MOTT_1947
    ] = 67.0  # fmt: skip
    """Sharpness gamma of the scatter of the strain at fracture, for mean_mass = "mott_1947"; a case that leaves it out
    takes that of its casing."""
    velocity_source: Annotated[Literal["burst", "gurney"], _RUPTURE] = "burst"
    """Speed in Eq. 21: from the burst, or Eqs. 23-24."""
    sampler: Literal["quantile", "graded"] = "quantile"
    """Stratified inverse of the law, closing on the mass; or the paper's grades (Eqs. 26-29). End pieces are drawn by
    "quantile" always."""
    graded_m0: Annotated[
        float, Quantity("kg", "0 g", minimum=0.0), Bounds(0.0, 100.0, "a grade of mass, not a round's"), _GRADED
    ] = 0.0
    """Mass of grade 0, for sampler = "graded"."""
    graded_dm: Annotated[
        Mass,
        Bounds(1e-7, 100.0, "narrower grades would be more than there are fragments", usual=(1e-6, 0.1)),
        _GRADED,
    ] = 1.0e-4
    """Mass between two grades, for sampler = "graded"."""
    velocity: Literal["mean", "interpolation"] = "mean"
    """Mean over the fragment's material points, or the field at a random one of them (Eq. 30)."""
    random_roll: bool = False
    """Turn all fragments of a realisation together by a random angle about the round's axis: for a single round that
    is axisymmetric until it breaks up, so that no azimuth differs from another whatever the mesh. Several rounds, and
    rounds with images, are never turned."""
    explosive_constant: Annotated[
        float | None,
        Bounds(1e-4, 1e4, "published constants lie near 1"),
        OnlyWith("mean_mass", ("gurney_sarmousakis",)),
    ] = None
    """B of Gurney and Sarmousakis (kg^(1/2) m^(-7/6)); left out: by the name of the explosive."""
    direction_scatter: Annotated[
        float,
        Quantity("rad", "6 deg", minimum=0.0, maximum=0.5),
        Bounds(0.0, 0.5, "the panel test of natural fragments shows 4 to 8 degrees", usual=(0.0, 0.21)),
    ] = DIRECTION_SCATTER
    """Random deviation of each fragment's direction from that of its metal: standard deviation about each of two axes
    perpendicular to it."""
    tilt: Annotated[
        float,
        Quantity("rad", "2 deg", minimum=0.0, maximum=0.5),
        Bounds(0.0, 0.5, "what leans farther falls over", usual=(0.0, 0.1)),
    ] = 0.0
    """How far from its attitude the round or the whole stack may lean at random: standard deviation about each of two
    horizontal axes, drawn for every realisation."""
    shape_factor: Annotated[float, Quantity("kg/m^3", "2600 kg/m^3"), SHAPE_FACTOR] = 2600.0
    """k in the presented area A = (m/k)^(2/3) given to every fragment."""
    segments: Stations | Mapping[str, Stations] | None = None
    """Where to cut the casing (m from the nose end), of all rounds or by the name of each; left out: the segments of
    the burst stage."""

    def __post_init__(self) -> None:
        check_inputs(self, "break_up", InputError)
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


def _rising(name: str, stations: Stations) -> None:
    try:
        values = [float(station) for station in stations]
    except (TypeError, ValueError):
        raise InputError(f"{name}: found {stations!r}; stations in m from the nose end are needed") from None
    if not all(math.isfinite(value) and value > 0.0 for value in values):
        raise InputError(f"{name}: found {values}; every station lies above zero (m from the nose end)")
    if any(b <= a for a, b in pairwise(values)):
        raise InputError(f"{name}: found {values}; stations must rise from the nose end to the base")
