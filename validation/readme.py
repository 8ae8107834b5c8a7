"""Tables and pictures in the READMEs, so that no figure there is typed by hand."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["LADDER", "PICTURES", "README", "copy_figures", "insert_tables"]

README = Path(__file__).resolve().parent.parent / "README.md"
LADDER = Path(__file__).resolve().parent / "README.md"
"""Where the rows of the cases stand in full."""
PICTURES = README.parent / "docs" / "pictures"


def insert_tables(tables: Mapping[str, str], path: Path = LADDER) -> None:
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


def copy_figures(figures: Path, names: Sequence[str], prefix: str, folder: Path = PICTURES) -> None:
    """Copy a run's figures (PNG) to where the README finds them, as `<prefix>_<name>.png`."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        shutil.copyfile(figures / f"{name}.png", folder / f"{prefix}_{name}.png")
