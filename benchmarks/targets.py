"""Every ratio that has a target, on each kind of machine on which it was last measured, from `history/`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from benchmarks.table import rows_of
from validation.rows import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["comparisons", "machine_name", "targets_table"]


def comparisons(found: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Figure, target and whether it is met, as text, of every comparison with a target, by benchmark and its words."""
    return {
        f"{name}: {row.what}": {"figure": row.figure, "target": row.target, "met": row.met}
        for name, figures in found.items()
        if name != "machine"
        for row in rows_of(figures)
        if row.target
    }


def machine_name(machine: Mapping[str, Any]) -> str:
    """A kind of machine in a few words."""
    return f"{machine['processor']}, {machine['cores']} cores".replace("(R)", "")


def targets_table(folder: Path) -> str:
    """Markdown: a row for each comparison, a column for each machine with the newest figure and its date."""
    newest: dict[str, dict[str, tuple[str, dict[str, str]]]] = {}
    machines: list[str] = []
    for path in sorted(folder.glob("*.jsonl")):
        for line in map(json.loads, path.read_text(encoding="utf-8").splitlines()):
            for what, one in line.get("comparisons", {}).items():
                if line["machine"] not in machines:
                    machines.append(line["machine"])
                newest.setdefault(what, {})[line["machine"]] = (line["date"], one)
    rows = []
    for what, by_machine in newest.items():
        _, last = max(by_machine.values(), key=lambda measured: measured[0])
        target = last["target"]
        rows.append((what, target, *(_cell(by_machine.get(name)) for name in machines)))
    return markdown_table(("what", "target", *machines), rows)


def _cell(measured: tuple[str, dict[str, str]] | None) -> str:
    """A figure with its date, and a word where the target of that day was missed."""
    if measured is None:
        return ""
    date, one = measured
    return f"{one['figure']}{' MISSED' if one['met'] == 'MISSED' else ''} ({date})"
