"""All figures of the report: loading this module enters them."""

from __future__ import annotations

from fragfield.report.figures import burst, hazard, pictures, rounds, site
from fragfield.report.figures.drawing import FIGURES

__all__ = ["FIGURES", "MODULES"]

MODULES = (rounds, hazard, site, burst, pictures)
