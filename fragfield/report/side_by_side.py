"""Figures drawn by two processes: this one, and a helper that reads the run itself.

Drawing takes most of a report's time and one figure knows nothing of another. The helper takes figures from the front
of the queue, this process from its end, once it has made all else. Where no helper can be had, or it fails, this
process draws what is left: the figures are the same, to the last byte.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import threading
from base64 import b64decode, b64encode
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.report.drawing import drawing_style, to_bytes

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from fragfield.report.run_files import RunFiles

    Drawing = Callable[[RunFiles, bool], Figure | None]

__all__ = ["FigureQueue", "draw_figure", "serve"]

_SERVE = "from fragfield.report.side_by_side import serve; serve()"
_FILES = ("svg", "png", "narrow")


def draw_figure(run: RunFiles, function: Drawing) -> dict[str, bytes] | None:
    """A figure as "svg" and "png", and as "narrow" SVG for a telephone; None where there is no data for it."""
    with drawing_style():
        wide = function(run, False)
        if wide is None:
            return None
        narrow = function(run, True)
        svg, png = to_bytes(wide, "svg", "png")
        return {"svg": svg, "png": png, "narrow": to_bytes(narrow, "svg")[0] if narrow is not None else svg}


class FigureQueue:
    """Figures to be drawn, by name.

    Parameters
    ----------
    run : RunFiles
        The run that they show.
    helped : bool
        Start a helper with the first figure, where there are two cores.
    """

    def __init__(self, run: RunFiles, *, helped: bool) -> None:
        self._run = run
        self._helped = helped and len(os.sched_getaffinity(0)) > 1
        self._waiting: deque[tuple[str, Drawing]] = deque()
        self._drawn: dict[str, dict[str, bytes] | None] = {}
        self._process: subprocess.Popen[str] | None = None
        self._thread: threading.Thread | None = None
        self._all_known = threading.Event()
        self._more = threading.Semaphore(0)

    def add(self, name: str, function: Drawing) -> None:
        """Have a figure drawn."""
        self._waiting.append((name, function))
        self._more.release()
        if self._helped and self._thread is None:
            self._thread = threading.Thread(target=self._feed, daemon=True)
            self._thread.start()

    def finish(self) -> dict[str, dict[str, bytes] | None]:
        """Draw what is left; the files of every figure by its name, None where there was no data for it."""
        self._all_known.set()
        self._more.release()
        with suppress(IndexError):
            while True:
                name, function = self._waiting.pop()
                self._drawn[name] = draw_figure(self._run, function)
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        with suppress(IndexError):  # what a helper that failed gave back
            while True:
                name, function = self._waiting.pop()
                self._drawn[name] = draw_figure(self._run, function)
        return self._drawn

    def close(self) -> None:
        """End the helper, in the middle of a figure where an error ends the report."""
        self._waiting.clear()
        self._all_known.set()
        self._more.release()
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def _feed(self) -> None:
        """Give the helper one figure after another."""
        try:
            process = self._process = subprocess.Popen(
                [sys.executable, "-c", _SERVE, str(self._run.folder)],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            )  # fmt: skip
        except OSError:
            return
        assert process.stdin is not None
        assert process.stdout is not None
        with suppress(OSError, ValueError), process.stdin, process.stdout:
            if process.stdout.readline() != "ready\n":  # read while figures are still taken by the other end
                return
            while True:
                self._more.acquire()
                try:
                    name, function = self._waiting.popleft()
                except IndexError:
                    if self._all_known.is_set():
                        return
                    continue
                whole = False
                try:
                    process.stdin.write(json.dumps([function.__module__, function.__qualname__]) + "\n")
                    process.stdin.flush()
                    found: dict[str, Any] | None = json.loads(process.stdout.readline())
                    self._drawn[name] = None if found is None else {key: b64decode(found[key]) for key in _FILES}
                    whole = True
                finally:
                    if not whole:
                        self._waiting.append((name, function))


def serve() -> None:
    """Draw the figures asked for on standard input of the run named on the command line."""
    from fragfield.report.run_files import read_run

    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    run = read_run(Path(sys.argv[1]))
    importlib.import_module("matplotlib.backends.backend_svg")
    answers.write("ready\n")
    answers.flush()
    for line in sys.stdin:
        module, name = json.loads(line)
        files = draw_figure(run, getattr(importlib.import_module(module), name))
        told = None if files is None else {key: b64encode(data).decode("ascii") for key, data in files.items()}
        answers.write(json.dumps(told) + "\n")
        answers.flush()
