"""What all pages of a case share: heading, navigation, saving, and faults at their fields."""

from __future__ import annotations

from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from nicegui import run, ui

from fragfield.app.document import steps_of
from fragfield.case.faults import Fault
from fragfield.case.keys import key_path
from fragfield.errors import InputError, message_of
from fragfield.report.figures.rounds import PATTERNS
from fragfield_base import errors

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from nicegui.element import Element

    from fragfield.app.document import CaseDocument, Session


class Raw(str):
    """Text that is HTML already."""

    __slots__ = ()


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


PAGES: dict[str, tuple[str, ...]] = {
    "start": (),
    "round": ("round", "official"),
    "arrangement": (
        "round.attitude", "round.azimuth", "round.base", "round.position", "round.axis", "round.ignition",
        "round.initiation", "stack", "plane",
    ),
    "site": ("site", "exposed", "obstacle", "flight.ground"),
    "run": ("",),
    "result": (),
}  # fmt: skip
"""Names of the pages, in order (`/name` is the address), with the keys that each edits; all other keys are on "run"."""
_TICK = 0.4  # s between looks at the case


def title_of(page: str) -> str:
    """A page as links and titles name it."""
    return "Check and run" if page == "run" else page.capitalize()


def page_of(key: str) -> str:
    """The page that has the field of a key: that which names most of it."""
    asked = f"{'.'.join(step for step in steps_of(key) if isinstance(step, str))}."
    named = [(own, page) for page, keys in PAGES.items() for own in keys if not own or asked.startswith(f"{own}.")]
    return max(named, key=lambda one: len(one[0]))[1]


class CasePage:
    """One page (of `PAGES`) in one browser window: what it shows of a case, and its fields; `focus` is a key of one."""

    def __init__(self, session: Session, name: str, document: CaseDocument | None, focus: str = "") -> None:
        self.session, self.name, self.document, self.focus = session, name, document, focus
        self._inputs: dict[str, Element] = {}
        self._listeners: list[Callable[[], object]] = []
        self._shown = -1
        self._head()

    @property
    def case(self) -> CaseDocument:
        """The case; only pages of one ask for it."""
        assert self.document is not None
        return self.document

    @property
    def folder(self) -> Path:
        """Where the case stands, else the folder of the application."""
        return self.document.path.parent if self.document is not None else self.session.space.folder

    def address(self, name: str, **query: str) -> str:
        """Address of a page of the same case."""
        words = {"case": self.document.name} if self.document is not None else {}
        return f"/{name}?{urlencode(words | query)}" if words or query else f"/{name}"

    def change(self, path: Sequence[str | int], value: object) -> bool:
        """Put a value into the case, None to remove it; says why where that cannot be kept."""
        return self.attempt(lambda: self.case.set(path, value))

    def attempt(self, act: Callable[[], object]) -> bool:
        """Do something to the case; an InputError is shown, and False returned."""
        try:
            act()
        except (errors.InputError, OSError) as error:
            ui.notify(message_of(error), type="negative", multi_line=True, timeout=8000)
            return False
        return True

    def compute(self, title: str, target: str, *commands: Sequence[str]) -> None:
        """Save the case and start commands of the command line that write into `target`; then go to the run."""

        def start() -> None:
            if self.case.is_draft:
                self.case.save()
            self.session.compute(title, target, commands)

        if self.attempt(start):
            ui.navigate.to(self.address("run"))

    def bind(self, path: Sequence[str | int], element: Element) -> None:
        """Let an element show the faults of a key."""
        key = key_path(path)
        element.props["data-key"] = key
        self._inputs[key] = element

    def unbind(self, above: str) -> None:
        """Forget the elements of the keys that begin so: their part of the page is built again."""
        self._inputs = {key: one for key, one in self._inputs.items() if not key.startswith(above)}

    def follow(self, listener: Callable[[], object]) -> None:
        """Call something after the case has changed and was judged, and once at the beginning."""
        self._listeners.append(listener)

    def start(self) -> None:
        """Begin to look at the case; called when the page is built."""
        if self.document is None:
            return
        ui.run_javascript("fragfield.current()")
        ui.timer(_TICK, self._tick)
        ui.timer(0.05, self._tick, once=True)
        if self.focus:
            ui.run_javascript(f"setTimeout(() => fragfield.focus({self.focus!r}), 300)")

    def _head(self) -> None:
        case = self.document
        ui.colors(primary="#16365c", secondary="#56616d", negative="#a3301a", positive="#1f5c8a", warning="#9a5b00")
        ui.page_title(f"{title_of(self.name)} · {case.name if case else 'fragfield'}")
        with box("head", "header"):
            with box("head-line"):
                ui.link("fragfield", self.address("start")).classes("brand")
                note(case.name if case is not None else str(self.session.space.folder), "case-name")
                if case is not None:
                    self._state = note("", "state").props("role=status")
                    self._save = ui.button("Save", on_click=self._save_case).props("dense id=save")
                    self._drop = ui.button("Discard changes", on_click=self._drop_draft).props("dense flat")
            if case is not None:
                with ui.element("nav").props('aria-label="Pages of this case"'):
                    for number, name in enumerate(PAGES, start=1):
                        link = ui.link(f"{number} {title_of(name)}", self.address(name))
                        link.props(f'accesskey="{number}"' + (' aria-current="page"' if name == self.name else ""))
        if case is not None:
            self._news = box("news").props("role=status")
            with self._news:
                note(
                    "Another program has changed the file since it was read. What it wrote is not replaced.", "warning"
                )
                ui.button("Read it again", on_click=self._drop_draft).props("dense flat")
            self._news.set_visibility(False)
            self._faults = box("faults").props("role=alert")

    def _save_case(self) -> None:
        if self.attempt(self.case.save):
            ui.notify(f"{self.case.name} is saved", type="positive")

    def _drop_draft(self) -> None:
        if self.attempt(self.case.reload):
            ui.navigate.reload()

    async def _tick(self) -> None:
        case = self.case
        if not ui.context.client.has_socket_connection:
            return
        self._show_state()
        if self._shown != case.version:
            version = case.version
            faults = await run.io_bound(case.faults)
            if faults is None or version != case.version:  # the server ends, or it is judged again at the next look
                return
            self._shown = version
            self._show_faults(faults)
            for listener in self._listeners:
                found = listener()
                if hasattr(found, "__await__"):
                    await found

    def _show_state(self) -> None:
        case = self.case
        self._state.set_text("changes not saved" if case.is_draft else "saved")
        self._save.set_enabled(case.is_draft)
        self._drop.set_visibility(case.is_draft)
        self._news.set_visibility(case.changed_on_disk)

    def _show_faults(self, faults: Sequence[Fault]) -> None:
        """Put every fault at its field; those of no field, or of one in a closed part, are listed above the page."""
        at: dict[str, list[str]] = {}
        elsewhere: list[Fault] = []
        for fault in faults:
            key = self._nearest(fault.key)
            if key:
                at.setdefault(key, []).append(fault.words if key == fault.key else f"{fault.key}: {fault.words}")
            if not key or not _is_seen(self._inputs[key]):
                elsewhere.append(fault)
        for key, element in self._inputs.items():
            words = "; ".join(at.get(key, [])) or None
            if hasattr(element, "error"):
                element.error = words
            else:
                element.classes(*(("has-fault",) if words else ()), remove="" if words else "has-fault")
        self._faults.clear()
        with self._faults:
            if faults:
                note(f"To be mended before a run: {len(faults)}", "fault-count")
            for fault in elsewhere[:12]:
                with box("fault"):
                    if fault.key:
                        ui.link(fault.key, self.address(page_of(fault.key), key=fault.key))
                    ui.label(fault.words)

    def _nearest(self, key: str) -> str:
        while key and key not in self._inputs:
            key = key.rpartition(".")[0] if "." in key else (key.partition("[")[0] if "[" in key else "")
        return key


def _is_seen(element: Element) -> bool:
    """Whether an element has room for words, and no part of the page that holds it is closed."""
    folds = [one for one in element.ancestors() if isinstance(one, ui.expansion)]
    return hasattr(element, "error") and all(one.value for one in folds)


def add_pages(session: Session) -> None:
    """Make the addresses of all pages."""
    ui.button.default_props("no-caps")
    ui.toggle.default_props("no-caps dense")
    for kind in (ui.input, ui.number, ui.select):
        kind.default_props("outlined dense stack-label options-dense")
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
