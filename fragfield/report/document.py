"""Texts of the page: document number, revision and classification, code words, CSS strings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from markupsafe import Markup, escape

if TYPE_CHECKING:
    from fragfield.report.reading.run_files import RunFiles


def code_words(text: str) -> Markup:
    """A text as HTML, what stands between a pair of backticks as code."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return escape(text)
    code = Markup("<code>{}</code>")
    return Markup("").join(code.format(part) if number % 2 else escape(part) for number, part in enumerate(parts))


def css_text(text: str) -> str:
    """A text as it stands between the quotes of a CSS string in a page."""
    safe = "".join(f"\\{ord(sign):x} " if sign in '\\"<>&\n\r\f' else sign for sign in text)
    return " ".join(safe.split("\t"))


def identity_line(run: RunFiles) -> str:
    """Classification, number and revision in one line; empty where the case gives none."""
    document = run.document
    revision = f"revision {document.revision}" if document.revision else ""
    return " · ".join(part for part in (document.classification, document.number, revision) if part)
