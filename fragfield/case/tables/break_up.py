"""The table [break_up]: how the casing becomes fragments."""

from __future__ import annotations

from typing import Annotated, ClassVar, get_args

from pydantic import Field

from fragfield.case.tables.base import Table
from fragfield_base.inputs import Bounds, Entries, Length, Quantity, QuantityOrFile
from transition.settings import MEAN_MASS, BreakUpSettings, MeanMassLaw

__all__ = ["BreakUpTable", "FragmentCountsTable"]

_MEAN_MASS = QuantityOrFile("kg", "14.9 g", above=0.0, words=get_args(MeanMassLaw), holds="counted fragments")
_GROUPS = Entries(10000, "groups of mass")


class FragmentCountsTable(Table):
    """Fragments counted in a test, by mass: what the file that `mean_mass` names holds. The program fills it in."""

    source: str = Field(min_length=1)
    """The file."""
    edges: Annotated[
        list[Annotated[float, Quantity("kg", "0.5 g", minimum=0.0)]],
        Bounds(0.0, 1e4, "a fragment, not a round"),
        _GROUPS,
    ] = Field(min_length=1)
    """Rising edges of the groups of mass: as many as groups where the last has no upper end, or one more."""
    number: Annotated[list[float], Bounds(0.0, 1e9, "pieces that somebody counted"), _GROUPS] = Field(min_length=1)
    """Pieces of each group, of all rounds together."""
    mass: Annotated[
        list[Annotated[float, Quantity("kg", "12 g", minimum=0.0)]] | None,
        Bounds(0.0, 1e5, "fragments of some rounds"),
        _GROUPS,
    ] = None
    """Mass of the pieces of each group, where they were weighed."""
    rounds: Annotated[float, Bounds(1e-4, 1e4, "rounds of a test, or the part of one")] = 1.0
    """Rounds that the pieces come from; below 1: the part of one round whose fragments were caught."""
    scale: Annotated[float, Bounds(1e-3, 1e3, "a factor of uncertainty")] = 1.0
    """Factor on the fitted mean masses, for studies of their uncertainty."""


class BreakUpTable(Table, BreakUpSettings):
    """Mott's law per segment, its sampler, and the velocity that fragments inherit (Eqs. 19-31)."""

    NO_KEYS: ClassVar = ("random_roll", "shape_factor")
    ORDER: ClassVar = ("realisations", "dimension", "mixed_fraction", "mean_mass", "counts")
    realisations: int = Field(default=32, ge=1, le=100_000)
    """Fewest times that the casings are broken up at random; `fly` adds more up to hazard.max_realisations."""
    mean_mass: Annotated[float | str, _MEAN_MASS, MEAN_MASS] = BreakUpSettings.mean_mass  # type: ignore[assignment]
    """Law of the mean fragment mass (Eq. 21, Mott's of 1947, or Gurney and Sarmousakis), the mean itself, or a .csv
    file of the fragments that a test of this round counted, to which the mean masses of Eq. 21 are fitted."""
    counts: FragmentCountsTable | None = None
    """What the file of `mean_mass` holds; the program fills it in."""
    segments: Annotated[list[Length] | None, Entries(1000, "segments of a casing")] = None  # type: ignore[assignment]
    """Stations at which every casing is cut into segments; left out: the segments of its profile."""

    @property
    def mean_mass_is_file(self) -> bool:
        """Whether the mean mass is fitted to the fragments of a file."""
        return _MEAN_MASS.is_file(self.mean_mass)
