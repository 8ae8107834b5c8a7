"""The reference of summary.json, made from the catalogue of output quantities."""

from __future__ import annotations

from itertools import groupby

from fragfield.quantities import QUANTITIES, schema

__all__ = ["summary_reference"]


def summary_reference() -> str:
    """A table of all values of each part of summary.json, as Markdown."""
    parts = []
    for part, values in groupby(QUANTITIES.values(), key=lambda one: one.path.partition(".")[0].removesuffix("[]")):
        about = schema()["properties"][part].get("description", "")
        lines = [f"### {part}", "", about, "", "| key | unit | meaning |", "|---|---|---|"]
        for one in values:
            meaning = ". ".join(words for words in (one.label, one.note) if words).replace("|", "\\|")
            lines.append(f"| `{one.path.partition('.')[2] or one.path}` | {one.unit} | {meaning} |")
        parts.append("\n".join(lines))
    return "\n\n".join(parts)
