"""Parts that pages are made of: boxes, headings, folds, choices, and tables as HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import ui

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from nicegui.element import Element


__all__ = ["Raw", "act", "box", "choose", "facts", "fold", "heading", "html", "note",
           "set_defaults", "shown_facts"]  # fmt: skip


class Raw(str):
    """Text that is HTML already."""

    __slots__ = ()


def set_defaults() -> None:
    """How fields and buttons look on every page."""
    ui.button.default_props("no-caps")
    ui.toggle.default_props("no-caps dense")
    for kind in (ui.input, ui.number, ui.select):
        kind.default_props("outlined dense stack-label options-dense")


def box(kind: str = "", tag: str = "div") -> Element:
    """A part of the page, by the name of its look."""
    return ui.element(tag).classes(kind)


def heading(words: str, level: int = 2) -> None:
    """A heading in the page."""
    with ui.element(f"h{level}"):
        ui.label(words)


def note(words: str, kind: str = "note") -> ui.label:
    """A line of small text, or of another look: "meaning", "fault", "warning"."""
    return ui.label(words).classes(kind)


def html(words: str = "", kind: str = "") -> ui.html:
    """HTML of the application's own making."""
    return ui.html(words, sanitize=False).classes(kind)


def fold(title: str, *, opened: bool = False) -> ui.expansion:
    """A part of the page that opens."""
    return ui.expansion(title, value=opened).classes("folded")


def act(words: str, name: str, do: Callable[..., object], look: str = "outline dense") -> ui.button:
    """A button, known to tests and style by the name of its act."""
    return ui.button(words, on_click=do).props(f"{look} data-act={name}")


def choose(label: str, options: Any, value: object, take: Callable[[Any], object]) -> ui.select:  # noqa: ANN401 - list or mapping
    """A box to choose in; what is chosen is handed over."""
    return ui.select(options, label=label, value=value, on_change=lambda event: take(event.value))


def facts(rows: Iterable[Sequence[str]], heads: Sequence[str] = ()) -> str:
    """A table as HTML: the first cell of a row names it where there are no heads; texts are escaped, `Raw` is not."""
    first = "td" if heads else "th"
    lines = []
    for row in rows:
        named, *others = (one if isinstance(one, Raw) else escape(one) for one in row)
        lines.append(f"<tr><{first}>{named}</{first}>{''.join(f'<td>{one}</td>' for one in others)}</tr>")
    head = "".join(f"<th>{escape(one)}</th>" for one in heads)
    top = f"<thead><tr>{head}</tr></thead>" if heads else ""
    return f'<div class="table-box"><table class="facts">{top}<tbody>{"".join(lines)}</tbody></table></div>'


def shown_facts(rows: Iterable[Sequence[str]], heads: Sequence[str] = ()) -> None:
    """A table in the page."""
    html(facts(rows, heads))
