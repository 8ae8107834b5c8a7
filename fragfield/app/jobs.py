"""Runs as processes of their own, one after the other; they go on when a page or the application is closed.

A job is a file: what to do, who does it, how it ended. Each has a process (`fragfield.app.jobs`) that waits until
the jobs before it have ended, runs the commands of the command line one by one, and records the end. The application
only writes and reads these files, so that nothing is lost with it.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from types import FrameType

    from fragfield.app.workspace import Workspace


_LIVE = ("queued", "running", "stopping")
_MOST_KEPT = 40
_TAIL = 6000  # characters of a log that are shown


@dataclass(frozen=True)
class Job:
    """A run, or a part of one, and its process."""

    file: Path
    """Where it is recorded."""
    title: str
    """What it computes."""
    case: str
    run: str
    """Names of the case file and of the run directory, relative to the workspace."""
    commands: list[list[str]]
    """Words after `fragfield`, of one command after the other."""
    state: str = "queued"
    """"queued", "running", "stopping", "done", "stopped" or "failed"."""
    code: int | None = None
    """Exit code of the last command."""
    process: int = 0
    born: str = ""
    queued: float = field(default_factory=time.time)
    ended: float = 0.0

    @property
    def is_live(self) -> bool:
        """Whether it waits or computes."""
        return self.state in _LIVE

    @property
    def log(self) -> Path:
        """What its commands wrote on their standard streams."""
        return self.file.with_suffix(".log")

    @property
    def progress_file(self) -> Path:
        """Where its commands keep their progress."""
        return self.file.with_suffix(".progress")

    def progress(self) -> dict[str, Any]:
        """The last progress: stage, share, detail, seconds_left; empty before the first."""
        with suppress(OSError, ValueError):
            found = json.loads(self.progress_file.read_text(encoding="utf-8"))
            return found if isinstance(found, dict) else {}
        return {}

    def words(self) -> str:
        """The end of its log."""
        with suppress(OSError):
            return self.log.read_text(encoding="utf-8", errors="replace")[-_TAIL:]
        return ""


def start_job(space: Workspace, *, title: str, case: str, run: str, commands: list[list[str]]) -> Job:
    """Queue commands and start the process that runs them; raises InputError where it cannot be started."""
    name = f"jobs/{time.time_ns():020d}"
    job = Job(space.state(f"{name}.json"), title, case, run, [])
    job = replace(job, commands=[[*words, *_following(words, job)] for words in commands])
    write_job(job)
    try:
        process = subprocess.Popen(
            [sys.executable, "-m", "fragfield.app.jobs", str(job.file)], cwd=space.folder,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
    except OSError as error:
        job.file.unlink(missing_ok=True)
        raise InputError(f"{case}: the run cannot be started ({error.strerror})") from None
    # It records its own number; until then it counts as started.
    job = replace(job, process=process.pid, born=born(process.pid))
    for old in jobs_of(space)[_MOST_KEPT:]:
        if not old.is_live:
            forget(old)
    return job


def _following(words: list[str], job: Job) -> list[str]:
    """The option by which a command says how far it is, where it has one."""
    return ["--progress-file", str(job.progress_file)] if words[0] in ("run", "fly", "report") else []


def jobs_of(space: Workspace) -> list[Job]:
    """All jobs, the newest first; one whose process is gone without a word has failed."""
    folder = space.state("jobs/x").parent
    return [job for file in sorted(folder.glob("*.json"), reverse=True) if (job := read_job(file)) is not None]


def read_job(file: Path) -> Job | None:
    """A job as it is recorded; None where the file is no job."""
    with suppress(OSError, ValueError, TypeError):
        job = Job(**{**json.loads(file.read_text(encoding="utf-8")), "file": file})
        young = time.time() - job.queued < 20.0 and not job.process
        if job.is_live and not young and not alive(job):
            return replace(job, state="failed" if job.state != "stopping" else "stopped")
        return job
    return None


def write_job(job: Job) -> None:
    """Record a job."""
    write_text(job.file, json.dumps({**asdict(job), "file": job.file.name}, indent=1), InputError)


def alive(job: Job) -> bool:
    """Whether its process is there, and not another one that was given its number."""
    return job.process > 0 and born(job.process) == job.born != ""


def born(process: int) -> str:
    """When a process was started, in the system's own count; empty where it is gone."""
    with suppress(OSError, IndexError):
        words = Path(f"/proc/{process}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
        return "" if words[0] == "Z" else words[19]
    if sys.platform != "linux":
        with suppress(OSError):
            os.kill(process, 0)
            return "there"
    return ""


def cancel(job: Job) -> None:
    """Stop a job as Ctrl-C does: a burst leaves a checkpoint, from which it can be resumed."""
    if not job.is_live or not alive(job):
        return
    write_job(replace(job, state="stopping"))
    with suppress(OSError):
        os.kill(job.process, signal.SIGTERM)


def forget(job: Job) -> None:
    """Remove the record of a job that has ended; its run stays."""
    if not job.is_live:
        for file in (job.file, job.log, job.progress_file):
            file.unlink(missing_ok=True)


_BETWEEN = 0.5  # s between looks at the jobs before
_stopped: list[int] = []
_running: list[subprocess.Popen[bytes]] = []


def main(file: Path) -> None:
    """Wait for the jobs before, run the commands, record the end."""
    signal.signal(signal.SIGTERM, _stop)
    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    job = read_job(file)
    if job is None:
        return
    job = replace(job, process=os.getpid(), born=born(os.getpid()))
    write_job(job)
    while not _stopped and any(before.is_live for before in _before(file)):
        time.sleep(_BETWEEN)
    code: int | None = None
    if not _stopped:
        job = replace(job, state="running")
        write_job(job)
    for command in job.commands:
        if _stopped or code not in (None, 0):
            break
        code = _run(job, command)
    state = "stopped" if _stopped else ("done" if code == 0 else "failed")
    write_job(replace(job, state=state, code=code, ended=time.time()))


def _before(file: Path) -> list[Job]:
    """Jobs that were queued earlier."""
    earlier = sorted(one for one in file.parent.glob("*.json") if one.name < file.name)
    return [job for one in earlier if (job := read_job(one)) is not None and (alive(job) or not job.process)]


def _run(job: Job, command: list[str]) -> int:
    """Exit code of one command of the command line."""
    with job.log.open("ab") as log:
        log.write(f"$ fragfield {' '.join(command)}\n".encode())
        log.flush()
        process = subprocess.Popen(
            [sys.executable, "-m", "fragfield", *command], stdin=subprocess.DEVNULL, stdout=log, stderr=log
        )
        _running[:] = [process]
        if _stopped:
            process.terminate()
        return process.wait()


def _stop(number: int, frame: FrameType | None) -> None:
    """Pass an interruption on to the command that runs."""
    del frame
    _stopped.append(number)
    for process in _running:
        with suppress(OSError):
            process.send_signal(signal.SIGINT)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
