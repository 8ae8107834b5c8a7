"""The tables of benchmarks/README.md, written by the run that measured them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.history import HISTORY
from benchmarks.table import markdown, shown
from benchmarks.targets import targets_table
from validation.readme import insert_tables

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["README", "write_tables", "write_targets"]

README = Path(__file__).resolve().parent / "README.md"


def write_tables(found: Mapping[str, Mapping[str, Any]], path: Path = README) -> None:
    """Put the figures of each benchmark between its marks, with a line that says on what they were taken."""
    place = _machine(found["machine"])
    tables = {name: f"{markdown(figures)}\n\n{place}" for name, figures in found.items() if name != "machine"}
    insert_tables(tables, path)


def write_targets(folder: Path = HISTORY, path: Path = README) -> None:
    """Put the table of all targets, on all machines of the history, between its marks."""
    insert_tables({"targets": targets_table(folder)}, path)


def _machine(found: Mapping[str, Any]) -> str:
    """The machine in a line."""
    caches = ", ".join(f"{name} {size}" for name, size in found["caches"].items())
    versions = ", ".join(f"{name} {text}" for name, text in found["versions"].items())
    cores = f"{found['cores']} core{'s' * (found['cores'] != 1)}"
    memory = shown("bytes", found["memory_bytes"])
    return f"{found['date']}: {found['processor']}, {cores}, {caches}, {memory}; {versions}."
