"""Assembles the report: figures to files, and one self-contained HTML page."""

from __future__ import annotations

import base64
from contextlib import nullcontext
from dataclasses import replace
from datetime import UTC, datetime
from importlib import resources
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from markupsafe import Markup, escape

from fragfield.errors import InputError
from fragfield.report.blocks import Columns, Illustration
from fragfield.report.figures.drawing import draw_figure
from fragfield.report.map_page import write_map
from fragfield.report.reading.run_files import read_run
from fragfield.report.sections import sections
from fragfield.report.tables.stages import digest_of
from fragfield.version import __version__
from fragfield.view.offscreen import drawing
from fragfield_base.writing import write_files, write_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from matplotlib.figure import Figure

    from fragfield.report.blocks import Block, Section
    from fragfield.report.reading.run_files import RunFiles
    from fragfield.report.sections import Draw


_MIME = {"svg": "image/svg+xml", "png": "image/png"}


def write_report(
    run_dir: Path | str,
    path: Path | str | None = None,
    *,
    pictures: bool = True,
) -> Path:
    """Write the report of a run, whole or in part.

    Parameters
    ----------
    run_dir : Path
        The run directory; only its files are read.
    path : Path, optional
        The page to write; left out: `report.html` in the run directory. Figures go to `figures` beside it.
    pictures : bool
        Draw the burst and the fragments by VTK; where VTK cannot draw, the report says so and goes on.

    Returns
    -------
    Path
        The page: one file that opens offline.

    Raises
    ------
    InputError
        No run directory, a damaged file in it, or no right to write.
    """
    run = read_run(Path(run_dir))
    target = Path(path) if path is not None else run.folder / "report.html"
    folder = target.parent / "figures"
    with drawing(run.folder, folder, wide=False) if pictures else nullcontext() as finish:
        illustrator = _Illustrator(run, folder, finish)
        return _write(
            run, illustrator, target, lambda: sections(run, illustrator.draw, illustrator.picture),
            lambda written: write_map(run, target.with_name("map.html"), identity=identity_line(run), written=written),
        )  # fmt: skip


def write_page(run: RunFiles, target: Path, parts: Callable[[Draw], list[Section]]) -> Path:
    """Write a page of other sections with the report's template, figures in `figures` beside it; the page.

    Raises InputError: no right to write.
    """
    illustrator = _Illustrator(run, target.parent / "figures", None)
    return _write(run, illustrator, target, lambda: parts(illustrator.draw), lambda _: None)


def _write(
    run: RunFiles,
    illustrator: _Illustrator,
    target: Path,
    make: Callable[[], list[Section]],
    beside: Callable[[str], object],
) -> Path:
    try:
        illustrator.folder.mkdir(parents=True, exist_ok=True)
        parts = _counted(make())
        illustrator.finish(parts)
        written = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
        page = _render(run, parts, illustrator.count, written)
        beside(written)
    except OSError as error:
        raise InputError(f"{target}: the report cannot be written ({error.strerror or error})") from error
    return write_text(target, page, InputError)


class _Illustrator:
    """Draws each figure once, and keeps it as SVG beside the page; pictures come from another process."""

    def __init__(self, run: RunFiles, folder: Path, pictures: Callable[[], str] | None) -> None:
        self.run = run
        self.folder = folder
        self.pictures = pictures
        self.count = 0
        self.files: dict[Path, bytes] = {}

    def draw(
        self, name: str, title: str, caption: str, function: Callable[[RunFiles], Figure | None]
    ) -> list[Illustration]:
        if (drawn := draw_figure(self.run, function)) is None:
            return []
        self.count += 1
        self.files[self.folder / f"{name}.svg"] = drawn
        return [Illustration(name, title, caption, image=_uri(drawn, "svg"))]

    def picture(self, name: str, title: str, caption: str) -> list[Block]:
        if self.pictures is None:
            return []
        self.count += 1
        return [Illustration(name, title, caption)]

    def finish(self, parts: list[Section]) -> None:
        """Write the files, put the pictures in their places once they are drawn, and figures side by side."""
        write_files(self.files, InputError)
        fault = self.pictures() if self.pictures is not None else ""
        for part in parts:
            part.blocks = list(_side_by_side([self._with_picture(block, fault) for block in part.blocks]))

    def _with_picture(self, block: Block, fault: str) -> Block:
        """A picture, or why there is none."""
        if not isinstance(block, Illustration) or block.image:
            return block
        if fault:
            return replace(block, missing=fault)
        return replace(block, image=_uri((self.folder / f"{block.name}.png").read_bytes(), "png"))


def _side_by_side(blocks: list[Block]) -> Iterator[Block]:
    """The blocks, with figures that follow each other in columns."""
    for of_figures, group in groupby(blocks, key=lambda block: isinstance(block, Illustration)):
        members = tuple(group)
        if of_figures and len(members) > 1:
            yield Columns(members)
        else:
            yield from members


def _counted(parts: list[Section]) -> list[Section]:
    """The sections with their numbers, the annexes with letters."""
    body = sum(not part.annex for part in parts)
    for place, part in enumerate(parts):
        part.count = chr(ord("A") + place - body) if part.annex else str(place + 1)
    return parts


def _uri(data: bytes, kind: str) -> str:
    return f"data:{_MIME[kind]};base64,{base64.b64encode(data).decode('ascii')}"


def _render(run: RunFiles, parts: list[object] | object, figures: int, written: str) -> str:
    from jinja2 import Environment, StrictUndefined
    from jinja2.loaders import DictLoader

    folder = resources.files("fragfield.report") / "templates"
    sources = {name: (folder / name).read_text(encoding="utf-8") for name in ("report.html", "report.css")}
    environment = Environment(
        loader=DictLoader(sources), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["css_text"] = css_text
    environment.filters["code"] = code_words
    return environment.get_template("report.html").render(
        title=run.title,
        sections=parts,
        figures=figures,
        style=sources["report.css"],
        program_version=run.provenance.get("program_version") or __version__,
        computed=_readable(run.provenance.get("date", "")),
        written=written,
        document=run.document,
        identity=identity_line(run),
        missing=run.missing,
    )


def _readable(date: str) -> str:
    """A date of the provenance, in ISO form, for the reader; another text stays as it is."""
    try:
        return datetime.fromisoformat(date).astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC")
    except ValueError:
        return date


def code_words(text: str) -> Markup:
    """A text as HTML, what stands between a pair of backticks as code."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return escape(text)
    code = Markup("<code>{}</code>")
    return Markup("").join(code.format(part) if number % 2 else escape(part) for number, part in enumerate(parts))


def css_text(text: str) -> str:
    """A text as it stands between the quotes of a CSS string in a page."""
    safe = "".join(f"\\{ord(sign):x} " if sign in '\\"<>&\n\r\f' else sign for sign in text)
    return " ".join(safe.split("\t"))


def identity_line(run: RunFiles) -> str:
    """Classification, number and revision, as far as the case gives them, and the digest of the run's numbers."""
    document = run.document
    revision = f"revision {document.revision}" if document.revision else ""
    numbers = run.folder / "summary.json"
    digest = f"{numbers.name} SHA-256 {digest_of(numbers)}" if numbers.is_file() else ""
    return " · ".join(part for part in (document.classification, document.number, revision, digest) if part)
