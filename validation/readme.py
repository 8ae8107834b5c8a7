"""Tables in the README, between marks, so that no figure there is typed by hand."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["README", "insert_tables"]

README = Path(__file__).resolve().parent.parent / "README.md"


def insert_tables(tables: Mapping[str, str], path: Path = README) -> None:
    """Replace what stands between `<!-- begin NAME -->` and `<!-- end NAME -->`.

    Raises
    ------
    ValueError
        The file has no such marks.
    """
    text = path.read_text(encoding="utf-8")
    for name, table in tables.items():
        pattern = re.compile(rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", re.DOTALL)
        text, found = pattern.subn(lambda marks, table=table: f"{marks[1]}{table}\n{marks[2]}", text)
        if not found:
            raise ValueError(f"{path.name} has no marks for the table {name}")
    path.write_text(text, encoding="utf-8")
