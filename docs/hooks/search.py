"""Search without a server: the index as a script beside the pages, which a browser also loads from a folder."""

from __future__ import annotations

import json
from pathlib import Path

__all__ = ["write_index"]


def write_index(site: Path) -> Path:
    """Write search/index.js from the search_index.json that MkDocs made; the file's path.

    Raises
    ------
    FileNotFoundError
        MkDocs was built without its plugin `search`.
    """
    found = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    entries = [{key: entry[key] for key in ("location", "title", "text")} for entry in found["docs"]]
    script = site / "search" / "index.js"
    text = json.dumps(entries, ensure_ascii=False, separators=(",", ":")).replace("</", "<\\/")
    script.write_text(f"window.pages = {text};\n", encoding="utf-8")
    return script
