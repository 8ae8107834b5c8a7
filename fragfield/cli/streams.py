"""Preparation of the process: standard streams that accept any text."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import typer

from fragfield.errors import EXIT_INPUT, InputError
from fragfield_base.ambient import settle

if TYPE_CHECKING:
    from collections.abc import Iterator


def prepare_process() -> list[str]:
    """Let no letter fail, and settle the variables of libraries; the arguments, which no library sees.

    Raises InputError: a variable holds what it must not.
    """
    closed = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - as long as the process
    sys.stdout, sys.stderr = sys.stdout or closed, sys.stderr or closed
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # names of a case in a terminal that knows ASCII alone
    settle(InputError)
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
