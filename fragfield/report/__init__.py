"""The report of a run: one HTML file for engineer, reviewer and approver, and its figures as files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fragfield.report.assemble import write_report
    from fragfield.report.reading.run_files import RunFiles, read_run

__all__ = ["RunFiles", "read_run", "write_report"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - what is asked for; the process that draws needs little of it
    from importlib import import_module

    if name in __all__:
        return getattr(import_module(f"{__name__}.{'assemble' if name == 'write_report' else 'run_files'}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
