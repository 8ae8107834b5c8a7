"""Exposed sites of two runs, such as two revisions of one site."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fragfield.studies.compare.runs import ComparedRun

__all__ = ["compare_places"]

_VALUES = {"density": ("density_normal", "density_ground"), "probability": ("probability",), "hits": ("expected_hits",)}


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
    quantity, limit = entry["criterion"]["quantity"], entry["criterion"]["limit"]
    bounds = [entry[name]["upper"] for name in _VALUES[quantity] if entry[name]]
    return {
        "verdict": entry["verdict"],
        "quantity": quantity,
        "part_of_criterion": max(bounds) / limit if bounds else None,
        "probability": (entry["probability"] or {}).get("upper"),
        "margin": entry["margin"],
    }
