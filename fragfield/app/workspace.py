"""The folder that the application works in, its cases and runs, and the commands that compute a run."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.terminal.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path


STATE = ".fragfield"
"""Folder within it for logs and settings; it may be deleted when nothing runs."""
_MOST_LISTED = 60
_NOT_IN_A_NAME = re.compile(r"[^\w.-]+")


def safe_name(name: str, ending: str) -> str:
    """The name of a new file: without folders and odd signs, with its ending; raises InputError where none is left."""
    stem = _NOT_IN_A_NAME.sub("_", name.strip()).strip("._-")[:80]
    stem = stem.removesuffix(ending).strip("._-")
    if not stem:
        raise InputError(f'name: found "{name}"; allowed: a name with letters or digits')
    return stem + ending


@dataclass(frozen=True)
class Listed:
    """A case or a run as the first page lists it."""

    name: str
    changed: float
    state: str = ""


@dataclass(frozen=True)
class Workspace:
    """A folder (absolute, resolved) whose files the pages may read and write, and none outside of it."""

    folder: Path

    @classmethod
    def of(cls, given: Path | None) -> tuple[Workspace, str, str]:
        """The workspace of what `fragfield app` was given, with the names of the case and of the run to be shown.

        Raises InputError: there is no such file or folder.
        """
        place = (given or Path()).resolve()
        if not place.exists():
            raise InputError(f"{given}: no such case file or run directory")
        if place.is_file():
            return cls(place.parent), place.name, ""
        if not (place / "case.toml").is_file() or not (place / "run.log").exists():
            return cls(place), "", ""
        folder = place.parent.parent if place.parent.name == "runs" else place.parent
        space = cls(folder)
        name = str(place.relative_to(folder))
        case = next((one.name for one in space.cases() if Path(one.name).stem == place.name), "")
        return space, case, name

    def inside(self, name: str) -> Path:
        """Path of a file or folder by its name relative to the workspace.

        Raises InputError: it lies outside, also by way of a link, or among the application's own files.
        """
        with suppress(OSError, ValueError, RuntimeError):  # a name of zeros, or links in a ring
            path = (self.folder / name).resolve()
            within = path.is_relative_to(self.folder) and path != self.folder
            if name and within and STATE not in path.relative_to(self.folder).parts:
                return path
        raise InputError(f'found the path "{name[:200]}"; allowed: a file in the folder {self.folder}')

    def name_of(self, path: Path) -> str:
        """Name of a path relative to the workspace."""
        return str(path.relative_to(self.folder))

    def state(self, name: str) -> Path:
        """Path of one of the application's own files; its folder is made."""
        path = self.folder / STATE / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def cases(self) -> list[Listed]:
        """Case files in the folder and one level below, the last changed first."""
        found = [*self.folder.glob("*.toml"), *self.folder.glob("cases/*.toml")]
        listed = [Listed(self.name_of(path), path.stat().st_mtime) for path in found if _is_case(path)]
        return sorted(listed, key=lambda one: -one.changed)[:_MOST_LISTED]

    def runs(self) -> list[Listed]:
        """Run directories in the folder and in `runs`, the last changed first."""
        listed = [
            Listed(self.name_of(path), (path / "case.toml").stat().st_mtime, _state_of(path)) for path in self._runs()
        ]
        return sorted(listed, key=lambda one: -one.changed)[:_MOST_LISTED]

    def _runs(self) -> Iterator[Path]:
        for pattern in ("runs/*/case.toml", "*/case.toml"):
            for path in self.folder.glob(pattern):
                if not path.is_symlink() and path.parent.resolve().is_relative_to(self.folder):
                    yield path.parent

    def run_of(self, case: str) -> str:
        """Name of the run directory of a case, as `fragfield run` names it."""
        return str(Path("runs") / Path(case).stem)


def _is_case(path: Path) -> bool:
    with suppress(OSError):
        if path.is_file() and path.stat().st_size < 1 << 20:
            text = path.read_text(encoding="utf-8", errors="replace")
            return re.search(r"^\s*\[+(burst|round|flight|hazard)\]+", text, re.MULTILINE) is not None
    return False


def _state_of(path: Path) -> str:
    """Which of a run's stages is done last: a word of the command line, or empty."""
    from fragfield.files.run_directory import STAGES

    done = ""
    for name, stage in STAGES.items():
        if RunDirectory(path).file(stage.result).is_file():
            done = name
    return done


_TAIL = 6000  # characters of the log that are shown
_TO_END = 60.0  # s that an interrupted command has for its checkpoint
_WITH_PROGRESS = ("run", "fly", "report")


class Job:
    """A run, or a part of one, that is computed or has ended: commands (words after `fragfield`), one after the other.

    Log and progress stand in the workspace's state, those of the job before are replaced. Raises InputError: the log
    cannot be written, or no process started.
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

    def progress(self) -> Progress:
        """The last progress; of no stage before the first."""
        with suppress(OSError, ValueError, TypeError):
            return Progress(**json.loads(self._progress.read_text(encoding="utf-8")))
        return Progress("")

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
