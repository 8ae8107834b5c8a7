"""Common base of the errors of all stages, so that one name catches them, and the nearest names for their messages."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches


class InputError(ValueError):
    """The input cannot be used; the message says where, what was found and what is allowed.

    Every stage raises one of its own, which is one of these.
    """


class NumericalStop(RuntimeError):  # noqa: N818 - it ends a run, it does not crash it
    """A computation left its bounds and was ended; the message says where and when."""


def nearest_name(name: str, allowed: Iterable[str], *, likeness: float = 0.5) -> str | None:
    """The allowed name that is nearest to another, upper or lower case; None when none is as like as `likeness`."""
    names = list(allowed)
    close = get_close_matches(name.casefold(), [one.casefold() for one in names], n=1, cutoff=likeness)
    # Of names that differ in case alone ("mm" and "Mm") the one of fewer capitals.
    alike = sorted((one for one in names if one.casefold() in close), key=lambda one: sum(map(str.isupper, one)))
    return alike[0] if alike else None


def names_allowed(name: object, valid: Iterable[str]) -> str:
    """End of a message about an unknown name: the nearest valid one, and all that are allowed."""
    names = list(valid)
    close = nearest_name(str(name), names)
    hint = f"; did you mean {close!r}?" if close is not None else ""
    return f"{hint} (allowed: {', '.join(names)})"


def plain_key(name: str) -> str:
    """Letters and digits of a name, lower case, "composition" as "comp": "comp_b" and "Composition B" are one.

    The one spelling by which `substances.substance_key` finds every substance.
    """
    return re.sub(r"[^a-z0-9]", "", name.casefold()).replace("composition", "comp")


def show(value: object) -> str:
    """A found value as a message shows it, shortened."""
    try:
        text = f'"{value}"' if isinstance(value, str) else repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits
        text = "something too large to print"
    return text if len(text) <= 60 else text[:57] + "..."
