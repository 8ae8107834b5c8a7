"""A ratio beside its target, as every benchmark states it."""

from __future__ import annotations

from typing import Any

__all__ = ["at_least", "at_most", "near"]


def at_most(ratio: float, target: float, what: str) -> dict[str, Any]:
    """The ratio is to be the target or less; `what` says of what to what."""
    return {"compared": what, "ratio": ratio, "target": target, "met": bool(ratio <= target)}


def at_least(ratio: float, target: float, what: str) -> dict[str, Any]:
    """The ratio is to be the target or more."""
    return {"compared": what, "ratio": ratio, "target": target, "met": bool(ratio >= target)}


def near(ratio: float, tolerance: float, what: str) -> dict[str, Any]:
    """The ratio is to be 1 within the tolerance."""
    met = bool(abs(ratio - 1.0) <= tolerance)
    return {"compared": what, "ratio": ratio, "target": 1.0, "tolerance": tolerance, "met": met}
