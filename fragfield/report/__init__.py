"""The report of a run: one HTML file for engineer, reviewer and approver, and its figures as files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield_base.lazy_names import lazy_names

if TYPE_CHECKING:
    from fragfield.report.assemble import write_report, write_uncertainty_page
    from fragfield.report.reading.run_files import RunFiles, read_run

__all__ = ["RunFiles", "read_run", "write_report", "write_uncertainty_page"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "fragfield.report.assemble": "write_report write_uncertainty_page",
        "fragfield.report.reading.run_files": "RunFiles read_run",
    },
)
