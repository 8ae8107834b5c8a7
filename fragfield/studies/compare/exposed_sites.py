"""Exposed sites of two runs, such as two revisions of one site."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.hazard.verdict import part_of_criterion

if TYPE_CHECKING:
    from fragfield.studies.compare.runs import ComparedRun

__all__ = ["compare_places"]


def compare_places(run: ComparedRun, reference: ComparedRun) -> list[dict[str, Any]]:
    """Rows by the name of the site: verdict, bound over the criterion, probability of a hit and margin of both.

    A site that only one run has stands with None for the other.
    """
    ours, theirs = (_places(one) for one in (run, reference))
    rows = []
    for name in dict.fromkeys([*ours, *theirs]):
        row: dict[str, Any] = {"name": name}
        for key, sites in (("run", ours), ("reference", theirs)):
            found = sites.get(name)
            row[key] = None if found is None else _row(found)
        rows.append(row)
    return rows


def _places(run: ComparedRun) -> dict[str, dict[str, Any]]:
    return {str(entry["name"]): entry for entry in run.summary.get("exposed") or []}


def _row(entry: dict[str, Any]) -> dict[str, Any]:
    return {
        "verdict": entry["verdict"],
        "quantity": entry["criterion"]["quantity"],
        "part_of_criterion": part_of_criterion(entry),
        "probability": (entry["probability"] or {}).get("upper"),
        "margin": entry["margin"],
    }
