"""The table [break_up]: how the casing becomes fragments."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from fragfield.case.tables.base import Table
from fragfield.case.units.compound import NumberOrWord, QuantityOrFile
from fragfield.case.units.kinds import EnergyPerArea, Length, Mass
from fragfield.case.units.quantities import Quantity, degrees

__all__ = ["BreakUpTable", "FragmentCountsTable"]

_MEAN_MASS = QuantityOrFile(
    "kg", "14.9 g", above=0.0, words=("mott", "mott_1947", "gurney_sarmousakis"), holds="counted fragments"
)


def _renamed(value: object) -> object:
    if value == "patch":
        raise PydanticCustomError("renamed", 'Now called "mean": the mean over a fragment\'s material points')
    return value


class FragmentCountsTable(Table):
    """Fragments counted in a test, by mass: what the file that `mean_mass` names holds. The program fills it in."""

    source: str = Field(min_length=1)
    """The file."""
    edges: list[Annotated[float, Quantity("kg", "0.5 g", minimum=0.0)]] = Field(min_length=1)
    """Rising edges of the groups of mass: as many as groups where the last has no upper end, or one more."""
    number: list[float] = Field(min_length=1)
    """Pieces of each group, of all rounds together."""
    mass: list[Annotated[float, Quantity("kg", "12 g", minimum=0.0)]] | None = None
    """Mass of the pieces of each group, where they were weighed."""
    rounds: float = Field(default=1.0, gt=0.0)
    """Rounds that the pieces come from; below 1: the part of one round whose fragments were caught."""
    scale: float = Field(default=1.0, gt=0.0)
    """Factor on the fitted mean masses, for studies of their uncertainty."""


class BreakUpTable(Table):
    """Mott's law per segment, its sampler, and the velocity that fragments inherit (Eqs. 19-31)."""

    realisations: int = Field(default=32, ge=1, le=100_000)
    """Fewest times that the casings are broken up at random; `fly` adds more up to hazard.max_realisations."""
    dimension: Literal[2, 3, "mixed"] = 2
    """Two-dimensional break-up of thin walls, three-dimensional, or a mixture of both by mass."""
    mixed_fraction: float = Field(default=0.5, ge=0.0, le=1.0)
    """Mass fraction that breaks up in three dimensions, for dimension = "mixed"."""
    mean_mass: Annotated[float | str, _MEAN_MASS] = "mott"
    """Law of the mean fragment mass (Eq. 21, Mott's of 1947, or Gurney and Sarmousakis), the mean itself, or a .csv
    file of the fragments that a test of this round counted, to which the mean masses of Eq. 21 are fitted."""
    counts: FragmentCountsTable | None = None
    """What the file of `mean_mass` holds; the program fills it in."""
    mean_mass_factor: float | None = Field(default=None, ge=1.0)
    """Factor by which the mean mass is uncertain, for the report; left out: that of the law over published data."""
    prefactor: Annotated[float | str, NumberOrWord(("paper",), 4.0)] = 4.0
    """Factor C of Eq. 21 in SI; "paper" reads the printed 381.5 in grams."""
    fracture_energy: EnergyPerArea = 14.7e4
    """Energy W of fracture per area."""
    critical_strain: float = Field(default=0.75, gt=0.0)
    """Strain at rupture; 0.5 to 1.0 for steel."""
    fracture_stress: Annotated[float, Quantity("Pa", "804 MPa", above=0.0)] = 804e6
    """True stress at fracture P_F, for mean_mass = "mott_1947"."""
    fracture_gamma: float = Field(default=67.0, gt=0.0)
    """Sharpness gamma of the scatter of the strain at fracture, for mean_mass = "mott_1947"."""
    velocity_source: Literal["burst", "gurney"] = "burst"
    """Speed in Eq. 21: from the burst, or Eqs. 23-24."""
    sampler: Literal["quantile", "graded"] = "quantile"
    """Stratified inverse of the law, closing on the mass; or the paper's grades (Eqs. 26-29)."""
    graded_m0: Annotated[float, Quantity("kg", "0 g", minimum=0.0)] = 0.0
    """Mass of grade 0, for sampler = "graded"."""
    graded_dm: Mass = 1e-4
    """Mass between two grades, for sampler = "graded"."""
    velocity: Annotated[Literal["mean", "interpolation"], BeforeValidator(_renamed)] = "mean"
    """Mean over the fragment's material points, or the field at a random one of them (Eq. 30)."""
    explosive_constant: float | None = Field(default=None, gt=0.0)
    """B of Gurney and Sarmousakis (kg^(1/2) m^(-7/6)); left out: by the name of the explosive."""
    direction_scatter: Annotated[float, Quantity("rad", "6 deg", minimum=0.0, maximum=0.5)] = degrees(6.0)
    """Random deviation of each fragment's direction from that of its metal: standard deviation about each of two axes
    perpendicular to it."""
    tilt: Annotated[float, Quantity("rad", "2 deg", minimum=0.0, maximum=0.5)] = 0.0
    """How far from its attitude the round or the whole stack may lean at random: standard deviation about each of two
    horizontal axes, drawn for every realisation."""
    segments: list[Length] | None = None
    """Stations at which every casing is cut into segments; left out: the segments of its profile."""

    @property
    def mean_mass_is_file(self) -> bool:
        """Whether the mean mass is fitted to the fragments of a file."""
        return _MEAN_MASS.is_file(self.mean_mass)
