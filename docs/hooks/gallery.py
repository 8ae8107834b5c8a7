"""The gallery: every script of examples/ with its words, its picture and its text."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["gallery", "scripts"]

ROOT = Path(__file__).resolve().parents[2]


def scripts() -> list[Path]:
    """The scripts, in alphabetical order."""
    return sorted((ROOT / "examples").glob("*.py"))


def gallery() -> str:
    """All examples as Markdown.

    Raises
    ------
    FileNotFoundError
        An example has no picture in docs/pictures; `sh setup.sh examples pictures` makes them.
    """
    return "\n\n".join("\n".join(_entry(path)) for path in scripts())


def _entry(path: Path) -> Iterator[str]:
    text = path.read_text(encoding="utf-8")
    first, _, rest = (ast.get_docstring(ast.parse(text)) or "").partition("\n\n")
    title = path.stem.replace("_", " ").capitalize()
    picture = ROOT / "docs" / "pictures" / f"example_{path.stem}.png"
    if not picture.is_file():
        raise FileNotFoundError(f"{picture} is missing: sh setup.sh examples pictures")
    yield f"## {title}"
    yield ""
    yield " ".join(first.split())
    yield ""
    yield f"![{title}](pictures/{picture.name})"
    yield ""
    yield " ".join(rest.split())
    yield ""
    yield f"`examples/{path.name}`:"
    yield ""
    yield f"```python\n{text.rstrip()}\n```"
