"""Progress on stderr: stage, fraction, rate, remaining time; on a terminal and on rank 0 only."""

from __future__ import annotations

import json
import math
import sys
import time
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path
    from types import TracebackType

    from rich.progress import Progress as Bars
    from rich.progress import TaskID

    from burst_fenicsx import BurstProgress
    from flight import FlightProgress


COMPILING = "compiling kernels: once for this version on this machine"
"""What stands beside the stage meanwhile."""
_BETWEEN = 0.25  # s between two writings of a file of progress


@dataclass(frozen=True)
class Progress:
    """How far a run is; `print` shows it as a line.

    Attributes
    ----------
    stage : str
        "burst", "break-up", "fly" or "report".
    share : float
        Of the stage that is done, 0 to 1: of the burst's time, or of the fragments flown.
    detail : str
        The same in words.
    seconds_left : float, optional
        Of the stage, at the rate of the last seconds; None where it is not known.
    """

    stage: str
    share: float = 0.0
    detail: str = ""
    seconds_left: float | None = None

    def __str__(self) -> str:
        left = "" if self.seconds_left is None else f"   {duration(self.seconds_left)} left"
        return f"{self.stage} {100.0 * self.share:.0f} %{f'   {self.detail}' if self.detail else ''}{left}"


def into_file(path: Path) -> Callable[[Progress], None]:
    """What keeps the last progress in a file, as one JSON object, for another program to read.

    It is replaced whole, a few times a second at most; one that cannot be written is left alone.
    """
    last = ("", 0.0)

    def follow(state: Progress) -> None:
        nonlocal last
        now = time.monotonic()
        if state.stage == last[0] and state.share < 1.0 and now - last[1] < _BETWEEN:
            return
        last = (state.stage, now)
        draft = path.with_name(f"{path.name}.new")
        with suppress(OSError):
            draft.write_text(json.dumps(asdict(state)), encoding="utf-8")
            draft.replace(path)

    return follow


class ProgressReporter:
    """A line on stderr that follows the stages; a context manager, closed on errors and Ctrl-C as well.

    Parameters
    ----------
    enabled : bool
        False on ranks other than 0 and for `--quiet`; a stderr that is no terminal disables it too.
    follow : callable, optional
        Called with a `Progress` at every step; what it raises ends the run.

    Attributes
    ----------
    expected_end : float, optional
        When the burst may end (s), by which its progress counts until its end is foreseen.
    """

    expected_end: float | None = None

    def __init__(self, *, enabled: bool, follow: Callable[[Progress], object] | None = None) -> None:
        self._enabled = enabled and sys.stderr.isatty()
        self._follow = follow
        self._stage = ""
        self._bars: Bars | None = None
        self._task: TaskID | None = None
        self._shown = Progress("")
        self._watch = ExitStack()

    def __enter__(self) -> ProgressReporter:
        if self._enabled or self._follow is not None:
            self._bars = _rich_progress(shown=self._enabled)
            self._bars.start()
            self._watch.enter_context(watching_compilation(self._compiling))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._watch.close()
        if self._bars is not None:
            self._bars.stop()
            self._bars = None
        if error is None:
            self._end_stage()

    def stage(self, name: str) -> None:
        """Begin a stage, which ends the one before; its bar pulses until a first amount is known."""
        self._end_stage()
        self._stage = name
        self._shown = Progress(name)
        if self._follow is not None:
            self._follow(Progress(name))
        if self._bars is not None:
            if self._task is not None:
                self._bars.remove_task(self._task)
            self._task = self._bars.add_task(name, total=None, detail="", left="")

    def _end_stage(self) -> None:
        if self._follow is not None and self._stage:
            self._follow(Progress(self._stage, 1.0))

    def burst(self, state: BurstProgress) -> None:
        """Show a `burst_fenicsx.BurstProgress`."""
        rate = f"{state.cell_steps_per_second / 1e6:.2f} M cell-steps/s"
        end, about = (state.end_time, "") if state.end_time is not None else (self.expected_end, "about ")
        of = "" if end is None else f" of {about}{end * 1e6:.0f}"
        detail = f"{state.time * 1e6:.2f}{of} us   step {state.step}   {rate}"
        self._show(state.time, end or math.inf, detail)

    def flight(self, state: FlightProgress) -> None:
        """Show a `flight.FlightProgress`."""
        rate = state.done / max(state.wall_seconds, 1e-9)
        detail = f"{state.done} of {state.total} fragments   {rate:.0f} fragments/s"
        self._show(state.done, state.total, detail)

    def _compiling(self, begins: bool) -> None:
        if self._stage:
            self._publish(Progress(self._stage, self._shown.share, COMPILING) if begins else self._shown)

    def _show(self, done: float, total: float, detail: str) -> None:
        """Show what is done of a whole; the time left is at the rate of the last seconds, as rich has it."""
        if self._bars is None or self._task is None:
            return
        share = min(done / total, 1.0) if total > 0.0 else 1.0
        self._bars.update(self._task, completed=share, total=1.0)
        self._shown = Progress(self._stage, share, detail, self._bars.tasks[-1].time_remaining)
        self._publish(self._shown)

    def _publish(self, state: Progress) -> None:
        if self._follow is not None:
            self._follow(state)
        if self._bars is not None and self._task is not None:
            left = "" if state.seconds_left is None else f"{duration(state.seconds_left)} left"
            self._bars.update(self._task, detail=state.detail, left=left)


def duration(seconds: float) -> str:
    """A time as people read it: under 1 s, 42 s, 3 min 20 s, 2 h 5 min."""
    whole = round(seconds)
    if whole < 1:
        return "under 1 s"
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def _rich_progress(*, shown: bool) -> Bars:
    from rich.console import Console
    from rich.progress import BarColumn, SpinnerColumn, TextColumn
    from rich.progress import Progress as Bars

    return Bars(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[detail]}"),
        TextColumn("{task.fields[left]}"),
        console=Console(stderr=True),
        transient=True,
        refresh_per_second=4,
        disable=not shown,
    )


_EVENT = "numba:compile"


@contextmanager
def watching_compilation(changed: Callable[[bool], object]) -> Iterator[None]:
    """Call `changed(True)` when numba begins to compile, and `changed(False)` when it is done, within the context.

    Kernels that come from the cache are not compiled. What a kernel calls is compiled with it: one pair of calls.
    """
    from numba.core import event

    class Watch(event.Listener):
        depth = 0

        def on_start(self, _: Any) -> None:  # noqa: ANN401 - numba's event
            self.depth += 1
            if self.depth == 1:
                changed(True)

        def on_end(self, _: Any) -> None:  # noqa: ANN401
            self.depth -= 1
            if self.depth == 0:
                changed(False)

    watch = Watch()
    event.register(_EVENT, watch)
    try:
        yield
    finally:
        event.unregister(_EVENT, watch)
