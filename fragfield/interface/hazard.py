"""The distances to apply of a run; the recommended one and its parts if it is determined, otherwise the reason."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.errors import InputError, NotDeterminedError
from fragfield.results.words import basis_words, metres, parts_words, ricochet_words, source_words

if TYPE_CHECKING:
    from pathlib import Path

    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.results.hazard import DistanceParts, Hazard, WithoutRicochet
    from fragfield.results.rules import DistanceToApply
    from fragfield.results.summary import Summary


class HazardDistance:
    """The distances of a flown run; a number that is not determined raises NotDeterminedError.

    Attributes
    ----------
    to_apply : DistanceToApply
        For storage and handling (`siting`) and disposal in the open, determined or not: `line` is what every view shows
        first, `words` say what each is by and what was left out.
    summary : Hazard
        The part of the summary, with all of it.
    determined, reason : bool, str
        Whether there is a distance, and why not.
    """

    def __init__(self, summary: Summary, directory: Path) -> None:
        if summary.hazard is None or summary.distance_to_apply is None:
            raise InputError(f"{directory}: contains no distance; run `fragfield fly` first")
        self._directory = directory
        self.to_apply: DistanceToApply = summary.distance_to_apply
        self.summary: Hazard = summary.hazard
        self.determined, self.reason = self.summary.determined, self.summary.reason

    @property
    def recommended(self) -> float:
        """The recommended distance (m): the expected one and what is not known of it, added up."""
        return self._known.recommended or 0.0

    @property
    def parts(self) -> DistanceParts:
        """Its parts (m), the expected distance and half-widths; of one that is None `not_included` says why."""
        return self._known.parts

    @property
    def not_included(self) -> dict[str, str]:
        """Parts that the recommended distance does not include, and why."""
        return self._known.not_included

    @property
    def expected(self) -> float:
        """Distance (m) at which the expected density of hazardous fragments falls through the acceptable one."""
        return self._known.expected or 0.0

    @property
    def upper(self) -> float | None:
        """Its one-sided 95 % upper bound (m), by points or over realisations; None for a single realisation."""
        return self._known.upper

    @property
    def standard_error(self) -> float | None:
        """Standard error of the expected distance (m); None for a single realisation."""
        return self._known.standard_error

    @property
    def without_ricochet(self) -> WithoutRicochet:
        """The same distances of the same flights up to the first impact."""
        return self._known.without_ricochet

    @property
    def direction(self) -> float | None:
        """Azimuth of the worst direction (degrees from +x); None where the distance is of all azimuths."""
        return self._known.direction_deg

    @property
    def bearing(self) -> float | None:
        """Bearing of the worst direction (degrees from north, clockwise); None without [site] too."""
        return self._known.bearing_deg

    @property
    def realisations(self) -> int:
        """Events that were flown."""
        return self.summary.realisations

    @property
    def ensemble(self) -> EnsembleHazard:
        """Densities and distances by realisation, azimuth and distance, from ensemble.h5."""
        from flight.files.ensemble import read_ensemble

        path = self._directory / "ensemble.h5"
        if not path.is_file():
            raise InputError(f"{path}: no such file; run `fragfield fly` first")
        return read_ensemble(path)[0]

    @property
    def _known(self) -> Hazard:
        if not self.determined:
            raise NotDeterminedError(f"{self._directory}: the distance is not determined: {self.reason}")
        return self.summary

    def __repr__(self) -> str:
        if not self.determined:
            return "<fragfield.HazardDistance: not determined>"
        return f"<fragfield.HazardDistance: {metres(self.recommended)}>"

    def __str__(self) -> str:
        if not self.determined:
            return f"{self.to_apply.line}\nrecommended distance: not determined\n  {self.reason}"
        found = self.summary
        return (
            f"{self.to_apply.line}\nrecommended distance {metres(self.recommended)}\n  {parts_words(found)}\n"
            f"  {source_words(found)}; {basis_words(found)}; {ricochet_words(found)}"
        )
