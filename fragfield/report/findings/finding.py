"""One statement on a run, and how grave it is."""

from __future__ import annotations

from typing import Literal, NamedTuple

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
