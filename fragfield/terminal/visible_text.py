"""Makes control characters of foreign text visible on a terminal."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["hidden_in", "visible"]

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
