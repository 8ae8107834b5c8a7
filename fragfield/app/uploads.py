"""Files that a page takes from the user's machine into the folder of its case."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from fragfield.app.security import MOST_UPLOADED
from fragfield.app.workspace import safe_name
from fragfield.errors import InputError
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from nicegui.events import UploadEventArguments

    from fragfield.app.page import CasePage

__all__ = ["files_in", "keep_file", "upload"]


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
