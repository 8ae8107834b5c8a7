"""The results of the validation: one JSON file, of which the pages are made, and what the report takes of it.

Of every case it says when, by which version and revision it was computed; a case computed again replaces its entry, if
it came to its end with full cells and every row has numbers::

    {"format": "fragfield validation", "format_version": 1,
     "cases": {"copper_cylinder": {"date": ..., "fragfield": "0.1.0", "revision": ..., "versions": {...},
                                   "quick": false, "stopped": null, "rows": [{"case": ..., "quantity": ..., ...}]}}}

`rows` are those of `python -m validation --json`. `before` says, of an entry that an earlier revision computed, which
change of the program's numbers came after it.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield_base.writing import replacing

if TYPE_CHECKING:
    from collections.abc import Mapping

    from validation.rows import Rows

__all__ = ["EVIDENCE", "FORMAT", "RECORD", "entry", "read_record", "reason_against", "write_evidence", "write_record"]

FORMAT = "fragfield validation"
FORMAT_VERSION = 1
RECORD = Path(__file__).resolve().parent / "record.json"
EVIDENCE = RECORD.parent.parent / "fragfield" / "data" / "evidence.json"
"""What goes with the program, for its report."""
_MEASURED = ("m107_1944", "polar_zones", "copper_cylinder", "colliding_tubes", "steel_tubes", "paper_3_1", "paper_3_2")
"""Studies against measurements or published results, the nearest to a distance first."""
_SHOWN = ("case", "quantity", "ours", "reference", "unit", "error", "tolerance", "source", "subjects")


def reason_against(rows: Rows, stopped: str | None) -> str:
    """Why a result may not stand in the record, in words; empty if it may."""
    if stopped:
        return f"stopped: {stopped}"
    if rows.quick:
        return "these are coarse cells (--quick)"
    if not rows:
        return "there are no rows"
    if rows.unsound:
        return f"bursts with open energy or lost cells: {', '.join(rows.unsound)}"
    empty = [row.quantity for row in rows if not row.has_numbers]
    return f"rows without a number: {', '.join(empty)}" if empty else ""


def entry(rows: Rows) -> dict[str, Any]:
    """The record of a case that was computed now, by this version."""
    from fragfield.files.provenance import revision, versions

    found = versions()
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "fragfield": found["fragfield"],
        "revision": revision(),
        "versions": found,
        "quick": False,
        "stopped": None,
        "before": "",
        "rows": [row.as_dict() for row in rows],
    }


def read_record(path: Path = RECORD) -> dict[str, Any]:
    """Entries by case; none where there is no file.

    Raises
    ------
    ValueError
        The file is no such record.
    """
    if not path.is_file():
        return {}
    content = json.loads(path.read_text(encoding="utf-8"))
    if content.get("format") != FORMAT or content.get("format_version") != FORMAT_VERSION:
        raise ValueError(f"{path} is no record of the validation in version {FORMAT_VERSION}")
    cases: dict[str, Any] = content["cases"]
    return cases


def write_record(entries: Mapping[str, Any], path: Path = RECORD) -> None:
    """Write all entries, in the order given; a file that was there is whole until the new one is."""
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {"format": FORMAT, "format_version": FORMAT_VERSION, "cases": dict(entries)}
    text = json.dumps(content, indent=1, allow_nan=False) + "\n"
    with replacing(path, OSError) as file:
        file.write(text.encode("utf-8"))


def write_evidence(entries: Mapping[str, Any], path: Path = EVIDENCE) -> None:
    """Write numbers of checks and the comparisons with measurements, one a line, for the report."""
    judged = [row for one in entries.values() for row in one["rows"]
              if row["passed"] is not None and row["kind"] != "comparison"]  # fmt: skip
    head = {
        "checks": [sum(row["passed"] for row in judged), len(judged)],
        "versions": sorted({one["fragfield"] for one in entries.values()}),
        "revisions": sorted({one["revision"] for one in entries.values()}),
    }
    rows = [
        {key: float(f"{row[key]:.4g}") if isinstance(row[key], float) else row[key] for key in _SHOWN}
        for name in _MEASURED if name in entries for row in entries[name]["rows"]
        if row["kind"] == "comparison" and row["error"] is not None
    ]  # fmt: skip
    lines = ",\n".join(f"  {json.dumps(row, ensure_ascii=False)}" for row in rows)
    text = f'{json.dumps(head)[:-1]}, "comparisons": [\n{lines}\n]}}\n'
    with replacing(path, OSError) as file:
        file.write(text.encode("utf-8"))
