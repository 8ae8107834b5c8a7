"""Names of explosives as people write them: "comp_b", "Comp. B" and "Composition B" are one."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Mapping

    Value = TypeVar("Value")

__all__ = ["explosive_key", "value_for"]


def explosive_key(name: str) -> str:
    """Letters and digits of the name alone, in lower case, "composition" shortened to "comp"."""
    return re.sub(r"[^a-z0-9]", "", name.casefold()).replace("composition", "comp")


def value_for(name: str, values: Mapping[str, Value]) -> Value | None:
    """The value of an explosive in a table by name, whichever way both are written; None where it is not in it."""
    wanted = explosive_key(name)
    return next((value for known, value in values.items() if explosive_key(known) == wanted), None)
