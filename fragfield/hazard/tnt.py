"""Equivalents of explosives in TNT for blast, read from fragfield/data/tnt_equivalents.toml."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Any

from fragfield_base.names import value_for

__all__ = ["tnt_equivalent", "tnt_equivalents"]


@cache
def tnt_equivalents() -> dict[str, tuple[float, str]]:
    """Factor for peak incident overpressure and its source, by explosive."""
    text = (resources.files("fragfield") / "data" / "tnt_equivalents.toml").read_text(encoding="utf-8")
    table: dict[str, Any] = tomllib.loads(text)
    return {name: (entry["value"], table["source"][entry["source"]]) for name, entry in table["factor"].items()}


def tnt_equivalent(explosive: str) -> tuple[float, str]:
    """Equivalent of an explosive in TNT for peak pressure, and words on it with the source (empty for TNT itself).

    An explosive that is not in the table has the largest equivalent that is: its blast distances are then rather too
    long.
    """
    table = tnt_equivalents()
    known = value_for(explosive, table)
    if known is None:
        strongest = max(table, key=lambda name: table[name][0])
        factor, source = table[strongest]
        return factor, (
            f"{factor:g} for {explosive}, whose equivalent is not known: the largest known one, of {strongest} "
            f"({source})"
        )
    factor, source = known
    return factor, f"{factor:g} for {explosive} ({source})" if factor != 1.0 else ""
