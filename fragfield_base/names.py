"""Names: the nearest of those that are allowed, for messages, and those of explosives as people write them."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    Value = TypeVar("Value")

__all__ = ["explosive_key", "names_allowed", "nearest_name", "value_for"]


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


def explosive_key(name: str) -> str:
    """Letters and digits of the name, lower case, "composition" as "comp": "comp_b" and "Composition B" are one."""
    return re.sub(r"[^a-z0-9]", "", name.casefold()).replace("composition", "comp")


def value_for(name: str, values: Mapping[str, Value]) -> Value | None:
    """The value of an explosive in a table by name, whichever way both are written; None where it is not in it."""
    wanted = explosive_key(name)
    return next((value for known, value in values.items() if explosive_key(known) == wanted), None)
