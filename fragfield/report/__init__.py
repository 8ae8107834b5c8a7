"""The report of a run: one HTML file for engineer, reviewer and approver, and its figures as files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fragfield.report.assemble import write_report
    from fragfield.report.reading.run_files import RunFiles, read_run

__all__ = ["RunFiles", "read_run", "write_report"]

_HOMES = {
    "RunFiles": "fragfield.report.reading.run_files",
    "read_run": "fragfield.report.reading.run_files",
    "write_report": "fragfield.report.assemble",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 - what is asked for; the process that draws needs little of it
    from importlib import import_module

    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
