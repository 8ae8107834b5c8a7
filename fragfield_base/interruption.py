"""Signals that end a run, deferred to points where a run may end."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

SIGNALS = (signal.SIGINT, signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else []))
"""Ctrl-C, what batch systems and `kill` send, and what a terminal that is closed or lost sends."""
end_requested = threading.Event()
"""Asks, from any thread, for the end of what this process computes, as a signal does."""


class Interruption:
    """While it is entered, signals that end a command are noted, not raised; a computation asks between its steps.

    In the middle of a step positions belong to one time and stresses to another: no run can go on from there, and
    a checkpoint of it would be wrong without a word. In the middle of a file HDF5 would be left half-way. A second
    SIGINT raises KeyboardInterrupt at once, for a user who does not want to wait; nothing may be written then. Further
    SIGTERM are noted only: launchers send several.

    Where the block ends without an error, a signal that the block did not defer is delivered again to the handler that
    was there before, so that blocks may be nested and no signal is lost. A signal that the process ignores (nohup,
    background jobs of a shell) stays ignored. Outside the main thread Python takes no signals and nothing is changed.

    Parameters
    ----------
    comm : MPI communicator, optional
        Ranks that stop together, at the same step.
    patient : bool
        Raise at no signal, not at a second SIGINT either; for blocks that are short.
    """

    def __init__(self, comm: Any = None, *, patient: bool = False) -> None:  # noqa: ANN401 - MPI stays unloaded
        self._comm = comm if comm is not None and comm.size > 1 else None
        self._patient = patient
        self._noted: int | None = None
        self._answered = False
        self._by_keyboard = False
        self._usual: dict[int, Any] = {}

    def __enter__(self) -> Self:
        """Take the signals over."""
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                usual = signal.getsignal(number)
                if usual is not signal.SIG_IGN and usual is not None:
                    self._usual[number] = signal.signal(number, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the signals back, and with them the one that came."""
        for number, usual in self._usual.items():
            signal.signal(number, usual)
        self._usual = {}
        if self._noted is not None and not self._answered and kind is None:
            signal.raise_signal(self._noted)

    def asked(self) -> bool:
        """Whether the run shall end, the same on all ranks; collective, to be called between steps."""
        noted = self._noted is not None or end_requested.is_set()
        self._answered = noted if self._comm is None else bool(self._comm.allreduce(int(noted)))
        return self._answered

    def check(self) -> None:
        """Raise KeyboardInterrupt if the run shall end; collective."""
        if self.asked():
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        if number == signal.SIGINT:
            if self._by_keyboard and not self._patient:
                raise KeyboardInterrupt
            self._by_keyboard = True
        self._noted = number
