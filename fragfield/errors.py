"""Input errors, numerical stops and program faults, with their exit codes.

In Python `fragfield.InputError` and `fragfield.NumericalStop` are those of `fragfield_base.errors`, which the errors of
every stage are; a distance that is not determined is a `NotDeterminedError` once it is asked for.
"""

from __future__ import annotations

import os
import sys
import threading
from typing import TYPE_CHECKING

from fragfield_base import errors

if TYPE_CHECKING:
    from collections.abc import Iterable
    from types import FrameType


EXIT_DONE = 0
EXIT_INPUT = 2
EXIT_NUMERICAL = 3  # a numerical stop, or a result that is not determined
EXIT_FAULT = 4  # a fault of the program itself
EXIT_INTERRUPTED = 130

_AGAIN = 0.05  # s after which an interruption that was dropped or deferred comes again
_PATIENCE = 200  # times that one is deferred: an import that hangs is interrupted all the same
_IMPORTS = "<frozen importlib._bootstrap>"
_interrupts: list[int] = []  # signals that came, see `interrupt`
_deferred: list[int] = []


class InputError(errors.InputError):
    """The input cannot be used; the message names the file, the key, what was found and what is allowed."""


class NotDeterminedError(RuntimeError):
    """The distance that was asked for is not determined; the message says why."""


def exit_code_of(error: BaseException) -> int:
    """Exit code of the command line for an error: 2 input, 3 numerical stop, 130 interrupted, 4 anything else."""
    if isinstance(error, KeyboardInterrupt):
        return EXIT_INTERRUPTED
    if isinstance(error, errors.InputError):
        return EXIT_INPUT
    if isinstance(error, (errors.NumericalStop, NotDeterminedError)):
        return EXIT_NUMERICAL
    if isinstance(error, (MemoryError, OSError)):
        return EXIT_INPUT  # of the machine or of a file: the user's to mend
    return EXIT_INTERRUPTED if _interrupts else EXIT_FAULT


def interrupt(number: int, frame: FrameType | None) -> None:
    """Handler of signals that end a command: as Python's own, and remembers that one came.

    While modules are loaded it is deferred: there C libraries turn a KeyboardInterrupt into another error, or end the
    process.
    """
    importing = frame
    while importing is not None and importing.f_code.co_filename != _IMPORTS:
        importing = importing.f_back
    if importing is not None and len(_deferred) < _PATIENCE:
        _deferred.append(number)
        _send_again(number)
        return
    _interrupts.append(number)
    raise KeyboardInterrupt


def interrupt_again(unraisable: sys.UnraisableHookArgs) -> None:
    """As `sys.unraisablehook`: Python drops what is raised in a call-back of a C library, the compiler's for one.

    An interruption that was dropped there comes again a moment later, outside of the call-back.
    """
    if not isinstance(unraisable.exc_value, KeyboardInterrupt) or not _interrupts:
        sys.__unraisablehook__(unraisable)
        return
    _send_again(_interrupts[-1])


def _send_again(number: int) -> None:
    later = threading.Timer(_AGAIN, os.kill, (os.getpid(), number))
    later.daemon = True
    later.start()


def message_of(error: BaseException) -> str:
    """One message for an error that ends a command; an error of the program is named by its kind."""
    if isinstance(error, KeyboardInterrupt) or exit_code_of(error) == EXIT_INTERRUPTED:
        return "interrupted; what was written stays, --resume goes on from there"
    if isinstance(error, MemoryError):
        return f"out of memory{f' ({error})' if str(error) else ''}; larger cells or fewer rounds need less of it"
    if isinstance(error, OSError) and exit_code_of(error) == EXIT_INPUT:
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{error.strerror or error}"
    if exit_code_of(error) == EXIT_FAULT:
        text = " ".join(str(error).split())
        words = f"{type(error).__name__}{f': {text}' if text else ''}"
        return f"fault of the program: {words if len(words) <= 300 else words[:297] + '...'}"
    return str(error)


def nearest(name: str, allowed: Iterable[str]) -> str:
    """' (did you mean "..."?)' with the nearest allowed name, or an empty string when none is near."""
    close = nearest_name(name, allowed)
    return f' (did you mean "{close}"?)' if close is not None else ""


def nearest_name(name: str, allowed: Iterable[str]) -> str | None:
    """The allowed name that is nearest to another, upper or lower case; None when none is near."""
    return errors.nearest_name(name, allowed, likeness=0.6)
