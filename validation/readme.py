"""The pages that show the record: validation/README.md case by case, and the summary in README.md."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validation.rows import KINDS, markdown_table, rows_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["FRONT", "PAGE", "case_text", "insert_tables", "overview", "totals", "write_pages"]

FRONT = Path(__file__).resolve().parent.parent / "README.md"
PAGE = Path(__file__).resolve().parent / "README.md"


def insert_tables(tables: Mapping[str, str], path: Path = PAGE) -> None:
    """Replace what stands between `<!-- begin NAME -->` and `<!-- end NAME -->`.

    Raises
    ------
    ValueError
        The file has no such marks.
    """
    text = path.read_text(encoding="utf-8")
    for name, table in tables.items():
        marks = re.search(rf"(?<=<!-- begin {name} -->\n).*?(?=<!-- end {name} -->)", text, re.DOTALL)
        if marks is None:
            raise ValueError(f"{path.name} has no marks for the table {name}")
        text = f"{text[: marks.start()]}{table}\n{text[marks.end() :]}"
    path.write_text(text, encoding="utf-8")


def write_pages(
    entries: Mapping[str, Mapping[str, Any]], meaning: Mapping[str, str], page: Path = PAGE, front: Path = FRONT
) -> None:
    """Write all tables from the record; `meaning` says by case, in words, what it means for a distance."""
    tables = {name: case_text(one) for name, one in entries.items()}
    insert_tables({"overview": overview(entries, meaning), "totals": totals(entries), **tables}, page)
    insert_tables({"validation": totals(entries)}, front)


def overview(entries: Mapping[str, Mapping[str, Any]], meaning: Mapping[str, str]) -> str:
    """A line a case: rows by kind, how far off the comparisons are, and what that means for a distance."""
    body = []
    for name, words in meaning.items():
        rows = entries[name]["rows"] if name in entries else []
        checks = [row for row in rows if row["kind"] != "comparison" and row["passed"] is not None]
        passed = sum(row["passed"] for row in checks)
        link = f"[{name}](#{name})" if rows else f"{name} (not computed)"
        body.append((link, f"{passed} of {len(checks)}" if checks else "-", _errors(rows), words))
    return markdown_table(("case", "checks passed", "error of the comparisons", "what it means for a distance"), body)


def _errors(rows: Sequence[Mapping[str, Any]]) -> str:
    errors = [100.0 * row["error"] for row in rows
              if row["kind"] == "comparison" and row["error"] is not None and row["tolerance"] != 0.0]  # fmt: skip
    if not errors:
        return "-"
    low, high = min(errors), max(errors)
    return f"{low:+.0f} %" if len(errors) == 1 else f"{low:+.0f} to {high:+.0f} %"


def totals(entries: Mapping[str, Mapping[str, Any]]) -> str:
    """Numbers of rows by kind, with the misses by name."""
    rows = [row for entry in entries.values() for row in entry["rows"]]
    body = []
    for kind in KINDS:
        own = [row for row in rows if row["kind"] == kind]
        judged = [row for row in own if row["passed"] is not None]
        missed = [row for row in judged if not row["passed"]]
        if kind == "comparison":
            words = f"{len(judged) - len(missed)} of {len(judged)} within the uncertainty that the test states"
        else:
            words = f"{len(judged) - len(missed)} of {len(judged)} passed"
            words += "".join(f"; missed: {row['case']}, {row['quantity']}" for row in missed)
        body.append((kind, str(len(own)), words))
    return markdown_table(("kind of row", "rows", "result"), body)


def case_text(entry: Mapping[str, Any]) -> str:
    """The rows of a case, and the revision that computed them."""
    changed = f" {entry['before']}" if entry.get("before") else ""
    sources = "; ".join(dict.fromkeys(row["source"] for row in entry["rows"]))
    return (
        f"Computed {entry['date'][:10]}, revision {entry['revision']}.{changed}\n\n"
        f"{rows_table(entry['rows'])}\n\nReferences: {sources}."
    )
