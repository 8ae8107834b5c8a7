"""The run that the application computes: commands of the command line, in a process of their own, one run at a time."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fragfield.app.workspace import Workspace


_TAIL = 6000  # characters of the log that are shown
_TO_END = 60.0  # s that an interrupted command has for its checkpoint
_WITH_PROGRESS = ("run", "fly", "report")


class Job:
    """A run, or a part of one, that is computed or has ended.

    Parameters
    ----------
    space : Workspace
        The folder; log and progress stand in its state, those of the job before are replaced.
    title, run : str
        What it computes, and the name of the run directory.
    commands : sequence of sequences of str
        Words after `fragfield`, of one command after the other; the next one begins when the one before ended with 0.

    Raises
    ------
    InputError
        The log cannot be written, or no process started.
    """

    def __init__(self, space: Workspace, title: str, run: str, commands: Sequence[Sequence[str]]) -> None:
        self.title, self.run = title, run
        self.code: int | None = None
        """Exit code of the last command that ended."""
        self._folder: Path = space.folder
        self._log, self._progress = space.state("job.log"), space.state("job.progress")
        self._rest = [list(words) for words in commands]
        self._cancelled = False
        self._progress.unlink(missing_ok=True)
        try:
            self._log.write_bytes(b"")
            self._process = self._begin()
        except OSError as error:
            raise InputError(f"{run}: the run cannot be started ({error.strerror})") from None
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def _begin(self) -> subprocess.Popen[bytes]:
        words = self._rest.pop(0)
        following = ["--progress-file", str(self._progress)] if words[0] in _WITH_PROGRESS else []
        with self._log.open("ab") as log:
            log.write(f"$ fragfield {' '.join(words)}\n".encode())
            log.flush()
            return subprocess.Popen(
                [sys.executable, "-m", "fragfield", *words, *following], cwd=self._folder,
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True,
            )  # fmt: skip

    def _follow(self) -> None:
        self.code = self._process.wait()
        while self._rest and self.code == 0 and not self._cancelled:
            try:
                self._process = self._begin()
            except OSError:
                self.code = 1
                return
            self.code = self._process.wait()

    @property
    def state(self) -> str:
        """One of running, stopping, done, stopped and failed."""
        if self._thread.is_alive():
            return "stopping" if self._cancelled else "running"
        return "done" if self.code == 0 and not self._rest else "stopped" if self._cancelled else "failed"

    @property
    def is_live(self) -> bool:
        """Whether it computes."""
        return self._thread.is_alive()

    def progress(self) -> dict[str, Any]:
        """The last progress: stage, share, detail, seconds_left; empty before the first."""
        with suppress(OSError, ValueError):
            found = json.loads(self._progress.read_text(encoding="utf-8"))
            return found if isinstance(found, dict) else {}
        return {}

    def words(self) -> str:
        """The end of its log."""
        with suppress(OSError):
            return self._log.read_text(encoding="utf-8", errors="replace")[-_TAIL:]
        return ""

    def cancel(self) -> None:
        """Stop it as Ctrl-C does: a burst leaves a checkpoint, from which it can be resumed."""
        self._cancelled = True
        self._process.send_signal(signal.SIGINT)

    def end(self) -> None:
        """Stop it, and wait until it has; a command that does not end is killed."""
        if self.is_live:
            self.cancel()
            self._thread.join(_TO_END)
            self._process.kill()
