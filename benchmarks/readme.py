"""The tables of benchmarks/README.md, written by the run that measured them; targets are from `history/`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.history import HISTORY
from benchmarks.table import markdown, shown
from validation.readme import insert_tables
from validation.rows import markdown_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

__all__ = ["README", "targets_table", "write_tables", "write_targets"]

README = Path(__file__).resolve().parent / "README.md"


def write_tables(found: Mapping[str, Mapping[str, Any]], path: Path = README) -> None:
    """Put the figures of each benchmark between its marks, with a line that says on what they were taken."""
    place = _machine(found["machine"])
    tables = {name: f"{markdown(figures)}\n\n{place}" for name, figures in found.items() if name != "machine"}
    insert_tables(tables, path)


def write_targets(names: Iterable[str], folder: Path = HISTORY, path: Path = README) -> None:
    """Put the table of all targets, on all machines of the history, between its marks."""
    insert_tables({"targets": targets_table(folder, names)}, path)


def _machine(found: Mapping[str, Any]) -> str:
    """The machine in a line."""
    caches = ", ".join(f"{name} {size}" for name, size in found["caches"].items())
    versions = ", ".join(f"{name} {text}" for name, text in found["versions"].items())
    cores = f"{found['cores']} core{'s' * (found['cores'] != 1)}"
    memory = shown("bytes", found["memory_bytes"])
    return f"{found['date']}: {found['processor']}, {cores}, {caches}, {memory}; {versions}."


def targets_table(folder: Path, names: Iterable[str]) -> str:
    """Markdown: a row for each comparison of these benchmarks, a column for each machine with its newest figure."""
    newest: dict[str, dict[str, tuple[str, dict[str, str]]]] = {}
    machines: list[str] = []
    for path in sorted(folder.glob("*.jsonl")):
        for line in map(json.loads, path.read_text(encoding="utf-8").splitlines()):
            for what, one in line.get("comparisons", {}).items():
                if what.partition(":")[0] not in names:
                    continue
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
