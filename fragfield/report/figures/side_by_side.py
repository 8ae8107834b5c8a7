"""Draws the figures of a report, and beside them in a process of its own the pictures.

VTK is loaded nowhere else: where it ends its process, as it does without a driver, the report goes on and says so. The
other process reads the run itself, and draws while this one computes and draws figures.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import tempfile
import threading
from base64 import b64decode, b64encode
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import IO, TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.report.figures.drawing import drawing_style, to_bytes

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from fragfield.report.reading.run_files import RunFiles

    Drawing = Callable[[RunFiles], Figure | None]

__all__ = ["FigureQueue", "draw_figure", "serve"]

_SERVE = "from fragfield.report.figures.side_by_side import serve; serve()"
_FILES = ("svg", "png")
_FAULT = "fault"


def draw_figure(run: RunFiles, function: Drawing) -> dict[str, bytes] | None:
    """A figure as "svg" and "png"; None where there is no data for it."""
    with drawing_style():
        figure = function(run)
        if figure is None:
            return None
        return dict(zip(_FILES, to_bytes(figure, *_FILES), strict=True))


class FigureQueue:
    """Figures and pictures to be drawn, by name, each once; pictures from when they are added on."""

    def __init__(self) -> None:
        self._figures: dict[str, Drawing] = {}
        self._known: set[str] = set()
        self._asked: SimpleQueue[tuple[str, Path, Path] | None] = SimpleQueue()
        self._seen: dict[str, dict[str, Any]] = {}
        self._process: subprocess.Popen[str] | None = None
        self._said: IO[str] | None = None
        self._thread: threading.Thread | None = None

    def add(self, name: str, function: Drawing) -> None:
        """Have a figure drawn."""
        self._figures[name] = function

    def add_picture(self, name: str, run: Path, folder: Path) -> None:
        """Have a picture of the run in a directory drawn by VTK, and its interactive view written to a folder."""
        if name in self._known:
            return
        self._known.add(name)
        self._asked.put((name, run, folder))
        if self._thread is None:
            self._thread = threading.Thread(target=self._feed, daemon=True)
            self._thread.start()

    def finish(self, run: RunFiles) -> dict[str, dict[str, bytes] | None]:
        """Draw the figures of a run; the files of each by its name, None where there was no data for it."""
        drawn = {name: draw_figure(run, function) for name, function in self._figures.items()}
        self._asked.put(None)
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        return drawn

    def picture(self, name: str) -> dict[str, Any]:
        """A picture, once all is finished.

        Returns
        -------
        dict
            "png", the file as bytes, and "view", the name of the interactive page or None; or "missing"
            alone, the reason why VTK draws nothing here.

        Raises
        ------
        InputError
            A file of the run is damaged.
        """
        found = self._seen.get(name)
        if found is None:
            from fragfield.view.offscreen import failure

            return {"missing": failure(self._last_words())}
        if "input" in found:
            raise InputError(found["input"])
        if _FAULT in found:
            raise RuntimeError(f"{name} could not be drawn: {found[_FAULT]}")
        return found

    def close(self) -> None:
        """End the other process, in the middle of a picture where an error ends the report."""
        self._asked.put(None)
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        if self._said is not None:
            self._said.close()

    def _last_words(self) -> str:
        """What a helper that ended said last, else its exit code."""
        if self._process is None or self._said is None:
            return "no process could be started"
        code = self._process.wait()
        self._said.seek(0)
        lines = self._said.read().strip().splitlines()
        return lines[-1] if lines else f"exit code {code}"

    def _feed(self) -> None:
        """Have one picture after another drawn."""
        try:
            self._said = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115 - see close
            process = self._process = subprocess.Popen(
                [sys.executable, "-c", _SERVE],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, text=True,
            )  # fmt: skip
        except OSError:
            return
        assert process.stdin is not None
        assert process.stdout is not None
        with suppress(OSError, ValueError), process.stdin, process.stdout:
            while (task := self._asked.get()) is not None:
                name, *folders = task
                process.stdin.write(json.dumps([name, *map(str, folders)]) + "\n")
                process.stdin.flush()
                answer = json.loads(process.stdout.readline())
                self._seen[name] = {key: b64decode(answer[key]) if key == "png" else answer[key] for key in answer}


def serve() -> None:
    """Draw the pictures that are asked for on standard input."""
    gc.disable()  # a short life: pictures are many small things, which it would look through again and again
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for line in sys.stdin:
        name, run, folder = json.loads(line)
        found = _draw_picture(name, Path(run), Path(folder))
        answers.write(json.dumps({key: _text(value) for key, value in found.items()}) + "\n")
        answers.flush()


def _text(value: bytes | str | None) -> str | None:
    return b64encode(value).decode("ascii") if isinstance(value, bytes) else value


def _draw_picture(name: str, directory: Path, folder: Path) -> dict[str, Any]:
    """A picture and its view; errors as entries, since the other process is to raise them."""
    from fragfield.report.reading.run_files import read_run
    from fragfield.view import offscreen
    from fragfield.view.interactive import interactive_fault, view_of_burst, view_of_fragments
    from fragfield.view.pictures import burst_figure, fragments_figure

    offscreen.go_untried()
    of_burst = name == "picture_of_burst"
    try:
        run = read_run(directory)
        (png,) = to_bytes((burst_figure if of_burst else fragments_figure)(run), "png")
        view = None
        if not interactive_fault():
            view = (view_of_burst if of_burst else view_of_fragments)(run, folder).name
    except offscreen.PictureUnavailableError as error:
        return {"missing": str(error)}
    except InputError as error:
        return {"input": str(error)}
    except Exception as error:  # noqa: BLE001 - reported to the process that has a log
        import traceback

        return {_FAULT: f"{error}\n{traceback.format_exc()}"}
    return {"png": png, "view": view}
