"""Page 5, test data: a table of a test, held against the case, and flown in place of a burst."""

from __future__ import annotations

import ast
import math
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import ui

import fragfield
from fragfield.app.forms import files_in, keep_file, upload
from fragfield.app.page import act, box, choose, facts, heading, html, note
from fragfield.app.workspace import safe_name
from fragfield.numbers import number

if TYPE_CHECKING:
    from collections.abc import Callable

    from fragfield.app.page import CasePage
    from fragfield.case import CaseTable


_KINDS = (".csv", ".txt", ".tsv", ".xlsx", ".ods", ".h5")
_CHOICES = {
    "encoding": ("utf-8", "cp1252", "mac_roman"), "separator": ("comma", "semicolon", "tab", "bar", "space"),
    "decimal": ("point", "comma"), "kind": ("arena", "pit", "fragments", "drag", "walls"),
}  # fmt: skip
"""What may be said of a table that does not show it, see `fragfield.import_table`."""
_MOST_ANSWERS = 12


def content(page: CasePage) -> None:
    """Build the page."""
    texts, files = page.texts, files_in(page.folder, _KINDS)
    heading(texts("data.title"))
    note(texts("data.form"), "meaning")
    if files:
        _importer(page, files)
        heading(texts("data.held"))
        _holder(page, files)
    upload(page, texts("start.choose"), _KINDS, lambda name, data: keep_file(page, name, data, _KINDS))


def _importer(page: CasePage, files: list[str]) -> None:
    """A table as a test has it, in any usual form: what was found in it, questions, and the file that a case reads."""
    texts = page.texts
    chosen: dict[str, Any] = {"file": files[0]}
    answers: dict[str, Any] = {}

    async def read() -> None:
        options = {key: value for key, value in chosen.items() if key != "file" and value not in (None, "")} | answers
        casing = page.case.path if not page.case.faults() and not page.case.is_draft else None
        table = page.folder / chosen["file"]
        found = await page.ask(place, fragfield.import_table, table, case=casing, refused=asked, **options)
        if found is None:
            return
        with place:
            with box("words", "pre").props("data-box=imported"):
                ui.label(str(found))
            name = f"{safe_name(Path(chosen['file']).stem, '')}_{found.kind}{Path(found.default_name).suffix}"
            act(texts("data.write", name=name), "write-table", lambda: write(found, name))

    def asked(error: Exception) -> None:
        """Answers to a question of the importer, as buttons."""
        option, choices = getattr(error, "option", ""), getattr(error, "choices", ())
        named = {one: one for one in choices[:_MOST_ANSWERS]}
        if option == "empty-zones":
            named = {"": texts("data.nothing_fell")}
        with box("choices"):
            for answer, words in named.items():
                act(words, "answer", lambda _, answer=answer: answered(option, answer))

    def answered(option: str, answer: str) -> Any:  # noqa: ANN401 - a coroutine
        take_answer(answers, option, answer)
        return read()

    def say(key: str) -> Callable[[object], None]:
        """What is said of the table; answers were for the file that was chosen, and for what was not said."""

        def keep(value: object) -> None:
            chosen[key] = value
            if key == "file":
                answers.clear()
            answers.pop(key, None)

        return keep

    def write(found: Any, name: str) -> None:  # noqa: ANN401 - an imported table
        if page.attempt(lambda: found.write(page.folder / name)):
            ui.navigate.reload()

    with box("form"):
        choose(texts("data.file"), files, files[0], say("file"))
        for key, words in _CHOICES.items():
            choose(texts(f"data.{key}"), list(words), None, say(key)).props("clearable")
        rounds = ui.number(texts("data.rounds"), min=1e-3, max=1e4)
        rounds.on_value_change(lambda event: say("number_of_rounds")(event.value))
    act(texts("data.read"), "read-table", read, "outline")
    place = box()


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


def _holder(page: CasePage, files: list[str]) -> None:
    """A file of fragments held against the case, and flown."""
    texts, chosen = page.texts, {"file": files[0]}

    async def check() -> None:
        case = page.case.resolved()
        if case is None:
            ui.notify(texts("run.no_cost"), type="warning")
            return
        found = await page.ask(place, _held, page, case, page.folder / chosen["file"])
        if found is None:
            return
        words, picture = found
        with place:
            html(words)
            if picture:
                heading(texts("data.polar"), 3)
                html(picture, "picture").style("max-width:36rem")
            act(texts("data.fly"), "fly-file", fly, "")

    def fly() -> None:
        file = page.session.space.name_of(page.folder / chosen["file"])
        target = f"{page.session.space.run_of(page.case.name)}_{Path(file).stem}"
        title = texts("data.fly_title", name=page.case.name, file=chosen["file"])
        page.queue(
            title, target, ["fly", page.case.name, "--fragments", file, "--out", target], ["report", target]
        )  # fmt: skip

    with box("choices"):
        choose(texts("data.file"), files, files[0], lambda name: chosen.update(file=name))
        act(texts("data.check"), "check-file", check, "outline")
    place = box()


def _held(page: CasePage, case: CaseTable, path: Path) -> tuple[str, str]:
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
