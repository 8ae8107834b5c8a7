"""An interruption by the keyboard that waits until the step is whole."""

from __future__ import annotations

import signal
import threading
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from types import FrameType, TracebackType

__all__ = ["Interruption"]


class Interruption:
    """While it is entered, Ctrl-C is noted instead of raised at once; `check` raises it, a second Ctrl-C does too.

    In the middle of a step the places belong to one time and the stresses to another, and no run could go on from
    there. Outside the main thread Python takes no signals and nothing is changed.
    """

    def __init__(self) -> None:
        self._asked = False
        self._usual: signal.Handlers | object = None

    def __enter__(self) -> Self:
        """Take the signal over."""
        if threading.current_thread() is threading.main_thread():
            self._usual = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the signal back."""
        if self._usual is not None:
            signal.signal(signal.SIGINT, self._usual)  # type: ignore[arg-type]

    def check(self) -> None:
        """Raise KeyboardInterrupt if one has been asked for."""
        if self._asked:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        if self._asked:
            raise KeyboardInterrupt
        self._asked = True
