"""Draws figures and pictures in two processes: this one, and a helper that reads the run itself.

Drawing takes most of a report's time and figures are independent. The helper draws the pictures, for which
VTK is loaded nowhere else: where VTK ends its process, as it does without a driver, the report goes on and says so.
Then it takes figures from the front of the queue, while this process takes them from its end, once it has made all
else. Where no helper can be had, or it fails, this process draws what figures are left: they are the same, to the last
byte.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import subprocess
import sys
import tempfile
import threading
from base64 import b64decode, b64encode
from collections import deque
from contextlib import suppress
from pathlib import Path
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
_FEWEST = 8
"""Figures for which alone a helper is started: it takes 1.2 s of processor time to begin, a figure 0.2 s."""
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
    """Figures and pictures to be drawn, by name.

    Parameters
    ----------
    run : RunFiles
        The run that they show.
    helped : bool
        Start a helper for figures, where there are two cores; for a picture it is started in any case.
    fewest : int
        Figures that must be waiting before a helper is started for them.
    """

    def __init__(self, run: RunFiles, *, helped: bool, fewest: int = _FEWEST) -> None:
        self._run = run
        self._fewest = fewest
        self._helped = helped and len(os.sched_getaffinity(0)) > 1
        self._waiting: deque[tuple[str, Drawing]] = deque()
        self._drawn: dict[str, dict[str, bytes] | None] = {}
        self._pictures: deque[tuple[str, Path]] = deque()
        self._seen: dict[str, dict[str, Any]] = {}
        self._known: set[str] = set()
        self._outdated = False
        self._process: subprocess.Popen[str] | None = None
        self._said: IO[str] | None = None
        self._thread: threading.Thread | None = None
        self._all_known = threading.Event()
        self._more = threading.Semaphore(0)

    def renew(self, run: RunFiles) -> None:
        """Draw what is added from now on from the run as it is by now; the helper reads it again."""
        self._run = run
        self._outdated = True

    def add(self, name: str, function: Drawing) -> None:
        """Have a figure drawn; one that was added before is not drawn again."""
        if self._is_new(name):
            self._waiting.append((name, function))
            self._more.release()
            if self._helped and len(self._waiting) >= self._fewest:
                self._start()

    def add_picture(self, name: str, folder: Path) -> None:
        """Have a picture of VTK drawn, and its interactive view written to a folder; once, like a figure."""
        if self._is_new(name):
            self._pictures.append((name, folder))
            self._more.release()
            self._start()

    def _is_new(self, name: str) -> bool:
        """Whether a name was not asked for before; it is known from now on."""
        new = name not in self._known
        self._known.add(name)
        return new

    def _start(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._feed, daemon=True)
            self._thread.start()

    def finish(self) -> dict[str, dict[str, bytes] | None]:
        """Draw what is left; the files of every figure by its name, None where there was no data for it."""
        self._all_known.set()
        self._more.release()
        self._draw_rest()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._draw_rest()  # what a helper that failed gave back
        return self._drawn

    def _draw_rest(self) -> None:
        with suppress(IndexError):
            while True:
                name, function = self._waiting.pop()
                self._drawn[name] = draw_figure(self._run, function)

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
        """End the helper, in the middle of a figure where an error ends the report."""
        self._waiting.clear()
        self._pictures.clear()
        self._all_known.set()
        self._more.release()
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
        """Give the helper one picture and one figure after another."""
        try:
            self._outdated = False
            self._said = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115 - see close
            process = self._process = subprocess.Popen(
                [sys.executable, "-c", _SERVE, str(self._run.folder)],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, text=True,
            )  # fmt: skip
        except OSError:
            return
        assert process.stdin is not None
        assert process.stdout is not None
        with suppress(OSError, ValueError), process.stdin, process.stdout:
            if process.stdout.readline() != "ready\n":  # read while figures are still taken by the other end
                return
            while self._given(process):
                pass

    def _given(self, process: subprocess.Popen[str]) -> bool:
        """Have the helper draw what comes next; False when there is nothing left."""
        self._more.acquire()
        if self._outdated:
            self._outdated = False
            _asked(process, ["read", "", ""])
        if self._pictures:
            name, folder = self._pictures.popleft()
            answer = _asked(process, ["picture", name, str(folder)])
            self._seen[name] = {key: b64decode(answer[key]) if key == "png" else answer[key] for key in answer}
            return True
        try:
            name, function = self._waiting.popleft()
        except IndexError:
            return not self._all_known.is_set()
        whole = False
        try:
            found = _asked(process, ["figure", function.__module__, function.__qualname__])
            self._drawn[name] = None if found is None else {key: b64decode(found[key]) for key in _FILES}
            whole = True
        finally:
            if not whole:
                self._waiting.append((name, function))
        return True


def _asked(process: subprocess.Popen[str], task: list[str]) -> Any:  # noqa: ANN401 - an object of JSON
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(json.dumps(task) + "\n")
    process.stdin.flush()
    return json.loads(process.stdout.readline())


def serve() -> None:
    """Draw what is asked for on standard input, of the run named on the command line."""
    from fragfield.report.reading.run_files import read_run

    gc.disable()  # a short life: figures are many small things, which it would look through again and again
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    run = read_run(Path(sys.argv[1]))
    answers.write("ready\n")
    answers.flush()
    for line in sys.stdin:
        kind, first, second = json.loads(line)
        found: dict[str, Any] | None = None
        if kind == "read":
            run = read_run(Path(sys.argv[1]))
        elif kind == "picture":
            found = _draw_picture(run, first, Path(second))
        else:
            found = draw_figure(run, getattr(importlib.import_module(first), second))
        answer = None if found is None else {key: _text(value) for key, value in found.items()}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _text(value: bytes | str | None) -> str | None:
    return b64encode(value).decode("ascii") if isinstance(value, bytes) else value


def _draw_picture(run: RunFiles, name: str, folder: Path) -> dict[str, Any]:
    """A picture and its view; errors as entries, since the other process is to raise them."""
    from fragfield.view import offscreen
    from fragfield.view.interactive import interactive_fault, view_of_burst, view_of_fragments
    from fragfield.view.pictures import burst_figure, fragments_figure

    offscreen.go_untried()
    of_burst = name == "picture_of_burst"
    try:
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
