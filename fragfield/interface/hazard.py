"""The distances to apply of a run; the recommended one and its parts if it is determined, otherwise the reason."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError, NotDeterminedError
from fragfield.hazard.certainty import basis_words, is_determined, metres, ricochet_words, source_words
from fragfield.hazard.recommended import parts_words
from fragfield.results.rules import DistanceToApply

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from flight.hazard.ensemble import EnsembleHazard


class HazardDistance:
    """The distances to apply, the recommended one and its parts.

    Parameters
    ----------
    summary : mapping
        summary.json.
    directory : Path
        Of the run.
    """

    def __init__(self, summary: Mapping[str, Any], directory: Path) -> None:
        self._found = dict(summary.get("hazard") or {})
        self._to_apply = summary.get("distance_to_apply")
        self._directory = directory

    @property
    def to_apply(self) -> DistanceToApply:
        """The distances to apply, for storage and handling (`siting`) and disposal in the open; determined or not.

        `line` is what every view shows first, `words` say what each is by and what was left out.
        """
        if self._to_apply is None:
            raise InputError(
                f"{self._directory}: contains no distance to apply, because another version computed the flight; "
                "run `fragfield fly` again"
            )
        return DistanceToApply.read(self._to_apply)

    @property
    def determined(self) -> bool:
        """Whether there is a distance; where not, the numbers below raise NotDeterminedError."""
        return is_determined({"hazard": self._found})

    @property
    def reason(self) -> str:
        """Why it is not determined; empty where it is."""
        return "" if self.determined else str(self._found.get("reason", ""))

    @property
    def recommended(self) -> float:
        """The recommended distance (m): the expected one and what is not known of it, added up."""
        return float(self._number("recommended"))

    @property
    def parts(self) -> dict[str, float | None]:
        """Its parts (m): `expected`, and the half-widths `quadrature`, `randomness`, `grid` and `inputs`.

        One that is not known is None; `not_included` says why.
        """
        return dict(self._number("parts"))

    @property
    def not_included(self) -> dict[str, str]:
        """Parts that the recommended distance does not include, and why."""
        return dict(self._number("not_included"))

    @property
    def expected(self) -> float:
        """Distance (m) at which the expected density of hazardous fragments falls through the acceptable one."""
        return float(self._number("expected"))

    @property
    def upper(self) -> float | None:
        """Its one-sided 95 % upper bound (m), by points or over realisations; None for a single realisation."""
        return self._optional("upper")

    @property
    def standard_error(self) -> float | None:
        """Standard error of the expected distance (m); None for a single realisation."""
        return self._optional("standard_error")

    @property
    def without_ricochet(self) -> dict[str, float | None]:
        """`recommended`, `expected`, `upper`, `standard_error` (m) of the same flights up to the first impact.

        The numbers above count what fragments do after it too; where `flight.ground.ricochet` is "none" both are one.
        """
        self._number("recommended")
        return dict(self._found.get("without_ricochet") or {})

    @property
    def direction(self) -> float | None:
        """Azimuth of the worst direction (degrees from +x); None where the distance is of all azimuths."""
        return self._optional("direction_deg")

    @property
    def bearing(self) -> float | None:
        """Bearing of the worst direction (degrees from north, clockwise); None without [site] too."""
        return self._optional("bearing_deg")

    @property
    def realisations(self) -> int:
        """Events that were flown."""
        return int(self._found.get("realisations", 0))

    @property
    def summary(self) -> dict[str, Any]:
        """All of the part, SI; the page "Output files" of the guide explains the keys."""
        return dict(self._found)

    @property
    def ensemble(self) -> EnsembleHazard:
        """Densities and distances by realisation, azimuth and distance, from ensemble.h5."""
        from flight.files.ensemble import read_ensemble

        path = self._directory / "ensemble.h5"
        if not path.is_file():
            raise InputError(f"{path}: no such file; run `fragfield fly` first")
        return read_ensemble(path)[0]

    def _number(self, key: str) -> Any:  # noqa: ANN401 - of JSON
        if not self.determined:
            raise NotDeterminedError(f"{self._directory}: the distance is not determined: {self.reason}")
        if "recommended" not in self._found:
            raise InputError(
                f"{self._directory}: contains no recommended distance, because another version computed the flight; "
                "run `fragfield fly` again"
            )
        return self._found.get(key)

    def _optional(self, key: str) -> float | None:
        value = self._number(key)
        return None if value is None else float(value)

    def __repr__(self) -> str:
        if not self.determined:
            return "<fragfield.HazardDistance: not determined>"
        return f"<fragfield.HazardDistance: {metres(self.recommended)}>"

    def __str__(self) -> str:
        if not self.determined:
            return f"{self.to_apply.line}\nrecommended distance: not determined\n  {self.reason}"
        number = f"{source_words(self._found)}; {basis_words(self._found)}"
        if words := ricochet_words(self._found):
            number += f"; {words}"
        return (
            f"{self.to_apply.line}\nrecommended distance {metres(self.recommended)}\n  {parts_words(self._found)}\n"
            f"  {number}"
        )
