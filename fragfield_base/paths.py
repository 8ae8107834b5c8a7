"""Names of files as people give them: absolute from the start, "~" expanded, what cannot be a name refused.

The command line leaves the working folder, in which libraries look for settings of their own (`matplotlibrc`,
`.petscrc`, `.numba_config.yaml`), once it has begun. Names are relative to the folder in which it began.
"""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

_ELSEWHERE = "/"
_REFUSED = {
    errno.ELOOP: "a loop of symbolic links; allowed: links that end at a file or folder",
    errno.ENAMETOOLONG: "a name that is too long for this file system; allowed: a shorter one",
}
_start: Path | None = None


def start_folder(error: type[Exception]) -> Path:
    """The folder in which the command began, or the working folder; `error` where that is no more."""
    try:
        return _start or Path.cwd()
    except OSError as found:
        raise error(f"the working folder cannot be used ({found.strerror}); change into another one") from None


def leave_folder(error: type[Exception]) -> None:
    """Keep the folder in which the command began, and leave it."""
    global _start  # noqa: PLW0603 - of the process, as the working folder is
    _start = start_folder(error)
    os.chdir(_ELSEWHERE)


def absolute(path: str | os.PathLike[str], error: type[Exception], folder: Path | None = None) -> Path:
    """The absolute path of a file or folder that somebody named; it need not exist.

    "~" and "~name" at its beginning are the home folders of the user and of that user. A relative name is relative to
    `folder`, such as that of a case file; left out: see `start_folder`. Raises `error`, with one message, for an empty
    name, one that is not UTF-8, an unknown home, a loop of links.
    """
    text = os.fsdecode(path)
    if not text:
        raise error("found an empty name of a file; allowed: a name")
    if text.startswith("~"):
        text = os.path.expanduser(text)  # noqa: PTH111 - leaves an unknown home as it is, without an error
        if text.startswith("~"):
            home = text.partition("/")[0]
            raise error(f"{path}: found {home}, and there is no such home; a name with a tilde: ./{text}")
    place = (folder or start_folder(error)) / text
    try:
        str(place).encode("utf-8")
    except UnicodeEncodeError:
        raise error(f"{place}: a name that is not UTF-8; allowed: rename it, or a link to it") from None
    try:
        place.stat()
    except ValueError:
        raise error(f"{place}: found the character NUL in a name; allowed: any other") from None
    except OSError as found:
        if found.errno in _REFUSED:
            raise error(f"{place}: {_REFUSED[found.errno]}") from None
    return place


def shown(found: Any) -> Any:  # noqa: ANN401 - of the kind that is given
    """A text, or all texts of tables and lists, with files below the folder of the beginning named from there."""
    if _start is None or _start == Path(_ELSEWHERE):
        return found
    if isinstance(found, str):
        return found.replace(f"{_start}{os.sep}", "")
    if isinstance(found, dict):
        return {key: shown(value) for key, value in found.items()}
    if isinstance(found, (list, tuple)):
        return type(found)(shown(value) for value in found)
    return found
