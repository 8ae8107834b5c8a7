"""One log file for a run, written by rank 0; warnings also go to stderr."""

from __future__ import annotations

import logging
import os
import sys
import threading
import warnings
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TextIO

from fragfield.errors import InputError
from fragfield.terminal.visible_text import visible
from fragfield_base.paths import shown
from fragfield_base.writing import append_text_file

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

__all__ = ["LOGGERS", "concerns_the_user", "logged", "to_stderr", "words_of"]

LOGGERS = ("fragfield", "burst_fenicsx", "transition", "flight", "py.warnings")
"""Those of our packages, and that of Python's warnings."""
_FORMAT = "%(asctime)s %(levelname)-7s %(name)s: %(message)s"
_lock = threading.Lock()
_shown_before: list[tuple[Any, Any]] = []  # as often as warnings are captured: what showed and captured them before
_before: dict[str, tuple[int, int, bool]] = {}  # of each logger in use: by how many, its level and propagation before


class _Short(logging.Formatter):
    """Level and message, as shown on the terminal."""

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


@contextmanager
def _handled(handler: logging.Handler, names: tuple[str, ...]) -> Iterator[None]:
    """Give the loggers a handler; the last of several that overlap, as in threads, leaves them as they were."""
    loggers = [logging.getLogger(name) for name in names]
    with _lock:
        for logger in loggers:
            users, level, propagate = _before.get(logger.name, (0, logger.level, logger.propagate))
            _before[logger.name] = users + 1, level, propagate
            logger.addHandler(handler)
            logger.propagate = False  # some libraries hang a handler of their own on the root logger
            logger.setLevel(min(logger.level or logging.INFO, logging.INFO))
    try:
        yield
    finally:
        with _lock:
            for logger in loggers:
                users, level, propagate = _before.pop(logger.name)
                logger.removeHandler(handler)
                if users > 1:
                    _before[logger.name] = users - 1, level, propagate
                else:
                    logger.setLevel(level)
                    logger.propagate = propagate
        handler.close()


class _Visible(logging.Formatter):
    """Whole records, without control characters of the texts in them."""

    def format(self, record: logging.LogRecord) -> str:
        return visible(super().format(record))


class _LogFile(logging.StreamHandler[TextIO]):
    """A log that a full disk does not stop: the run says so itself when it can write nothing else either."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Drop the record."""

    def close(self) -> None:
        """Close the file too."""
        with suppress(OSError, ValueError):
            self.stream.close()
        super().close()


@contextmanager
def logged(path: Path, *, fresh: bool) -> Iterator[None]:
    """Write what the packages log, and Python's warnings, to a file.

    Parameters
    ----------
    path : Path
        The log file.
    fresh : bool
        Start the file again; otherwise go on at its end.
    """
    descriptor = append_text_file(path, InputError, fresh=fresh)
    stream = os.fdopen(descriptor, "a", encoding="utf-8", errors="backslashreplace")
    handler = _LogFile(stream)
    handler.setFormatter(_Visible(_FORMAT))
    with _captured_warnings(), _handled(handler, LOGGERS):
        yield


@contextmanager
def to_stderr(*, quiet: bool) -> Iterator[None]:
    """Show warnings on stderr, with `quiet` errors only; what libraries log (rasterio) is no message of ours."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(logging.ERROR if quiet else logging.WARNING)
    handler.setFormatter(_Short())
    handler.addFilter(concerns_the_user)
    silent, root = logging.NullHandler(), logging.getLogger()  # without a handler Python shows all of them
    root.addHandler(silent)
    try:
        with _captured_warnings(), _handled(handler, LOGGERS):
            yield
    finally:
        root.removeHandler(silent)


@contextmanager
def _captured_warnings() -> Iterator[None]:
    """Python's warnings as records of the logger "py.warnings"; may be nested, and overlap in threads.

    `logging.captureWarnings` keeps one state for the whole process, which `warnings.catch_warnings` elsewhere undoes.
    No library may call it meanwhile, as ffcx does when the burst loads it: our warnings would lose their code, and with
    it their place in summary.json and on the terminal.
    """
    with _lock:
        if not _shown_before:
            _shown_before.append((warnings.showwarning, logging.captureWarnings))
        else:
            _shown_before.append(_shown_before[0])
        warnings.showwarning, logging.captureWarnings = _show, _leave_warnings
    try:
        yield
    finally:
        with _lock:
            before = _shown_before.pop()
            if not _shown_before:
                warnings.showwarning, logging.captureWarnings = before


def _show(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Log a warning with its kind and its code."""
    if file is not None:
        file.write(warnings.formatwarning(message, category, filename, lineno, line))
        return
    text = warnings.formatwarning(message, category, filename, lineno, line)
    code = getattr(category, "code", category.__name__)
    extra = {"words": str(message), "category": category, "code": code}
    logging.getLogger("py.warnings").warning("%s", text, extra=extra)


def _leave_warnings(capture: bool) -> None:
    """Stand in for `logging.captureWarnings`: warnings go where they go already."""
