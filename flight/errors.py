"""Errors and warnings of the flight library, with messages that say what to do."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING

from fragfield_base import errors

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["FlightWarning", "InputError", "nearest"]


class InputError(errors.InputError):
    """The input cannot be flown; the message says what was found and what is allowed."""


class FlightWarning(UserWarning):
    """The result stands, but rests on something the user should know; `code` names what, for programs."""

    code = "flight"


class DragTableWarning(FlightWarning):
    """Fragments were faster than the end of the drag table reaches."""

    code = "drag_table"


def nearest(name: str, valid: Iterable[str]) -> str:
    """End of a message about an unknown name: the nearest valid one, and all that are allowed."""
    names = list(valid)
    close = get_close_matches(name.casefold(), [one.casefold() for one in names], n=1, cutoff=0.5)
    # Of names that differ in case alone ("mm" and "Mm") the one of fewer capitals.
    alike = sorted((one for one in names if one.casefold() in close), key=lambda one: sum(map(str.isupper, one)))
    hint = f"; did you mean {alike[0]!r}?" if alike else ""
    return f"{hint} (allowed: {', '.join(names)})"
