"""Names: the nearest of those that are allowed, for messages, and those of substances as people write them."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fragfield_base.substances import Kind

__all__ = ["names_allowed", "nearest_name", "plain_key", "substance_key", "substance_title"]


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
    """Letters and digits of a name, lower case, "composition" as "comp": "comp_b" and "Composition B" are one."""
    return re.sub(r"[^a-z0-9]", "", name.casefold()).replace("composition", "comp")


def substance_key(name: str, kind: Kind = "explosive") -> str:
    """The built-in name of a substance, however its name is written; letters and digits of one that is not built in.

    Every look-up of an explosive or a casing by its name goes through here.
    """
    from fragfield_base.substances import aliases

    key = plain_key(name)
    return aliases(kind).get(key, key)


def substance_title(name: str, kind: Kind = "explosive") -> str:
    """Name of a substance as text shows it: of a built-in one its usual name, of others the one given."""
    from fragfield_base.substances import substance, substance_names

    key = substance_key(name, kind)
    return substance(kind, key).title if key in substance_names(kind) else name
