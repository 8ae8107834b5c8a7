"""Break-up of a burst casing into fragments by Mott's law, and what is handed over to their flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield_base.lazy_names import lazy_names

if TYPE_CHECKING:
    from fragfield_base.burst_snapshot import SegmentRecord
    from transition.breaking_up import BreakUp, break_up
    from transition.errors import InputError
    from transition.field import CasingInMesh, snapshot_of
    from transition.law.mott import Graded, MottLaw, Quantile, Sampler
    from transition.points import MaterialPoints
    from transition.results import BreakUpResult, SegmentResult
    from transition.settings import BreakUpSettings
    from transition.snapshot import RoundData, Snapshot

__all__ = [
    "BreakUp",
    "BreakUpResult",
    "BreakUpSettings",
    "CasingInMesh",
    "Graded",
    "InputError",
    "MaterialPoints",
    "MottLaw",
    "Quantile",
    "RoundData",
    "Sampler",
    "SegmentRecord",
    "SegmentResult",
    "Snapshot",
    "break_up",
    "snapshot_of",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "fragfield_base.burst_snapshot": "SegmentRecord",
        "transition.breaking_up": "BreakUp break_up",
        "transition.points": "MaterialPoints",
        "transition.errors": "InputError",
        "transition.field": "CasingInMesh snapshot_of",
        "transition.law.mott": "Graded MottLaw Quantile Sampler",
        "transition.results": "BreakUpResult SegmentResult",
        "transition.settings": "BreakUpSettings",
        "transition.snapshot": "RoundData Snapshot",
    },
)
