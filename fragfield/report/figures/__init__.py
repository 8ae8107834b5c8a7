"""The figures of the report: one registered function each."""

from __future__ import annotations

from fragfield.report.figures import arrangement, burst, fragments, hazard, rounds, site, uncertainty
from fragfield.report.figures.drawing import FIGURES

__all__ = ["FIGURES", "arrangement", "burst", "fragments", "hazard", "rounds", "site", "uncertainty"]
