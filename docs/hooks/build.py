"""What MkDocs does beyond its own: formulas, pages made from the program, tables of the README."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from docs.hooks.case_reference import built_in_tables, case_reference
from docs.hooks.command_reference import command_reference
from docs.hooks.mathematics import Mathematics

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig

__all__ = ["on_config", "on_page_markdown"]

ROOT = Path(__file__).resolve().parents[2]
_PLACE = re.compile(r"^<!-- insert (\w+)(?: (\w+))? -->$", re.MULTILINE)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Let Markdown read formulas."""
    config.markdown_extensions.append(Mathematics())  # type: ignore[arg-type]
    return config


def on_page_markdown(markdown: str, **_: object) -> str:
    """Put what a page asks for by `<!-- insert NAME -->` or `<!-- insert readme TABLE -->` in its place."""
    return _PLACE.sub(_insert, markdown)


def _insert(place: re.Match[str]) -> str:
    kind, name = place.groups()
    return readme_part(name) if kind == "readme" else _MADE[kind]()


def readme_part(name: str) -> str:
    """Lines of the README between the marks that `python -m validation` writes.

    Raises
    ------
    ValueError
        The README has no such marks.
    """
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(rf"<!-- begin {name} -->\n(.*?)<!-- end {name} -->", text, re.DOTALL)
    if found is None:
        raise ValueError(f"README.md has no part {name}")
    return found.group(1)


def validation_ladder() -> str:
    """The ladder's own page, with what it links to in the place of this one."""
    text = (ROOT / "validation" / "README.md").read_text(encoding="utf-8")
    return text.replace("../docs/pictures/", "pictures/")


def missed_rows() -> str:
    """Rows of the ladder's tables, without their sources, that missed what is allowed, as Markdown."""
    lines = ["| case | quantity | ours | reference | error | allowed |", "|---|---|---|---|---|---|"]
    for name, table in re.findall(r"<!-- begin (\w+) -->\n(.*?)<!-- end", validation_ladder(), re.DOTALL):
        for row in table.splitlines():
            cells = [cell.strip() for cell in row.strip("|").split("|")]
            if "MISSED" in cells:
                lines.append(f"| `{name}` | {' | '.join(cells[:5])} |")
    return "\n".join(lines)


_MADE = {
    "case_reference": case_reference,
    "built_in_tables": built_in_tables,
    "command_reference": command_reference,
    "validation_ladder": validation_ladder,
    "missed_rows": missed_rows,
}
