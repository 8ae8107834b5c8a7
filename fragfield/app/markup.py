"""Headings, tables and the fill patterns of drawings, as HTML and SVG."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from nicegui import ui

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

__all__ = ["Raw", "facts", "heading", "shown_facts"]


class Raw(str):
    """Text that is HTML already."""

    __slots__ = ()


def heading(words: str, level: int = 2) -> None:
    """A heading in the page."""
    with ui.element(f"h{level}"):
        ui.label(words)


def facts(rows: Iterable[Sequence[str]], heads: Sequence[str] = ()) -> str:
    """A table as HTML: the first cell of a row names it where there are no heads; texts are escaped, `Raw` is not."""
    first = "td" if heads else "th"
    lines = []
    for row in rows:
        cells = [one if isinstance(one, Raw) else escape(one) for one in row]
        named, *others = cells
        lines.append(f"<tr><{first}>{named}</{first}>{''.join(f'<td>{one}</td>' for one in others)}</tr>")
    head = "".join(f"<th>{escape(one)}</th>" for one in heads)
    top = f"<thead><tr>{head}</tr></thead>" if heads else ""
    return f'<div class="table-box"><table class="facts">{top}<tbody>{"".join(lines)}</tbody></table></div>'


def shown_facts(rows: Iterable[Sequence[str]], heads: Sequence[str] = ()) -> None:
    """A table in the page."""
    ui.html(facts(rows, heads), sanitize=False)
