"""One log file for a run, written by rank 0; warnings also go to stderr."""

from __future__ import annotations

import logging
import os
import re
import sys
import warnings
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TextIO

from fragfield.errors import InputError
from fragfield_base.paths import shown
from fragfield_base.writing import append_text_file

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


LOGGERS = ("fragfield", "burst_fenicsx", "transition", "flight", "py.warnings")
"""Those of our packages, and that of Python's warnings."""
_FORMAT = "%(asctime)s %(levelname)-7s %(name)s: %(message)s"


class _Short(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return visible(shown(f"{record.levelname.lower()}: {words_of(record)}"))


def words_of(record: logging.LogRecord) -> str:
    """What a record says, of Python's warnings without the line of source that they come from."""
    return str(getattr(record, "words", None) or record.getMessage())


def concerns_the_user(record: logging.LogRecord) -> bool:
    """Whether a record is ours; of Python's warnings those of our own kinds, not a library's deprecations."""
    if record.name != "py.warnings":
        return True
    category = getattr(record, "category", None)
    return category is not None and category.__module__ != "builtins"


class _Once(logging.Filter):
    def __init__(self) -> None:
        super().__init__()
        self._said: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        words, known = words_of(record), len(self._said)
        self._said.add(words)
        return len(self._said) > known


@contextmanager
def _handled(handler: logging.Handler) -> Iterator[None]:
    loggers = [logging.getLogger(name) for name in LOGGERS]
    before = [(logger, logger.level, logger.propagate) for logger in loggers]
    for logger in loggers:
        logger.addHandler(handler)
        logger.propagate = False  # some libraries hang a handler of their own on the root logger
        logger.setLevel(min(logger.level or logging.INFO, logging.INFO))
    try:
        yield
    finally:
        for logger, level, propagate in before:
            logger.removeHandler(handler)
            logger.setLevel(level)
            logger.propagate = propagate
        handler.close()


class _Visible(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return visible(super().format(record))


class _LogFile(logging.StreamHandler[TextIO]):
    """A log that a full disk does not stop: the run says so itself when it can write nothing else either."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Drop the record."""

    def close(self) -> None:
        with suppress(OSError, ValueError):
            self.stream.close()
        super().close()


@contextmanager
def logged(path: Path, *, fresh: bool) -> Iterator[None]:
    """Write what the packages log, and Python's warnings, to a file.

    `path`: the log file; `fresh`: start the file again; otherwise go on at its end.
    """
    descriptor = append_text_file(path, InputError, fresh=fresh)
    stream = os.fdopen(descriptor, "a", encoding="utf-8", errors="backslashreplace")
    handler = _LogFile(stream)
    handler.setFormatter(_Visible(_FORMAT))
    with _captured_warnings(), _handled(handler):
        yield


@contextmanager
def to_stderr(*, quiet: bool) -> Iterator[None]:
    """Show warnings on stderr, with `quiet` errors only; what libraries log (rasterio) is no message of ours."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(logging.ERROR if quiet else logging.WARNING)
    handler.setFormatter(_Short())
    handler.addFilter(concerns_the_user)
    handler.addFilter(_Once())
    silent, root = logging.NullHandler(), logging.getLogger()  # without a handler Python shows all of them
    root.addHandler(silent)
    try:
        with _captured_warnings(), _handled(handler):
            yield
    finally:
        root.removeHandler(silent)


@contextmanager
def _captured_warnings() -> Iterator[None]:
    """Python's warnings as records of the logger "py.warnings", with their code.

    Not by `logging.captureWarnings`, which no library may call meanwhile, as ffcx does when the burst loads it: our
    warnings would lose their code, and with it their place in summary.json and on the terminal.
    """

    def leave(capture: bool) -> None:
        """Let warnings go where they go already."""

    before = warnings.showwarning, logging.captureWarnings
    warnings.showwarning, logging.captureWarnings = _show, leave
    try:
        yield
    finally:
        warnings.showwarning, logging.captureWarnings = before


def _show(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    if file is not None:
        file.write(warnings.formatwarning(message, category, filename, lineno, line))
        return
    text = warnings.formatwarning(message, category, filename, lineno, line)
    code = getattr(category, "code", category.__name__)
    extra = {"words": str(message), "category": category, "code": code}
    logging.getLogger("py.warnings").warning("%s", text, extra=extra)


# C0 and C1 but for the new line and the tabulator, marks that turn the direction of writing, and halves of characters,
# as which Python reads the bytes of a file name that are no UTF-8.
_HIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
# In names of keys those two as well: they would break a message into lines.
_HIDDEN_IN_NAME = re.compile(_HIDDEN.pattern.replace("[", "[\t\n\u2028\u2029", 1))


def visible(found: Any) -> Any:  # noqa: ANN401 - of the kind that is given
    r"""A text, or all texts of tables and lists, with control characters as Python writes them (`\x1b`)."""
    if isinstance(found, str):
        return _escaped(_HIDDEN, found)
    if isinstance(found, dict):
        return {visible(key): visible(value) for key, value in found.items()}
    if isinstance(found, (list, tuple)):
        return type(found)(visible(value) for value in found)
    return found


def hidden_in(document: object) -> Iterator[tuple[str, str]]:
    """Keys of a document (entries counted from 1) whose text, or whose own name, holds such a character, with it."""
    waiting: list[tuple[str, object]] = [("", document)]
    while waiting:
        path, found = waiting.pop()
        if isinstance(found, dict):
            for key, value in found.items():
                name = _escaped(_HIDDEN_IN_NAME, str(key))
                below = f"{path}.{name}" if path else name
                waiting.append((below, value))
                if match := _HIDDEN_IN_NAME.search(str(key)):
                    yield below, f"U+{ord(match[0]):04X}"
        elif isinstance(found, (list, tuple)):
            waiting += [(f"{path}[{number}]", value) for number, value in enumerate(found, start=1)]
        elif isinstance(found, str) and (match := _HIDDEN.search(found)):
            yield path, f"U+{ord(match[0]):04X}"


def _escaped(hidden: re.Pattern[str], text: str) -> str:
    return hidden.sub(lambda match: repr(match[0])[1:-1], text)
