"""What MkDocs does beyond its own: formulas, pages made from the program, the ladder's tables, search, colours."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from docs.hooks.api_reference import api_reference
from docs.hooks.case_reference import built_in_tables, case_reference
from docs.hooks.command_reference import command_reference
from docs.hooks.gallery import gallery
from docs.hooks.mathematics import Mathematics
from docs.hooks.search import write_index
from docs.hooks.summary_reference import summary_reference

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig

__all__ = ["on_config", "on_page_markdown", "on_post_build"]

ROOT = Path(__file__).resolve().parents[2]
_PLACE = re.compile(r"^<!-- insert (\w+)(?: (\w+))? -->$", re.MULTILINE)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Let Markdown read formulas."""
    config.markdown_extensions.append(Mathematics())  # type: ignore[arg-type]
    return config


def on_post_build(config: MkDocsConfig) -> None:
    """Write the index of the search, and the colours of code, beside the pages."""
    from pygments.formatters import HtmlFormatter

    site = Path(config.site_dir)
    write_index(site)
    (site / "code.css").write_text(HtmlFormatter(style="tango").get_style_defs(".highlight"), encoding="utf-8")


def on_page_markdown(markdown: str, **_: object) -> str:
    """Put what a page asks for in its place: `<!-- insert NAME -->`, or with what is named in it."""
    return _PLACE.sub(_insert, markdown)


def _insert(place: re.Match[str]) -> str:
    kind, name = place.groups()
    if kind in _NAMED:
        return _NAMED[kind](name)
    return _MADE[kind]()


def ladder_part(name: str) -> str:
    """Lines of validation/README.md between the marks that `python -m validation` writes.

    Raises
    ------
    ValueError
        It has no such marks.
    """
    text = (ROOT / "validation" / "README.md").read_text(encoding="utf-8")
    found = re.search(rf"<!-- begin {name} -->\n(.*?)<!-- end {name} -->", text, re.DOTALL)
    if found is None:
        raise ValueError(f"validation/README.md has no part {name}")
    return found.group(1)


def validation_ladder() -> str:
    """The ladder's own page, with what it links to in the place of this one."""
    text = (ROOT / "validation" / "README.md").read_text(encoding="utf-8")
    places = {
        "../docs/": "",
        "](../CHANGELOG.md)": "](changelog.md)",
        "[benchmarks/README.md](../benchmarks/README.md)": "`benchmarks/README.md`",
        "[validation/README.md](README.md)": "this page",
    }
    for there, here in places.items():
        text = text.replace(there, here)
    return text


def missed_rows() -> str:
    """Rows of the ladder's tables, without their sources, that missed what is allowed, as Markdown."""
    lines = ["| case | quantity | ours | reference | error | allowed |", "|---|---|---|---|---|---|"]
    for name, table in re.findall(r"<!-- begin (\w+) -->\n(.*?)<!-- end", validation_ladder(), re.DOTALL):
        for row in table.splitlines():
            cells = [cell.strip() for cell in row.strip("|").split("|")]
            if "MISSED" in cells:
                lines.append(f"| `{name}` | {' | '.join(cells[:5])} |")
    return "\n".join(lines)


def changelog() -> str:
    """CHANGELOG.md, without its title, with what it links to in the place of this page."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    return text.partition("\n")[2].replace("](docs/", "](")


def citation() -> str:
    """CITATION.cff as a sentence and as it stands."""
    import yaml

    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    found = yaml.safe_load(text)
    authors = ", ".join(author.get("name") or author.get("family-names", "") for author in found["authors"])
    lines = [f"{authors}: *{found['title']}*, version {found['version']}, licence {found['license']}."]
    return "\n".join([*lines, "", f"```yaml\n{text.strip()}\n```"])


def script(name: str) -> str:
    """A script of docs/theory as it stands."""
    return f"```python\n{(ROOT / 'docs' / 'theory' / f'{name}.py').read_text(encoding='utf-8').rstrip()}\n```"


_NAMED = {"ladder": ladder_part, "api": api_reference, "script": script}
_MADE = {
    "case_reference": case_reference,
    "built_in_tables": built_in_tables,
    "command_reference": command_reference,
    "summary_reference": summary_reference,
    "validation_ladder": validation_ladder,
    "missed_rows": missed_rows,
    "changelog": changelog,
    "citation": citation,
    "gallery": gallery,
}
