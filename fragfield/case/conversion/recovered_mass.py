"""Mass of an arena table against the casing of the round that it stands for: the whole round is to be flown."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from fragfield.case.conversion.placing import are_alike, masses_of
from fragfield.errors import InputError

if TYPE_CHECKING:
    from flight.arena import ArenaTable
    from fragfield.case.schema import CaseTable


_WARNED = 0.9
_ALLOWED = (0.5, 1.1)


@dataclass(frozen=True)
class RecoveredMass:
    """Mass that an arena test recovered, and that of the casing."""

    mass: float
    """Of the table, one round (kg), as it was read."""
    casing_mass: float | None
    """Of the casing of a round of the case (kg); None where the case has no rounds."""
    arena_mass: str
    """How the case has the table flown: `flight.arena_mass`."""

    @property
    def fraction(self) -> float | None:
        """Part of the casing that was recovered; None where the case has no rounds."""
        return None if self.casing_mass is None else self.mass / self.casing_mass

    @property
    def factor(self) -> float:
        """Factor on the numbers of the table with which it is flown."""
        return 1.0 if self.fraction is None or self.arena_mass != "scaled" else 1.0 / self.fraction

    @property
    def words(self) -> str:
        """What was recovered and how it is flown, for terminal, log and report."""
        if self.fraction is None:
            return (
                f"the arena table holds {self.mass:.4g} kg of fragments; without a table [[round]] the mass of "
                "the casing "
                "is not known, nor the fraction of it that was recovered"
            )
        held = (
            f"the arena table holds {self.mass:.4g} kg of fragments, {100.0 * self.fraction:.3g} % of the "
            f"{self.casing_mass:.4g} kg of the casing"
        )
        if self.arena_mass == "scaled":
            return f"{held}; its numbers are flown times {self.factor:.4g}, scaled to the casing"
        return held

    @property
    def warning(self) -> str:
        """What is doubtful in it; empty where all is well."""
        if self.fraction is None or _WARNED <= self.fraction <= _ALLOWED[1]:
            return ""
        if self.arena_mass == "scaled":
            return f"{self.words}: what was not recovered is taken to have flown as what was"
        if self.fraction < _WARNED:
            return (
                f"{self.words}: fragments that were not recovered are not flown, so that densities and distances "
                "are too "
                'small; flight.arena_mass = "scaled" scales the numbers to the casing'
            )
        return f"{self.words}: more than the round has"

    def summary(self) -> dict[str, Any]:
        """As summary.json has it, `flight.recovered`."""
        return {**asdict(self), "fraction": self.fraction, "factor": self.factor, "words": self.words}


def recovered_mass(case: CaseTable, table: ArenaTable, name: str) -> RecoveredMass:
    """Compare an arena table, from a file `name`, with the casing of the resolved case's rounds.

    Raises InputError: the rounds of the case differ, so that one table cannot stand for all; a fragment is heavier than
    the casing; or the mass is below 50 % or above 110 % of the casing's and `flight.arena_mass` does not say that this
    is meant.
    """
    meant = case.flight.arena_mass
    if not table.total_mass > 0.0:
        raise InputError(f"{name}: found no fragment; allowed: an arena table of a round that burst")
    if not case.round:
        if meant == "scaled":
            raise InputError(
                f'{name}: flight.arena_mass: found "scaled" without a table [[round]], so that the mass of the '
                "casing is "
                'not known; allowed: "checked" or "as_given", or a round with its profile and casing'
            )
        return RecoveredMass(table.total_mass, None, meant)
    if not are_alike(case):
        raise InputError(
            f"{name}: an arena table holds the fragments of one kind of round, and those of the case differ; allowed: "
            "rounds alike"
        )
    casing = masses_of(case.round[0]).casing
    heaviest = float(table.mass[table.number > 0.0].max(initial=0.0))
    if heaviest > _ALLOWED[1] * casing:
        raise InputError(
            f"{name}: mean_mass_kg: found {heaviest:.4g}, more than the casing of round[1], {casing:.4g} kg; allowed: "
            "fragments of that round (is it in kg?)"
        )
    found = RecoveredMass(table.total_mass, casing, meant)
    low, high = _ALLOWED
    fraction = found.mass / casing
    if meant == "checked" and not low <= fraction <= high:
        raise InputError(
            f'{name}: {found.words} of round[1]; allowed with flight.arena_mass = "checked": {100.0 * low:g} to '
            f'{100.0 * high:g} %. Are its numbers those of one round, and all zones in it? "scaled" scales the '
            "numbers to "
            'the casing, "as_given" flies them as they are'
        )
    return found
