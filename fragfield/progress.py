"""Progress on stderr: which stage, how far, how fast, how long still. On a terminal and on rank 0 only."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import TracebackType

    from rich.progress import Progress, TaskID

    from burst_fenicsx import BurstProgress
    from flight import FlightProgress

__all__ = ["ProgressReporter", "duration"]


class ProgressReporter:
    """A line on stderr that follows the stages; a context manager, closed on errors and Ctrl-C as well.

    Parameters
    ----------
    enabled : bool
        False on ranks other than 0 and for `--quiet`; a stderr that is no terminal disables it too.
    """

    def __init__(self, *, enabled: bool) -> None:
        self._enabled = enabled and sys.stderr.isatty()
        self._progress: Progress | None = None
        self._task: TaskID | None = None

    def __enter__(self) -> ProgressReporter:
        if self._enabled:
            self._progress = _rich_progress()
            self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._progress is not None:
            self._progress.stop()
            self._progress = None

    def stage(self, name: str) -> None:
        """Begin a stage; its bar pulses until a first amount is known."""
        if self._progress is None:
            return
        if self._task is not None:
            self._progress.remove_task(self._task)
        self._task = self._progress.add_task(name, total=None, detail="", left="")

    def burst(self, state: BurstProgress) -> None:
        """Show a `burst_fenicsx.BurstProgress`."""
        rate = f"{state.cell_steps_per_second / 1e6:.2f} M cell-steps/s"
        detail = f"{state.time * 1e6:.2f} of {state.end_time * 1e6:.0f} us   step {state.step}   {rate}"
        self._show(state.time, state.end_time, detail, state.seconds_left)

    def flight(self, state: FlightProgress) -> None:
        """Show a `flight.FlightProgress`."""
        rate = state.done / max(state.wall_seconds, 1e-9)
        detail = f"{state.done} of {state.total} fragments   {rate:.0f} fragments/s"
        self._show(state.done, state.total, detail, state.seconds_left)

    def _show(self, done: float, total: float, detail: str, seconds_left: float | None) -> None:
        if self._progress is None or self._task is None:
            return
        left = "" if seconds_left is None or not seconds_left < 1e7 else f"{duration(seconds_left)} left"
        self._progress.update(self._task, completed=done, total=total, detail=detail, left=left)


def duration(seconds: float) -> str:
    """A time as people read it: 42 s, 3 min 20 s, 2 h 5 min."""
    whole = max(round(seconds), 0)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def _rich_progress() -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

    return Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[detail]}"),
        TextColumn("{task.fields[left]}"),
        console=Console(stderr=True),
        transient=True,
        refresh_per_second=4,
    )
