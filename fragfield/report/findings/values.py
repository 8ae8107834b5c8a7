"""Numbers of summary.json and counts, as the findings need them."""

from __future__ import annotations

from typing import Any

from fragfield.numbers import number

__all__ = ["counted", "value_of"]


def counted(count: int, noun: str) -> str:
    """A count with its noun, in the plural where it is one."""
    return f"{number(count)} {noun}{'' if count == 1 else 's'}"


def value_of(part: dict[str, Any], name: str) -> float | None:
    """A number of a table of summary.json; None where there is none."""
    found = part.get(name)
    return float(found) if isinstance(found, (int, float)) and not isinstance(found, bool) else None
