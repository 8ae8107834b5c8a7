"""Names of files as people give them: absolute from the start, "~" expanded, what cannot be a name refused."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any


def absolute(path: str | os.PathLike[str], error: type[Exception], folder: Path | None = None) -> Path:
    """The absolute path of a file or folder that somebody named; it need not exist.

    "~" and "~name" at its beginning are the home folders of the user and of that user. A relative name is relative to
    `folder`, such as that of a case file; left out: to the working folder. Raises `error`, with one message, for an
    empty name, one that is not UTF-8, an unknown home.
    """
    text = os.fsdecode(path)
    if not text:
        raise error("found an empty name of a file; allowed: a name")
    if text.startswith("~"):
        text = os.path.expanduser(text)  # noqa: PTH111 - leaves an unknown home as it is, without an error
        if text.startswith("~"):
            home = text.partition("/")[0]
            raise error(f"{path}: found {home}, and there is no such home; a name with a tilde: ./{text}")
    place = (folder or Path.cwd()) / text
    try:
        str(place).encode("utf-8")
    except UnicodeEncodeError:
        raise error(f"{place}: a name that is not UTF-8; allowed: rename it, or a link to it") from None
    return place


def shown(found: Any) -> Any:  # noqa: ANN401 - of the kind that is given
    """A text, or all texts of tables and lists, with files below the working folder named from there."""
    if isinstance(found, str):
        try:
            here = str(Path.cwd())
        except OSError:  # it is no more
            return found
        return found if here == "/" else found.replace(f"{here}{os.sep}", "")
    if isinstance(found, dict):
        return {key: shown(value) for key, value in found.items()}
    if isinstance(found, (list, tuple)):
        return type(found)(shown(value) for value in found)
    return found
