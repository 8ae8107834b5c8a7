"""Forms: an input for every field of a table, with its meaning, unit and bounds, and faults beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nicegui import ui

from fragfield.app.fields import default_of, fields_of, help_of, kinds_of, label_of, read_field, shown
from fragfield.app.page import box, fold, note
from fragfield.app.server import MOST_UPLOADED
from fragfield.app.workspace import safe_name
from fragfield.case.keys import Key, key_path
from fragfield.errors import InputError
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from pathlib import Path

    from nicegui.element import Element
    from nicegui.events import UploadEventArguments, ValueChangeEventArguments

    from fragfield.app.page import CasePage


_TABLES = ("table", "tables")


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
    """Inputs for the fields of a table, which need not be there yet, sub-tables folded below them.

    `only`, `without`: fields to show alone, or not to show; `kind`: of tables of several kinds, that one.
    """
    known = {one.name: one for one in fields_of(names_of(path), kind)}
    fields = [known[name] for name in (only or known) if name not in without]
    table, defaults = page.case.get(path, {}), {one.name: one.default for one in fields}
    table = table if isinstance(table, dict) else {}
    with box("form"):
        for one in fields:
            if one.form not in _TABLES and (one.name in table or one.applies(table, defaults)):
                field_input(page, (*path, one.name), one)
    for one in fields:
        if one.form in _TABLES:
            folded(page, (*path, one.name), one)


def folded(page: CasePage, path: tuple[str | int, ...], entry: Key, *, without: Collection[str] = ()) -> None:
    """A sub-table, or a list of them, that opens where it is set or where a fault is; built when it is opened."""
    opened = page.focus.startswith(key_path(path)) or (len(path) > 1 and page.case.get(path) not in (None, {}, []))
    with fold(label_of(entry.path), opened=opened) as part:
        if words := " ".join(entry.meaning.split()):
            note(words, "meaning")
        place = box()
    page.bind(path, part)

    def build() -> None:
        if part.value and not place.default_slot.children:
            with place:
                if entry.form == "tables":
                    entries_form(page, path)
                else:
                    form(page, path, without=without)

    part.on_value_change(build)
    build()


def entries_form(page: CasePage, path: tuple[str | int, ...], *, changed: Callable[[], object] | None = None) -> None:
    """A list of tables: each with its form, to be added and removed."""
    kinds = kinds_of(names_of(path))

    @ui.refreshable
    def show() -> None:
        entries = page.case.get(path, [])
        for number, entry in enumerate(entries if isinstance(entries, list) else []):
            place = (*path, number)
            kind, name = (str(entry.get(key, "")) if isinstance(entry, dict) else "" for key in ("kind", "name"))
            title = " · ".join([name or f"{number + 1}", *([kind.capitalize()] if kind in kinds else [])])
            with fold(title, opened=page.focus.startswith(key_path(place)) or len(entries) == 1) as part:
                form(page, place, without=("kind",) if kinds else (), kind=kind)
                ui.button("Remove", icon="delete", on_click=lambda _, at=place: again(at, None)).props("dense flat")
            page.bind(place, part)
        with box("choices"):
            for kind in kinds or ("",):
                what = kind.capitalize() or label_of(names_of(path)[-1])
                ui.button(f"Add {what}", icon="add", on_click=lambda _, kind=kind: add(kind)).props("dense outline")

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
    entry: Key | None = None,
    *,
    choices: Sequence[str] = (),
    changed: Callable[[], object] | None = None,
) -> Element:
    """An input for one field; what is typed stands in the case at once.

    `entry`: left out, as the schema has it; `choices`: names to choose from, others may be typed; `changed`: called
    after every change.
    """
    known = entry or next(one for one in fields_of(names_of(path[:-1])) if one.name == path[-1])
    value = page.case.get(path)
    label = label_of(known.path) + (" *" if known.needed else "")

    def take(event: ValueChangeEventArguments) -> None:
        new = None if event.value is None else read_field(known, str(event.value))
        if isinstance(page.case.get(path), dict) and isinstance(new, str) and new.startswith("{"):
            return
        if page.change(path, new) and changed is not None:
            changed()

    default = f"{words} (default)" if (words := default_of(known)) else ""
    if known.form in ("choice", "switch") or choices:
        options = ["true", "false"] if known.form == "switch" else list(choices or known.choices)
        element = _word_input(label, shown(value), options, take, free=bool(choices), placeholder=default)
    else:
        element = ui.input(label, value=shown(value), on_change=take, autocomplete=[*map(str, known.choices)] or None)
        element.props("autocapitalize=off spellcheck=false")
        examples = " / ".join([*map(str, known.choices), *([known.example] if known.example else [])])
        element.props["placeholder"] = default or (f"for example {examples}" if examples else "")
    element.props("hide-hint")
    element.props["hint"] = help_of(known) or None
    page.bind(path, element)
    return element


def _word_input(
    label: str, value: str, options: list[str], take: Callable[..., object], *, free: bool, placeholder: str
) -> ui.select:
    """A choice among words; with `free` others may be typed; empty: the default."""
    if value and value not in options:
        options = [*options, value]
    element = ui.select(
        options, label=label, value=value or None, on_change=take, clearable=True, with_input=free,
        new_value_mode="add-unique" if free else None,
    )  # fmt: skip

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


def files_in(folder: Path, endings: Sequence[str]) -> list[str]:
    """Names of the files of a folder that end so."""
    return sorted(one.name for one in folder.iterdir() if one.suffix.lower() in endings and one.is_file())


def upload(page: CasePage, label: str, endings: Sequence[str], take: Callable[[str, bytes], object]) -> None:
    """A box for a file of the user's machine: its name and its bytes are handed over."""

    async def received(event: UploadEventArguments) -> None:
        data = await event.file.read()
        page.attempt(lambda: take(event.file.name, data))

    too_large = f"The file is larger than {MOST_UPLOADED >> 20} MiB, or not of a kind that is read"
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
