"""Forms: an input for every field of a table, with its meaning, unit and bounds, and faults beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nicegui import ui

from fragfield.app.fields import Field, fields_of, kinds_of, read_field, shown
from fragfield.case.messages import key_path

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from nicegui.element import Element
    from nicegui.events import ValueChangeEventArguments

    from fragfield.app.page import CasePage

__all__ = ["entries_form", "field_input", "form", "names_of", "word_input"]


def names_of(path: Sequence[str | int]) -> tuple[str, ...]:
    """A place in the case without the numbers of entries, as `fields_of` takes it."""
    return tuple(step for step in path if isinstance(step, str))


def form(
    page: CasePage,
    path: Sequence[str | int],
    *,
    only: Collection[str] = (),
    without: Collection[str] = (),
    kind: str = "",
) -> None:
    """Inputs for the fields of a table, sub-tables folded below them.

    Parameters
    ----------
    page : CasePage
        Of the case.
    path : sequence
        Place of the table; it need not be there yet.
    only, without : collections of str
        Fields to show alone, or not to show.
    kind : str
        Of tables of several kinds, that one.
    """
    fields = [
        one for one in fields_of(names_of(path), kind) if (one.name in only or not only) and one.name not in without
    ]
    if only:
        fields.sort(key=lambda one: list(only).index(one.name))
    table, defaults = page.case.get(path, {}), {one.name: one.default for one in fields}
    table = table if isinstance(table, dict) else {}
    with ui.element("div").classes("form"):
        for one in fields:
            if one.kind not in ("table", "tables") and (one.name in table or one.applies(table, defaults)):
                field_input(page, (*path, one.name), one)
    for one in fields:
        if one.kind in ("table", "tables"):
            _folded(page, (*path, one.name), one)


def _folded(page: CasePage, path: tuple[str | int, ...], entry: Field) -> None:
    """A sub-table, or a list of them, that opens where it is set or where a fault is."""
    key = key_path(path)
    opened = page.focus.startswith(key) or page.case.get(path) not in (None, {}, [])
    with ui.expansion(page.texts.label(entry.name), value=opened).classes("folded") as fold:
        if entry.meaning:
            ui.label(entry.meaning).classes("meaning")
        place = ui.element("div")
    page.bind(path, fold)

    def build() -> None:
        if fold.value and not place.default_slot.children:
            with place:
                if entry.kind == "tables":
                    entries_form(page, path)
                else:
                    form(page, path)

    fold.on_value_change(build)
    build()


def entries_form(page: CasePage, path: tuple[str | int, ...], *, changed: Callable[[], object] | None = None) -> None:
    """A list of tables: each with its form, to be added and removed."""
    kinds = kinds_of(names_of(path))

    @ui.refreshable
    def show() -> None:
        entries = page.case.get(path, [])
        for number, entry in enumerate(entries if isinstance(entries, list) else []):
            place = (*path, number)
            kind = str(entry.get("kind", "")) if isinstance(entry, dict) else ""
            name = str(entry.get("name", "")) if isinstance(entry, dict) else ""
            title = " · ".join(part for part in (name or f"{number + 1}", kind) if part)
            key = key_path(place)
            with ui.expansion(title, value=page.focus.startswith(key) or len(entries) == 1).classes("folded") as fold:
                form(page, place, without=("kind",) if kinds else (), kind=kind)
                ui.button(page.texts("form.remove"), icon="delete", on_click=lambda _, at=place: again(at, None)).props(
                    "dense flat no-caps"
                )
            page.bind(place, fold)
        for kind in kinds or ("",):
            label = page.texts("form.add", what=page.texts.label(kind or str(path[-1])))
            ui.button(label, icon="add", on_click=lambda _, kind=kind: add(kind)).props("dense outline no-caps")

    def add(kind: str) -> None:
        entries = page.case.get(path, [])
        fields = {one.name: one for one in fields_of(names_of(path), kind)}
        table: dict[str, Any] = {"name": f"{kind or path[-1]} {len(entries) + 1}"} if "name" in fields else {}
        again((*path, len(entries)), table | ({"kind": kind} if kind else {}))

    def again(at: tuple[str | int, ...], value: object) -> None:
        if page.change(at, value):
            page.unbind(f"{key_path(path)}[")
            show.refresh()
            if changed is not None:
                changed()

    show()


def field_input(
    page: CasePage,
    path: tuple[str | int, ...],
    entry: Field | None = None,
    *,
    choices: Sequence[str] = (),
    changed: Callable[[], object] | None = None,
) -> Element:
    """An input for one field; what is typed stands in the case at once.

    Parameters
    ----------
    page : CasePage
        Of the case.
    path : tuple
        Place of the field.
    entry : Field, optional
        Left out: as the schema has it.
    choices : sequence of str
        Names to choose from; others may be typed.
    changed : callable, optional
        Called after every change.
    """
    known = entry or next(one for one in fields_of(names_of(path[:-1])) if one.name == path[-1])
    value = page.case.get(path)
    label = page.texts.label(known.name) + (" *" if known.needed else "")

    def take(event: ValueChangeEventArguments) -> None:
        text = event.value
        new = None if text is None else read_field(known, str(text))
        if isinstance(page.case.get(path), dict) and isinstance(new, str) and new.startswith("{"):
            return
        if page.change(path, new) and changed is not None:
            changed()

    default = page.texts("form.default", value=known.default) if known.default else ""
    if known.kind in ("choice", "switch") or choices:
        options = list(choices or known.choices) if known.kind != "switch" else ["true", "false"]
        element = word_input(label, shown(value), options, take, free=bool(choices), placeholder=default)
    else:
        element = ui.input(label, value=shown(value), on_change=take, autocomplete=list(known.choices) or None)
        element.props("stack-label autocapitalize=off spellcheck=false")
        element.props["placeholder"] = default or _for_example(page, known)
    element.props("outlined dense hide-hint")
    element.props["hint"] = known.help or None
    page.bind(path, element)
    return element


def word_input(
    label: str, value: str, options: list[str], take: Callable[..., object], *, free: bool, placeholder: str = ""
) -> ui.select:
    """A choice among words; with `free` others may be typed; empty: the default."""
    if value and value not in options:
        options = [*options, value]
    element = ui.select(
        options, label=label, value=value or None, on_change=take, clearable=True, with_input=free,
        new_value_mode="add-unique" if free else None,
    )  # fmt: skip
    element.props("stack-label options-dense")

    def show_default() -> None:
        """What holds where nothing is chosen."""
        if element.value:
            element.props.pop("display-value", None)
        else:
            element.props["display-value"] = placeholder
        element.update()

    if placeholder and not free:
        element.on_value_change(show_default)
        show_default()
    return element


def _for_example(page: CasePage, known: Field) -> str:
    words = [*known.choices, *([known.example] if known.example else [])]
    return page.texts("form.example", value=" / ".join(words)) if words else ""
