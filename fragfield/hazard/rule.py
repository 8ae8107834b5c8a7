"""A distance by a published rule, as summary.json and the report have it."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["COMPARISON", "DISPOSAL", "SITING", "Rule"]

SITING, DISPOSAL, COMPARISON = "siting", "disposal", "comparison"
"""What a rule is for: distances for storage and handling, for disposal in the open, or none that is prescribed."""


@dataclass(frozen=True)
class Rule:
    """A distance by a rule.

    Attributes
    ----------
    name, source, formula, inputs, range : str
        In words and SI units.
    hazard : "fragments" or "blast"
        What it keeps people from.
    use : "siting", "disposal" or "comparison"
        Activity for which the distance is prescribed; "comparison": it is shown beside the others alone.
    distance : float or None
        In m; None outside the rule's range.
    reason : str
        Why the rule does not apply to this arrangement; empty where it does.
    basis : str
        What it rests on.
    """

    name: str
    hazard: str
    use: str
    distance: float | None
    source: str
    formula: str
    inputs: str
    range: str
    reason: str = ""
    basis: str = "mass alone"

    def __post_init__(self) -> None:
        if (self.distance is None) != bool(self.reason):
            raise ValueError(f"{self.name}: a rule has either a distance or a reason why it has none")
