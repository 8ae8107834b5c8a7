"""Preparation of the process: standard streams that accept any text."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, TextIO

import typer

from fragfield.errors import EXIT_INPUT, InputError
from fragfield_base.ambient import settle
from fragfield_base.paths import leave_folder

if TYPE_CHECKING:
    from collections.abc import Iterator


def prepare_process() -> list[str]:
    """Let no letter fail, and keep this process from what it has not been given; its arguments.

    Libraries see neither the arguments nor the working folder. Raises InputError: a variable holds what it must not.
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
    leave_folder(InputError)
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
