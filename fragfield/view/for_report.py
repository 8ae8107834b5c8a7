"""The pictures of a report, drawn by VTK in a process of their own while the report draws its figures.

Where VTK ends its process, as it does without a driver, the report goes on and says so.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.errors import InputError

if TYPE_CHECKING:
    from types import TracebackType

__all__ = ["VIEWS", "PictureProcess", "draw"]

VIEWS = {"picture_of_burst": "view_burst.html", "picture_of_fragments": "view_fragments.html"}
"""Interactive page of each picture."""
_DRAW = "import sys; from fragfield.view.for_report import draw; sys.exit(draw(*sys.argv[1:]))"
_DONE, _FAULT, _INPUT, _UNAVAILABLE = 0, 1, 2, 3


class PictureProcess:
    """A process that draws the pictures of a run; a context manager, at whose end it has ended too.

    Parameters
    ----------
    run : Path
        The run directory.
    folder : Path
        Of the report: interactive pages go there, pictures into its folder `figures`.
    """

    def __init__(self, run: Path, folder: Path) -> None:
        self._words = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115 - see __exit__
        self._process = subprocess.Popen(
            [sys.executable, "-c", _DRAW, str(run), str(folder)], stdin=subprocess.DEVNULL, stderr=self._words
        )

    def __enter__(self) -> PictureProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()
        self._words.close()

    def finish(self) -> str:
        """Wait for the pictures; why VTK draws none here, or nothing.

        Raises
        ------
        InputError
            A file of the run is damaged.
        """
        from fragfield.view.offscreen import failure

        code = self._process.wait()
        self._words.seek(0)
        words = self._words.read().strip()
        last = (words.splitlines() or [f"exit code {code}"])[-1]
        if code == _INPUT:
            raise InputError(last)
        if code == _FAULT:
            raise RuntimeError(f"pictures could not be drawn: {words}")
        return "" if code == _DONE else last if code == _UNAVAILABLE else failure(last)


def draw(run: str, folder: str) -> int:
    """Draw the pictures and pages of a run; an exit code, and why on stderr."""
    from fragfield.report.reading.run_files import read_run
    from fragfield.view import interactive, offscreen
    from fragfield.view.show import write_pictures

    offscreen.go_untried()
    try:
        files = read_run(Path(run))
        write_pictures(files, Path(folder) / "figures", wide=False)
        if not interactive.interactive_fault():
            interactive.write_interactive_views(files, Path(folder))
    except offscreen.PictureUnavailableError as error:
        print(error, file=sys.stderr)
        return _UNAVAILABLE
    except InputError as error:
        print(error, file=sys.stderr)
        return _INPUT
    return _DONE
