"""Begin and end of a command: streams that accept any text, its result on stdout, or one message and an exit code."""

from __future__ import annotations

import os
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from json import dumps
from pathlib import Path
from typing import Any, TextIO

import typer

from fragfield.errors import EXIT_FAULT, EXIT_INPUT, EXIT_INTERRUPTED, InputError, exit_code_of, message_of
from fragfield.pipeline.parallel import launched_rank
from fragfield.terminal.logs import visible
from fragfield_base.ambient import settle
from fragfield_base.paths import shown


def print_paths(found: dict[str, Any]) -> None:
    """Print the paths of a result, one a line."""
    for paths in found.values():
        for path in paths:
            typer.echo(visible(str(path)))


def give(found: dict[str, Any], *, json: bool, show: Callable[[dict[str, Any]], None]) -> None:
    """Print a result: as one JSON object, or as text; files by their names from the folder of the beginning."""
    found = {key: value if key == "case" else shown(value) for key, value in found.items()}
    with to_stdout():
        if json:
            typer.echo(dumps(found, allow_nan=False))
        else:
            show(visible(found))


@contextmanager
def guarded(*, json: bool, quiet: bool) -> Iterator[None]:
    """End every error with one message and its exit code; the traceback of one of the program goes to a log."""
    from fragfield.terminal.logs import to_stderr

    try:
        with to_stderr(quiet=quiet or launched_rank() > 0):
            yield
    except KeyboardInterrupt as error:
        _print_message(message_of(error), json=json)
        raise typer.Exit(EXIT_INTERRUPTED) from error
    except typer.Exit:
        raise
    except Exception as error:  # noqa: BLE001 - the last guard: nothing passes it
        code, message = exit_code_of(error), message_of(error)
        if code == EXIT_FAULT:
            message += f"; please report it with {_log_of(error)}"
        _print_message(message, json=json, code=code)
        raise typer.Exit(code) from None


def _log_of(error: Exception) -> str:
    """Where the traceback of a fault can be read: the run's log, else a file of its own."""
    if (log := getattr(error, "fragfield_log", None)) is not None:
        return str(log)
    try:
        descriptor, name = tempfile.mkstemp(prefix="fragfield-fault-", suffix=".log")  # readable by its owner alone
        with os.fdopen(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(f"{' '.join(sys.argv)}\n")
            traceback.print_exception(error, file=file)
    except OSError:
        return "what you did (its traceback could not be written)"
    return name


def _print_message(message: str, *, json: bool, code: int = EXIT_INTERRUPTED) -> None:
    rank = launched_rank()
    if rank == 0 or code == EXIT_FAULT:  # which other ranks may not have met
        with suppress(OSError):
            typer.echo(f"fragfield: {f'rank {rank}: ' if rank else ''}{visible(shown(message))}", err=True)
    if rank > 0:
        return
    if json:
        with suppress(typer.Exit, InputError), to_stdout():
            typer.echo(dumps({"error": {"message": shown(message), "exit_code": code}}))


def prepare_process() -> list[str]:
    """Let no letter fail, and settle the variables of libraries; the arguments, which no library sees.

    Raises InputError: a variable holds what it must not, or the working folder is no more.
    """
    # A file that is opened while a standard stream is closed would get its number, and what libraries write there.
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free
    sys.stdout = sys.stdout or os.fdopen(os.dup(1), "w", encoding="utf-8")
    sys.stderr = sys.stderr or os.fdopen(os.dup(2), "w", encoding="utf-8")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # names of a case in a terminal that knows ASCII alone
    settle(InputError)
    try:
        Path.cwd()
    except OSError as fault:
        raise InputError(f"the working folder cannot be used ({fault.strerror}); change into another one") from None
    arguments = sys.argv[1:]
    sys.argv[1:] = []
    return arguments


def silence(stream: TextIO | None = None) -> None:
    """Let what is still to be written to a stream go nowhere: whoever read it has gone, or its disk is full.

    By default it is standard output.
    """
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), (stream or sys.stdout).fileno())


def finish_messages() -> None:
    """Write what is left for standard error, or drop it: Python 3.13 ends with 120 where that fails at its end."""
    try:
        sys.stderr.flush()
    except (OSError, ValueError):
        silence(sys.stderr)


@contextmanager
def to_stdout() -> Iterator[None]:
    """Write a result; raises InputError where it cannot be written, and ends silently where the reader is gone."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        silence()
        raise typer.Exit(EXIT_INPUT) from None
    except OSError as error:
        silence()
        raise InputError(f"standard output: cannot be written: {error.strerror or error}") from None
