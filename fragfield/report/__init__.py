"""The report of a run: one HTML file for engineer, reviewer and approver, and its figures as files."""

from __future__ import annotations

from fragfield.report.assemble import write_report
from fragfield.report.run_files import RunFiles, read_run

__all__ = ["RunFiles", "read_run", "write_report"]
