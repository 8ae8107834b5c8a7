"""One statement on a run, and how grave it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

Weight = Literal["stop", "warning", "note", "good"]
"""How grave a finding is."""
_LABELS = {"stop": "Do not use", "warning": "Warning", "note": "Note", "good": "Passed"}


class Finding(NamedTuple):
    """One statement on the run: "stop" (do not use), "warning", "note", or "good" (a check that passed)."""

    weight: Weight
    text: str

    @property
    def label(self) -> str:
        """The weight in a word, so that it does not depend on colour."""
        return _LABELS[self.weight]


def value_of(part: Mapping[str, Any], name: str) -> float | None:
    """A number of a part of summary.json; None where there is none."""
    found = part.get(name)
    return float(found) if isinstance(found, (int, float)) and not isinstance(found, bool) else None
