"""The break-up law of each segment, as summary.json gives it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fragfield.report.reading.run_files import RunFiles

__all__ = ["NumberLaw", "number_above", "segment_laws"]


@dataclass(frozen=True)
class NumberLaw:
    """N(m) = sum over the terms of n0 exp(-(m/mu)^exponent); one term, or two for the mixture."""

    round_index: int
    segment_index: int
    name: str
    terms: tuple[tuple[float, float, float], ...]
    """n0, mu (kg), exponent."""
    line: dict[str, Any]
    """The segment's line in summary.json."""


def segment_laws(run: RunFiles) -> list[NumberLaw]:
    """Laws of all segments of all rounds; empty while the break-up has not been run."""
    laws = []
    for round_index, item in enumerate(run.part("break_up").get("rounds") or []):
        for segment_index, line in enumerate(item.get("segments") or []):
            terms = _terms(line)
            if terms:
                laws.append(NumberLaw(round_index, segment_index, str(line.get("name", segment_index)), terms, line))
    return laws


def _terms(line: dict[str, Any]) -> tuple[tuple[float, float, float], ...]:
    """Terms of the mixture: its parts have one mean mass, so that their shares of the mass are those of the number."""
    total = line.get("n0")
    if not total:
        return ()
    return tuple(
        (float(total) * float(part["mass_fraction"]), float(part["mu"]), 1.0 / float(part["dimension"]))
        for part in line.get("parts") or []
    )


def number_above(law: NumberLaw, mass: NDArray[np.float64]) -> NDArray[np.float64]:
    """Expected number of fragments heavier than `mass` (kg) from the segment (Eq. 19)."""
    return np.sum([n0 * np.exp(-((mass / mu) ** exponent)) for n0, mu, exponent in law.terms], axis=0)
