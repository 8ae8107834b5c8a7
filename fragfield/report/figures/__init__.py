"""The figures of the report: one registered function each."""

from __future__ import annotations

from fragfield.report.figures import burst, fragments, hazard, rounds, site, uncertainty
from fragfield.report.figures.drawing import FIGURES

__all__ = ["FIGURES", "burst", "fragments", "hazard", "rounds", "site", "uncertainty"]
