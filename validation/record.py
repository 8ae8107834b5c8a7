"""The validation's results as the report reads them: one JSON file that goes with the program.

The file says of every case when, by which version and with which cells (`quick`) it was computed, so that a report can
show whether the evidence is of the very version that it reports on. A case computed again replaces its entry and leaves
the others::

    {"format": "fragfield validation", "format_version": 1,
     "cases": {"copper_cylinder": {"date": ..., "fragfield": "0.1.0", "revision": ..., "versions": {...},
                                   "quick": false, "stopped": null, "rows": [{"case": ..., "quantity": ..., ...}]}}}

`rows` are those of `python -m validation --json`; `stopped` is what a case that could not go on said. The results that
`validation.keeping` keeps out of the record lie beside it in the same format; NaN is null there.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from fragfield_base.writing import replacing
from validation.readme import README
from validation.rows import Row, markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

__all__ = ["FORMAT", "RECORD", "Outcome", "entry", "overview", "read_record", "write_record"]

FORMAT = "fragfield validation"
FORMAT_VERSION = 1
RECORD = README.parent / "fragfield" / "data" / "validation.json"
_MOST_MISSES = 3  # named in the overview


@dataclass(frozen=True)
class Outcome:
    """What a case gave: its rows, and why it stopped where it did not come to an end."""

    rows: tuple[Row, ...]
    stopped: str | None = None


def entry(outcome: Outcome, *, quick: bool) -> dict[str, Any]:
    """The record of a case that was computed now, by this version."""
    from fragfield.files.provenance import revision, versions

    found = versions()
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "fragfield": found["fragfield"],
        "revision": revision(),
        "versions": found,
        "quick": quick,
        "stopped": outcome.stopped,
        "rows": [_finite(row.as_dict()) for row in outcome.rows],
    }


def _finite(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row as JSON can hold it."""
    return {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}


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


def overview(entries: Mapping[str, Any], order: Sequence[str]) -> str:
    """Table for the README: one line a case, with every miss named as far as there is room."""
    body = []
    for name in order:
        if name not in entries:
            body.append((f"`{name}`", "-", "-", "not computed", ""))
            continue
        one = entries[name]
        judged = [row for row in one["rows"] if row["passed"] is not None]
        missed = [row for row in judged if not row["passed"]]
        words = [_miss(row) for row in missed[:_MOST_MISSES]]
        if len(missed) > _MOST_MISSES:
            words.append(f"{len(missed) - _MOST_MISSES} more")
        if one["stopped"]:
            words.append(f"stopped: {one['stopped']}")
        how = f"{one['fragfield']}{', quick' if one['quick'] else ''}"
        body.append((f"`{name}`", str(len(judged)), str(len(judged) - len(missed)), "; ".join(words) or "none", how))
    return markdown_table(("case", "checks", "passed", "missed", "version"), body)


def _miss(row: Mapping[str, Any]) -> str:
    bounded = row["tolerance"] == 0.0
    return f"{row['quantity']} {row['error']:+.2g}" if bounded else f"{row['quantity']} {100 * row['error']:+.1f} %"
