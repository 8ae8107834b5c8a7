"""The smallest symmetric part of an arrangement of rounds: found, computed, completed by reflection."""

from __future__ import annotations

from burst_fenicsx.symmetry.part import SymmetricPart, smallest_part, symmetry_words

__all__ = ["SymmetricPart", "smallest_part", "symmetry_words"]
