"""The pages of the application, one module each."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from nicegui import ui

from fragfield.app.page import PAGES, CasePage, box, note, set_defaults
from fragfield.errors import InputError
from fragfield.report.figures.rounds import PATTERNS

if TYPE_CHECKING:
    from fragfield.app.document import Session

__all__ = ["add_pages"]


def add_pages(session: Session) -> None:
    """Make the addresses of all pages."""
    set_defaults()
    ui.add_head_html('<link rel="stylesheet" href="/static/app.css">', shared=True)
    ui.add_body_html(PATTERNS, shared=True)
    ui.add_body_html('<script src="/static/app.js"></script><script src="/static/map.js"></script>', shared=True)
    for name in PAGES:
        _add(session, name)

    @ui.page("/")
    def first() -> None:
        ui.navigate.to("/start")


def _add(session: Session, name: str) -> None:
    @ui.page(f"/{name}")
    def show(case: str = "", key: str = "", run: str = "") -> None:
        content = import_module(f"fragfield.app.pages.{name}").content
        try:
            document = session.open(case) if case else None
        except InputError as error:
            page = CasePage(session, "start", None)
            with box("content"):
                note(str(error), "fault")
                ui.link("Start", "/start")
            return
        if document is None and name != "start" and not run:
            ui.navigate.to("/start")
            return
        page = CasePage(session, name, document, key)
        with box(f"content page-{name}"):
            content(page, run) if name == "result" else content(page)
        page.start()
