"""A distance by a published rule, as summary.json and the report have it."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Rule"]


@dataclass(frozen=True)
class Rule:
    """A distance by a rule.

    Attributes
    ----------
    name, source, formula, inputs, range : str
        In words and SI units.
    hazard : "fragments" or "blast"
        What it keeps people from.
    distance : float or None
        In m; None outside the rule's range.
    basis : str
        What it rests on.
    """

    name: str
    hazard: str
    distance: float | None
    source: str
    formula: str
    inputs: str
    range: str
    basis: str = "mass alone"
