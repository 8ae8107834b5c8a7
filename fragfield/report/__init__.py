"""The report of a run: one HTML file for engineer, reviewer and approver, and its figures as files."""

from __future__ import annotations

from fragfield_base.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(__name__, {"fragfield.report.assemble": "write_report write_uncertainty_page"})
