"""Number, revision, classification and names of the document, from the case's table [document]."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fragfield.report.run_files import RunFiles

__all__ = ["css_text", "document_of", "identity_line"]

_KEYS = ("number", "revision", "classification", "prepared_by", "reviewed_by", "approved_by")


def document_of(run: RunFiles) -> dict[str, Any]:
    """The table with every key; empty texts where the case says nothing."""
    table = run.case.get("document")
    table = table if isinstance(table, dict) else {}
    return {
        **{key: str(table.get(key) or "") for key in _KEYS},
        "changes": [str(c) for c in table.get("changes") or []],
    }


def css_text(text: str) -> str:
    """A text as it stands between the quotes of a CSS string in a page."""
    safe = "".join(f"\\{ord(sign):x} " if sign in '\\"<>&\n\r\f' else sign for sign in text)
    return " ".join(safe.split("\t"))


def identity_line(run: RunFiles) -> str:
    """Classification, number and revision in one line; empty where the case gives none."""
    document = document_of(run)
    revision = f"revision {document['revision']}" if document["revision"] else ""
    return " · ".join(part for part in (document["classification"], document["number"], revision) if part)
