"""What MkDocs does beyond its own: formulas, pages made from the program, gallery, search without a server, colours."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

from docs.hooks import first_page, reference, substances, tables
from docs.hooks.mathematics import Mathematics

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig

__all__ = ["gallery", "on_config", "on_page_markdown", "on_post_build"]

ROOT = Path(__file__).resolve().parents[2]
_PLACE = re.compile(r"^<!-- insert (\w+)(?: (\w+))? -->$", re.MULTILINE)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Let Markdown read formulas."""
    config.markdown_extensions.append(Mathematics())  # type: ignore[arg-type]
    return config


def on_page_markdown(markdown: str, **_: object) -> str:
    """Put what a page asks for in its place: `<!-- insert NAME -->`, or with what is named in it."""
    return _PLACE.sub(lambda place: _MADE[place[1]](*filter(None, [place[2]])), markdown)


def on_post_build(config: MkDocsConfig) -> None:
    """Write the colours of code beside the pages, and the index of the search as a script that a browser loads."""
    from pygments.formatters import HtmlFormatter

    site = Path(config.site_dir)
    (site / "code.css").write_text(HtmlFormatter(style="tango").get_style_defs(".highlight"), encoding="utf-8")
    found = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    entries = [{key: entry[key] for key in ("location", "title", "text")} for entry in found["docs"]]
    text = json.dumps(entries, ensure_ascii=False, separators=(",", ":")).replace("</", "<\\/")
    (site / "search" / "index.js").write_text(f"window.pages = {text};\n", encoding="utf-8")


def gallery() -> str:
    """Every script of examples/ with its words, its picture and its text, as Markdown.

    Raises
    ------
    FileNotFoundError
        An example has no picture in docs/pictures; `sh setup.sh examples pictures` makes them.
    """
    parts = []
    for path in sorted((ROOT / "examples").glob("*.py")):
        text = path.read_text(encoding="utf-8")
        words = (ast.get_docstring(ast.parse(text)) or "").split("\n\n")
        title, picture = path.stem.replace("_", " ").capitalize(), f"pictures/example_{path.stem}.png"
        if not (ROOT / "docs" / picture).is_file():
            raise FileNotFoundError(f"docs/{picture} is missing: sh setup.sh examples pictures")
        first, *rest = (" ".join(part.split()) for part in words)
        shown = f"![{title}]({picture})"
        parts += [f"## {title}", first, shown, *rest, f"`examples/{path.name}`:", f"```python\n{text.rstrip()}\n```"]
    return "\n\n".join(parts)


def _file(name: str, moved: dict[str, str]) -> str:
    """A file of the project's root without its title, links turned to where this site has what they lead to."""
    text = (ROOT / name).read_text(encoding="utf-8").partition("\n")[2]
    for there, here in moved.items():
        text = text.replace(there, here)
    return text


def _citation() -> str:
    import yaml

    from fragfield_base.version import __version__

    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    found = yaml.safe_load(text)
    authors = ", ".join(author.get("name") or author.get("family-names", "") for author in found["authors"])
    sentence = f"{authors}: *{found['title']}*, version {__version__}, licence {found['license']}."
    return f"{sentence}\n\n```yaml\n{text.strip()}\n```"


def _script(name: str) -> str:
    return f"```python\n{(ROOT / 'docs' / 'theory' / f'{name}.py').read_text(encoding='utf-8').rstrip()}\n```"


_MADE = {
    "api": reference.api_reference,
    "built_in_profiles": reference.built_in_profiles,
    "case_reference": reference.case_reference,
    "command_reference": reference.command_reference,
    "summary_reference": reference.summary_reference,
    "changelog": lambda: _file("CHANGELOG.md", {"](docs/": "](", "](validation/README.md)": "](validation.md)"}),
    "citation": _citation,
    "first_page_example": first_page.example,
    "gallery": gallery,
    "published_rules": tables.published_rules,
    "ricochet_kinds": tables.ricochet_kinds,
    "run_tables": tables.run_tables,
    "script": _script,
    "substance_form": substances.substance_form,
    "substance_grades": substances.substance_grades,
    "substance_overview": substances.substance_overview,
    "substance_values": substances.substance_values,
    "uncertain_inputs": tables.uncertain_inputs,
    "validation": lambda: _file("validation/README.md", {"](../docs/": "]("}),
}
