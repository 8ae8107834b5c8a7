"""Page 5, test data: a table of a test, held against the case, and flown in place of a burst."""

from __future__ import annotations

import ast
import math
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

import fragfield
from fragfield.app.jobs import start_job
from fragfield.app.markup import facts, heading
from fragfield.app.workspace import safe_name
from fragfield.errors import message_of
from fragfield.numbers import number

if TYPE_CHECKING:
    from fragfield.app.page import CasePage
    from fragfield.case import Case

__all__ = ["content", "take_answer"]

_KINDS = (".csv", ".txt", ".tsv", ".xlsx", ".ods", ".h5")
_CHOICES = {
    "encoding": ("utf-8", "cp1252", "mac_roman"), "separator": ("comma", "semicolon", "tab", "bar", "space"),
    "decimal": ("point", "comma"), "kind": ("arena", "pit", "fragments", "drag", "walls"),
}  # fmt: skip
"""What may be said of a table that does not show it, see `fragfield.import_table`."""
_MOST_ANSWERS = 12


def content(page: CasePage) -> None:
    """Build the page."""
    texts, folder = page.texts, page.case.path.parent
    heading(texts("data.title"))
    ui.label(texts("data.form")).classes("meaning")
    files = sorted(one.name for one in folder.iterdir() if one.suffix in _KINDS and one.is_file())
    if not files:
        ui.label(texts("data.none")).classes("meaning")
        return
    chosen = {"file": files[0]}
    _importer(page, folder, files)
    heading(texts("data.held"))
    place = ui.element("div")

    async def check() -> None:
        place.clear()
        case = page.case.resolved()
        if case is None:
            ui.notify(texts("run.no_cost"), type="warning")
            return
        try:
            words, picture = await run.io_bound(_held, page, case, folder / chosen["file"])
        except (fragfield.InputError, OSError) as error:
            with place:
                ui.label(message_of(error)).classes("fault")
            return
        with place:
            ui.html(words, sanitize=False)
            if picture:
                heading(texts("data.polar"), 3)
                ui.html(picture, sanitize=False).classes("picture").style("max-width:36rem")
            ui.button(texts("data.fly"), on_click=fly).props("no-caps data-act=fly-file")

    def fly() -> None:
        def act() -> None:
            if page.case.is_draft:
                page.case.save()
            file = page.session.space.name_of(folder / chosen["file"])
            target = f"{page.session.space.run_of(page.case.name)}_{Path(file).stem}"
            title = texts("data.fly_title", name=page.case.name, file=chosen["file"])
            commands = [["fly", page.case.name, "--fragments", file, "--out", target], ["report", target]]
            start_job(page.session.space, title=title, case=page.case.name, run=target, commands=commands)

        if page.attempt(act):
            ui.navigate.to(page.address("run"))

    with ui.element("div").classes("choices"):
        ui.select(
            files, value=files[0], label=texts("data.file"), on_change=lambda event: chosen.update(file=event.value)
        ).props("outlined dense")
        ui.button(texts("data.check"), on_click=check).props("no-caps outline data-act=check-file")
    place.move(target_index=-1)


def _importer(page: CasePage, folder: Path, files: list[str]) -> None:
    """A table as a test has it, in any usual form: what was found in it, questions, and the file that a case reads."""
    texts = page.texts
    chosen: dict[str, Any] = {"file": files[0]}
    answers: dict[str, Any] = {}
    place = ui.element("div")

    async def read() -> None:
        place.clear()
        options = {key: value for key, value in chosen.items() if key != "file" and value not in (None, "")} | answers
        casing = page.case.path if not page.case.faults() and not page.case.is_draft else None
        try:
            found = await run.io_bound(fragfield.import_table, folder / chosen["file"], case=casing, **options)
        except (fragfield.InputError, OSError) as error:
            with place:
                ui.label(message_of(error)).classes("fault")
                _answers(error)
            return
        with place:
            with ui.element("pre").classes("words").props("data-box=imported"):
                ui.label(str(found))
            name = f"{safe_name(Path(chosen['file']).stem, '')}_{found.kind}{Path(found.default_name).suffix}"
            ui.button(texts("data.write", name=name), on_click=lambda: write(found, name)).props(
                "no-caps outline dense data-act=write-table"
            )

    def _answers(error: Exception) -> None:
        """Answers to a question of the importer, as buttons."""
        option, choices = getattr(error, "option", ""), getattr(error, "choices", ())
        named = {one: one for one in choices[:_MOST_ANSWERS]}
        if option == "empty-zones":
            named = {"": texts("data.nothing_fell")}
        with ui.element("div").classes("choices"):
            for answer, words in named.items():
                ui.button(words, on_click=lambda _, answer=answer: answered(option, answer)).props(
                    "dense outline no-caps data-box=answer"
                )

    def answered(option: str, answer: str) -> Any:  # noqa: ANN401 - a coroutine
        take_answer(answers, option, answer)
        return read()

    def say(key: str, value: object) -> None:
        """What is said of the table; answers were for the file that was chosen, and for what was not said."""
        chosen[key] = value
        if key == "file":
            answers.clear()
        else:
            answers.pop(key, None)

    def write(found: Any, name: str) -> None:  # noqa: ANN401 - an imported table
        if page.attempt(lambda: found.write(page.session.space.inside(name))):
            ui.navigate.reload()

    with ui.element("div").classes("form"):
        ui.select(files, value=files[0], label=texts("data.file")).props("outlined dense").on_value_change(
            lambda event: say("file", event.value)
        )
        for key, words in _CHOICES.items():
            box = ui.select(list(words), label=texts(f"data.{key}"), clearable=True).props("outlined dense stack-label")
            box.on_value_change(lambda event, key=key: say(key, event.value))
        rounds = ui.number(texts("data.rounds"), min=1e-3, max=1e4).props("outlined dense stack-label")
        rounds.on_value_change(lambda event: say("number_of_rounds", event.value))
    ui.button(texts("data.read"), on_click=read).props("no-caps outline data-act=read-table")
    place.move(target_index=-1)


def take_answer(answers: dict[str, Any], option: str, answer: str) -> None:
    """Keep an answer to a question of `fragfield.import_table` as the argument that it is."""
    if option in ("unit", "column"):
        quantity, _, value = answer.partition("=")
        answers[f"{option}s"] = {**answers.get(f"{option}s", {}), quantity: value.strip('"')}
    elif option == "rounds":
        answers["number_of_rounds"] = float(answer)
    elif option == "empty-zones":
        answers["empty_zones"] = True
    else:
        answers[option.replace("-", "_")] = ast.literal_eval(answer) if option == "sheet" else answer


def _held(page: CasePage, case: Case, path: Path) -> tuple[str, str]:
    """What a file of fragments holds, in words of the command line, and its polar plot."""
    from fragfield.checking.check import fragments_report
    from fragfield.pipeline.arena import read_arena

    texts, found = page.texts, fragments_report(case, path)
    held = found["fragments"]
    rows = [(texts("data.number"), number(held["number"], 5)), (texts("data.mass"), f"{number(held['mass'], 4)} kg")]
    if recovered := held.get("recovered"):
        rows.append((texts("data.recovered"), recovered["words"]))
    warnings = "".join(f'<p class="warning">{escape(words)}</p>' for words in found["warnings"])
    read = read_arena(path, case)
    return f"{facts(rows)}{warnings}", "" if read is None else _polar(read[0], texts("data.polar"))


def _polar(table: Any, title: str) -> str:  # noqa: ANN401 - an arena table
    """Number of fragments by polar zone, the nose on the right: both halves of a section along the axis."""
    counts = [float(table.number[table.zone == zone].sum()) for zone in range(len(table.zones) - 1)]
    most = max(counts, default=0.0) or 1.0
    parts = []
    for degrees in range(0, 181, 30):
        x, y = math.cos(math.radians(degrees)), -math.sin(math.radians(degrees))
        parts.append(f'<path class="extension" d="M0 0L{158 * x:.1f} {158 * y:.1f}"/>')
        parts.append(f'<text class="small" x="{168 * x:.1f}" y="{4 + 168 * y:.1f}">{degrees}°</text>')
    for zone, count in enumerate(counts):
        low, high = float(table.zones[zone]), float(table.zones[zone + 1])
        reach = 150.0 * math.sqrt(count / most)  # areas as numbers
        for side in (-1.0, 1.0):
            turns = [math.radians(turn) for turn in (low, 0.5 * (low + high), high)]
            corners = " ".join(f"{reach * math.cos(one):.1f},{side * reach * math.sin(one):.1f}" for one in turns)
            words = f"<title>{low:g}–{high:g}°: {count:.4g}</title>"
            parts.append(f'<polygon class="zone" points="0,0 {corners}">{words}</polygon>')
    return f'<svg viewBox="-190 -180 380 350" role="img" aria-label="{escape(title)}">{"".join(parts)}</svg>'
