"""The error that the break-up raises on purpose, with a message a user can act on."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING

from fragfield_base import errors

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["InputError", "nearest"]


class InputError(errors.InputError):
    """The input cannot be broken up; the message says what was found and what is allowed."""


def nearest(name: object, valid: Iterable[str]) -> str:
    """End of a message about an unknown name: the nearest valid one, and all that are allowed."""
    names = list(valid)
    close = get_close_matches(str(name).casefold(), [one.casefold() for one in names], n=1, cutoff=0.5)
    # Of names that differ in case alone ("mm" and "Mm") the one of fewer capitals.
    alike = sorted((one for one in names if one.casefold() in close), key=lambda one: sum(map(str.isupper, one)))
    hint = f"; did you mean {alike[0]!r}?" if alike else ""
    return f"{hint} (allowed: {', '.join(names)})"
