"""`python -m fragfield.app.detached FILE`: the process of one job, see `fragfield.app.jobs`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.app.jobs import alive, born, read_job, write_job

if TYPE_CHECKING:
    from types import FrameType

    from fragfield.app.jobs import Job

__all__ = ["main"]

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
