"""All figures of the report: loading this module enters them."""

from __future__ import annotations

from fragfield.report.figures import arrangement, burst, fragments, hazard, pictures, rounds, site, uncertainty
from fragfield.report.figures.drawing import FIGURES

__all__ = ["FIGURES", "MODULES"]

MODULES = (rounds, arrangement, hazard, site, fragments, burst, pictures, uncertainty)
