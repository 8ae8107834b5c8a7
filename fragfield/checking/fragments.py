"""`fragfield check --fragments`: whether fragments of another source fit the case with which they are to be flown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.pipeline.arena import read_arena

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.case import Case

__all__ = ["fragments_report"]


def fragments_report(case: Case, path: Path) -> dict[str, Any]:
    """What a file of fragments or an arena table holds.

    Returns
    -------
    dict
        `fragments`: `file`, `number` and `mass` (kg) of all fragments as they are flown, of an arena table those of one
        round; and of that `recovered`, as `flight.recovered` of summary.json. `warnings`.

    Raises
    ------
    InputError
        The file cannot be read, or an arena table has not the mass of the case's rounds.
    """
    found = read_arena(path, case)
    if found is None:
        from flight import Fragments

        fragments = Fragments.read(path)
        held = {"file": path.name, "number": len(fragments), "mass": float(fragments.mass.sum())}
        return {"fragments": held, "warnings": []}
    table, recovered = found
    held = {"file": path.name, "number": float(table.number.sum()), "mass": table.total_mass}
    warnings = [recovered.warning] if recovered.warning else []
    return {"fragments": {**held, "recovered": recovered.summary()}, "warnings": warnings}
