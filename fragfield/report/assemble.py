"""Writes the report, figures to files and sections by their templates into one self-contained page, and the map."""

from __future__ import annotations

import base64
import json
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from fragfield.case.conversion.surroundings import direction_words
from fragfield.errors import InputError
from fragfield.hazard.site_map import COLORS, KINDS, VERDICTS, extent_of
from fragfield.hazard.to_apply import USES
from fragfield.hazard.verdict import criterion_words, part_text
from fragfield.numbers import SPACE, number
from fragfield.report.figures.registered import FIGURES
from fragfield.report.figures.site import north_of, site_shapes
from fragfield.report.sections import SECTIONS, STUDY, Section, digest_of
from fragfield.results.run import StoredRun
from fragfield.results.words import margin_metres, rounded_metres, whole_metres
from fragfield_base.version import __version__
from fragfield_base.writing import write_files, write_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from jinja2 import Environment

    from fragfield.results.site import Estimate, Probability
    from fragfield.results.uncertainty import UncertaintyResult


_LONGEST_NUMBER = 18  # characters of a cell: "1,017.4 ± 4.0", "12,345 – 23,456"


@dataclass(frozen=True)
class _Illustration:
    name: str
    title: str
    caption: str
    image: str
    count: int = 0


def write_report(run_dir: Path | str, path: Path | str | None = None) -> Path:
    """Write the report of a run, whole or in part, and its map where there is one; the page opens offline.

    `path`: left out, `report.html` in the run directory; figures go to `figures` beside it.

    Raises InputError: no run directory, a damaged file in it (nothing is written then), or no right to write.
    """
    run = StoredRun(run_dir)
    run.require()
    _ = run.summary, run.values, run.study, run.snapshot, run.launched, run.landed, run.ensemble
    target = Path(path) if path is not None else run.path / "report.html"
    names = [name for name in FIGURES if not name.startswith("uncertainty_") or run.study]
    written = _write(run, target, SECTIONS, names)
    _write_map(run, target.with_name("map.html"), written)
    return target


def write_uncertainty_page(folder: Path, run_directory: Path, found: UncertaintyResult) -> Path:
    """Write uncertainty.html and its figures into a study's folder, under title and number of its nominal run."""
    run = StoredRun(run_directory)
    run.study = found
    target = folder / "uncertainty.html"
    _write(run, target, STUDY, [name for name in FIGURES if name.startswith("uncertainty_")])
    return target


def _write(run: StoredRun, target: Path, sections: Sequence[Section], names: Sequence[str]) -> str:
    written = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    try:
        drawn = _draw(run, target.parent / "figures", names)
        page = _render(run, sections, drawn, written)
    except OSError as error:
        raise InputError(f"{target}: the report cannot be written ({error.strerror or error})") from error
    write_text(target, page, InputError)
    return written


def _draw(run: StoredRun, folder: Path, names: Sequence[str]) -> dict[str, _Illustration]:
    folder.mkdir(parents=True, exist_ok=True)
    files = {name: svg for name in names if (svg := FIGURES[name].svg(run)) is not None}
    write_files({folder / f"{name}.svg": svg for name, svg in files.items()}, InputError)
    return {name: _Illustration(name, *FIGURES[name].words(run), image=_uri(svg)) for name, svg in files.items()}


def _uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode('ascii')}"


def _render(run: StoredRun, sections: Sequence[Section], drawn: Mapping[str, _Illustration], written: str) -> str:
    environment, document = _environment(), run.document
    numbered: list[str] = []

    def figures(*names: str) -> str:
        there = [drawn[name] for name in names if name in drawn]
        numbered.extend(one.name for one in there)
        first = len(numbered) - len(there) + 1
        blocks: Any = environment.get_template("blocks.html").module
        return Markup(blocks.illustrations([replace(one, count=first + at) for at, one in enumerate(there)]))

    every = {
        "run": run, "document": document, "hazard": run.summary.hazard, "figures": figures,
    }  # fmt: skip
    shown: list[dict[str, Any]] = []
    for section in sections:
        if (body := _body(run, section, environment, every)) is not None:
            number_of = sum(not one["annex"] for one in shown)
            count = chr(ord("A") + len(shown) - number_of) if section.annex else str(number_of + 1)
            shown.append({"key": section.key, "title": section.title, "annex": section.annex, "count": count,
                          "body": Markup(body)})  # fmt: skip
    return environment.get_template("report.html").render(
        every, title=run.title, sections=shown, style=environment.get_template("report.css").render(),
        program_version=run.provenance.get("program_version") or __version__,
        computed=_readable(run.provenance.get("date", "")), written=written, identity=identity_line(run),
        missing=run.missing,
    )  # fmt: skip


def _body(run: StoredRun, section: Section, environment: Environment, every: Mapping[str, Any]) -> str | None:
    """A section by its template, the word that its stage has not been run, or nothing."""
    if section.stage in run.missing:
        words = f"<p>Not computed: the stage “{section.stage}” has not been run in this directory.</p>"
        return None if section.annex else words
    if (context := section.context(run)) is None:
        return None
    return environment.get_template(f"{section.key}.html").render(every, **context)


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("fragfield.report"), autoescape=lambda name: name != "report.css",
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, extensions=["jinja2.ext.do"],
    )  # fmt: skip
    environment.filters |= {
        "css_text": css_text,
        "code": code_words,
        # by column, whether it holds words, which are broken and begin at the left
        "worded": lambda lines: [max(map(len, column)) > _LONGEST_NUMBER for column in zip(*lines, strict=True)],
        "number": number,
        "metres": whole_metres,
        "whole": rounded_metres,
        "margin": margin_metres,
        "few": _few,
        "bounded": _bounded,
        "use": lambda use: USES.get(use, "comparison"),
        "criterion": criterion_words,
        "part_of_it": part_text,
        "direction": lambda one: direction_words(one.azimuth_deg, one.bearing_deg, whole=True),
    }
    return environment


def _few(value: float | None) -> str:
    if value is None:
        return "–"
    return "0" if value <= 0.0 else number(float(f"{value:.2g}"), 2)


def _bounded(value: Estimate | Probability | None, scale: float = 1.0) -> str:
    if value is None or value.expected is None or value.upper is None:
        return "–"
    return f"{_few(scale * value.expected)};{SPACE}{_few(scale * value.upper)}"


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


def identity_line(run: StoredRun) -> str:
    """Classification, number and revision, as far as the case gives them, and the digest of the run's numbers."""
    document = run.document
    revision = f"revision {document.revision}" if document.revision else ""
    numbers = run.path / "summary.json"
    digest = f"{numbers.name} SHA-256 {digest_of(numbers)}" if numbers.is_file() else ""
    return " · ".join(part for part in (document.classification, document.number, revision, digest) if part)


def _write_map(run: StoredRun, path: Path, written: str) -> None:
    if (found := site_shapes(run)) is None:
        return
    from fragfield.case.conversion.surroundings import site_of
    from fragfield.places.site import POINTS

    (case, shapes), to_apply, identity = found, run.summary.distance_to_apply, identity_line(run)
    low, high = extent_of(shapes)
    drawn: list[dict[str, Any]] = [{**vars(shape), "points": shape.points.round(3).tolist()} for shape in shapes]
    site = site_of(case)
    data = {
        "shapes": drawn, "kinds": KINDS, "colors": COLORS, "compass": POINTS,
        "verdicts": {name: asdict(style) for name, style in VERDICTS.items()},
        "extent": [low.tolist(), high.tolist()], "origin": list(case.flight.origin), "north": north_of(case),
        "site": None if site is None else asdict(site),
    }  # fmt: skip
    # "</" ends a script element wherever it stands
    text = json.dumps(data, allow_nan=False).replace("</", "<\\/")
    page = _environment().get_template("map.html").render(
        title=run.title, to_apply=to_apply.line if to_apply else "", data=text,
        identity=f"{identity} · " if identity else "", written=written,
        program_version=run.provenance.get("program_version") or __version__,
    )  # fmt: skip
    write_text(path, page, InputError)
