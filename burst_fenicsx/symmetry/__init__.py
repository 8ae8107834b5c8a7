"""The smallest symmetric part of an arrangement of rounds: found, computed, and completed to the whole by reflection."""

from __future__ import annotations

from burst_fenicsx.symmetry.completion import Completion
from burst_fenicsx.symmetry.part import SymmetricPart, smallest_part

__all__ = ["Completion", "SymmetricPart", "smallest_part"]
