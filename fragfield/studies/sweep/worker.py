"""A worker process that computes runs of a sweep one after another, and its handle in the sweep.

A run in a process of its own takes no other with it; a process that stays keeps its imports and compiled kernels, which
would take longer than a small burst. Requests and answers are lines of JSON on its standard input and output.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from fragfield.errors import EXIT_DONE, EXIT_FAULT, EXIT_INTERRUPTED, exit_code_of, message_of

__all__ = ["Worker", "perform", "serve"]

_SERVE = "from fragfield.studies.sweep.worker import serve; serve()"
_WATCH = 0.5  # s between two looks whether the process that gives the work is still there


class Worker:
    """A process that makes runs; started with its first run, and again after one that it did not survive.

    It has a session of its own, so that Ctrl-C reaches it by us alone: a second signal would break the checkpoint that
    the first one makes it write.

    Parameters
    ----------
    threads : int
        Threads of a run.
    command : list of str, optional
        What to start instead of `serve`, for tests.
    """

    def __init__(self, threads: int, command: list[str] | None = None) -> None:
        self._threads = threads
        self._command = command or [sys.executable, "-c", _SERVE]
        self._process: subprocess.Popen[str] | None = None
        self._starting = threading.Lock()
        self._ended = False

    def call(self, request: dict[str, Any]) -> tuple[int, str]:
        """Make one run; its exit code and, where that is not 0, why."""
        process = self._started()
        if process is None:
            return EXIT_INTERRUPTED, "interrupted"
        assert process.stdin is not None
        assert process.stdout is not None
        line = ""
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
            line = process.stdout.readline()
        if not line.endswith("\n"):
            code = process.wait()
            self._process = None
            return code or EXIT_FAULT, _why_ended(code or EXIT_FAULT)
        answer = json.loads(line)
        return int(answer["exit_code"]), str(answer["message"])

    def interrupt(self) -> None:
        """End the run at hand with its checkpoint, and start no other."""
        with self._starting:
            self._ended = True
            if self._process is not None and self._process.poll() is None:
                self._process.terminate()

    def close(self) -> None:
        """End the process, once the run at hand has ended, and wait for it."""
        process, self._process = self._process, None
        if process is not None:
            with suppress(OSError):
                if process.stdin is not None:
                    process.stdin.close()
            process.wait()
            if process.stdout is not None:
                process.stdout.close()

    def _started(self) -> subprocess.Popen[str] | None:
        with self._starting:
            if self._ended:
                return None
            if self._process is None:
                number = str(self._threads)
                environment = {**os.environ, "NUMBA_NUM_THREADS": number, "OMP_NUM_THREADS": number}
                self._process = subprocess.Popen(
                    self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
                    env=environment,
                )  # fmt: skip
            return self._process


def _why_ended(code: int) -> str:
    if code < 0:
        return f"ended by signal {-code}"
    return "a fault of the program; its traceback is in the run's log" if code == EXIT_FAULT else f"exit code {code}"


def perform(request: dict[str, Any]) -> tuple[int, str]:
    """Make the run of a request: `stage`, `case_file`, `out`, `resume`, `overwrite`; exit code and message.

    A request of the stage "sample" has keys of its own, see `fragfield.studies.uncertainty.sample`, and its results as
    message.
    """
    from fragfield.pipeline.chain import Request, run_chain, run_stage
    from fragfield.terminal.logs import to_stderr

    if request["stage"] == "sample":
        from fragfield.studies.uncertainty.sample import perform_sample

        return perform_sample(request)
    asked = Request(
        Path(request["case_file"]), Path(request["out"]), resume=request["resume"], overwrite=request["overwrite"],
        quiet=True, threads=int(os.environ.get("NUMBA_NUM_THREADS", "1")), lean=True,
    )  # fmt: skip
    try:
        with to_stderr(quiet=True):
            if request["stage"] == "run":
                run_chain(asked)
            else:
                run_stage(asked, request["stage"])
    except KeyboardInterrupt as error:
        return EXIT_INTERRUPTED, message_of(error)
    except Exception as error:  # noqa: BLE001 - a failed run is a line of the table
        return exit_code_of(error), message_of(error)
    return EXIT_DONE, ""


def serve() -> None:
    """Answer requests until there are no more, or until a signal or the end of the parent ends the run at hand."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints is no answer
    threading.Thread(target=_watch, args=(os.getppid(),), daemon=True).start()
    with suppress(KeyboardInterrupt, BrokenPipeError):
        for line in sys.stdin:
            code, message = perform(json.loads(line))
            answers.write(json.dumps({"exit_code": code, "message": message}) + "\n")
            answers.flush()
            if code == EXIT_INTERRUPTED:
                break


def _watch(parent: int) -> None:
    """End the run at hand, with its checkpoint, once the process that gives the work is no more: it was killed."""
    while os.getppid() == parent:
        time.sleep(_WATCH)
    os.kill(os.getpid(), signal.SIGTERM)
