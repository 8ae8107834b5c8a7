"""Formulas between dollar signs become MathML, which browsers show by themselves: no script, no network."""

from __future__ import annotations

from typing import TYPE_CHECKING

from latex2mathml.converter import convert
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor

if TYPE_CHECKING:
    import re

    from markdown import Markdown

__all__ = ["Mathematics", "formula"]

_AFTER_CODE = 185  # code between backticks (190) is left alone; backslashes (180) are the formula's own


def formula(text: str, *, display: bool) -> str:
    """MathML of a LaTeX formula.

    Raises
    ------
    ValueError
        It has a command that is not known.
    """
    found = convert(" ".join(text.split()), display="block" if display else "inline")
    if ">\\" in found:
        raise ValueError(f"formula ${text}$: {found[found.index('>' + chr(92)) + 1 :].split('<')[0]} is not known")
    return str(found)


class _Formula(InlineProcessor):
    def __init__(self, pattern: str, md: Markdown, *, display: bool) -> None:
        super().__init__(pattern, md)
        self._display = display
        self._store = md.htmlStash

    def handleMatch(self, m: re.Match[str], data: str) -> tuple[str, int, int]:  # noqa: ARG002 - markdown's interface
        """Put the formula in markdown's store of finished HTML."""
        return self._store.store(formula(m.group(1), display=self._display)), m.start(0), m.end(0)


class Mathematics(Extension):
    """`$...$` within a line, `$$...$$` on its own."""

    def extendMarkdown(self, md: Markdown) -> None:
        """Register both patterns."""
        md.inlinePatterns.register(_Formula(r"\$\$(.+?)\$\$", md, display=True), "display formula", _AFTER_CODE + 1)
        md.inlinePatterns.register(_Formula(r"\$(?![\s$])(.+?)(?<!\s)\$", md, display=False), "formula", _AFTER_CODE)
