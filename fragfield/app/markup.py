"""Parts that pages are made of: boxes, headings, folds, choices, uploads, and tables as HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import ui

from fragfield.app.security import MOST_UPLOADED
from fragfield.app.workspace import safe_name
from fragfield.errors import InputError
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from nicegui.element import Element
    from nicegui.events import UploadEventArguments

    from fragfield.app.page import CasePage

__all__ = ["Raw", "act", "box", "choose", "facts", "files_in", "fold", "heading", "html", "keep_file", "note",
           "set_defaults", "shown_facts", "upload"]  # fmt: skip


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


def files_in(folder: Path, endings: Sequence[str]) -> list[str]:
    """Names of the files of a folder that end so."""
    return sorted(one.name for one in folder.iterdir() if one.suffix.lower() in endings and one.is_file())


def upload(page: CasePage, label: str, endings: Sequence[str], take: Callable[[str, bytes], object]) -> None:
    """A box for a file of the user's machine: its name and its bytes are handed over."""

    async def received(event: UploadEventArguments) -> None:
        data = await event.file.read()
        page.attempt(lambda: take(event.file.name, data))

    too_large = page.texts("start.too_large", most=MOST_UPLOADED >> 20)
    ui.upload(
        label=label, on_upload=received, auto_upload=True, max_file_size=MOST_UPLOADED - (1 << 16),
        on_rejected=lambda: ui.notify(too_large, type="negative"),
    ).props(f'flat bordered accept="{",".join(endings)}"')  # fmt: skip


def keep_file(page: CasePage, name: str, data: bytes, endings: Sequence[str]) -> None:
    """Write an uploaded file into the folder and show the page again; raises InputError where it is there already."""
    ending = next((one for one in endings if name.lower().endswith(one)), "")
    if not ending:
        raise InputError(f"{name[:80]}: found a file of this ending; allowed: {', '.join(endings)}")
    path = page.folder / safe_name(name[: -len(ending)], ending)
    if path.exists():
        raise InputError(f"{path.name}: is there already; rename the file first")
    write_bytes(path, data, InputError)
    ui.navigate.reload()
