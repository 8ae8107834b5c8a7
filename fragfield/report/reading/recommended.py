"""The recommended distance of summary.json and its parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["PART_NAMES", "hazard_of", "recommended"]

PART_NAMES = {
    "randomness": "randomness of the break-up",
    "grid": "grid",
    "inputs": "inputs",
    "samples": "number of samples",
}
"""The parts of the recommended distance that are added to the expected distance, in words."""


def hazard_of(run: RunFiles) -> dict[str, Any]:
    """The part `hazard` of summary.json, in the words of the contract (adapter, until the summary has them)."""
    hazard = dict(run.part("hazard"))
    if hazard and "expected" not in hazard:
        upper, expected = hazard.get("upper"), hazard.get("distance")
        hazard["expected"] = expected
        hazard["recommended"] = upper if upper is not None else expected
        half = None if upper is None or expected is None else upper - expected
        hazard["parts"] = {"expected": expected, "randomness": half, "grid": None, "inputs": None, "samples": None}
        hazard["not_included"] = {"inputs": "no study of uncertainty"}
    return hazard


def recommended(run: RunFiles) -> float | None:
    """The recommended distance (m); None where it is not determined."""
    hazard = hazard_of(run)
    return hazard.get("recommended") if hazard.get("determined") else None
